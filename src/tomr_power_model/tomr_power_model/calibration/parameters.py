"""Which values of a robot.yaml are fitted, and the priors of them."""

from collections.abc import Mapping, Sequence
from typing import cast

from attrs import field, frozen

from tomr_power_model.calibration.priors import (
    DEFAULT_RELATIVE_STD,
    RELATIVE_STD,
    absent_prior,
)
from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import (
    Parameter,
    Values,
    bounds_of,
    center_axis,
    center_of,
    is_of_wheels,
    uniform_std,
    unit_of,
    wheel_key,
)
from tomr_power_model.robot.description import closest
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS

EVERY = "all"
_MOTOR = tuple(spec.name for spec in MOTOR_PARAMETERS)
# Of place or past, which an instant's motion does not show, or of other tools.
_NOT_BY_DEFAULT = ("kinematic.", "sensor.", "body.", "drivetrain.", "electrical.winding_heating")
_FIXED = {
    spec.name: spec
    for spec in ROBOT_PARAMETERS
    if spec.kind == "float" and not spec.name.startswith(("motor.", "sensors."))
}


@frozen
class Choice:
    """What the user asked for."""

    keys: tuple[str, ...] = ()  # empty: the default set
    shared: tuple[str, ...] = ()  # of these one value for all wheels; EVERY: of all
    tolerances: Mapping[str, float] = field(factory=dict)  # relative half ranges, by general key
    has_total: bool = False  # whether the whole robot's power was measured
    quantity: str = "power"


def choose(
    values: Values, wheels: tuple[str, str, str], choice: Choice, place: str
) -> list[Parameter]:
    """The values to fit. Raises InputError for a key that cannot be fitted."""
    keys = choice.keys or default_keys(values, wheels, choice)
    keys = tuple(dict.fromkeys((*keys, *(key for key in choice.shared if key != EVERY))))
    found: dict[str, Parameter] = {}
    for key in keys:
        for parameter in _expand(key, values, wheels, choice, place):
            found.setdefault(parameter.keys[0], parameter)
    unknown = set(choice.tolerances) - {parameter.name for parameter in found.values()}
    if unknown:
        raise InputError(
            f"--tolerance {min(unknown)}: it is not fitted: {closest(min(unknown), list(keys))}"
        )
    return list(found.values())


def default_keys(values: Values, wheels: tuple[str, str, str], choice: Choice) -> tuple[str, ...]:
    """The values that a robot's power usually determines: what its description includes."""
    keys = ["robot.mass", "robot.inertia_z"]
    if choice.quantity != "motor_current":
        # With currents alone the voltage is modelled from these two: nothing measures them.
        keys += ["motor.resistance", "motor.torque_constant"]
    for effect_id, effect in EFFECTS.items():
        if effect_id.startswith(_NOT_BY_DEFAULT):
            continue
        given = [key for key in values if key.startswith(f"physics.{effect_id}.")]
        keys += [
            f"physics.{effect_id}.{name}"
            for name, bounds in effect.parameters.items()
            if given and (bounds.default is None or any(key.endswith(f".{name}") for key in given))
        ]
    if choice.quantity == "motor_current":
        keys = [key for key in keys if not key.startswith("physics.electrical.driver")]
    if choice.has_total:
        keys.append("supply.auxiliary_power")
    return tuple(keys)


def wheel_of(parameter: Parameter, wheels: Sequence[str]) -> str | None:
    """The wheel whose own value it is; None: of the whole robot, or shared by its wheels."""
    return next((wheel for wheel in wheels if f".{wheel}." in parameter.keys[0]), None)


def _known() -> list[str]:
    """General keys of all that can be fitted."""
    physics = [f"physics.{name}.{key}" for name, item in EFFECTS.items() for key in item.parameters]
    return [*_FIXED, *_MOTOR, *physics]


def _expand(
    key: str, values: Values, wheels: Sequence[str], choice: Choice, place: str
) -> list[Parameter]:
    """The parameters behind a key: three if each wheel has its own."""
    axis = center_axis(key)
    if axis is not None:
        return [_parameter(key, key, center_of(values)[axis], choice)]
    own = next((wheel for wheel in wheels if f".{wheel}." in key), None)
    general = key if own is None else key.replace(f".{own}.", ".")
    for_wheels = general in _MOTOR or is_of_wheels(general)
    if general not in _known() or (own and not for_wheels):
        raise InputError(f"--fit {key}: no such value in a robot.yaml: {closest(key, _known())}")
    modelled = general in _MOTOR and general != "motor.rotor_inertia"
    if modelled and choice.quantity == "motor_current":
        raise InputError(
            f"--fit {key}: {place} measures motor currents, and the voltage is modelled from "
            "this value: nothing measures it; leave it out, or record the supply's power"
        )
    if own is not None:
        names = [key]
    elif not for_wheels or key in choice.shared or EVERY in choice.shared:
        names = [general]
    else:
        names = [wheel_key(general, wheel) for wheel in wheels]
    default = _FIXED[general].default if general in _FIXED else None
    return [
        _parameter(name, general, values.get(name, values.get(general, default)), choice)
        for name in names
    ]


def _parameter(key: str, general: str, value: object, choice: Choice) -> Parameter:
    """With a prior relative to what robot.yaml says, else that of an absent effect."""
    mean, std = absent_prior(general)
    if value is not None:
        mean = cast(float, value)
        if mean:
            std = abs(mean) * RELATIVE_STD.get(general, DEFAULT_RELATIVE_STD)
    half = choice.tolerances.get(general)
    if half is not None and mean:
        std = uniform_std(half * abs(mean))
    lower, upper = bounds_of(general)
    return Parameter(
        general, (key,), unit_of(general), std, prior_mean=mean, lower=lower, upper=upper
    )
