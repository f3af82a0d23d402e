"""The robot's description: read from robot.yaml or from ROS parameters."""

from tomr_power_model.robot.description import (
    GRAVITY,
    WHEELS,
    Controller,
    Measurement,
    Motor,
    Robot,
    Sensors,
    Supply,
    robot_from_parameters,
)
from tomr_power_model.robot.files import (
    load_robot,
    read_description,
    read_node_sections,
    read_sections,
    shipped_robot,
    shipped_robots,
)

__all__ = [
    "GRAVITY",
    "WHEELS",
    "Controller",
    "Measurement",
    "Motor",
    "Robot",
    "Sensors",
    "Supply",
    "load_robot",
    "read_description",
    "read_node_sections",
    "read_sections",
    "robot_from_parameters",
    "shipped_robot",
    "shipped_robots",
]
