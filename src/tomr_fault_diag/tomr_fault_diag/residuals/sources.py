"""What the residual stage reads besides the predictions."""

from typing import Any

from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.inertial import Imu
from tomr_power_model.messages.intake import stamp_of
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.readings import NAN
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Input, imu_input, measured_inputs

_NOT_WATCHED = (NAN, NAN, NAN)


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelStream | None = None
) -> tuple[Input, ...]:
    """Encoders, power as the robot publishes it, and the IMU of a robot that has one."""
    inputs = measured_inputs(robot, stage.encoders, stage.power, wheels, refused=stage.refused)
    turns, forces = stage.settings.watch_gyro, stage.settings.watch_accelerometer
    if not (turns or forces):
        return inputs

    inertial = Imu(robot.imu_rpy)

    def imu(message: Any, receive_ns: int) -> Arrival:
        rate, force = inertial.read(message)
        return stage.imu(
            stamp_of(message, receive_ns),
            rate if turns else _NOT_WATCHED,
            force if forces else _NOT_WATCHED,
        )

    return (*inputs, imu_input(imu))
