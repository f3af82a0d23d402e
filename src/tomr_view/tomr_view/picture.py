"""What the page shows of a robot at a moment: gathered from residuals, diagnosis and truth."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from attrs import define, field, frozen

from tomr_fault_diag.classifier.messages import NAME
from tomr_fault_diag.residuals.frame import (
    MOTORS,
    SPEEDS,
    TOTAL,
    ResidualFrame,
    measured_speed,
    residual_names,
)
from tomr_power_model.geometry.kinematics import wheel_angles, wheels_to_twist
from tomr_power_model.geometry.poses import moved
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.faults import all_parameters, fault_ids

PICTURE_PERIOD = NANOSECONDS // 10
_LONGEST_STEP = 0.5  # s, between two ticks of one motion
_TRUTH_AGE = NANOSECONDS  # after which the truth about faults is not known any more
_FASTEST = 1e4  # rad/s: no wheel turns so fast
_MOST_INPUTS = 64  # anybody may publish on /diagnostics

Json = dict[str, Any]


@frozen
class Status:
    """A diagnostic status, of a message or of our own."""

    name: str
    level: int
    message: str
    values: Mapping[str, str] = field(factory=dict)

    @classmethod
    def of_message(cls, status: Any) -> "Status":
        """From a diagnostic_msgs/DiagnosticStatus of ROS or of a recording."""
        level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
        values = {item.key: item.value for item in status.values}
        return cls(status.name, level, status.message, values)


def number(value: float) -> float | None:
    """A number as JSON can hold it, four digits; None for what is not known."""
    return float(f"{value:.4g}") if math.isfinite(value) else None


def described(robot: Robot) -> Json:
    """The robot as the page draws it [m, rad]."""
    names = residual_names(robot.wheel_topics)
    return {
        "radius": robot.robot_radius,
        "wheel_radius": robot.wheel_radius,
        "wheels": list(robot.wheel_topics),
        "angles": [float(angle) for angle in wheel_angles(robot)],
        "residuals": [name.removeprefix("residuals: ") for name in names],
    }


def fault_buttons() -> list[Json]:
    """The simulator's faults, and whether each sits on a wheel."""
    parameters = all_parameters()
    return [{"id": name, "has_wheel": f"faults.{name}.wheel" in parameters} for name in fault_ids()]


@define
class Gatherer:
    """Holds what is known last of each thing; driven by stamps."""

    robot: Robot
    frame: ResidualFrame | None = None
    status: Status | None = None
    shares: Mapping[str, float | None] = field(factory=dict)  # probability of each state
    inputs: dict[str, Status] = field(factory=dict)
    faults: tuple[Json, ...] = ()
    _faults_ns: int = 0
    _start_ns: int = 0
    _pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    _speeds: tuple[float, ...] = (0.0,) * WHEELS

    def residuals(self, frame: ResidualFrame) -> None:
        """Take the residuals of a tick; one from before the last starts the picture afresh."""
        if self.frame is None or frame.stamp_ns < self.frame.stamp_ns:
            self._start_ns, self._pose = frame.stamp_ns, (0.0, 0.0, 0.0)
        else:
            step = (frame.stamp_ns - self.frame.stamp_ns) / NANOSECONDS
            self._move(min(step, _LONGEST_STEP))
        self.frame = frame
        self._speeds = tuple(
            speed if abs(speed) < _FASTEST else 0.0
            for speed in (measured_speed(frame.residuals[index]) for index in SPEEDS)
        )

    def diagnosis(self, statuses: Iterable[Status]) -> None:
        """Take what /diagnostics says of this robot. Raises ValueError for what is no number."""
        for status in statuses:
            if status.name.endswith(NAME):
                self.shares = {
                    key.removeprefix("p "): number(float(value))
                    for key, value in status.values.items()
                    if key.startswith("p ")
                }
                self.status = status
            elif "inputs: " in status.name:
                topic = status.name.rpartition("inputs: ")[2]
                if topic in self.inputs or len(self.inputs) < _MOST_INPUTS:
                    self.inputs[topic] = status

    def truth(self, statuses: Iterable[Status], stamp_ns: int) -> None:
        """Take what a simulator says of its faults."""
        self._faults_ns = stamp_ns
        self.faults = tuple(
            {"id": status.name, "wheel": int(float(status.values.get("wheel", "0")))}
            for status in statuses
            if float(status.values.get("severity", "0")) > 0.0
        )

    def _move(self, seconds: float) -> None:
        """Where the wheels have taken the robot, as they turned."""
        twist = wheels_to_twist(self.robot) @ np.array(self._speeds)
        x, y, yaw = moved(np.array(self._pose), seconds * twist).tolist()
        self._pose = (x, y, yaw)

    def picture(self) -> Json | None:
        """The moment of the last residuals; None before the first ones."""
        frame = self.frame
        if frame is None:
            return None
        known = frame.stamp_ns - self._faults_ns < _TRUTH_AGE
        powers = [frame.residuals[index] for index in (*MOTORS, TOTAL)]
        return {
            "t": round((frame.stamp_ns - self._start_ns) / NANOSECONDS, 3),
            "pose": [round(value, 4) for value in self._pose],
            "speeds": [number(value) for value in self._speeds],
            "expected": [number(frame.residuals[index].modelled) for index in SPEEDS],
            "powers": [
                [number(item.modelled + item.residual), number(item.modelled)] for item in powers
            ],
            "units": [item.unit for item in powers],
            "residuals": [[number(r.residual), number(r.band)] for r in frame.residuals],
            "faults": list(self.faults) if known else None,
            **self._words(),
        }

    def _words(self) -> Json:
        status = self.status
        inputs = [
            {**item.values, "topic": topic, "level": item.level, "message": item.message}
            for topic, item in sorted(self.inputs.items())
        ]
        if status is None:
            return {"state": "", "level": 3, "message": "no diagnosis yet", "inputs": inputs}
        return {
            "state": status.values.get("state", ""),
            "level": status.level,
            "message": status.message,
            "unseen": status.values.get("not_observable", ""),
            "shares": self.shares,
            "severity": status.values.get("severity", ""),
            "conditions": status.values.get("conditions", ""),
            "evidence": [
                text for key, text in status.values.items() if key.startswith("evidence ")
            ],
            "inputs": inputs,
        }


def spells(pictures: Sequence[Json]) -> list[list[Any]]:
    """[first, last, state, level] of each stretch of pictures in one state, by index."""
    found: list[list[Any]] = []
    for index, picture in enumerate(pictures):
        if not found or found[-1][2] != picture["state"]:
            found.append([index, index, picture["state"], picture["level"]])
        found[-1][1] = index
    return found
