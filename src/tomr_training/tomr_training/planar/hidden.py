"""Physics that real robots have and their descriptions lack, in sizes that an explanation leaves.

An effect that the description knows already is only as far off as all its values.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from attrs import evolve

from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot import WHEELS, Controller, Robot
from tomr_training.drives import every_value
from tomr_training.planar.faults import dry_friction

Draw = Callable[[float, np.random.Generator], dict[str, float]]

LEAST_OFF, MOST_OFF = 0.003, 0.03  # of values from their description
MOST_EFFECTS = 6  # that a description lacks
_FAST = 8.0  # rad/s, of a wheel
_TURN = 2.0 * math.pi


def _uniform(**ranges: tuple[float, float]) -> Draw:
    def draw(torque: float, random: np.random.Generator) -> dict[str, float]:
        return {name: float(random.uniform(*limits)) for name, limits in ranges.items()}

    return draw


def _torque(low: float, high: float, **ranges: tuple[float, float]) -> Draw:
    """A torque as a share of dry friction, the rest as `_uniform`."""

    def draw(torque: float, random: np.random.Generator) -> dict[str, float]:
        size = torque * float(random.uniform(low, high))
        return {"torque": size, **_uniform(**ranges)(torque, random)}

    return draw


def _quadratic(torque: float, random: np.random.Generator) -> dict[str, float]:
    return {"coefficient": torque * float(random.uniform(0.0, 0.1)) / _FAST**2}


def _ripple(torque: float, random: np.random.Generator) -> dict[str, float]:
    size = torque * float(random.uniform(0.0, 0.15))
    order = float(random.integers(1, 13))
    return {"torque": size, "order": order, "phase": float(random.uniform(0.0, _TURN))}


# Parameters of each effect that may be left out, given the dry friction at a wheel [N m].
LEFT_OUT: Mapping[str, Draw] = {
    "friction.stribeck": _torque(0.0, 0.2, speed=(0.4, 1.5)),
    "friction.asymmetric": _torque(-0.1, 0.1),
    "friction.load_dependent": _uniform(coefficient=(0.0, 0.06)),
    "friction.quadratic": _quadratic,
    "drivetrain.torque_ripple": _ripple,
    "contact.roller_drag": _uniform(coefficient=(0.0, 0.01), slip=(0.0, 0.0)),
    "contact.rolling_resistance": _uniform(coefficient=(0.0, 0.002)),
    "electrical.winding_heating": _uniform(
        thermal_resistance=(0.0, 5.0), time_constant=(60.0, 400.0), initial=(0.0, 15.0)
    ),
    "electrical.supply_sag": _uniform(resistance=(0.0, 0.12)),
    "electrical.switching_loss": _uniform(coefficient=(0.0, 0.08)),
    "electrical.regeneration_loss": _uniform(efficiency=(0.8, 1.0)),
    "electrical.iron_loss": _uniform(hysteresis=(0.0, 1e-3), eddy=(0.0, 5e-6)),
    "kinematic.wheel_radius": _uniform(scale=(0.997, 1.003)),
    "body.mass_center_offset": _uniform(x=(-0.01, 0.01), y=(-0.01, 0.01)),
    "sensor.power_scale": _uniform(scale=(0.98, 1.02)),
    "sensor.power_bias": _uniform(power=(-0.1, 0.1)),
    "sensor.power_lag": _uniform(time_constant=(0.0, 0.01)),
    "sensor.clock_offset": _uniform(delay=(0.0, 0.004)),
}


def with_hidden_physics(believed: Robot, random: np.random.Generator) -> Robot:
    """A real robot whose description is nearly right."""
    most = float(random.uniform(LEAST_OFF, MOST_OFF))

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - most, 1.0 + most))

    plant = every_value(believed, off)
    torque = dry_friction(believed)
    names = [name for name in LEFT_OUT if name not in believed.physics]
    chosen = random.choice(names, int(random.integers(1, MOST_EFFECTS + 1)), replace=False)
    physics = dict(plant.physics)
    for name in map(str, chosen):
        count = WHEELS if EFFECTS[name].place == "wheel" else 1
        one, two, three = ([LEFT_OUT[name](torque, random) for _ in range(count)] * WHEELS)[:WHEELS]
        physics[name] = (one, two, three)
    controller = tuned(plant.controller, 0.5 * most, random)
    return evolve(plant, physics=physics, controller=controller)


def tuned(given: Controller, most: float, random: np.random.Generator) -> Controller:
    """Drivers a little off: a real loop is never known as well as a simulated one."""

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - most, 1.0 + most))

    return evolve(
        given,
        proportional=off(given.proportional),
        integral=off(given.integral),
        acceleration_limit=off(given.acceleration_limit),
    )
