"""The hypotheses: every effect of the vocabulary at every place, and every wrong parameter.

A row of the table says how large an effect may be (`spread`, of its size) and which shapes it
starts from; adding an effect is one row.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType

from attrs import frozen

from tomr_power_model.robot.vocabulary import EFFECTS
from tomr_reality_gap.hypotheses.knobs import (
    NEUTRAL,
    Hypothesis,
    Knob,
    Turned,
    bounds_of,
    unit_of,
    wheel_key,
)
from tomr_reality_gap.hypotheses.scales import Scales

ALL, BODY, SUPPLY = "all_wheels", "body", "supply"

Size = Callable[[Scales], float]
Shapes = Callable[[Scales], Sequence[Mapping[str, float]]]


def _no_shape(scales: Scales) -> Sequence[Mapping[str, float]]:
    return ({},)


@frozen
class Row:
    """How an effect is tried."""

    sizes: Mapping[str, Size]  # spread of each parameter that starts from neutral
    shapes: Shapes = _no_shape  # starts of the others, and their spreads relative to them
    sign: int = 1  # of the permitted side of the sizes; 0: both
    least: Size = lambda scales: 0.0  # size below which it cannot be told from sampling
    weight: float = 0.0


def _speeds(scales: Scales) -> Sequence[Mapping[str, float]]:
    return [{"speed": part * scales.speed} for part in (0.06, 0.15, 0.4)]


def _times(scales: Scales) -> Sequence[Mapping[str, float]]:
    return [{"time_constant": part * scales.duration} for part in (0.15, 0.5, 1.5)]


def _slips(scales: Scales) -> Sequence[Mapping[str, float]]:
    """The contract's law, and dry friction against sliding in the rolling direction as well."""
    return [{}, {"slip": 0.4}]


def _azimuths(scales: Scales) -> Sequence[Mapping[str, float]]:
    return [{"azimuth": part * math.pi / 4.0} for part in range(8)]


_TABLE: Mapping[str, Row] = {
    "friction.coulomb": Row({"torque": lambda s: 0.5 * s.torque}),
    "friction.viscous": Row({"coefficient": lambda s: 0.5 * s.torque / s.speed}),
    "friction.stribeck": Row({"torque": lambda s: 0.5 * s.torque}, _speeds),
    "friction.asymmetric": Row({"torque": lambda s: 0.3 * s.torque}, sign=0),
    "friction.load_dependent": Row({"coefficient": lambda s: 0.1}),
    "friction.quadratic": Row({"coefficient": lambda s: 0.5 * s.torque / s.speed**2}),
    "contact.roller_drag": Row(
        {"coefficient": lambda s: 0.5 * s.torque / (s.load * s.radius)}, _slips
    ),
    "contact.rolling_resistance": Row(
        {"coefficient": lambda s: 0.5 * s.torque / (s.load * s.radius)}
    ),
    "body.payload_mass": Row({"mass": lambda s: 0.2 * s.mass}),
    "body.slope": Row({"angle": lambda s: 0.05}, _azimuths),
    "body.mass_center_offset": Row(
        {"x": lambda s: 0.15 * s.arm, "y": lambda s: 0.15 * s.arm}, sign=0
    ),
    "electrical.winding_heating": Row(
        {"thermal_resistance": lambda s: 0.2 / 0.004 / s.copper, "initial": lambda s: 10.0},
        _times,
    ),
    "electrical.supply_sag": Row({"resistance": lambda s: 0.02 * s.voltage / s.current}),
    "electrical.driver_standby": Row({"power": lambda s: 0.5 * s.power}),
    "electrical.switching_loss": Row({"coefficient": lambda s: 0.3 * s.power / s.current}),
    "electrical.regeneration_loss": Row({"efficiency": lambda s: 0.5}, sign=-1),
    "electrical.iron_loss": Row(
        {
            "hysteresis": lambda s: 0.3 * s.torque / s.gear,
            "eddy": lambda s: 0.3 * s.torque / s.speed / s.gear**2,
        }
    ),
    "kinematic.wheel_radius": Row({"scale": lambda s: 0.03}, sign=0),
    "sensor.power_scale": Row({"scale": lambda s: 0.1}, sign=0),
    "sensor.power_bias": Row({"power": lambda s: 0.3 * s.power}, sign=0),
    # Within a driver's period power is a sawtooth: timing finer than that is not known.
    "sensor.power_lag": Row({"time_constant": lambda s: 0.05}, least=lambda s: s.period),
    "sensor.clock_offset": Row({"delay": lambda s: 0.03}, sign=0, least=lambda s: s.period),
}

