"""What to check first on a robot once something was named, by state without its wheel's number."""

import re
from collections.abc import Mapping

from tomr_fault_diag.classifier.states import State

CHECKS: Mapping[str, str] = {
    "slip": "the floor for dust, water or a sill, the rollers for wear and dirt, and the place of "
    "the payload: an unloaded wheel slips first",
    "control system fault": "the motor's plug and its driver's fuse, enable line and error light",
    "motor system fault": "the encoder's plug and cable, then the motor's coupling and gear",
    "dragging wheel": "the wheel by hand, powered off: brake, bearing, something wound around it",
    "stuck wheel": "the wheel by hand, powered off: something jammed in it, a brake that holds",
    "degraded motor": "the motor's temperature, brushes and the resistance of plugs and windings",
    "power sensor fault": "the power sensor's plug and its bus; the motor itself may be well",
    "external load": "what the robot pushes or tows, and what leans on it",
    "does not follow its commands": "e-stop, contactor, the drivers' supply, a collision monitor "
    "between cmd_vel and the drivers; where it moves, who else commands it, and the base's limits; "
    "of a robot that was described a moment ago, robot.yaml",
    "low supply": "the battery's charge, its plugs and its fuse; charge it",
    "unknown": "what the evidence names, and whether robot.yaml still describes this robot",
    "stale": "whether the sensors' drivers and the other two nodes run",
    "not enough data": "the network's load, the sensors' rates and the stamps of their messages",
}


def check_first(state: State | str) -> str:
    """What to look at first, by a state or its name; empty where nothing is wrong."""
    name = state if isinstance(state, str) else state.name
    return CHECKS.get(re.sub(r" \d$", "", name), "")
