"""The hypotheses: every effect of the vocabulary at every place, and every wrong parameter.

How large an effect may be and which shapes it starts from is part of the effect.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from types import MappingProxyType

from attrs import frozen

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
    *,
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
    made = _Catalogue(base, tuple(wheels), scales, tolerance)
    found = (
        *made.effects(),
        *made.ripples(orders),
        *made.slipping(),
        *made.late(),
        *made.wrong_parameters(),
        *(made.alternative(key, value) for key, value in alternatives.items()),
    )
    if not currents_only:
        return found
    electrical = [name for name, effect in EFFECTS.items() if not effect.in_currents]
    hidden = (*electrical, *(f"parameter.physics.{name}." for name in electrical))
    return tuple(item for item in found if not item.effect.startswith(hidden))


@frozen
class _Catalogue:
    base: ParameterisedRobot
    wheels: tuple[str, ...]
    scales: Scales
    tolerance: float

    def alternative(self, key: str, value: float) -> Hypothesis:
        """A value that is another one, not the same a little off; 0 may be either."""
        before = self.base.values.get(key, 0.0)
        assert isinstance(before, int | float)
        offset = value - before
        step = _DELAY_STEP if key == "controller.delay" else _STEP * abs(offset)
        parameter = _value((key,), before, abs(offset), step=step, discrete_offset=offset)
        place = _PARAMETERS.get(key, (0.0, BODY))[1]
        return Hypothesis(f"parameter.{key}", (place,), (parameter,), log_prior=_WRONG_PARAMETER)

    def ripples(self, orders: Sequence[float]) -> Iterator[Hypothesis]:
        effect_id, size = "drivetrain.torque_ripple", 0.3 * self.scales.torque
        for where in self._places(effect_id):
            torque, order, phase = (
                self._keys(effect_id, name, where) for name in ("torque", "order", "phase")
            )
            parameters = (
                Parameter("torque", torque, "N m", size, step=_STEP * size, lower=0.0),
                Parameter("order", order, "1/rev", 0.05, step=0.005, is_shape=True),
                Parameter("phase", phase, "rad", 1.0, step=0.05, is_shape=True),
            )
            for number, quarter in product(orders, range(4)):
                start = dict.fromkeys(torque, 0.0) | dict.fromkeys(order, number)
                start |= dict.fromkeys(phase, 0.5 * math.pi * quarter)
                yield Hypothesis(effect_id, where, parameters, start=start)

    def slipping(self) -> Iterator[Hypothesis]:
        """Friction at which some of what the contacts carry is too much; more shows nothing."""
        effect_id, ratios = "contact.slip", self.scales.traction_ratios
        for where in self._places(effect_id):
            keys = self._keys(effect_id, "friction", where)
            for number, friction in enumerate(ratios[1:]):
                # Starts differ a little so that hypotheses do; at none of them does a wheel slide.
                start = max(ratios) * (_ROLLS + 0.001 * number)
                low, offset = _LEAST_FRICTION - start, friction - start
                size, step = -offset, -_STEP * friction
                parameter = Parameter(
                    "friction",
                    keys,
                    "",
                    size,
                    step=step,
                    lower=low,
                    upper=0.0,
                    discrete_offset=offset,
                )
                yield Hypothesis(effect_id, where, (parameter,), start=dict.fromkeys(keys, start))

    def late(self) -> Iterator[Hypothesis]:
        """Power sensors that are late, or early, by more than a step in power lasts."""
        effect_id, step = "sensor.clock_offset", 0.1 * _LATE[0]
        for where in self._places(effect_id):
            keys = self._keys(effect_id, "delay", where)
            for number, delay in enumerate(_LATE):
                start = 1e-6 * (number + 1)  # what distinguishes hypotheses of one name
                size = abs(delay)
                parameter = Parameter("delay", keys, "s", size, step=step, discrete_offset=delay)
                yield Hypothesis(effect_id, where, (parameter,), start=dict.fromkeys(keys, start))

    def effects(self) -> Iterator[Hypothesis]:
        for effect_id, effect in EFFECTS.items():
            if effect.prior is not None:
                shapes = list(effect.prior.shapes(self.scales))
                for where, shape in product(self._places(effect_id), shapes):
                    yield self._effect(effect_id, effect.prior, where, shape)

    def _places(self, effect_id: str) -> list[tuple[str, ...]]:
        """Where an effect may be that the description leaves out."""
        if any(key.startswith(f"physics.{effect_id}.") for key in self.base.values):
            return []
        place = EFFECTS[effect_id].place
        return [(place,)] if place != "wheel" else [(ALL,), *((wheel,) for wheel in self.wheels)]

    def _keys(self, effect_id: str, name: str, where: tuple[str, ...]) -> tuple[str, ...]:
        if EFFECTS[effect_id].place != "wheel":
            return (f"physics.{effect_id}.{name}",)
        chosen = self.wheels if where == (ALL,) else where
        return tuple(f"physics.{effect_id}.{wheel}.{name}" for wheel in chosen)

    def _effect(
        self,
        effect_id: str,
        prior: HypothesisPrior,
        where: tuple[str, ...],
        shape: Mapping[str, float],
    ) -> Hypothesis:
        found, start, described = [], {}, EFFECTS[effect_id].parameters
        for name, size in prior.sizes.items():
            keys, neutral = self._keys(effect_id, name, where), described[name].neutral
            start.update(dict.fromkeys(keys, neutral))
            std, unit = size(self.scales), described[name].unit
            low, high = (bound - neutral for bound in bounds_of(keys[0]))
            low = max(low, 0.0) if prior.sign > 0 else low
            high = min(high, 0.0) if prior.sign < 0 else high
            step = (prior.sign or 1) * _STEP * std
            found.append(Parameter(name, keys, unit, std, step=step, lower=low, upper=high))
        for name, value in shape.items():
            keys, unit = self._keys(effect_id, name, where), described[name].unit
            start.update(dict.fromkeys(keys, value))
            std, step, low, high = _SHAPE_STD * value, _SHAPE_STD * _STEP * value, -0.9, 9.0
            if unit == "rad":  # an angle may be off either way, and has no smallest value
                std, step, low, high = 1.0, 0.05, -math.inf, math.inf
            low, high = (low, high) if unit == "rad" else (low * value, high * value)
            found.append(
                Parameter(name, keys, unit, std, step=step, lower=low, upper=high, is_shape=True)
            )
        least = prior.least(self.scales)
        return Hypothesis(
            effect_id,
            where,
            tuple(found),
            start=start,
            least=least,
            log_prior=prior.log_prior,
            stands_for=prior.stands_for,
        )

    def wrong_parameters(self) -> Iterator[Hypothesis]:
        relatives = dict(_PARAMETERS)
        for effect_id, effect in EFFECTS.items():
            place = BODY if effect_id.startswith("body.") else SUPPLY
            for name in effect.parameters:
                relatives[f"physics.{effect_id}.{name}"] = (_EFFECT_PARAMETER, place)
        for general, (relative, place) in relatives.items():
            if general in self.base.values and not general.startswith("motor."):
                if self.base.values[general] or general.startswith("physics."):
                    yield self._wrong(general, (general,), relative, place)
                continue
            own = {wheel: wheel_key(general, wheel) for wheel in self.wheels}
            own = {wheel: key for wheel, key in own.items() if self.base.values.get(key)}
            if len(own) == len(self.wheels):
                yield self._wrong(general, tuple(own.values()), relative, ALL)
            for wheel, key in own.items():
                yield self._wrong(general, (key,), relative, wheel)

    def _wrong(
        self, general: str, keys: tuple[str, ...], relative: float, place: str
    ) -> Hypothesis:
        value = self.base.values[keys[0]]
        assert isinstance(value, float)
        std, least = relative * abs(value), _WRONG * self.tolerance * abs(value)
        parameter = _value(keys, value, std, step=_STEP * std)
        return Hypothesis(
            f"parameter.{general}", (place,), (parameter,), log_prior=_WRONG_PARAMETER, least=least
        )


def _value(
    keys: tuple[str, ...], value: float, std: float, *, step: float, discrete_offset: float = 0.0
) -> Parameter:
    """Offset of a described value."""
    lower, upper = (bound - value for bound in bounds_of(keys[0]))
    return Parameter(
        "value",
        keys,
        unit_of(keys[0]),
        std,
        step=step,
        lower=lower,
        upper=upper,
        discrete_offset=discrete_offset,
    )
