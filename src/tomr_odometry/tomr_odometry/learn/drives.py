"""Drives with a known pose as the fit takes them: ways of the rims and traction, step by step."""

from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.reference import Path2D, reference_of
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.errors import InputError
from tomr_power_model.geometry import poses
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Complaints

Array = NDArray[np.float64]
LEG_S = 20.0  # of a drive that is fitted at once: longer ones are cut
_JUMP = 0.5  # m: a reference that leaps further between two samples was corrected: the leg is left
_LEAST_WAY = 0.2  # m


@frozen
class Leg:
    """A part of a drive."""

    steps: Array  # way of each rim in each step [m], (n, 3)
    used: Array  # traction over load, (n, 3)
    moved: Array  # true x, y [m] and yaw [rad], in base_link at its start
    way: float  # along the true path [m]


class _Recorder(SlipOdometry):
    """The core without its filter, of which the inputs are kept."""

    def __init__(self, robot: Robot) -> None:
        self.rows: list[tuple[int, Array, Array]] = []
        self._nothing: Estimate | None = None
        super().__init__(robot, OdometrySettings(use_imu=False))

    def _advance(self, time: int, dt: float, rims: Array, inertial: Array) -> None:
        self.rows.append((time, rims[0].copy(), self._used.value.copy()))

    def _estimate(self, tick: int) -> Estimate:
        if self._nothing is None:
            self._nothing = super()._estimate(tick)
        return self._nothing


def read_legs(path: Path, robot: Robot, topic: str, turned: float = 0.0) -> list[Leg]:
    """The legs of a recording; the reference's heading is `turned` [rad] against the robot's.

    Raises InputError where pose or power is missing.
    """
    recorder = _Recorder(robot)
    with open_recording(path) as recording:
        reference = reference_of(recording, topic)
        for _ in estimates(recording, robot, recorder, Complaints()):
            pass
    if not any(np.any(used) for _, _, used in recorder.rows):
        raise InputError(f"{path}: no motor power: creep grows with the force that power shows")
    stamps = np.array([row[0] for row in recorder.rows], dtype=np.int64)
    rims = np.array([row[1] for row in recorder.rows])
    used = np.array([row[2] for row in recorder.rows])
    inside = (stamps >= reference.stamps[0]) & (stamps <= reference.stamps[-1])
    legs, seconds = [], 1e-9 * (stamps - stamps[0])
    for number in range(int(seconds[-1] // LEG_S) + 1):
        chosen = np.flatnonzero(inside & (seconds // LEG_S == number))
        if len(chosen) > 2:
            leg = leg_of(stamps[chosen], rims[chosen], used[chosen], reference, turned)
            legs += [leg] if leg is not None else []
    return legs


def leg_of(
    stamps: NDArray[np.int64], rims: Array, used: Array, reference: Path2D, turned: float
) -> Leg | None:
    """One leg; None where the reference hardly moved, or was corrected on the way."""
    own = (reference.stamps >= stamps[0]) & (reference.stamps <= stamps[-1])
    path = reference.pose[own]
    if len(path) < 2 or np.hypot(*np.diff(path[:, :2], axis=0).T).max() > _JUMP:
        return None
    start, end = reference.at(stamps[[0, -1]])
    way = float(np.hypot(*np.diff(path[::6, :2], axis=0).T).sum())
    if way < _LEAST_WAY:
        return None
    moved = poses.turned(end - start, -(start[2] + turned))
    return Leg(np.diff(rims, axis=0), used[1:], moved, way)
