"""Odometry that knows of slip."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from tomr_power_model.nodes.launching import ROBOT_FILE, SETTINGS_FILE, find_files

ARGUMENTS = (
    DeclareLaunchArgument(
        "robot", default_value="reference", description="robot.yaml, or a shipped robot by name"
    ),
    DeclareLaunchArgument(
        "settings",
        default_value="",
        description="parameter file with settings of the node, such as publish_tf; empty: none",
    ),
    DeclareLaunchArgument("use_sim_time", default_value="false", description="time of /clock"),
    DeclareLaunchArgument("namespace", default_value="", description="of the robot's topics"),
)


def generate_launch_description() -> LaunchDescription:
    """Start the node."""
    node = Node(
        package="tomr_odometry",
        executable="slip_odometry",
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            LaunchConfiguration(ROBOT_FILE),
            LaunchConfiguration(SETTINGS_FILE),
            {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)},
        ],
        output="screen",
    )
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=find_files), node])
