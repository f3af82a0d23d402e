"""The commands of this package; each loads what it needs where Ctrl-C ends it with a line."""

from tomr_power_model.cli import run_module


def power_model() -> int:
    """Entry point of `power_model`."""
    return run_module("tomr_power_model.nodes.power_model_node")


def tomr_calibrate() -> int:
    """Entry point of `tomr_calibrate`."""
    return run_module("tomr_power_model.calibrate_cli")