# Parameters that may be wrong, their spread relative to the value, and the place.
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
# What shows in electrical power alone, and iron loss, which brakes the rotor as Coulomb and viscous
# friction do: the currents of the motors do not tell it.
_ELECTRICAL = frozenset(
    {
        "electrical.iron_loss",
        "electrical.driver_standby",
        "electrical.switching_loss",
        "electrical.regeneration_loss",
        "sensor.power_scale",
        "sensor.power_bias",
        "sensor.power_lag",
        "sensor.clock_offset",
    }
)
_DELAY_STEP = 0.002  # s
_ROLLS = 1.05  # of the largest traction over load: with this friction no wheel slides
_LEAST_GRIP = 0.01
_LATE = (0.015, 0.03, 0.06, -0.02)  # s
_EFFECT_PARAMETER = 0.4  # spread of an included effect's parameter, relative to its value
_WRONG = 1.5  # tolerances that a parameter must be off to be called wrong
_WRONG_PARAMETER = -math.log(2.0)  # what is left out is likelier than a wrong number
_STEP = 0.1  # of the spread
_BEYOND = 1.25  # how far a tolerance is stretched before the value counts as wrong
_SHAPE_SPREAD = 0.5  # of a shape's start


def nuisances(
    base: Turned,
    wheels: Sequence[str],
    tolerance: float,
    tolerances: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Knob, ...]:
    """Knobs for what may be off within the stated tolerance, each wheel by itself.

    A tolerance is half of the range; all of it is equally likely, hence the spread of a uniform
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
            spread = half / math.sqrt(3.0)
            found.append(Knob(key, (key,), "", spread, spread, -_BEYOND * half, _BEYOND * half))
    return tuple(found)


def _shared(key: str, wheels: Sequence[str]) -> str:
    """The key without a wheel's name."""
    for wheel in wheels:
        key = key.replace(f".{wheel}.", ".")
    return key


def catalogue(
    base: Turned,
    wheels: Sequence[str],
    scales: Scales,
    tolerance: float,
    orders: Sequence[float] = (),
    leaps: Mapping[str, float] = MappingProxyType({}),
    currents_only: bool = False,
) -> tuple[Hypothesis, ...]:
    """All hypotheses about a robot.

    Args:
        base: its description.
        wheels: their names.
        scales: how large effects may be.
        tolerance: of the description's values.
        orders: of torque ripples that may be there.
        leaps: values of the drivers that the wheels' speeds ask for, far from the described ones.
        currents_only: whether nothing but the motors' currents is measured.
    """
    found = (
        *_effects(base, wheels, scales),
        *_ripples(base, wheels, scales, orders),
        *_slipping(base, wheels, scales),
        *_late(base, wheels),
        *_wrong_parameters(base, wheels, tolerance),
        *(_leap(base, key, value) for key, value in leaps.items()),
    )
    if not currents_only:
        return found
    hidden = tuple(f"parameter.physics.{effect}." for effect in _ELECTRICAL)
    return tuple(
        item
        for item in found
        if item.effect not in _ELECTRICAL and not item.effect.startswith(hidden)
    )


def _leap(base: Turned, key: str, value: float) -> Hypothesis:
    """A value that is another one, not the same a little off; 0 may be either."""
    before = base.values.get(key, 0.0)
    assert isinstance(before, int | float)
    turn = value - before
    low, high = bounds_of(key)
    step = _DELAY_STEP if key == "controller.delay" else _STEP * abs(turn)
    knob = Knob(
        "value", (key,), unit_of(key), abs(turn), step, low - before, high - before, leap=turn
    )
    place = _PARAMETERS.get(key, (0.0, BODY))[1]
    return Hypothesis(f"parameter.{key}", (place,), (knob,), {}, _WRONG_PARAMETER)


def _ripples(
    base: Turned, wheels: Sequence[str], scales: Scales, orders: Sequence[float]
) -> Iterator[Hypothesis]:
    effect_id = "drivetrain.torque_ripple"
    if any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    for where in _places(effect_id, wheels):
        keys = {
            name: _keys(effect_id, name, where, wheels) for name in ("torque", "order", "phase")
        }
        size = 0.3 * scales.torque
        knobs = (
            Knob("torque", keys["torque"], "N m", size, _STEP * size, 0.0),
            Knob("order", keys["order"], "1/rev", 0.05, 0.005, is_shape=True),
            Knob("phase", keys["phase"], "rad", 1.0, 0.05, is_shape=True),
        )
        for order in orders:
            for quarter in range(4):
                start = dict.fromkeys(keys["torque"], 0.0)
                start |= dict.fromkeys(keys["order"], order)
                start |= dict.fromkeys(keys["phase"], 0.5 * math.pi * quarter)
                yield Hypothesis(effect_id, where, knobs, start)


