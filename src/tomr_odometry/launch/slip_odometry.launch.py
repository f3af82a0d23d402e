"""Odometry that knows of slip."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

ROBOT = LaunchConfiguration("robot")
# A file, or the name of a robot that is shipped.
ROBOT_FILE = PythonExpression(
    [
        *("'", ROBOT, "' if '", ROBOT, "'.endswith(('.yaml', '.yml')) else "),
        *("'", FindPackageShare("tomr_power_model"), "/robots/", ROBOT, ".yaml'"),
    ]
)
ARGUMENTS = (
    DeclareLaunchArgument(
        "robot", default_value="reference", description="robot.yaml, or a shipped robot by name"
    ),
    DeclareLaunchArgument(
        "settings",
        default_value=ROBOT_FILE,
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
            ROBOT_FILE,
            LaunchConfiguration("settings"),
            {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)},
        ],
        output="screen",
    )
    return LaunchDescription([*ARGUMENTS, node])
