"""The topics of the robot and of the suite, and which process answers for each."""

from attrs import frozen

from tomr_demo.score import DIAGNOSTICS as DIAGNOSIS
from tomr_demo.score import TRUTH
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_power_model.messages.outgoing import TYPES
from tomr_power_model.messages.types import (
    BATTERY,
    DIAGNOSTICS,
    IMU,
    JOINT_STATE,
    ODOMETRY,
    TWIST_STAMPED,
)
from tomr_power_model.robot import Robot
from tomr_power_model.topics.predictions import prediction_topics

# The processes, in the order in which data passes through them, and the modules they run.
PROCESSES = {
    "sim_bridge": "tomr_sim_bridge.nodes.sim_bridge_node",
    "power_model": "tomr_power_model.nodes.power_model_node",
    "power_residuals": "tomr_fault_diag.nodes.power_residuals_node",
    "fault_classifier": "tomr_fault_diag.nodes.fault_classifier_node",
}
OWN = "tomr_demo"


@frozen
class Topic:
    """A topic to record."""

    type_name: str
    process: str
    best_effort: bool = False
    decoded: bool = False


def all_topics(robot: Robot) -> dict[str, Topic]:
    """Every topic but /clock, which a recording carries in its receive stamps."""

    def sensor(type_name: str) -> Topic:
        return Topic(type_name, "sim_bridge", best_effort=True)

    topics = {
        "cmd_vel": Topic(TWIST_STAMPED, OWN),
        "joint_states": sensor(JOINT_STATE),
        **{f"{wheel}/power": sensor(BATTERY) for wheel in robot.wheel_topics},
        "battery_state": sensor(BATTERY),
        "imu/data": sensor(IMU),
        "odom": sensor(ODOMETRY),
        "ground_truth/odom": Topic(ODOMETRY, "sim_bridge"),
        TRUTH: Topic(DIAGNOSTICS, "sim_bridge", decoded=True),
        **{
            topic: Topic(TYPES[kind], "power_model")
            for topic, kind in prediction_topics(robot).items()
        },
        RESIDUALS: Topic(DIAGNOSTICS, "power_residuals", decoded=True),
        DIAGNOSIS: Topic(DIAGNOSTICS, "fault_classifier", decoded=True),
    }
    return {f"/{name.lstrip('/')}": topic for name, topic in topics.items()}
