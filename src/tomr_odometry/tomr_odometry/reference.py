"""Paths to compare with: a reference pose of a recording, and what the wheels alone say."""

import math
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.geometry.poses import turned
from tomr_power_model.messages.intake import MALFORMED, stamp_of
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.types import ODOMETRY, TF
from tomr_power_model.recordings import Recording, require_topic
from tomr_power_model.robot import Robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
POSES = (ODOMETRY, "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped")


@frozen
class Path2D:
    """Poses over time: stamps [ns] (n,), x, y [m] and unwrapped yaw [rad] (n, 3)."""

    stamps: NDArray[np.int64]
    pose: Array

    def at(self, stamps: NDArray[np.int64]) -> Array:
        """Poses at some stamps, between samples; held beyond the ends."""
        start = self.stamps[0]
        wanted, own = (1e-9 * (times - start) for times in (stamps, self.stamps))
        return np.stack([np.interp(wanted, own, column) for column in self.pose.T], axis=1)

    def laid_on(self, pose: Array, at: Array) -> "Path2D":
        """Moved rigidly so that the pose `at` comes to lie on `pose`."""
        return Path2D(self.stamps, pose + turned(self.pose - at, pose[2] - at[2]))


def _path(rows: list[tuple[int, float, float, float]], place: str) -> Path2D:
    stamps = np.array([row[0] for row in rows], dtype=np.int64)
    order = np.argsort(stamps, kind="stable")
    order = order[np.concatenate([[True], np.diff(stamps[order]) > 0])]
    if len(order) < 2:
        raise InputError(f"{place}: {len(order)} poses: give a topic with a pose over time")
    pose = np.array([row[1:] for row in rows])[order]
    pose[:, 2] = np.unwrap(pose[:, 2])
    return Path2D(stamps[order], pose)


def _planar(position: Any, turn: Any) -> tuple[float, float, float]:
    yaw = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y**2 + turn.z**2))
    return float(position.x), float(position.y), yaw


def reference_of(recording: Recording, topic: str, namespace: str | None = None) -> Path2D:
    """Poses of a topic; `tf:CHILD` takes the transforms to a frame from /tf. Raises InputError."""
    name, _, child = topic.partition(":")
    found = require_topic(recording, name, namespace)
    kind, rows = recording.topics[found], []
    if kind not in (*POSES, TF) or (kind == TF) != bool(child):
        raise InputError(
            f"{recording.path}: {topic} is a {kind}: give a nav_msgs/Odometry, a pose, or tf:CHILD"
        )
    for _, _, message, receive_ns in recording.messages([found]):
        if kind == TF:
            for item in message.transforms:
                if item.child_frame_id.strip("/") == child:
                    moved = item.transform
                    place = _planar(moved.translation, moved.rotation)
                    rows.append((stamp_of(item, receive_ns), *place))
            continue
        pose = getattr(message.pose, "pose", message.pose)
        place = _planar(pose.position, pose.orientation)
        rows.append((stamp_of(message, receive_ns), *place))
    rows = [row for row in rows if all(math.isfinite(value) for value in row[1:])]
    return _path(rows, f"{recording.path}: {topic}")


def wheel_path(recording: Recording, robot: Robot, namespace: str | None = None) -> Path2D:
    """What the encoders alone say of the way, as if nothing slipped."""
    wheels, rows = WheelStream(robot.wheel_names), []
    topic = require_topic(recording, "joint_states", namespace)
    for _, _, message, receive_ns in recording.messages([topic]):
        try:
            samples = wheels.samples(message, stamp_of(message, receive_ns))
        except MALFORMED:
            continue
        rows += [
            (stamp, *found.position)
            for stamp, found in samples
            if all(math.isfinite(value) for value in found.position)
        ]
    if len(rows) < 2:
        raise InputError(f"{recording.path}: {topic}: no wheel positions: odometry counts them")
    body, radius = body_of(robot)
    angles = np.array([row[1:] for row in rows])
    step = np.diff(angles, axis=0) * radius @ body.to_twist.T
    yaw = np.concatenate([[0.0], np.cumsum(step[:, 2])])
    ways = turned(step, 0.5 * (yaw[1:] + yaw[:-1]))
    pose = np.concatenate([np.zeros((1, 3)), np.cumsum(ways, axis=0)])
    return Path2D(np.array([row[0] for row in rows], dtype=np.int64), pose)
