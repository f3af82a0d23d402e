"""The hypotheses: every effect of the vocabulary at every place, and every wrong parameter.

How large an effect may be and which shapes it starts from is part of the effect.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from tomr_power_model.effects import EFFECTS, HypothesisPrior
from tomr_power_model.effects.scales import Scales
from tomr_power_model.estimation.parameter import (
    Parameter,
    ParameterisedRobot,
    bounds_of,
    uniform_std,
    unit_of,
    wheel_key,
)
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

ALL, BODY, SUPPLY = "all_wheels", "body", "supply"

# Parameters that may be wrong, their prior standard deviation over the value, and the place.
_PARAMETERS: Mapping[str, tuple[float, str]] = {
    "robot.mass": (0.2, BODY),
    "robot.inertia_z": (0.3, BODY),
    "robot.wheel_radius": (0.03, ALL),
    "robot.robot_radius": (0.03, BODY),
    "robot.wheel_inertia": (0.5, ALL),
    "motor.resistance": (0.2, ALL),
    "motor.torque_constant": (0.1, ALL),
    "motor.rotor_inertia": (0.5, ALL),
    "controller.proportional": (0.2, ALL),
    "controller.integral": (0.3, ALL),
    "controller.acceleration_limit": (0.2, BODY),
    "supply.nominal_voltage": (0.05, SUPPLY),
    "supply.auxiliary_power": (0.3, SUPPLY),
}
_DELAY_STEP = 0.002  # s
_ROLLS = 1.05  # of the largest traction over load: with this friction no wheel slides
_LEAST_FRICTION = 0.01
_LATE = (0.015, 0.03, 0.06, -0.02)  # s
_EFFECT_PARAMETER = 0.4  # prior deviation of an included effect's parameter, over its value
_WRONG = 1.5  # tolerances that a parameter must be off to be called wrong
_WRONG_PARAMETER = -math.log(2.0)  # what is left out is likelier than a wrong number
_STEP = 0.1  # of the prior_std
_BEYOND = 1.25  # how far a tolerance is stretched before the value counts as wrong
_SHAPE_STD = 0.5  # of a shape's start


def nuisances(
    base: ParameterisedRobot,
    wheels: Sequence[str],
    tolerance: float,
    tolerances: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Parameter, ...]:
    """Parameters for what may be off within the stated tolerance, each wheel by itself.

    A tolerance is half of the range; all of it is equally likely, hence the deviation of a uniform
    distribution. `tolerances` are those of single values, by their keys.
    """
    keys = ["robot.mass", "robot.inertia_z"]
    for wheel in wheels:
        keys += [wheel_key(f"motor.{name}", wheel) for name in ("resistance", "torque_constant")]
    keys += [
        key
        for key in base.values
        if key.startswith("physics.") and not key.startswith(("physics.sensor.", "physics.body."))
    ]
    found = []
    for key in keys:
        value = base.values[key]
        own = tolerances.get(key, tolerances.get(_shared(key, wheels), tolerance))
        if isinstance(value, float) and value and own:
            half = own * abs(value)
            prior_std = uniform_std(half)
            edge = _BEYOND * half
            found.append(
                Parameter(key, (key,), "", prior_std, step=prior_std, lower=-edge, upper=edge)
            )
    return tuple(found)


def _shared(key: str, wheels: Sequence[str]) -> str:
    """The key without a wheel's name."""
    for wheel in wheels:
        key = key.replace(f".{wheel}.", ".")
    return key


def catalogue(
    base: ParameterisedRobot,
    wheels: Sequence[str],
    scales: Scales,
    tolerance: float,
    orders: Sequence[float] = (),
    alternatives: Mapping[str, float] = MappingProxyType({}),
    currents_only: bool = False,
) -> tuple[Hypothesis, ...]:
    """All hypotheses about a robot.

    Args:
        base: its description.
        wheels: their names.
        scales: how large effects may be.
        tolerance: of the description's values.
        orders: of torque ripples that may be there.
        alternatives: values of the drivers, far from the described ones, that wheel speeds ask for.
        currents_only: whether nothing but the motors' currents is measured.
    """
    found = (
        *_effects(base, wheels, scales),
        *_ripples(base, wheels, scales, orders),
        *_slipping(base, wheels, scales),
        *_late(base, wheels),
        *_wrong_parameters(base, wheels, tolerance),
        *(_alternative(base, key, value) for key, value in alternatives.items()),
    )
    if not currents_only:
        return found
    electrical = [name for name, effect in EFFECTS.items() if not effect.in_currents]
    hidden = tuple(f"parameter.physics.{name}." for name in electrical)
    return tuple(
        item
        for item in found
        if item.effect not in electrical and not item.effect.startswith(hidden)
    )


