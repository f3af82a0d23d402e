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
_LARGEST = 1e6  # m, of a coordinate


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
        self._age += dt
        self._low *= math.exp(-dt / _MEMORY)
        rows = zip(force.tolist(), std.tolist(), sliding.tolist(), strict=True)
        for wheel, (signed, doubt, slides) in enumerate(rows):
            if not math.isfinite(signed):
                continue
            size, mean = abs(signed), float(self._mean[wheel])
            if slides:
                # Forces are noisy: their mean over a slide is the limit.
                goes_on = math.isfinite(mean) and self._age[wheel] <= _MEMORY
                self._mean[wheel] = mean + _SHARE * (size - mean) if goes_on else size
                self._std[wheel], self._age[wheel] = doubt, 0.0
                continue
            seen = max(size - _SIGMAS * doubt, 0.0)
            self._low[wheel] = max(self._low[wheel], seen)
            if seen > mean + _SIGMAS * self._std[wheel]:  # the floor is another one
                self._age[wheel] = math.inf


@frozen
class Grid:
    """Cells of the floor, row by row from the corner: -1 not seen; 0 nothing slid; 100 no grip."""

    corner: tuple[float, float]  # m, in the odometry frame
    cells: NDArray[np.int8]  # (rows along y, columns along x)


class Floor:
    """Where contacts slid, and with how much traction, by cells of the odometry frame."""

    def __init__(self, robot: Robot) -> None:
        angles = wheel_angles(robot)
        places = robot.robot_radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._contacts: list[tuple[float, float]] = list(map(tuple, places.tolist()))
        # Cell: samples, those that slid, and the lack of traction of these added up.
        self._cells: dict[tuple[int, int], list[float]] = {}
        self._here = (0, 0)

    def take(self, pose: Array, sliding: NDArray[np.bool_], share: Array) -> None:
        """Pose (x, y [m], yaw [rad]); which wheels slide; traction over load, NaN: not known."""
        x, y, yaw = pose.tolist()
        if not (abs(x) < _LARGEST and abs(y) < _LARGEST and math.isfinite(yaw)):
            return
        c, s = math.cos(yaw), math.sin(yaw)
        rows = zip(self._contacts, sliding.tolist(), share.tolist(), strict=True)
        for wheel, ((ahead, left), slid, used) in enumerate(rows):
            column = math.floor((x + c * ahead - s * left) / SIDE)
            row = math.floor((y + s * ahead + c * left) / SIDE)
            lack = 1.0 - min(abs(used), 1.0) if math.isfinite(used) else 1.0
            cell = self._cells.setdefault((column, row), [0.0, 0.0, 0.0])
            cell[0] += 1.0
            cell[1] += slid
            cell[2] += slid * lack
            if wheel == 0:
                self._here = column, row
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
