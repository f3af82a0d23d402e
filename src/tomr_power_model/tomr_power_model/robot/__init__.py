"""The robot's description: read from robot.yaml or from ROS parameters."""

from tomr_power_model.robot.commissioned import COMMISSIONING, digest_of, suite_version
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
    "COMMISSIONING",
    "GRAVITY",
    "WHEELS",
    "Controller",
    "Measurement",
    "Motor",
    "Robot",
    "Sensors",
    "Supply",
    "digest_of",
    "load_robot",
    "read_description",
    "read_node_sections",
    "read_sections",
    "robot_from_parameters",
    "shipped_robot",
    "shipped_robots",
    "suite_version",
]
