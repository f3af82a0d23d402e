"""Which values of a robot.yaml are fitted, how far they are believed, and how they are put back."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import cast

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.priors import (
    DEFAULT_RELATIVE_STD,
    RELATIVE_STD,
    absent_prior,
)
from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.robot.description import closest
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS

Array = NDArray[np.float64]
Values = dict[str, object]

EVERY = "all"
_AXES = ("x", "y", "z")
_CENTER = "robot.mass_center"
_MOTOR = {spec.name: spec for spec in MOTOR_PARAMETERS}
# Of place or past, which an instant's motion does not tell, or of other tools.
_NOT_BY_DEFAULT = ("kinematic.", "sensor.", "body.", "drivetrain.", "electrical.winding_heating")
_FIXED = {
    spec.name: spec
    for spec in ROBOT_PARAMETERS
    if spec.kind == "float" and not spec.name.startswith(("motor.", "sensors."))
}


@frozen
class Free:
    """One value to be fitted, with what is believed of it before."""

    key: str  # as in robot.yaml, dotted
    general: str  # the key without a wheel's name
    wheel: int | None  # None: of the whole robot, or alike for its wheels
    unit: str
    believed: float
    spread: float  # standard deviation of the belief
    lower: float
    upper: float


@frozen
class Choice:
    """What the user asked for."""

    keys: tuple[str, ...] = ()  # empty: the default set
    alike: tuple[str, ...] = ()  # of these one value for all wheels; EVERY: of all
    tolerances: Mapping[str, float] = {}  # relative, by general key
    has_total: bool = False  # whether the whole robot's power was measured
    has_motors: bool = True
    quantity: str = "power"


def choose(values: Values, wheels: tuple[str, str, str], choice: Choice, place: str) -> list[Free]:
    """The values to fit. Raises InputError for a key that cannot be fitted."""
    keys = choice.keys or default_keys(values, wheels, choice)
    keys = tuple(dict.fromkeys((*keys, *(key for key in choice.alike if key != EVERY))))
    found: dict[str, Free] = {}
    for key in keys:
        for free in _expand(key, values, wheels, choice, place):
            found.setdefault(free.key, free)
    unknown = set(choice.tolerances) - {free.general for free in found.values()}
    if unknown:
        raise InputError(
            f"--tolerance {min(unknown)}: it is not fitted: {closest(min(unknown), list(keys))}"
        )
    return list(found.values())


def default_keys(values: Values, wheels: tuple[str, str, str], choice: Choice) -> tuple[str, ...]:
    """The values that a robot's power usually tells: what its description includes."""
    keys = ["robot.mass", "robot.inertia_z"]
    if choice.quantity != "motor_current":
        # With currents alone the voltage is modelled from these two: nothing measures them.
        keys += ["motor.resistance", "motor.torque_constant"]
    for effect_id, effect in EFFECTS.items():
        if effect_id.startswith(_NOT_BY_DEFAULT):
            continue
        told = [key for key in values if key.startswith(f"physics.{effect_id}.")]
        keys += [
            f"physics.{effect_id}.{name}"
            for name, bounds in effect.parameters.items()
            if told and (bounds.default is None or any(key.endswith(f".{name}") for key in told))
        ]
    if choice.quantity == "motor_current":
        keys = [key for key in keys if not key.startswith("physics.electrical.driver")]
    if choice.has_total:
        keys.append("supply.auxiliary_power")
    return tuple(keys)


def with_values(values: Values, free: Sequence[Free], numbers: Sequence[float] | Array) -> Values:
    """A copy of a description with fitted values in place of the believed ones."""
    changed = dict(values)
    for item, number in zip(free, numbers, strict=True):
        axis = item.key.removeprefix(_CENTER + ".")
        if axis in _AXES:
            center = list(cast(Iterable[float], changed.get(_CENTER, (0.0, 0.0, 0.0))))
            center[_AXES.index(axis)] = float(number)
            changed[_CENTER] = center
        else:
            changed[item.key] = float(number)
    return changed