def _alternative(base: ParameterisedRobot, key: str, value: float) -> Hypothesis:
    """A value that is another one, not the same a little off; 0 may be either."""
    before = base.values.get(key, 0.0)
    assert isinstance(before, int | float)
    offset = value - before
    low, high = bounds_of(key)
    step = _DELAY_STEP if key == "controller.delay" else _STEP * abs(offset)
    parameter = Parameter(
        "value",
        (key,),
        unit_of(key),
        abs(offset),
        step=step,
        lower=low - before,
        upper=high - before,
        discrete_offset=offset,
    )
    place = _PARAMETERS.get(key, (0.0, BODY))[1]
    return Hypothesis(f"parameter.{key}", (place,), (parameter,), log_prior=_WRONG_PARAMETER)


def _ripples(
    base: ParameterisedRobot, wheels: Sequence[str], scales: Scales, orders: Sequence[float]
) -> Iterator[Hypothesis]:
    effect_id = "drivetrain.torque_ripple"
    if any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    for where in _places(effect_id, wheels):
        keys = {
            name: _keys(effect_id, name, where, wheels) for name in ("torque", "order", "phase")
        }
        size = 0.3 * scales.torque
        parameters = (
            Parameter("torque", keys["torque"], "N m", size, step=_STEP * size, lower=0.0),
            Parameter("order", keys["order"], "1/rev", 0.05, step=0.005, is_shape=True),
            Parameter("phase", keys["phase"], "rad", 1.0, step=0.05, is_shape=True),
        )
        for order in orders:
            for quarter in range(4):
                start = dict.fromkeys(keys["torque"], 0.0)
                start |= dict.fromkeys(keys["order"], order)
                start |= dict.fromkeys(keys["phase"], 0.5 * math.pi * quarter)
                yield Hypothesis(effect_id, where, parameters, start=start)


def _slipping(
    base: ParameterisedRobot, wheels: Sequence[str], scales: Scales
) -> Iterator[Hypothesis]:
    """Friction at which some of what the contacts carry is too much; more of it shows nothing."""
    effect_id = "contact.slip"
    ratios = scales.traction_ratios
    if not ratios or any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    rolls = max(ratios)
    for where in _places(effect_id, wheels):
        keys = _keys(effect_id, "friction", where, wheels)
        for number, friction_coefficient in enumerate(scales.traction_ratios[1:]):
            # Starts differ a little so that hypotheses do; at none of them does a wheel slide.
            start = rolls * (_ROLLS + 0.001 * number)
            offset = friction_coefficient - start
            parameter = Parameter(
                "friction",
                keys,
                "",
                -offset,
                step=-_STEP * friction_coefficient,
                lower=_LEAST_FRICTION - start,
                upper=0.0,
                discrete_offset=offset,
            )
            yield Hypothesis(effect_id, where, (parameter,), start=dict.fromkeys(keys, start))


def _late(base: ParameterisedRobot, wheels: Sequence[str]) -> Iterator[Hypothesis]:
    """Power sensors that are late, or early, by more than a step in power lasts."""
    effect_id = "sensor.clock_offset"
    if any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    for where in _places(effect_id, wheels):
        keys = _keys(effect_id, "delay", where, wheels)
        for number, delay in enumerate(_LATE):
            start = 1e-6 * (number + 1)  # what distinguishes hypotheses of one name
            parameter = Parameter(
                "delay", keys, "s", abs(delay), step=0.1 * _LATE[0], discrete_offset=delay
            )
            yield Hypothesis(effect_id, where, (parameter,), start=dict.fromkeys(keys, start))


def _effects(
    base: ParameterisedRobot, wheels: Sequence[str], scales: Scales
) -> Iterator[Hypothesis]:
    for effect_id, effect in EFFECTS.items():
        prior = effect.prior
        if prior is None or any(key.startswith(f"physics.{effect_id}.") for key in base.values):
            continue
        for where in _places(effect_id, wheels):
            yield from (
                _effect(effect_id, prior, where, wheels, scales, shape)
                for shape in prior.shapes(scales)
            )


