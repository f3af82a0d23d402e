"""Numbers of a description that may be turned, and descriptions with some of them turned."""

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from attrs import field, frozen

from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS

Values = Mapping[str, object]

_TINY = 1e-9


@frozen
class Knob:
    """One number; turning it by x adds x to each of its keys."""

    name: str  # parameter as the report calls it
    keys: tuple[str, ...]  # of the description, one per wheel it acts on
    unit: str
    spread: float  # how far it may be off, standard deviation of the belief
    step: float  # for a derivative, with the sign of the permitted side
    lower: float = -math.inf  # bounds of the turn x
    upper: float = math.inf
    is_shape: bool = False  # shows only where its effect has a size
    leap: float = 0.0  # turn to try first, where a small step shows nothing of a large one

    @property
    def first_step(self) -> float:
        """Step of the derivative that tells whether it is turned at all."""
        return self.leap or self.step


@frozen
class Turned:
    """A description with its knobs turned; immutable."""

    values: Values  # flat, every wheel with keys of its own
    place: str  # of the description, for errors

    def by(self, knobs: Sequence[Knob], turns: Iterable[float]) -> "Turned":
        """The same with knobs turned further, within the bounds of the description."""
        changed = dict(self.values)
        for knob, turn in zip(knobs, turns, strict=True):
            for key in knob.keys:
                low, high = bounds_of(key)
                before = changed.get(key, neutral_of(key))
                assert isinstance(before, int | float)
                changed[key] = min(max(float(before) + float(turn), low), high)
        return Turned(MappingProxyType(changed), self.place)

    def given(self, start: Mapping[str, object]) -> "Turned":
        """The same with some values set, such as the shape of an effect that joins."""
        return Turned(MappingProxyType({**self.values, **start}), self.place)

    @property
    def robot(self) -> Robot:
        """The robot so described."""
        return robot_from_parameters(self.values, self.place)


def turned(values: Values, wheel_names: Sequence[str], place: str) -> Turned:
    """A description with all that wheels and motors share written out for each."""
    flat = dict(values)
    for spec in MOTOR_PARAMETERS:
        shared = flat.get(spec.name)
        for wheel in wheel_names:
            flat.setdefault(wheel_key(spec.name, wheel), shared)
    for key in [key for key in flat if key.startswith("physics.")]:
        effect_id, rest = split_effect(key)
        if EFFECTS[effect_id].place == "wheel" and "." not in rest:
            for wheel in wheel_names:
                flat.setdefault(f"physics.{effect_id}.{wheel}.{rest}", flat[key])
            del flat[key]
    return Turned(MappingProxyType(flat), place)


def wheel_key(general: str, wheel: str) -> str:
    """Key of one wheel for a key that all share: motor.x -> motor.<wheel>.x."""
    group, _, leaf = general.rpartition(".")
    return f"{group}.{wheel}.{leaf}"


def split_effect(key: str) -> tuple[str, str]:
    """(effect id, rest) of physics.<effect id>.<rest>."""
    for effect_id in EFFECTS:
        prefix = f"physics.{effect_id}."
        if key.startswith(prefix):
            return effect_id, key.removeprefix(prefix)
    raise KeyError(key)


def neutral_of(key: str) -> float:
    """What a number counts as where a description leaves it out."""
    if not key.startswith("physics."):
        return 0.0
    effect_id, rest = split_effect(key)
    return EFFECTS[effect_id].parameters[rest.rpartition(".")[2]].neutral


def bounds_of(key: str) -> tuple[float, float]:
    """Permitted range of a description's number."""
    if key.startswith("physics."):
        effect_id, rest = split_effect(key)
        parameter = EFFECTS[effect_id].parameters[rest.rpartition(".")[2]]
        return max(parameter.minimum, parameter.above + _TINY), parameter.maximum
    leaf = key.rpartition(".")[2]
    group = key.partition(".")[0]
    for spec in ROBOT_PARAMETERS:
        if spec.name == f"{group}.{leaf}":
            return max(spec.minimum, spec.above + _TINY), spec.maximum
    return -math.inf, math.inf


def unit_of(key: str) -> str:
    """Unit of a description's number."""
    leaf = key.rpartition(".")[2]
    if key.startswith("physics."):
        return EFFECTS[split_effect(key)[0]].parameters[leaf].unit
    names = {spec.name: spec.unit for spec in ROBOT_PARAMETERS}
    return names.get(f"{key.partition('.')[0]}.{leaf}", "")


@frozen
class Hypothesis:
    """One way in which reality may differ: an effect, or a wrong parameter, at a place."""

    effect: str  # of the vocabulary, or parameter.<key>
    where: tuple[str, ...]  # wheel names, or all_wheels, body, supply
    knobs: tuple[Knob, ...]  # the first is the size
    start: Mapping[str, float] = field(factory=dict)  # values that it brings along
    weight: float = 0.0  # log of the belief in it beforehand
    least: float = 0.0  # smallest size that data sampled like these can tell from nothing

    @property
    def name(self) -> str:
        """E.g. `friction.viscous at wheel_1_joint`."""
        return f"{self.effect} at {', '.join(self.where)}"

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from others of its name: the shape that it starts from."""
        return (self.name, *self.start.items())
