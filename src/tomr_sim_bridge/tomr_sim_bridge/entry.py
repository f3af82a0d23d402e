"""The commands of this package; each loads what it needs where Ctrl-C ends it with a line."""

from tomr_power_model.cli import run_module


def sim_bridge() -> int:
    """Entry point of `sim_bridge`."""
    return run_module("tomr_sim_bridge.nodes.sim_bridge_node")


def bag_replay() -> int:
    """Entry point of `bag_replay`."""
    return run_module("tomr_sim_bridge.nodes.bag_replay_node")


def tomr_simulate() -> int:
    """Entry point of `tomr_simulate`."""
    return run_module("tomr_sim_bridge.cli.simulate")


def tomr_import_robotino() -> int:
    """Entry point of `tomr_import_robotino`."""
    return run_module("tomr_sim_bridge.cli.import_robotino")
