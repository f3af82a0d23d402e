"""What the residual stage reads besides the predictions."""

from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.intake import WheelFinder
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Input, measured_inputs


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelFinder | None = None
) -> tuple[Input, ...]:
    """Encoders, and power as the robot publishes it."""
    return measured_inputs(robot, stage.encoders, stage.power, wheels, refused=stage.refused)
