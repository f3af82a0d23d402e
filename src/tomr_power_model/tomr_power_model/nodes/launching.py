"""What the launch files of the suite share; they alone need a ROS installation."""

from typing import Any

from tomr_power_model.robot.files import parameter_file, robot_file

ROBOT_FILE, SETTINGS_FILE = "robot_file", "settings_file"


def find_files(context: Any) -> None:
    """For an OpaqueFunction: the files that the arguments `robot` and `settings` name.

    Leaves them as configurations; a node needs both, so that without settings it gets the robot's
    once more, which changes nothing. Raises InputError in one line for a file that is not there.
    """
    given = context.launch_configurations
    robot, settings = given["robot"], given.get("settings", "")
    given[ROBOT_FILE] = str(robot_file(robot))
    given[SETTINGS_FILE] = str(parameter_file(settings)) if settings else given[ROBOT_FILE]
