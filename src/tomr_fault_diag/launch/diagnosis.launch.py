"""Diagnose a robot: from its commands, encoders and motor power to /diagnostics."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

REFERENCE_ROBOT = PathJoinSubstitution(
    [FindPackageShare("tomr_power_model"), "robots", "reference.yaml"]
)
ARGUMENTS = (
    DeclareLaunchArgument(
        "robot",
        default_value=REFERENCE_ROBOT,
        description="robot.yaml: geometry, masses, motors and friction of the robot",
    ),
    DeclareLaunchArgument(
        "settings",
        # A file is needed either way: by default the robot's once more, which changes nothing.
        default_value=LaunchConfiguration("robot"),
        description="parameter file with settings of the nodes, such as cmd_vel_type",
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
        "hardware_id", default_value="tomr", description="name of the robot in /diagnostics"
    ),
    DeclareLaunchArgument(
        "decision_rate", default_value="20.0", description="decisions per second [Hz]"
    ),
)


def argument(name: str, kind: type) -> dict[str, ParameterValue]:
    """The launch argument as a parameter of the same name, which must be of this type."""
    return {name: ParameterValue(LaunchConfiguration(name), value_type=kind)}


def stage(*parameters: dict[str, ParameterValue], package: str, executable: str) -> Node:
    """One node of the diagnosis, with the parameters it has besides those of all."""
    files = [LaunchConfiguration("robot"), LaunchConfiguration("settings")]
    return Node(
        package=package,
        executable=executable,
        namespace=LaunchConfiguration("namespace"),
        parameters=[*files, argument("use_sim_time", bool), *parameters],
        output="screen",
    )


def generate_launch_description() -> LaunchDescription:
    """Start the three nodes of the diagnosis."""
    rate = argument("decision_rate", float)
    hardware_id = argument("hardware_id", str)
    return LaunchDescription(
        [
            *ARGUMENTS,
            stage(rate, hardware_id, package="tomr_power_model", executable="power_model"),
            stage(rate, hardware_id, package="tomr_fault_diag", executable="power_residuals"),
            stage(hardware_id, package="tomr_fault_diag", executable="fault_classifier"),
        ]
    )
