"""Faults of the simulated robot. A new one is one file with a registered class, imported here."""

from tomr_sim_bridge.faults import control_signal_lost, encoder_lost, floor_slippery
from tomr_sim_bridge.faults.base import (
    FaultActions,
    all_parameters,
    check_settings,
    fault_ids,
    split_name,
)
from tomr_sim_bridge.faults.board import FaultBoard, FaultState

__all__ = [
    "FaultActions",
    "FaultBoard",
    "FaultState",
    "all_parameters",
    "check_settings",
    "control_signal_lost",
    "encoder_lost",
    "fault_ids",
    "floor_slippery",
    "split_name",
]
