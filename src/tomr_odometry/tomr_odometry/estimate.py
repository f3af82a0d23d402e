"""What the odometry knows at a tick."""

from collections.abc import Collection, Iterator

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_odometry.grip import Grid

Array = NDArray[np.float64]
SLIDES = 0.5  # probability from which a wheel is said to slide that an IMU shows
SLIDES_UNAIDED = 0.3  # and without one: from 0.5 on a fifth of the sliding is missed
NOT_USED = "not used"  # of a sensor, before why
_SLOW = 0.02  # m/s: sliding slower than that is none


@frozen
class Estimate:
    """What is known at a tick."""

    stamp_ns: int
    pose: Array  # x, y [m], yaw [rad], in the odometry frame
    pose_covariance: Array  # (3, 3)
    twist: Array  # in base_link [m/s, m/s, rad/s]
    twist_covariance: Array
    slip: Array  # ratio of each wheel, signed
    sliding: Array  # m/s, rim less ground
    probability: Array  # that each wheel slides
    slides: NDArray[np.bool_]  # which wheels are said to slide
    creeping: Array  # the part of it that grows with traction; the rest is loss of traction
    traction: Array  # N, NaN where not known
    traction_std: Array
    available: Array  # least and most that the contact can transmit [N], (3, 2), NaN: not known
    floor: Grid | None  # on request, once a second
    is_carried: bool
    missing: tuple[str, ...]  # sensors that are silent
    sensors: tuple[tuple[str, str], ...]
    assumed: tuple[str, ...]
    learnt: tuple[tuple[str, float], ...]

    @property
    def words(self) -> str:
        """What it comes to, in words."""
        if self.is_carried:
            return "carried or lifted: the pose is not known"
        lost = [f"{wheel + 1}" for wheel in np.flatnonzero(self.loses_traction)]
        said = "slipping" if self.is_slipping else "gripping"
        said += f": loss of traction at wheel {', '.join(lost)}" if lost else ""
        said += ": creep" if self.is_creeping and not lost else ""
        return f"{said}; without {', '.join(self._without())}" if self.missing else said

    def _without(self) -> Iterator[str]:
        uses = dict(self.sensors)
        for name in self.missing:
            use = uses.get(name, "")
            yield f"{name} ({use})" if use.startswith(NOT_USED) else name

    @property
    def loses_traction(self) -> NDArray[np.bool_]:
        """Which wheels slide beyond their limit."""
        return self.slides & (np.abs(self.sliding) > _SLOW)

    @property
    def losing(self) -> Array:
        """How fast contacts slide that lost traction, besides their creep [m/s]."""
        return np.where(self.loses_traction, self.sliding - self.creeping, 0.0)

    @property
    def is_slipping(self) -> bool:
        """Whether any wheel loses traction."""
        return bool(self.loses_traction.any())

    @property
    def is_creeping(self) -> bool:
        """Whether any wheel creeps enough to matter."""
        return bool((np.abs(self.creeping) > _SLOW).any())


def assumptions(missing: Collection[str], *, creeps: bool, by_power: bool) -> Iterator[str]:
    """What is taken for granted without the sensors that are `missing`, where it is not learnt how
    wheels creep, and where power shows that they slide."""
    if not creeps:
        yield "wheels do not creep: not learnt, see tomr_odometry learn"
    if "imu/data" in missing and by_power:
        yield "wheels slide as the motors' power shows: less surely than an IMU would"
    elif "imu/data" in missing:
        yield (
            "wheels do not slide: to show that takes an IMU, or cmd_vel and the power of two "
            "motors, with its sign"
        )
