"""What the residual stage reads besides the predictions."""

from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.inputs import Input, measured_inputs
from tomr_power_model.messages.intake import WheelFinder
from tomr_power_model.robot import Robot


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelFinder | None = None
) -> tuple[Input, ...]:
    """Encoders, and power as the robot publishes it."""
    return measured_inputs(robot, stage.encoders, stage.power, wheels)
