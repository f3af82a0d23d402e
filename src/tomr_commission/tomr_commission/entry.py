"""The commands of this package; each loads what it needs where Ctrl-C ends it with a line."""

from tomr_power_model.cli import run_module


def tomr_commission() -> int:
    """Entry point of `tomr_commission`."""
    return run_module("tomr_commission.cli")
