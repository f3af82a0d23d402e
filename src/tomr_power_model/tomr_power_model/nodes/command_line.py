"""The command line of a node: `--help` that lists its parameters."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

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
    """The arguments to start ROS with; `--help` and what no node knows end the process, and so
    does what ROS cannot read, with one line."""
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
        raise InputError(f"{name}: {_cause(given, error)}") from None
    parser.parse_args(own)
    return given


def _cause(arguments: Sequence[str], error: Exception) -> str:
    """Why ROS refuses its arguments; its own text ends with where it was in C."""
    for file in parameter_files(arguments):
        if not Path(file).is_file():
            return f"--params-file {file}: no such file: give a robot.yaml"
    return f"{' '.join(str(error).partition(', at ')[0].split())}: mend it"


def parameter_files(arguments: Sequence[str]) -> list[str]:
    """The files given as --params-file."""
    return [file for flag, file in pairwise(arguments) if flag == "--params-file"]
