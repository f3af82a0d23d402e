"""How large an effect is made: three sizes of each, in natural units, and its parameters from them.

The smallest is meant to lie below the noise of a single power sample. An effect that is not in
this table cannot be concealed; effects outside the vocabulary have theirs in `beyond.py`.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from attrs import frozen

from concealed.scales import Scales

Make = Callable[[float, Scales, np.random.Generator], dict[str, float]]

_USUAL = (1.0, 0.2, 0.035)


@frozen
class Recipe:
    """Sizes, large to small, and what makes an effect's parameters of one."""

    make: Make
    sizes: tuple[float, float, float] = _USUAL


def _either(random: np.random.Generator) -> float:
    return float(random.choice([-1.0, 1.0]))


def _some_way(reach: float, random: np.random.Generator) -> tuple[float, float]:
    """The coordinates of so far in a direction by chance."""
    direction = random.uniform(-math.pi, math.pi)
    return float(reach * math.cos(direction)), float(reach * math.sin(direction))


def _off_center(size: float, scales: Scales, random: np.random.Generator) -> dict[str, float]:
    x, y = _some_way(size * scales.radius, random)
    return {"x": x, "y": y}


def _ripple(size: float, scales: Scales, random: np.random.Generator) -> dict[str, float]:
    return {
        "torque": size * scales.torque,
        "order": float(random.integers(1, 9)),
        "phase": float(random.uniform(-math.pi, math.pi)),
    }


def _off_disc(size: float, scales: Scales, random: np.random.Generator) -> dict[str, float]:
    cosine, sine = _some_way(size, random)
    return {"cosine": cosine, "sine": sine}


def _iron(size: float, scales: Scales, random: np.random.Generator) -> dict[str, float]:
    return {
        "hysteresis": 0.6 * size * scales.torque / scales.gear,
        "eddy": 0.4 * size * scales.torque / (scales.speed * scales.gear**2),
    }


RECIPES: Mapping[str, Recipe] = {
    "friction.coulomb": Recipe(lambda s, u, _: {"torque": s * u.torque}),
    "friction.viscous": Recipe(lambda s, u, _: {"coefficient": s * u.torque / u.speed}),
    "friction.stribeck": Recipe(
        lambda s, u, _: {"torque": s * u.torque, "speed": 0.2 * u.speed}, (4.0, 1.5, 0.5)
    ),
    "friction.asymmetric": Recipe(
        lambda s, u, random: {"torque": s * u.torque * _either(random)}, (0.5, 0.12, 0.025)
    ),
    "friction.load_dependent": Recipe(lambda s, u, _: {"coefficient": s}, (0.2, 0.05, 0.01)),
    "friction.quadratic": Recipe(lambda s, u, _: {"coefficient": s * u.torque / u.speed**2}),
    "drivetrain.torque_ripple": Recipe(_ripple, (2.0, 0.5, 0.1)),
    "contact.roller_drag": Recipe(lambda s, u, _: {"coefficient": s}, (0.02, 0.005, 0.001)),
    "contact.rolling_resistance": Recipe(lambda s, u, _: {"coefficient": s}, (0.03, 0.006, 0.0012)),
    # The smaller the traction, the larger the effect.
    "contact.slip": Recipe(lambda s, u, _: {"friction": s * u.traction}, (1.1, 1.6, 1.95)),
    "body.payload_mass": Recipe(lambda s, u, _: {"mass": s * u.mass}, (0.4, 0.12, 0.04)),
    "body.mass_center_offset": Recipe(_off_center, (0.25, 0.08, 0.03)),
    "body.slope": Recipe(
        lambda s, _, random: {"angle": s, "azimuth": float(random.uniform(-math.pi, math.pi))},
        (0.05, 0.01, 0.0025),
    ),
    "electrical.winding_heating": Recipe(
        lambda s, u, random: {
            "thermal_resistance": s * u.thermal_resistance,
            "time_constant": float(random.uniform(15.0, 40.0)),
        },
        (1.5, 0.3, 0.05),
    ),
    "electrical.supply_sag": Recipe(
        lambda s, u, _: {"resistance": s * u.supply_resistance}, (1.0, 0.1, 0.015)
    ),
    "electrical.driver_standby": Recipe(lambda s, u, _: {"power": s * u.power}, (0.5, 0.1, 0.02)),
    "electrical.switching_loss": Recipe(
        lambda s, u, _: {"coefficient": s * u.power / u.current}, (0.15, 0.03, 0.006)
    ),
    # What returns: the smaller, the larger the effect.
    "electrical.regeneration_loss": Recipe(lambda s, u, _: {"efficiency": s}, (0.1, 0.6, 0.93)),
    "electrical.iron_loss": Recipe(_iron),
    "kinematic.wheel_radius": Recipe(
        lambda s, _, random: {"scale": 1.0 + s * _either(random)}, (0.05, 0.02, 0.005)
    ),
    "sensor.power_scale": Recipe(
        lambda s, _, random: {"scale": 1.0 + s * _either(random)}, (0.2, 0.05, 0.012)
    ),
    "sensor.power_bias": Recipe(
        lambda s, u, random: {"power": s * u.power * _either(random)}, (0.5, 0.1, 0.02)
    ),
    "sensor.power_lag": Recipe(lambda s, u, _: {"time_constant": s}, (0.08, 0.02, 0.004)),
    "sensor.clock_offset": Recipe(lambda s, u, _: {"delay": s}, (0.06, 0.015, 0.003)),
    "sensor.encoder_scale": Recipe(
        lambda s, _, random: {"scale": 1.0 + s * _either(random)}, (0.05, 0.02, 0.005)
    ),
    "sensor.encoder_eccentricity": Recipe(_off_disc, (0.05, 0.02, 0.005)),
    "sensor.supply_scale": Recipe(
        lambda s, _, random: {"scale": 1.0 + s * _either(random)}, (0.2, 0.05, 0.012)
    ),
}
