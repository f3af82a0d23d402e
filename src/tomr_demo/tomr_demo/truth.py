"""What a simulation says is wrong: `ground_truth/faults`. Only scoring looks at it."""

from typing import Any

from attrs import frozen

TOPIC = "ground_truth/faults"


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
