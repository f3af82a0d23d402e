"""What the residual stage reads besides the predictions."""

from typing import Any

from tomr_fault_diag.residuals.gyro import CLOSEST_NS
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.intake import WheelFinder, specific_force_of, stamp_of, yaw_rate_of
from tomr_power_model.messages.readings import NAN
from tomr_power_model.messages.types import IMU
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Input, Thinning, guarded, measured_inputs


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelFinder | None = None
) -> tuple[Input, ...]:
    """Encoders, power as the robot publishes it, and the IMU of a robot that has one."""
    inputs = measured_inputs(robot, stage.encoders, stage.power, wheels, refused=stage.refused)
    turns, forces = stage.settings.watch_gyro, stage.settings.watch_accelerometer
    if not (turns or forces):
        return inputs

    def imu(message: Any, receive_ns: int) -> Arrival:
        rate = yaw_rate_of(message) if turns else NAN
        force = specific_force_of(message) if forces else (NAN, NAN, NAN)
        return stage.imu(stamp_of(message, receive_ns), rate, force)

    thinning = Thinning(CLOSEST_NS)
    taker = guarded(thinning.around(imu))
    inertial = Input("imu/data", IMU, taker, is_too_close=thinning.is_too_close, is_optional=True)
    return (*inputs, inertial)
