"""Diagnose a robot: from its commands, encoders and motor power to /diagnostics."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from tomr_power_model.nodes.launching import ROBOT_FILE, SETTINGS_FILE, find_files

ARGUMENTS = (
    DeclareLaunchArgument(
        "robot",
        default_value="reference",
        description="robot.yaml: geometry, masses, motors and friction of the robot; or a shipped "
        "one by name: reference, robotino_v2, robotino_v2_gray",
    ),
    DeclareLaunchArgument(
        "settings",
        default_value="",
        description="parameter file with settings of the nodes, such as cmd_vel_type; empty: none",
    ),
    DeclareLaunchArgument(
        "use_sim_time",
        default_value="false",
        description="true: time comes from /clock, as of a simulation or a replayed bag",
    ),
    DeclareLaunchArgument(
        "namespace", default_value="", description="namespace of the robot's topics"
    ),
    DeclareLaunchArgument(
        "hardware_id",
        default_value="",
        description="name of the robot in /diagnostics; empty: its namespace, else tomr",
    ),
    DeclareLaunchArgument(
        "composition",
        default_value="false",
        description="true: the three stages in one process, at half the cost",
    ),
    DeclareLaunchArgument(
        "managed",
        default_value="false",
        description="true: with composition, a managed node that a lifecycle manager configures "
        "and activates",
    ),
    DeclareLaunchArgument(
        "decision_rate", default_value="20.0", description="decisions per second [Hz]"
    ),
)


def argument(name: str, kind: type) -> dict[str, ParameterValue]:
    """The launch argument as a parameter of the same name, which must be of this type."""
    return {name: ParameterValue(LaunchConfiguration(name), value_type=kind)}


def stage(
    *parameters: dict[str, ParameterValue], package: str, executable: str, composed: bool = False
) -> Node:
    """One node of the diagnosis, with the parameters it has besides those of all."""
    files = [LaunchConfiguration(ROBOT_FILE), LaunchConfiguration(SETTINGS_FILE)]
    condition = IfCondition if composed else UnlessCondition
    return Node(
        package=package,
        executable=executable,
        namespace=LaunchConfiguration("namespace"),
        parameters=[*files, argument("use_sim_time", bool), *parameters],
        condition=condition(LaunchConfiguration("composition")),
        output="screen",
    )


def generate_launch_description() -> LaunchDescription:
    """Start the three nodes of the diagnosis, or the one that holds them."""
    rate = argument("decision_rate", float)
    name = argument("hardware_id", str)
    return LaunchDescription(
        [
            *ARGUMENTS,
            OpaqueFunction(function=find_files),
            stage(rate, name, package="tomr_power_model", executable="power_model"),
            stage(rate, name, package="tomr_fault_diag", executable="power_residuals"),
            stage(name, package="tomr_fault_diag", executable="fault_classifier"),
            stage(
                rate,
                name,
                argument("managed", bool),
                package="tomr_fault_diag",
                executable="tomr_diagnosis",
                composed=True,
            ),
        ]
    )
