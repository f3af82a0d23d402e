"""The true state of each tick, read from a simulation's `ground_truth/faults`.

Only training and scoring look at it. A tick gets no label where its fault cannot be seen by
anyone: no residual leaves its band, the faulty wheel is not asked to turn, nothing slips.
"""

import math
from typing import Any

from attrs import frozen

from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP
from tomr_fault_diag.residuals.frame import SPEEDS, ResidualFrame

TOPIC = "ground_truth/faults"

_SLIPPING = 0.02  # m/s
_TURNING = 0.5  # rad/s
_AFTERMATH = 500_000_000  # ns that a robot needs to settle once a fault is gone


@frozen
class Truth:
    """What was wrong at a time."""

    stamp_ns: int
    fault: str | None
    wheel: int  # 0..2, of the faults that have one
    slip_speed: float  # fastest contact [m/s]


def truth_of(message: Any, stamp_ns: int) -> Truth:
    """Read one message of the truth."""
    fault, wheel, slip = None, 0, 0.0
    for status in message.status:
        values = {item.key: float(item.value) for item in status.values}
        for key, value in values.items():
            if key.startswith("slip_speed_"):
                slip = max(slip, abs(value))
        if values.get("active", 0.0) > 0.0:
            fault, wheel = status.name.rpartition(" ")[2], int(values.get("wheel", 1.0)) - 1
    return Truth(stamp_ns, fault, wheel, slip)


def label_of(frame: ResidualFrame, truth: Truth | None, healthy_since_ns: int) -> int | None:
    """Index of the true state, or None where nobody could tell."""
    if truth is None or truth.fault is None:
        return NORMAL if frame.stamp_ns - healthy_since_ns > _AFTERMATH else None
    if not any(frame.codes):
        return None
    if truth.fault == "floor_slippery":
        return SLIP if truth.slip_speed > _SLIPPING else None
    speed = frame.residuals[SPEEDS[truth.wheel]]
    if not speed.code and not abs(_number(speed.modelled)) > _TURNING:
        return None
    return CONTROL if truth.fault == "control_signal_lost" else MOTOR + truth.wheel


def _number(value: float) -> float:
    return 0.0 if math.isnan(value) else value
