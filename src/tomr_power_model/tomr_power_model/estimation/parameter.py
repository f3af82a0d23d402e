"""What an estimation may change: numbers of a robot's description, each with a Gaussian prior."""

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import cast

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.effects import EFFECTS, EffectParameter
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_power_model.robot.description import split_effect
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS

Array = NDArray[np.float64]
Values = Mapping[str, object]

_CENTER, _AXES = "robot.mass_center", ("x", "y", "z")


@frozen
class Parameter:
    """One number to be estimated: the value of its key, or an offset added to each of its keys.

    Its prior is N(prior_mean, prior_std^2); an offset has the prior mean 0.
    """

    name: str  # as a report calls it
    keys: tuple[str, ...]  # of the description, one per wheel it acts on
    unit: str
    prior_std: float
    prior_mean: float = field(kw_only=True, default=0.0)
    step: float = field(kw_only=True, default=0.0)  # of a derivative, towards the permitted side
    lower: float = field(kw_only=True, default=-math.inf)
    upper: float = field(kw_only=True, default=math.inf)
    is_shape: bool = field(kw_only=True, default=False)  # shows only where its effect has a size
    # Discrete alternative: offset to try first, where a small step shows nothing of a large one.
    discrete_offset: float = field(kw_only=True, default=0.0)

    def step_at(self, value: float) -> float:
        """Step of a derivative at a value that stays within the bounds."""
        return self.step if self.lower <= value + self.step <= self.upper else -self.step


def prior_stds(parameters: Sequence[Parameter]) -> Array:
    """Their prior standard deviations, (p,)."""
    return np.array([item.prior_std for item in parameters])


def bounds(parameters: Sequence[Parameter]) -> tuple[Array, Array]:
    """Their lower and upper bounds, (p,) each."""
    lower = np.array([item.lower for item in parameters])
    return lower, np.array([item.upper for item in parameters])


def uniform_std(half_range: float) -> float:
    """Standard deviation of what is equally likely anywhere within a tolerance, +- half_range."""
    return half_range / math.sqrt(3.0)


@frozen
class ParameterisedRobot:
    """A description of which numbers can be changed; immutable."""

    values: Values  # flat
    place: str  # of the description, for errors

    def offset(
        self, parameters: Sequence[Parameter], offsets: Iterable[float]
    ) -> "ParameterisedRobot":
        """The same with offsets added, within the bounds of the description."""
        changed = dict(self.values)
        for parameter, offset in zip(parameters, offsets, strict=True):
            for key in parameter.keys:
                low, high = bounds_of(key)
                before = changed.get(key, neutral_of(key))
                assert isinstance(before, int | float)
                changed[key] = min(max(float(before) + float(offset), low), high)
        return ParameterisedRobot(MappingProxyType(changed), self.place)

    def given(self, values: Mapping[str, float]) -> "ParameterisedRobot":
        """The same with some values set, such as the shape of an effect that joins."""
        changed = dict(self.values)
        for key, value in values.items():
            axis = center_axis(key)
            if axis is None:
                changed[key] = value
            else:
                center = center_of(changed)
                center[axis] = float(value)
                changed[_CENTER] = center
        return ParameterisedRobot(MappingProxyType(changed), self.place)

    @property
    def robot(self) -> Robot:
        """The robot so described."""
        return robot_from_parameters(self.values, self.place)


def per_wheel(values: Values, wheel_names: Sequence[str], place: str) -> ParameterisedRobot:
    """A description with all that wheels and motors share written out for each."""
    flat = dict(values)
    for spec in MOTOR_PARAMETERS:
        shared = flat.get(spec.name)
        for wheel in wheel_names:
            flat.setdefault(wheel_key(spec.name, wheel), shared)
    for key in values:
        if is_of_wheels(key) and not any(f".{wheel}." in key for wheel in wheel_names):
            for wheel in wheel_names:
                flat.setdefault(wheel_key(key, wheel), flat[key])
            del flat[key]
    return ParameterisedRobot(MappingProxyType(flat), place)


def is_of_wheels(key: str) -> bool:
    """Whether a number is one of an effect that acts at wheels."""
    found = split_effect(key)
    return found is not None and EFFECTS[found[0]].place == "wheel"


def wheel_key(general: str, wheel: str) -> str:
    """Key of one wheel for a key that all share: motor.x -> motor.<wheel>.x."""
    group, _, leaf = general.rpartition(".")
    return f"{group}.{wheel}.{leaf}"


def effect_parameter(key: str) -> EffectParameter | None:
    """What the vocabulary says of a number; None for one that belongs to no effect."""
    found = split_effect(key)
    if found is None:
        return None
    effect_id, rest = found
    return EFFECTS[effect_id].parameters[rest.rpartition(".")[2]]


def center_axis(key: str) -> int | None:
    """Which coordinate of the mass centre a number is; None for another one."""
    group, _, axis = key.rpartition(".")
    return _AXES.index(axis) if group == _CENTER and axis in _AXES else None


def center_of(values: Values) -> list[float]:
    """The mass centre that a description gives [m]."""
    return list(cast(Iterable[float], values.get(_CENTER, (0.0, 0.0, 0.0))))


def neutral_of(key: str) -> float:
    """What a number counts as where a description leaves it out."""
    described = effect_parameter(key)
    return 0.0 if described is None else described.neutral


def bounds_of(key: str) -> tuple[float, float]:
    """Permitted range of a description's number."""
    described = effect_parameter(key) or _fixed(key)
    if described is None:
        return -math.inf, math.inf
    return described.minimum, described.maximum


def unit_of(key: str) -> str:
    """Unit of a description's number."""
    if center_axis(key) is not None:
        return "m"
    described = effect_parameter(key) or _fixed(key)
    return "" if described is None else described.unit


def _fixed(key: str) -> ParameterSpec | None:
    """A number that every description has, be it of one wheel's motor."""
    general = f"{key.partition('.')[0]}.{key.rpartition('.')[2]}"
    return next((spec for spec in ROBOT_PARAMETERS if spec.name == general), None)
