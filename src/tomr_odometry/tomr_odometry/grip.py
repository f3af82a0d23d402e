"""How much traction there is: an interval for each wheel, and where on the floor it gave way."""

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import wheel_angles
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
SIDE = 0.25  # m, of a cell
UNKNOWN = -1  # cell of nav_msgs/OccupancyGrid
_SIGMAS = 2.0  # of an interval
_MEMORY = 2.0  # s, for which a wheel's traction says something of the floor under it now
_SHARE = 0.1  # of a new sample in the mean while a wheel slides
_FARTHEST = 100  # cells from the robot, of a grid
_MOST_CELLS = 40_000


class Available:
    """Interval of the traction that each contact can transmit [N].

    A wheel that grips has at least what it transmits; one that slides transmits all there is.
    """

    def __init__(self) -> None:
        self._low = np.zeros(WHEELS)
        self._mean, self._std = np.full((2, WHEELS), np.nan)  # while sliding
        self._age = np.full(WHEELS, math.inf)  # s, since the wheel slid last

    @property
    def interval(self) -> Array:
        """Least and most of each wheel, (3, 2); NaN: not known, the most is without bound."""
        slid = self._age < _MEMORY
        low = np.where(slid, np.maximum(self._mean - _SIGMAS * self._std, 0.0), self._low)
        high = np.where(slid, self._mean + _SIGMAS * self._std, np.nan)
        return np.stack([low, high], axis=1)

    def take(self, force: Array, std: Array, sliding: NDArray[np.bool_], dt: float) -> None:
        """Tractions [N], NaN where not known, and whether the wheels slide."""
        size, known = np.abs(force), np.isfinite(force)
        # Forces are noisy: their mean over a slide is the limit.
        joined = self._mean + _SHARE * (size - self._mean)
        self._age = np.where(sliding & known, 0.0, self._age + dt)
        begun = ~np.isfinite(joined) | (self._age > _MEMORY)
        self._mean = np.where(sliding & known, np.where(begun, size, joined), self._mean)
        self._std = np.where(sliding & known, std, self._std)
        self._low *= math.exp(-dt / _MEMORY)
        grips = ~sliding & known
        seen = np.maximum(size - _SIGMAS * std, 0.0)
        self._low = np.where(grips, np.fmax(self._low, seen), self._low)
        more = grips & (seen > self._mean + _SIGMAS * self._std)  # the floor is another one
        self._age[more] = math.inf


@frozen
class Grid:
    """Cells of the floor, row by row from the corner: -1 not seen; 0 nothing slid; 100 no grip."""

    corner: tuple[float, float]  # m, in the odometry frame
    cells: NDArray[np.int8]  # (rows along y, columns along x)


class Floor:
    """Where contacts slid, and with how much traction, by cells of the odometry frame."""

    def __init__(self, robot: Robot) -> None:
        angles = wheel_angles(robot)
        self._contacts = robot.robot_radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        # Cell: samples, those that slid, and the lack of traction of these added up.
        self._cells: dict[tuple[int, int], Array] = {}
        self._here = (0, 0)

    def take(self, pose: Array, sliding: NDArray[np.bool_], share: Array) -> None:
        """Pose (x, y [m], yaw [rad]); which wheels slide; traction over load, NaN: not known."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        places = pose[:2] + self._contacts @ np.array([[c, s], [-s, c]])
        if not (np.abs(places) < 1e6).all():
            return
        rows = np.floor(places / SIDE).astype(int).tolist()
        for (column, row), slid, used in zip(rows, sliding, share, strict=True):
            cell = self._cells.setdefault((column, row), np.zeros(3))
            lack = 1.0 - min(abs(used), 1.0) if math.isfinite(used) else 1.0
            cell += (1.0, slid, slid * lack)
        self._here = (rows[0][0], rows[0][1])
        while len(self._cells) > _MOST_CELLS:  # the oldest go
            del self._cells[next(iter(self._cells))]

    def grid(self) -> Grid | None:
        """The cells around the robot; None before the first."""
        near = {
            (column - self._here[0], row - self._here[1]): cell
            for (column, row), cell in self._cells.items()
            if max(abs(column - self._here[0]), abs(row - self._here[1])) <= _FARTHEST
        }
        if not near:
            return None
        places = np.array(list(near))
        corner = places.min(axis=0)
        width, height = places.max(axis=0) - corner + 1
        cells = np.full((height, width), UNKNOWN, dtype=np.int8)
        for (column, row), (count, _, lacking) in near.items():
            cells[row - corner[1], column - corner[0]] = round(100.0 * lacking / count)
        x, y = SIDE * (corner + np.array(self._here))
        return Grid((float(x), float(y)), cells)
