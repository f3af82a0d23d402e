"""Predictions as messages and back."""

from typing import Any

from tomr_power_model.messages.intake import Triple, Unusable
from tomr_power_model.messages.outgoing import JointMessage, Outgoing, SupplyMessage
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.robot import WHEELS, Robot

EXPECTED = "predicted/joint_states"
TOTAL = "battery_state/predicted"
VOLTAGE = "motor_voltage/predicted"
HELD = "motor_voltage/from_encoders"
_UNFINISHED = 40  # stamps that may wait for their last part


def prediction_topics(robot: Robot) -> dict[str, type[Outgoing]]:
    """Topics of a prediction and what they carry: joints, three motors, the total, three motors
    from encoders, the drivers' voltages."""
    wheels = robot.wheel_topics
    supplies = (
        *(f"{wheel}/power/predicted" for wheel in wheels),
        TOTAL,
        *(f"{wheel}/power/from_encoders" for wheel in wheels),
    )
    joints = dict.fromkeys((VOLTAGE, HELD), JointMessage)
    return {EXPECTED: JointMessage, **dict.fromkeys(supplies, SupplyMessage), **joints}


def prediction_messages(robot: Robot, prediction: Prediction) -> tuple[Outgoing, ...]:
    """The ten messages of one prediction, all with its stamp."""
    stamp, names = prediction.stamp_ns, robot.wheel_names
    supplies = (*prediction.motors, prediction.total, *prediction.from_encoders)
    return (
        JointMessage(EXPECTED, stamp, names, prediction.speed, prediction.torque),
        *(
            SupplyMessage(topic, stamp, reading)
            for topic, reading in zip(_supply_topics(robot), supplies, strict=True)
        ),
        JointMessage(VOLTAGE, stamp, names, (), prediction.voltage),
        JointMessage(HELD, stamp, names, (), prediction.held),
    )


def _supply_topics(robot: Robot) -> list[str]:
    return [topic for topic, kind in prediction_topics(robot).items() if kind is SupplyMessage]


class PredictionAssembler:
    """Puts the messages of one stamp together again; older unfinished ones are given up."""

    def __init__(self, robot: Robot) -> None:
        self._parts: dict[int, dict[str, Any]] = {}
        self._topics = prediction_topics(robot)
        self._supplies = _supply_topics(robot)

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
        supplies = [_reading(parts[topic]) for topic in self._supplies]
        joints = parts[EXPECTED]
        return Prediction(
            stamp_ns,
            _triple(joints.velocity),
            _triple(joints.effort),
            (supplies[0], supplies[1], supplies[2]),
            supplies[WHEELS],
            (supplies[4], supplies[5], supplies[6]),
            _triple(parts[VOLTAGE].effort),
            _triple(parts[HELD].effort),
        )


def _reading(message: Any) -> SupplyReading:
    return SupplyReading(float(message.voltage), float(message.current))


def _triple(values: Any) -> Triple:
    if len(values) != WHEELS:
        raise Unusable(f"{len(values)} wheels, a prediction has {WHEELS}")
    first, second, third = (float(value) for value in values)
    return first, second, third
