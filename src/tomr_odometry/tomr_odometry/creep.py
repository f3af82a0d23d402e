"""Creep: contacts that slide a little below their limit."""

from collections.abc import Mapping
from functools import cached_property
from typing import Self, cast

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot.parameters import ParameterSpec

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
_S = ParameterSpec
CREEP_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("creep.coefficient", "of each wheel", "floats", (0.0, 0.0, 0.0), length=3, minimum=0.0),
    _S("creep.growth", "with the square of traction over load", default=0.0, minimum=-2.0),
    _S("creep.uncertainty", "of the mean coefficient; 0: not learnt", default=0.0, minimum=0.0),
)


@frozen
class Creep:
    """Sliding of wheel i's contact, rim less ground, over the speed of the robot's travel.

        coefficient_i f (1 + growth f^2),   f = traction / load

    Rollers that drag or are soft let a wheel turn faster than it travels. Neither power nor
    encoders show it: `tomr_odometry learn` finds it where the pose is known.
    """

    coefficient: Triple = (0.0, 0.0, 0.0)
    growth: float = 0.0
    uncertainty: float = 0.0  # of the mean coefficient; 0: not learnt

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """From checked parameters."""
        return cls(
            coefficient=cast(Triple, values["creep.coefficient"]),
            growth=cast(float, values["creep.growth"]),
            uncertainty=cast(float, values["creep.uncertainty"]),
        )

    @property
    def mean(self) -> float:
        """Mean coefficient of the wheels."""
        return sum(self.coefficient) / len(self.coefficient)

    @property
    def is_known(self) -> bool:
        """Whether it was learnt."""
        return self.mean > 0.0 or self.uncertainty > 0.0

    def shape(self, used: Array) -> Array:
        """How far each wheel creeps per unit of the mean coefficient, from traction over load."""
        return np.asarray(self._share * used * (1.0 + self.growth * used**2))

    @cached_property
    def _share(self) -> Array:
        """Of each wheel in the mean coefficient."""
        return np.array(self.coefficient) / self.mean if self.mean > 0.0 else np.ones(3)
