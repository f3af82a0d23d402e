"""Faults of the simulated robot. A new one is a registered class in a file imported here."""

from tomr_sim_bridge.faults import (
    axle,
    body,
    control_signal_lost,
    encoder_lost,
    floor_slippery,
    motor,
    power_sensor,
    stops,
    supply_low,
)
from tomr_sim_bridge.faults.base import (
    BodyMotion,
    FaultActions,
    all_parameters,
    check_settings,
    fault_ids,
    natures,
    split_name,
)
from tomr_sim_bridge.faults.board import FaultBoard, FaultState

__all__ = [
    "BodyMotion",
    "FaultActions",
    "FaultBoard",
    "FaultState",
    "all_parameters",
    "axle",
    "body",
    "check_settings",
    "control_signal_lost",
    "encoder_lost",
    "fault_ids",
    "floor_slippery",
    "motor",
    "natures",
    "power_sensor",
    "split_name",
    "stops",
    "supply_low",
]