def _expand(
    key: str, values: Values, wheels: tuple[str, str, str], choice: Choice, place: str
) -> list[Free]:
    """The fitted values behind a key: three if each wheel has its own."""
    if key.startswith(_CENTER + ".") and key.removeprefix(_CENTER + ".") in _AXES:
        return [_center(key, values, choice)]
    if key in _FIXED:
        spec = _FIXED[key]
        believed = values.get(key, spec.default)
        return [_free(key, key, None, cast(float, believed), _bounds(spec), spec.unit, choice)]
    group = _motor if key.startswith("motor.") else _effect
    found = group(key, values, wheels, choice, place)
    if not found:
        known = [*_FIXED, *_MOTOR]
        known += [f"physics.{e}.{p}" for e, effect in EFFECTS.items() for p in effect.parameters]
        raise InputError(f"--fit {key}: no such value in a robot.yaml: {closest(key, known)}")
    return found


def _motor(
    key: str, values: Values, wheels: tuple[str, str, str], choice: Choice, place: str
) -> list[Free]:
    found = []
    alike = key in choice.alike or EVERY in choice.alike
    for wheel, general, alone in _wheels_of(key, "motor", wheels, alike):
        if general not in _MOTOR:
            return []
        if choice.quantity == "motor_current" and general != "motor.rotor_inertia":
            raise InputError(
                f"--fit {key}: {place} measures motor currents, and the voltage is modelled from "
                "this value: nothing tells it; leave it out, or record the supply's power"
            )
        spec = _MOTOR[general]
        own = key if wheel is None else _own(general, "motor", wheels[wheel])
        believed = cast(float, values.get(own, values.get(general)))
        found.append(_free(own, general, wheel, believed, _bounds(spec), spec.unit, choice))
        if alone:
            break
    return found


def _effect(
    key: str, values: Values, wheels: tuple[str, str, str], choice: Choice, place: str
) -> list[Free]:
    effect_id = next((e for e in EFFECTS if key.startswith(f"physics.{e}.")), None)
    if effect_id is None:
        return []
    group, effect = f"physics.{effect_id}", EFFECTS[effect_id]
    alike = key in choice.alike or EVERY in choice.alike or effect.place != "wheel"
    found = []
    for wheel, general, alone in _wheels_of(key, group, wheels, alike):
        name = general.removeprefix(group + ".")
        if name not in effect.parameters:
            return []
        bounds = effect.parameters[name]
        own = general if wheel is None else _own(general, group, wheels[wheel])
        told = values.get(own, values.get(general))
        limits = (max(bounds.minimum, bounds.above + _ABOVE), bounds.maximum)
        believed = None if told is None else cast(float, told)
        found.append(_free(own, general, wheel, believed, limits, bounds.unit, choice))
        if alone:
            break
    return found


def _wheels_of(
    key: str, group: str, wheels: tuple[str, str, str], alike: bool
) -> list[tuple[int | None, str, bool]]:
    """(wheel, key without it, whether it alone is meant) of each value behind a key."""
    rest = key.removeprefix(group + ".")
    for wheel, name in enumerate(wheels):
        if rest.startswith(name + "."):
            return [(wheel, f"{group}.{rest.removeprefix(name + '.')}", True)]
    if alike:
        return [(None, key, True)]
    return [(wheel, key, False) for wheel in range(len(wheels))]


def _own(general: str, group: str, wheel: str) -> str:
    return f"{group}.{wheel}.{general.removeprefix(group + '.')}"


_ABOVE = 1e-9  # an exclusive bound, seen from the permitted side


def _bounds(spec: ParameterSpec) -> tuple[float, float]:
    return max(spec.minimum, spec.above + _ABOVE), spec.maximum


def _center(key: str, values: Values, choice: Choice) -> Free:
    told = cast(Sequence[float], values.get(_CENTER, (0.0, 0.0, 0.0)))
    believed = float(told[_AXES.index(key[-1])])
    return _free(key, key, None, believed, (-math.inf, math.inf), "m", choice)


def _free(
    key: str,
    general: str,
    wheel: int | None,
    believed: float | None,
    bounds: tuple[float, float],
    unit: str,
    choice: Choice,
) -> Free:
    """A value with its belief: relative to what robot.yaml says, else that of an absent effect."""
    center, width = absent_prior(general)
    told = choice.tolerances.get(general)
    if believed is not None:
        center = believed
        if believed:
            width = abs(believed) * RELATIVE_STD.get(general, DEFAULT_RELATIVE_STD)
    if told is not None and center:
        width = told * abs(center)
    return Free(key, general, wheel, unit, center, width, *bounds)
