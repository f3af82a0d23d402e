"""Priors of a description's values before a fit, and the drives that would determine them."""

from tomr_power_model.effects import EFFECTS
from tomr_power_model.estimation.parameter import effect_parameter
from tomr_power_model.robot.description import split_effect

# Standard deviation relative to the value: data sheets are good for windings, poor for friction.
RELATIVE_STD = {
    "robot.mass": 0.1,
    "robot.inertia_z": 0.3,
    "robot.wheel_radius": 0.02,
    "robot.wheel_inertia": 0.5,
    "motor.resistance": 0.1,
    "motor.torque_constant": 0.05,
    "motor.rotor_inertia": 0.5,
    "supply.auxiliary_power": 0.5,
}
DEFAULT_RELATIVE_STD = 1.0

# (start, standard deviation) of values that a description does not give or gives as zero.
_ABSENT = {
    "robot.mass_center.x": (0.0, 0.02),
    "robot.mass_center.y": (0.0, 0.02),
    "supply.auxiliary_power": (0.0, 50.0),
}

# The drive that would determine a value, by the beginning of its key.
_DRIVES = (
    ("robot.mass_center", "circles and spins while driving, at several headings"),
    ("robot.mass", "starts and stops at full acceleration, straight, at several headings"),
    ("robot.inertia_z", "spins on the spot that start and stop at full acceleration"),
    ("robot.wheel_inertia", "spins and straight starts: it shows only beside mass and inertia_z"),
    ("motor.rotor_inertia", "spins and straight starts: it shows only beside mass and inertia_z"),
    ("motor.torque_constant", "none, power shows R / k^2 alone: measure the motor's idle speed"),
    ("motor.resistance", "hard acceleration, where copper loss counts, and k known otherwise"),
    (
        "supply.auxiliary_power",
        "standing still for ten seconds, battery_state and motor power recorded",
    ),
)


def absent_prior(general: str) -> tuple[float, float]:
    """Mean and standard deviation of a value that a description does not give."""
    parameter = effect_parameter(general)
    if parameter is None:
        return _ABSENT.get(general, (0.0, 1.0))
    return parameter.start, parameter.prior_std


def drive_for(general: str) -> str:
    """The drive that would determine a value, or an effect as a whole: physics.<effect id>."""
    effect = split_effect(general + ".")
    if effect is not None:
        return EFFECTS[effect[0]].shown_by
    found = (text for start, text in _DRIVES if general.startswith(start))
    return next(found, "a longer drive with more headings, speeds and accelerations")
