"""What the residual stage reads: encoders, and power by the registry of `drive.sources`."""

from collections.abc import Callable
from typing import Any

from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.drive.sources import (
    ENCODER_TOPIC,
    PowerTopic,
    motor_topics,
    total_topics,
)
from tomr_power_model.messages.inputs import Input, encoder_taker, guarded
from tomr_power_model.messages.intake import WheelFinder
from tomr_power_model.messages.types import JOINT_STATE
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot

Take = Callable[[Any, int], Arrival | str | None]


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelFinder | None = None
) -> tuple[Input, ...]:
    """Measured inputs of the residual stage, besides the predictions."""
    encoders: Take = encoder_taker(robot, stage.encoders, wheels)
    inputs = []
    for source in (*motor_topics(robot), *total_topics(robot)):
        if source.topic == ENCODER_TOPIC:
            encoders = _with_power(encoders, source, stage)
        else:
            inputs.append(Input(source.topic, source.type_name, guarded(_power(source, stage))))
    inputs.append(Input(ENCODER_TOPIC, JOINT_STATE, guarded(encoders)))
    return tuple(inputs)


def _power(source: PowerTopic, stage: ResidualStage) -> Take:
    def take(message: Any, receive_ns: int) -> Arrival | None:
        arrival = None
        for reading in source.read(message, receive_ns):
            arrival = stage.power(reading)
        return arrival

    return take


def _with_power(encoders: Take, source: PowerTopic, stage: ResidualStage) -> Take:
    power = _power(source, stage)

    def take(message: Any, receive_ns: int) -> Arrival | str | None:
        arrival = encoders(message, receive_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            power(message, receive_ns)
        return arrival

    return take
