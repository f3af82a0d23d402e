"""The commands of this package; each loads what it needs where Ctrl-C ends it with a line."""

from tomr_power_model.cli import run_module


def slip_odometry() -> int:
    """Entry point of `slip_odometry`."""
    return run_module("tomr_odometry.nodes.slip_odometry_node")


def tomr_odometry() -> int:
    """Entry point of `tomr_odometry`."""
    return run_module("tomr_odometry.cli")
