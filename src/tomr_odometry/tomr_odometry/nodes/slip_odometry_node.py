"""Node `slip_odometry`: where the robot is, and how much its wheels slip."""

from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.settings import PARAMETERS, OdometrySettings
from tomr_odometry.topics import estimate_messages, odometry_inputs, outputs
from tomr_power_model.errors import InputError
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.stage_node import StageNode, run_node
from tomr_power_model.robot.parameters import CMD_VEL_TYPE

NODE_PARAMETERS = (*PARAMETERS, CMD_VEL_TYPE)


class SlipOdometryNode(StageNode):
    """Publishes odometry and slip at the decision rate, stamped by the data."""

    def __init__(self) -> None:
        super().__init__("slip_odometry", NODE_PARAMETERS)
        self._settings = OdometrySettings.of(self.values)
        self._core = SlipOdometry(self._robot, self._settings)
        for topic, type_name in outputs(self._settings).items():
            try:
                self.offer_type(topic, type_name)
            except ImportError as error:
                raise InputError(
                    f"publish_tf = true: {error}: install tf2_msgs or set it to false"
                ) from error
        self.listen(odometry_inputs(self._robot, self._core), self._advance)

    def _advance(self) -> None:
        for estimate in self._core.due():
            for message in estimate_messages(
                self._robot, estimate, self._settings, self._namespace
            ):
                self.publish(message.topic, message.message)


def main() -> int:
    """Entry point of `slip_odometry`."""
    description = "Odometry that knows of slip, from cmd_vel, joint_states, motor power and an IMU."
    given = node_arguments("slip_odometry", description, NODE_PARAMETERS)
    return run_node(SlipOdometryNode, given)
