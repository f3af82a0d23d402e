"""The command line of a node: `--help` that lists its parameters."""

import argparse
import sys
from collections.abc import Iterable, Sequence

from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.utilities import remove_ros_args

from tomr_power_model.errors import InputError
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
    try:
        own = remove_ros_args(given)[1:]
    except (RCLError, UnknownROSArgsError) as error:
        # Its text ends with where it was in C.
        raise InputError(f"{name}: {str(error).partition(', at ')[0]}: mend it") from None
    parser.parse_args(own)
    return given