def _slipping(base: Turned, wheels: Sequence[str], scales: Scales) -> Iterator[Hypothesis]:
    """Grips at which some of what the contacts carry is too much; above all of it nothing shows."""
    effect_id = "contact.slip"
    if not scales.grips or any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    rolls = max(scales.grips)
    for where in _places(effect_id, wheels):
        keys = _keys(effect_id, "friction", where, wheels)
        for number, grip in enumerate(scales.grips[1:]):
            # Starts differ a little so that hypotheses do; at none of them does a wheel slide.
            start = rolls * (_ROLLS + 0.001 * number)
            leap = grip - start
            low = _LEAST_GRIP - start
            knob = Knob("friction", keys, "", -leap, -_STEP * grip, low, 0.0, leap=leap)
            yield Hypothesis(effect_id, where, (knob,), dict.fromkeys(keys, start))


def _late(base: Turned, wheels: Sequence[str]) -> Iterator[Hypothesis]:
    """Power sensors that are late, or early, by more than a step in power lasts."""
    effect_id = "sensor.clock_offset"
    if any(key.startswith(f"physics.{effect_id}.") for key in base.values):
        return
    for where in _places(effect_id, wheels):
        keys = _keys(effect_id, "delay", where, wheels)
        for number, leap in enumerate(_LATE):
            start = 1e-6 * (number + 1)  # what tells hypotheses of one name apart
            knob = Knob("delay", keys, "s", abs(leap), 0.1 * _LATE[0], leap=leap)
            yield Hypothesis(effect_id, where, (knob,), dict.fromkeys(keys, start))


def _effects(base: Turned, wheels: Sequence[str], scales: Scales) -> Iterator[Hypothesis]:
    for effect_id, row in _TABLE.items():
        if any(key.startswith(f"physics.{effect_id}.") for key in base.values):
            continue
        for where in _places(effect_id, wheels):
            yield from (
                _effect(effect_id, row, where, wheels, scales, shape)
                for shape in row.shapes(scales)
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
    row: Row,
    where: tuple[str, ...],
    wheels: Sequence[str],
    scales: Scales,
    shape: Mapping[str, float],
) -> Hypothesis:
    knobs, start = [], {}
    parameters = EFFECTS[effect_id].parameters
    for name, size in row.sizes.items():
        keys = _keys(effect_id, name, where, wheels)
        spread, neutral = size(scales), NEUTRAL.get(name, 0.0)
        start.update(dict.fromkeys(keys, neutral))
        low, high = bounds_of(keys[0])
        step = (row.sign or 1) * _STEP * spread
        unit = parameters[name].unit
        low, high = low - neutral, high - neutral
        if row.sign > 0:
            low = max(low, 0.0)
        elif row.sign < 0:
            high = min(high, 0.0)
        knobs.append(Knob(name, keys, unit, spread, step, low, high))
    for name, value in shape.items():
        keys = _keys(effect_id, name, where, wheels)
        start.update(dict.fromkeys(keys, value))
        unit = parameters[name].unit
        if unit == "rad":  # an angle may turn either way, and has no smallest value
            knobs.append(Knob(name, keys, unit, 1.0, 0.05, is_shape=True))
            continue
        spread = _SHAPE_SPREAD * value
        low, high = -0.9 * value, 9.0 * value
        knobs.append(Knob(name, keys, unit, spread, _STEP * spread, low, high, True))
    return Hypothesis(effect_id, where, tuple(knobs), start, row.weight, row.least(scales))


def _wrong_parameters(
    base: Turned, wheels: Sequence[str], tolerance: float
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
    base: Turned, general: str, relative: float, wheels: Sequence[str], tolerance: float
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
    base: Turned,
    general: str,
    keys: tuple[str, ...],
    relative: float,
    where: tuple[str, ...],
    tolerance: float,
) -> Hypothesis:
    value = base.values[keys[0]]
    assert isinstance(value, float)
    spread = relative * abs(value)
    low, high = bounds_of(keys[0])
    knob = Knob("value", keys, unit_of(keys[0]), spread, _STEP * spread, low - value, high - value)
    least = _WRONG * tolerance * abs(value)
    return Hypothesis(f"parameter.{general}", where, (knob,), {}, _WRONG_PARAMETER, least)
