"""Predictions as messages and back."""

from typing import Any

from tomr_power_model.messages.intake import Triple, Unusable
from tomr_power_model.messages.outgoing import JointMessage, Outgoing, SupplyMessage
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.robot import WHEELS, Robot

EXPECTED = "predicted/joint_states"
TOTAL = "battery_state/predicted"
_UNFINISHED = 40  # stamps that may wait for their last part


def prediction_topics(robot: Robot) -> tuple[str, ...]:
    """Topics of a prediction: joints, three motors, the total, three motors from encoders."""
    wheels = robot.wheel_topics
    return (
        EXPECTED,
        *(f"{wheel}/power/predicted" for wheel in wheels),
        TOTAL,
        *(f"{wheel}/power/from_encoders" for wheel in wheels),
    )


def prediction_messages(robot: Robot, prediction: Prediction) -> tuple[Outgoing, ...]:
    """The eight messages of one prediction, all with its stamp."""
    topics = prediction_topics(robot)
    stamp = prediction.stamp_ns
    supplies = (*prediction.motors, prediction.total, *prediction.from_encoders)
    joints = JointMessage(topics[0], stamp, robot.wheel_names, prediction.speed, prediction.torque)
    return joints, *(
        SupplyMessage(topic, stamp, reading)
        for topic, reading in zip(topics[1:], supplies, strict=True)
    )


class PredictionAssembler:
    """Puts the messages of one stamp together again; older unfinished ones are given up."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._parts: dict[int, dict[str, Any]] = {}
        self._topics = prediction_topics(robot)

    def add(self, topic: str, stamp_ns: int, message: Any) -> Prediction | None:
        """Take one message; returns the prediction when its last part has come."""
        parts = self._parts.setdefault(stamp_ns, {})
        if len(self._parts) > _UNFINISHED:
            del self._parts[min(self._parts)]
        parts[topic] = message
        if len(parts) < len(self._topics):
            return None
        for stamp in [stamp for stamp in self._parts if stamp <= stamp_ns]:
            del self._parts[stamp]
        supplies = [_reading(parts[topic]) for topic in self._topics[1:]]
        joints = parts[EXPECTED]
        return Prediction(
            stamp_ns,
            _triple(joints.velocity),
            _triple(joints.effort),
            (supplies[0], supplies[1], supplies[2]),
            supplies[WHEELS],
            (supplies[4], supplies[5], supplies[6]),
        )


def _reading(message: Any) -> SupplyReading:
    return SupplyReading(float(message.voltage), float(message.current))


def _triple(values: Any) -> Triple:
    if len(values) != WHEELS:
        raise Unusable(f"{len(values)} wheels, a prediction has {WHEELS}")
    first, second, third = (float(value) for value in values)
    return first, second, third