def _places(effect_id: str, wheels: Sequence[str]) -> list[tuple[str, ...]]:
    place = EFFECTS[effect_id].place
    if place != "wheel":
        return [(place,)]
    return [(ALL,), *((wheel,) for wheel in wheels)]


def _keys(
    effect_id: str, name: str, where: tuple[str, ...], wheels: Sequence[str]
) -> tuple[str, ...]:
    if EFFECTS[effect_id].place != "wheel":
        return (f"physics.{effect_id}.{name}",)
    chosen = wheels if where == (ALL,) else where
    return tuple(f"physics.{effect_id}.{wheel}.{name}" for wheel in chosen)


def _effect(
    effect_id: str,
    prior: HypothesisPrior,
    where: tuple[str, ...],
    wheels: Sequence[str],
    scales: Scales,
    shape: Mapping[str, float],
) -> Hypothesis:
    found, start = [], {}
    described = EFFECTS[effect_id].parameters
    for name, size in prior.sizes.items():
        keys = _keys(effect_id, name, where, wheels)
        prior_std, neutral = size(scales), described[name].neutral
        start.update(dict.fromkeys(keys, neutral))
        low, high = bounds_of(keys[0])
        step = (prior.sign or 1) * _STEP * prior_std
        unit = described[name].unit
        low, high = low - neutral, high - neutral
        if prior.sign > 0:
            low = max(low, 0.0)
        elif prior.sign < 0:
            high = min(high, 0.0)
        found.append(Parameter(name, keys, unit, prior_std, step=step, lower=low, upper=high))
    for name, value in shape.items():
        keys = _keys(effect_id, name, where, wheels)
        start.update(dict.fromkeys(keys, value))
        unit = described[name].unit
        if unit == "rad":  # an angle may be off either way, and has no smallest value
            found.append(Parameter(name, keys, unit, 1.0, step=0.05, is_shape=True))
            continue
        prior_std = _SHAPE_STD * value
        found.append(
            Parameter(
                name,
                keys,
                unit,
                prior_std,
                step=_STEP * prior_std,
                lower=-0.9 * value,
                upper=9.0 * value,
                is_shape=True,
            )
        )
    return Hypothesis(effect_id, where, tuple(found), start=start, least=prior.least(scales))


def _wrong_parameters(
    base: ParameterisedRobot, wheels: Sequence[str], tolerance: float
) -> Iterator[Hypothesis]:
    for general, (relative, place) in _PARAMETERS.items():
        if general.startswith("motor."):
            yield from _wrong(base, general, relative, wheels, tolerance)
        elif base.values.get(general):
            yield _wrong_at(base, general, (general,), relative, (place,), tolerance)
    seen = dict.fromkeys(
        f"physics.{effect}.{name}"
        for effect, described in EFFECTS.items()
        for name in described.parameters
    )
    for general in seen:
        if general in base.values:
            place = BODY if general.startswith("physics.body.") else SUPPLY
            yield _wrong_at(base, general, (general,), _EFFECT_PARAMETER, (place,), tolerance)
        else:
            yield from _wrong(base, general, _EFFECT_PARAMETER, wheels, tolerance)


def _wrong(
    base: ParameterisedRobot, general: str, relative: float, wheels: Sequence[str], tolerance: float
) -> Iterator[Hypothesis]:
    own = [(wheel, wheel_key(general, wheel)) for wheel in wheels]
    present = [(wheel, key) for wheel, key in own if base.values.get(key)]
    if len(present) == len(wheels):
        yield _wrong_at(
            base, general, tuple(key for _, key in present), relative, (ALL,), tolerance
        )
    for wheel, key in present:
        yield _wrong_at(base, general, (key,), relative, (wheel,), tolerance)


def _wrong_at(
    base: ParameterisedRobot,
    general: str,
    keys: tuple[str, ...],
    relative: float,
    where: tuple[str, ...],
    tolerance: float,
) -> Hypothesis:
    value = base.values[keys[0]]
    assert isinstance(value, float)
    prior_std = relative * abs(value)
    low, high = bounds_of(keys[0])
    parameter = Parameter(
        "value",
        keys,
        unit_of(keys[0]),
        prior_std,
        step=_STEP * prior_std,
        lower=low - value,
        upper=high - value,
    )
    return Hypothesis(
        f"parameter.{general}",
        where,
        (parameter,),
        log_prior=_WRONG_PARAMETER,
        least=_WRONG * tolerance * abs(value),
    )
