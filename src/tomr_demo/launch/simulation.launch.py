"""Simulate a robot, and diagnose it too unless asked not to."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from tomr_power_model.nodes.launching import ROBOT_FILE, find_files


def generate_launch_description() -> LaunchDescription:
    """Start the simulator, which also gives the time, and the nodes of the diagnosis."""
    robot = LaunchConfiguration("robot")
    namespace = LaunchConfiguration("namespace")
    factor = ParameterValue(LaunchConfiguration("real_time_factor"), value_type=float)
    clock = ParameterValue(LaunchConfiguration("publish_clock"), value_type=bool)
    diagnosis = PathJoinSubstitution(
        [FindPackageShare("tomr_fault_diag"), "launch", "diagnosis.launch.py"]
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robot",
                default_value="reference",
                description="robot.yaml of the robot to simulate, or a shipped one by name",
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="namespace of the robot's topics"
            ),
            DeclareLaunchArgument(
                "diagnosis", default_value="true", description="false: only the simulator"
            ),
            DeclareLaunchArgument(
                "real_time_factor",
                default_value="1.0",
                description="seconds of the robot per second",
            ),
            DeclareLaunchArgument(
                "publish_clock",
                default_value="true",
                description="false: time is that of the computer, as for one of several robots",
            ),
            DeclareLaunchArgument(
                "composition",
                default_value="false",
                description="true: the diagnosis in one process",
            ),
            OpaqueFunction(function=find_files),
            Node(
                package="tomr_sim_bridge",
                executable="sim_bridge",
                namespace=namespace,
                parameters=[
                    LaunchConfiguration(ROBOT_FILE),
                    {"real_time_factor": factor, "publish_clock": clock},
                ],
                output="screen",
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(diagnosis),
                launch_arguments={
                    "robot": robot,
                    "namespace": namespace,
                    "use_sim_time": LaunchConfiguration("publish_clock"),
                    "composition": LaunchConfiguration("composition"),
                }.items(),
                condition=IfCondition(LaunchConfiguration("diagnosis")),
            ),
        ]
    )
