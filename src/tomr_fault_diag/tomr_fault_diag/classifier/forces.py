"""Forces on the body, from what the wheels feel: what one explains is no fault of a wheel."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.ticks import NANOSECONDS

Array = NDArray[np.float64]


def by_sudden_force(shown: Array, shared: Array, forces: Sequence[float], scatter: float) -> Array:
    """Log-likelihoods (...) of a force of this tick alone over none, as strong as explains most; at
    least 0.

    `shown`: residuals of the wheels [bands], (..., n); `shared`: what forces along and across of
    1 N/kg and their moment do to them, (n, 3); `forces`: deviations [N/kg].
    """
    variances, ways = np.linalg.eigh(shared @ shared.T)
    seen = (shown @ ways) ** 2 / scatter**2
    most = np.zeros(shown.shape[:-1])
    for force in forces:
        ratio = 1.0 + force**2 * np.maximum(variances, 0.0) / scatter**2
        found = 0.5 * (seen @ (1.0 - 1.0 / ratio) - np.log(ratio).sum())
        most = np.maximum(most, found)
    return most


class SteadyForce:
    """A force that stays for a while, as on a slope or of somebody who leans: fitted to the last
    seconds, along the axes of the world.

    It passes the centre at no more than the lever of the moments: one wheel alone hardly bears it.
    """

    def __init__(self, memory: int, force: float, scatter: float) -> None:
        """`memory` over which it is fitted [ns], `force`: its deviation [N/kg], `scatter` of
        residuals [bands]."""
        self._memory = memory
        self._prior = (scatter / force) ** 2 * np.eye(3)
        self._scatter = scatter
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._yaw = 0.0  # rad, since some instant
        self._normal = np.zeros((3, 3))
        self._right = np.zeros(3)

    def take(self, shown: Array, shared: Array, elapsed: int, yaw_rate: float) -> float:
        """Log-likelihood over none that the ticks before gave it, of this one; at least 0.

        Arguments as above, and since the last tick the time [ns] and yaw rate [rad/s].
        """
        self._yaw += yaw_rate * min(elapsed, NANOSECONDS) / NANOSECONDS
        cos, sin = np.cos(self._yaw), np.sin(self._yaw)
        design = shared @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        left = shown - design @ _limited(self._normal + self._prior, self._right)
        kept = np.exp(-elapsed / self._memory)
        self._normal = kept * self._normal + design.T @ design
        self._right = kept * self._right + shown @ design
        return max(0.0, float(shown @ shown - left @ left) / (2.0 * self._scatter**2))


def _limited(normal: Array, right: Array) -> Array:
    """Force and moment of normal equations, (3,), the moment no larger than the force is without
    one."""
    moment = float(np.linalg.solve(normal, right)[2])
    most = float(np.hypot(*np.linalg.solve(normal[:2, :2], right[:2])))
    moment = min(max(moment, -most), most)
    force = np.linalg.solve(normal[:2, :2], right[:2] - moment * normal[:2, 2])
    return np.append(force, moment)
