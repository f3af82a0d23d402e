"""What an effect outside the vocabulary is to the plant, and how one is described."""

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from concealed.recipes import Recipe
from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.effects import DriverPower, PlantEffect

Vector = NDArray[np.float64]
USUAL = (1.0, 0.5, 0.25)


class Beyond(PlantEffect):
    """One such effect, at the wheels where `present` is 1; `given` holds its parameters."""

    units: ClassVar[Mapping[str, str]]
    shape_in_words: ClassVar[str]

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot)
        self._present = present
        self._given = dict(given)
        self._elapsed = 0.0

    def bill(self, drivers: DriverPower) -> None:
        self._elapsed += drivers.duration


@frozen
class Outside:
    """An effect outside the vocabulary with its recipe."""

    effect: Callable[[Robot, Vector, Mapping[str, float]], Beyond]
    recipe: Recipe
    units: Mapping[str, str]
    shape: str

    @classmethod
    def of(cls, kind: type[Beyond], recipe: Recipe) -> "Outside":
        return cls(kind, recipe, kind.units, kind.shape_in_words)
