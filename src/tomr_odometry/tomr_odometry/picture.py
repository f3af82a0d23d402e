"""A picture of a drive: its path by wheels, as estimated and true; slip over time."""

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from tomr_odometry.estimate import Estimate
from tomr_odometry.grip import SIDE, UNKNOWN, Grid
from tomr_odometry.reference import Path2D
from tomr_odometry.summary import estimated_path
from tomr_power_model.canvas import AFTER, BEFORE, MEASURED, PLACE, sheet
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
_WHEELS = ("#1d4ed8", "#c2410c", "#15803d")
_ELLIPSES = 12
_WITHIN_95 = 5.991
_MARGIN = 0.05  # of the paths' extent


def draw(
    robot: Robot,
    items: Sequence[Estimate],
    wheels: Path2D,
    reference: Path2D | None,
    floor: Grid | None,
) -> bytes:
    """The picture as PNG."""
    with sheet(2, 1, 4.2, heights=(2.0, 1.0)) as (page, (plane, over_time)):
        draw_plane(plane, items, wheels, reference, floor)
        _draw_slip(over_time, robot, items)
        buffer = BytesIO()
        page.savefig(buffer, format="png")
        return buffer.getvalue()


def draw_plane(
    plane: Axes,
    items: Sequence[Estimate],
    wheels: Path2D,
    reference: Path2D | None,
    floor: Grid | None,
) -> None:
    """Paths from above, ellipses and the floor's cells."""
    ours = estimated_path(items)
    start = ours.pose[0]
    by_wheels = wheels.laid_on(start, wheels.at(ours.stamps[:1])[0]).pose
    plane.plot(by_wheels[:, 0], by_wheels[:, 1], color=BEFORE, lw=1.0, label="by the wheels")
    plane.plot(ours.pose[:, 0], ours.pose[:, 1], color=AFTER, lw=1.4, label="estimated, 95 %")
    paths = [by_wheels, ours.pose]
    if reference is not None:
        true = reference.laid_on(start, reference.at(ours.stamps[:1])[0]).pose
        plane.plot(true[:, 0], true[:, 1], color=MEASURED, lw=1.0, ls="--", label="reference")
        paths.append(true)
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    circle = np.sqrt(_WITHIN_95) * np.stack([np.cos(turn), np.sin(turn)])
    for item in items[:: max(len(items) // _ELLIPSES, 1)]:
        values, axes = np.linalg.eigh(item.pose_covariance[:2, :2])
        ring = axes @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
        plane.plot(item.pose[0] + ring[0], item.pose[1] + ring[1], color=AFTER, lw=0.4)
    if floor is not None:
        _draw_floor(plane, floor)
    _show_paths(plane, np.concatenate(paths)[:, :2])
    plane.set_xlabel("x [m]")
    plane.set_ylabel("y [m]")
    plane.legend(fontsize=7)


def _draw_slip(over_time: Axes, robot: Robot, items: Sequence[Estimate]) -> None:
    seconds = 1e-9 * np.array([item.stamp_ns - items[0].stamp_ns for item in items])
    slip = np.array([item.slip for item in items])
    for name, column, color in zip(robot.wheel_names, slip.T, _WHEELS, strict=True):
        over_time.plot(seconds, column, color=color, lw=0.8, label=name)
    lost = [item.is_slipping for item in items]
    over_time.fill_between(
        seconds, 0.0, 1.0, where=lost, color=PLACE, alpha=0.6, lw=0.0, label="loss of traction",
        transform=over_time.get_xaxis_transform(),
    )  # fmt: skip
    over_time.set_xlabel("time [s]")
    over_time.set_ylabel("slip ratio")
    over_time.legend(fontsize=7)


def _show_paths(plane: Axes, points: Array) -> None:
    """All points of the paths, (n, 2), however far ellipses and cells of the floor reach."""
    low, high = points.min(axis=0), points.max(axis=0)
    half = (0.5 + _MARGIN) * max(float((high - low).max()), SIDE)
    (x, y) = 0.5 * (low + high)
    plane.set_xlim(x - half, x + half)
    plane.set_ylim(y - half, y + half)
    plane.set_aspect("equal", adjustable="box")


def _draw_floor(plane: Axes, floor: Grid) -> None:
    """Cells that were driven over: the darker, the less traction there was."""
    (x, y), (height, width) = floor.corner, floor.cells.shape
    cells = np.ma.masked_equal(floor.cells.astype(float), UNKNOWN)
    edges = (x, x + SIDE * width, y, y + SIDE * height)
    plane.imshow(
        cells, cmap="Oranges", vmin=0.0, vmax=100.0, alpha=0.5, origin="lower", extent=edges
    )
