"""Traction over load that creep goes by: contacts' forces, less what does not turn the body.

Forces come from power less the friction of the description. Friction that is wrong adds to each
wheel's force along the way it turns, and three such errors add up to a creep that turns the robot.
The true forces do not: the drag of rollers acts along the axles and turns no body, so their moment
is what the body's acceleration needs. Of what a moment is off by, half is taken for friction: how
much of it acts on the robot is not known.
"""

import math

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS
from tomr_power_model.slides.body import ContactBody, moving_wrench

Array = NDArray[np.float64]

_TIME = 0.3  # s, over which traction is averaged
_FRICTION = 0.5  # of what the moment is off by, that is taken for friction


class UsedTraction:
    """Streaming: forces of the contacts in, traction over load out."""

    def __init__(self, body: ContactBody, radius: Array) -> None:
        """`radius`: of the wheels [m], (3,)."""
        self.value = np.zeros(WHEELS)
        self._body, self._radius = body, radius
        self._arm = body.rows[:, 2].copy()
        self._share = _FRICTION * self._arm / float(self._arm @ self._arm)
        self._friction = np.zeros(WHEELS)  # N, that was taken for forces

    def take(self, force: Array, motion: Array | None, dt: float) -> None:
        """Go on by `dt` [s].

        Args:
            force: of the contacts [N], (3,); NaN where it is not known: such a wheel has none.
            motion: speeds [rad/s] and accelerations [rad/s^2] of the wheels, (2, 3); None where
                they are not known, or no force is new.
        """
        is_known = np.isfinite(force)
        if not is_known.all():
            self._friction = np.zeros(WHEELS)
        elif motion is not None:
            self._friction = self._share * self._off(force, motion * self._radius)
        now = (np.where(is_known, force, 0.0) - self._friction) / self._body.load
        self.value = now + math.exp(-dt / _TIME) * (self.value - now)

    def _off(self, force: Array, rims: Array) -> float:
        """What the forces' moment is more than the one that turns the body as it turns [N m].

        rims: their speeds [m/s] and accelerations [m/s^2], (2, 3).
        """
        twist, change = rims @ self._body.to_twist.T
        return float(self._arm @ force) - float(moving_wrench(self._body, twist, change)[2])
