"""What a drive's odometry comes to, as numbers and as lines."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tomr_odometry.estimate import Estimate
from tomr_odometry.reference import Path2D
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot

_TOGETHER = 0.5  # s: spells of slip that are nearer than this are one


def spells(items: Sequence[Estimate]) -> list[tuple[float, float]]:
    """Times since the start between which wheels slipped [s]."""
    found: list[tuple[float, float]] = []
    begin = items[0].stamp_ns
    for item in items:
        time = 1e-9 * (item.stamp_ns - begin)
        if item.is_slipping:
            joins = found and time - found[-1][1] < _TOGETHER
            found[-1:] = [(found[-1][0], time)] if joins else [*found[-1:], (time, time)]
    return found


def end_error(path: Path2D, reference: Path2D) -> float:
    """Distance of the ends when the starts are laid on each other [m]. Raises InputError."""
    stamps = path.stamps[(path.stamps >= reference.stamps[0])]
    stamps = stamps[stamps <= reference.stamps[-1]]
    if len(stamps) < 2:
        raise InputError("the reference pose is of another time than the drive: no end in common")
    own, true = path.at(stamps[[0, -1]]), reference.at(stamps[[0, -1]])
    laid = Path2D(stamps[[0, -1]], true).laid_on(own[0], true[0]).pose
    return float(np.hypot(*(laid[1, :2] - own[1, :2])))


def estimated_path(items: Sequence[Estimate]) -> Path2D:
    """The estimated poses."""
    stamps = np.array([item.stamp_ns for item in items], dtype=np.int64)
    return Path2D(stamps, np.array([item.pose for item in items]))


def _kinds(robot: Robot, items: Sequence[Estimate]) -> dict[str, dict[str, float]]:
    """Of each wheel: the way that its contact slid by creep, and by loss of traction [m], and the
    share of the time in which it lost traction."""
    elapsed = 1e-9 * np.diff([item.stamp_ns for item in items], prepend=items[0].stamp_ns)
    steps = np.clip(elapsed, 0.0, 1.0)[:, None]
    creep = (np.abs([item.creeping for item in items]) * steps).sum(axis=0)
    lost = (np.abs([item.losing for item in items]) * steps).sum(axis=0)
    share = np.mean([item.loses_traction for item in items], axis=0)
    rows = zip(robot.wheel_names, creep.tolist(), lost.tolist(), share.tolist(), strict=True)
    return {
        name: {"creep_m": one, "loss_of_traction_m": other, "loss_of_traction_share": part}
        for name, one, other, part in rows
    }


def summary(
    robot: Robot, items: Sequence[Estimate], wheels: Path2D, reference: Path2D | None
) -> dict[str, Any]:
    """Fields of odometry.json."""
    ours = estimated_path(items)
    slip = np.abs([item.slip for item in items])
    last = items[-1]
    found: dict[str, Any] = {
        "duration_s": 1e-9 * (last.stamp_ns - items[0].stamp_ns),
        "sensors": dict(last.sensors),
        "assumed": list(last.assumed),
        "slipping_share": float(np.mean([item.is_slipping for item in items])),
        "slipping_s": spells(items),
        "kinds_of_slip": _kinds(robot, items),
        "largest_slip": dict(zip(robot.wheel_names, slip.max(axis=0).tolist(), strict=True)),
        "end": dict(zip(("x", "y", "yaw"), last.pose.tolist(), strict=True)),
        "end_std": np.sqrt(np.diag(last.pose_covariance)).tolist(),
        "wheels_end": wheels.pose[-1].tolist(),
        "learnt": dict(last.learnt),
    }
    if reference is not None:
        found["end_error_m"] = end_error(ours, reference)
        found["end_error_of_wheels_m"] = end_error(wheels, reference)
    return found


def lines(found: Mapping[str, Any]) -> Iterator[str]:
    """The summary in words."""
    yield f"{found['duration_s']:.1f} s, from " + ", ".join(
        f"{name} ({said})" for name, said in found["sensors"].items()
    )
    for text in found["assumed"]:
        yield f"assumed: {text}"
    yield f"slipping {100.0 * found['slipping_share']:.1f} % of the time"
    for start, end in found["slipping_s"]:
        yield f"{start:8.2f} s to {end:8.2f} s"
    for name, kind in found["kinds_of_slip"].items():
        yield (
            f"{name}: slid {kind['creep_m']:.3f} m by creep, {kind['loss_of_traction_m']:.3f} m by "
            f"loss of traction ({100.0 * kind['loss_of_traction_share']:.1f} % of the time)"
        )
    end, std = found["end"], found["end_std"]
    x, y, yaw = found["wheels_end"]
    yield (
        f"end: x {end['x']:.3f} m, y {end['y']:.3f} m (+- {2 * max(std[:2]):.3f} m), "
        f"yaw {end['yaw']:.3f} rad (+- {2 * std[2]:.3f})"
    )
    yield f"by the wheels alone: x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad"
    if "end_error_m" in found:
        yield (
            f"end error {found['end_error_m']:.3f} m, "
            f"of the wheels alone {found['end_error_of_wheels_m']:.3f} m"
        )
