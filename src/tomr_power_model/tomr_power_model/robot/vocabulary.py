"""The vocabulary of physical effects: names, parameters, units and bounds.

This is the contract's table. What an effect does is written once in `tomr_power_model.physics`
(the model) and, independently, in a simulator; both refer to these names.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from attrs import frozen

Place = Literal["wheel", "body", "supply"]


@frozen
class EffectParameter:
    """One number of an effect."""

    unit: str
    minimum: float = 0.0
    maximum: float = math.inf
    above: float = -math.inf
    default: float | None = None  # None: must be given


@frozen
class Effect:
    """One named effect: where it can sit and which numbers describe it."""

    place: Place
    parameters: Mapping[str, EffectParameter]


_ANY = EffectParameter
_FREE = -math.inf


def _effect(place: Place, **parameters: EffectParameter) -> Effect:
    return Effect(place, MappingProxyType(parameters))


EFFECTS: Mapping[str, Effect] = MappingProxyType(
    {
        "friction.coulomb": _effect("wheel", torque=_ANY("N m")),
        "friction.viscous": _effect("wheel", coefficient=_ANY("N m s/rad")),
        "friction.stribeck": _effect("wheel", torque=_ANY("N m"), speed=_ANY("rad/s", above=0.0)),
        "friction.asymmetric": _effect("wheel", torque=_ANY("N m", _FREE)),
        "friction.load_dependent": _effect("wheel", coefficient=_ANY("", maximum=1.0)),
        "friction.quadratic": _effect("wheel", coefficient=_ANY("N m s^2/rad^2")),
        "drivetrain.torque_ripple": _effect(
            "wheel", torque=_ANY("N m"), order=_ANY("1/rev", above=0.0), phase=_ANY("rad", _FREE)
        ),
        # Beyond the contract: `slip`, see `physics.effects.friction.RollerDrag`.
        "contact.roller_drag": _effect(
            "wheel", coefficient=_ANY(""), slip=_ANY("", maximum=10.0, default=0.0)
        ),
        "contact.rolling_resistance": _effect("wheel", coefficient=_ANY("")),
        "contact.slip": _effect("wheel", friction=_ANY("", above=0.0)),
        "body.payload_mass": _effect("body", mass=_ANY("kg", _FREE)),
        "body.mass_center_offset": _effect("body", x=_ANY("m", _FREE), y=_ANY("m", _FREE)),
        "body.slope": _effect("body", angle=_ANY("rad", 0.0, 1.0), azimuth=_ANY("rad", _FREE)),
        # Beyond the contract: `initial`, the temperature above 25 C that a recording begins with.
        "electrical.winding_heating": _effect(
            "wheel",
            thermal_resistance=_ANY("K/W"),
            time_constant=_ANY("s", above=0.0),
            initial=_ANY("K", _FREE, default=0.0),
        ),
        "electrical.supply_sag": _effect("supply", resistance=_ANY("ohm")),
        "electrical.driver_standby": _effect("wheel", power=_ANY("W")),
        "electrical.switching_loss": _effect("wheel", coefficient=_ANY("W/A")),
        "electrical.regeneration_loss": _effect("wheel", efficiency=_ANY("", maximum=1.0)),
        "electrical.iron_loss": _effect(
            "wheel", hysteresis=_ANY("W s/rad"), eddy=_ANY("W s^2/rad^2")
        ),
        "kinematic.wheel_radius": _effect("wheel", scale=_ANY("", above=0.0)),
        "sensor.power_scale": _effect("wheel", scale=_ANY("", above=0.0)),
        "sensor.power_bias": _effect("wheel", power=_ANY("W", _FREE)),
        "sensor.power_lag": _effect("wheel", time_constant=_ANY("s")),
        "sensor.clock_offset": _effect("wheel", delay=_ANY("s", _FREE)),
    }
)
