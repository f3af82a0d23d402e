"""Missions of the simulated robot as YAML: shipped ones by name, others by path."""

from tomr_sim_bridge.missions.drive import drive, start_mission
from tomr_sim_bridge.missions.mission import (
    Mission,
    Plan,
    load_mission,
    parse_mission,
    shipped_missions,
)

__all__ = [
    "Mission",
    "Plan",
    "drive",
    "load_mission",
    "parse_mission",
    "shipped_missions",
    "start_mission",
]
