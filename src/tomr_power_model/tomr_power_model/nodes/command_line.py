"""The command line of a node: `--help` that lists its parameters."""

import argparse
import sys
from collections.abc import Iterable, Sequence

from rclpy.utilities import remove_ros_args

from tomr_power_model.robot.parameters import ParameterSpec

_PARAMETERS = """
Parameters, given after --ros-args as -p name:=value or in a file as --params-file robot.yaml:
"""


def node_arguments(
    name: str,
    description: str,
    specs: Iterable[ParameterSpec],
    epilog: str = "",
    arguments: Sequence[str] | None = None,
) -> list[str]:
    """The arguments to start ROS with; `--help` and what no node knows end the process."""
    given = list(sys.argv if arguments is None else [name, *arguments])
    parser = argparse.ArgumentParser(
        prog=name,
        description=description
        + "\n"
        + _PARAMETERS
        + "\n".join(f"  {spec.summary}" for spec in specs),
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.parse_args(remove_ros_args(given)[1:])
    return given
