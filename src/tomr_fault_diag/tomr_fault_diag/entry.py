"""The commands of this package; each loads what it needs where Ctrl-C ends it with a line."""

from tomr_power_model.cli import run_module


def power_residuals() -> int:
    """Entry point of `power_residuals`."""
    return run_module("tomr_fault_diag.nodes.power_residuals_node")


def fault_classifier() -> int:
    """Entry point of `fault_classifier`."""
    return run_module("tomr_fault_diag.nodes.fault_classifier_node")


def tomr_diagnosis() -> int:
    """Entry point of `tomr_diagnosis`."""
    return run_module("tomr_fault_diag.nodes.diagnosis_node")


def tomr_diagnose() -> int:
    """Entry point of `tomr_diagnose`."""
    return run_module("tomr_fault_diag.cli.diagnose")
