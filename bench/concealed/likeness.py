"""When a finding is true, and how far its numbers are off."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from attrs import frozen

from concealed.claims import PARAMETER, WHEELS, Finding, Places, TrueEffect, Truth

# Effects that power and encoders cannot distinguish, or hardly.
_ALIKE: tuple[frozenset[str], ...] = tuple(
    frozenset(names)
    for names in (
        (
            "friction.coulomb",
            "contact.rolling_resistance",
            "electrical.iron_loss",
            "parameter.physics.friction.coulomb.torque",
            "parameter.physics.contact.rolling_resistance.coefficient",
        ),
        (
            "friction.viscous",
            "electrical.iron_loss",
            "parameter.physics.friction.viscous.coefficient",
        ),
        ("body.payload_mass", "parameter.robot.mass"),
        (
            "electrical.winding_heating",
            "parameter.motor.resistance",
            "parameter.motor.torque_constant",
        ),
        (
            "electrical.driver_standby",
            "sensor.power_bias",
            "parameter.supply.auxiliary_power",
            "parameter.physics.electrical.driver_standby.power",
        ),
        ("sensor.power_lag", "sensor.clock_offset"),
        ("kinematic.wheel_radius", "parameter.robot.wheel_radius", "sensor.encoder_scale"),
        ("friction.stribeck", "parameter.physics.friction.stribeck.torque"),
        ("contact.roller_drag", "parameter.physics.contact.roller_drag.coefficient"),
        ("friction.load_dependent", "parameter.physics.friction.load_dependent.coefficient"),
        ("electrical.switching_loss", "parameter.physics.electrical.switching_loss.coefficient"),
        (
            "electrical.regeneration_loss",
            "parameter.physics.electrical.regeneration_loss.efficiency",
        ),
        (
            "electrical.supply_sag",
            "parameter.physics.electrical.supply_sag.resistance",
            "parameter.supply.nominal_voltage",
        ),
        ("body.mass_center_offset", "parameter.robot.mass_center"),
    )
)
_CLOSE = 0.015  # of the nominal value: a wrong parameter stated this well is stated right
_NARROW = 0.2  # of the nominal value: an interval that says something
_NOT_COMPARED = ("nominal", "initial_temperature")
_ANGLES = ("phase", "azimuth")


def family(effect: str) -> frozenset[str]:
    """An effect with those that data can hardly distinguish from it."""
    return frozenset({effect}).union(*(alike for alike in _ALIKE if effect in alike))


def overlap(one: Places, other: Places) -> bool:
    """Whether two places share something; body and supply touch every wheel."""
    return bool(one & other) or not one <= WHEELS or not other <= WHEELS


def explains(finding: Finding, true: TrueEffect) -> bool:
    """Whether a finding names an effect or one of its family where it is."""
    return finding.effect in family(true.effect) and overlap(finding.places, true.places)


def is_true(finding: Finding, truth: Truth) -> bool:
    """Whether a finding states something that is so, be it concealed or a deviation of the part."""
    if any(explains(finding, true) for true in truth.effects):
        return True
    return finding.effect.startswith(PARAMETER) and states_value(finding, truth)


def states_value(finding: Finding, truth: Truth) -> bool:
    """Whether a `parameter.*` finding states what the part really is."""
    nominal = _nominal(truth.nominal, finding.effect.removeprefix(PARAMETER))
    actual = actual_value(finding, truth)
    if nominal is None or actual is None:
        return False
    for estimate in finding.values.values():
        if abs(estimate.value - actual) <= _CLOSE * abs(nominal):
            return True
        if estimate.interval is not None:
            low, high = estimate.interval
            if low <= actual <= high and high - low < _NARROW * abs(nominal):
                return True
    return False


def actual_value(finding: Finding, truth: Truth) -> float | None:
    """What a parameter that a finding speaks of really is; None if the truth does not know it."""
    key = finding.effect.removeprefix(PARAMETER)
    nominal = _nominal(truth.nominal, key)
    return None if nominal is None else nominal * _actual_factor(finding, truth, key, nominal)


def _nominal(nominal: Mapping[str, Any], key: str) -> float | None:
    node: Any = nominal
    steps: tuple[str, ...]
    if key.startswith("physics."):
        effect, _, leaf = key.removeprefix("physics.").rpartition(".")
        steps = ("physics", effect, leaf)
    else:
        steps = tuple(key.split("."))
    for step in steps:
        node = node.get(step) if isinstance(node, Mapping) else None
    return float(node) if isinstance(node, int | float) else None


def _actual_factor(finding: Finding, truth: Truth, key: str, nominal: float) -> float:
    """Actual over nominal value, the mean of the wheels that a finding speaks of."""
    deviation = truth.deviations.get(key, 1.0)
    factors = np.array(deviation if isinstance(deviation, list) else [deviation] * len(WHEELS))
    usual = float(factors.mean())
    for true in truth.effects:
        if true.effect == finding.effect:
            factors[_wheels(true.places)] *= true.values["value"] / nominal / usual
    return float(factors[_wheels(finding.places)].mean())


def _wheels(places: Places) -> list[int]:
    return [n for n, wheel in enumerate(sorted(WHEELS)) if wheel in places] or [0, 1, 2]


@frozen
class Comparison:
    """One parameter, reported against true."""

    effect: str
    parameter: str
    error: float  # relative
    covered: bool | None  # whether its interval holds the true value; None: no interval


def compared(true: TrueEffect, finding: Finding) -> Iterator[Comparison]:
    """Parameters of a finding of the right name against the true ones."""
    for key, value in true.values.items():
        reported = finding.values.get(key)
        if reported is None and true.effect.startswith(PARAMETER) and key == "value":
            reported = next(iter(finding.values.values()), None)
        if reported is None or key in _NOT_COMPARED:
            continue
        covered = None
        if reported.interval is not None:
            covered = reported.interval[0] <= value <= reported.interval[1]
        error = _relative(key, reported.value - value, value, true)
        yield Comparison(true.effect, key, error, covered)


def _relative(key: str, error: float, value: float, true: TrueEffect) -> float:
    if key in _ANGLES:
        return abs((error + math.pi) % (2.0 * math.pi) - math.pi) / math.pi
    scale = abs(value)
    if key == "scale":
        scale = abs(value - 1.0)
    elif key in ("x", "y") and true.effect.startswith("body."):
        scale = math.hypot(true.values["x"], true.values["y"])
    return abs(error) / max(scale, 1e-12)
