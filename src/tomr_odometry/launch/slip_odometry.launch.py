"""Odometry that knows of slip."""

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
    DeclareLaunchArgument("robot", default_value=REFERENCE_ROBOT, description="robot.yaml"),
    DeclareLaunchArgument(
        "settings",
        default_value=LaunchConfiguration("robot"),
        description="parameter file with settings of the node, such as publish_tf",
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
            LaunchConfiguration("robot"),
            LaunchConfiguration("settings"),
            {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)},
        ],
        output="screen",
    )
    return LaunchDescription([*ARGUMENTS, node])
