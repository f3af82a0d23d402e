"""Missions of the simulator, recorded."""

from collections.abc import Collection
from pathlib import Path

from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import Robot
from tomr_sim_bridge.missions import drive, load_mission, start_mission
from tomr_sim_bridge.missions.mission import Mission

_START_NS = 1_700_000_000 * NANOSECONDS


def record_mission(
    mission: Mission | str, plant: Robot, seed: int, path: Path, without: Collection[str] = ()
) -> None:
    """Drive a mission with a seed and keep the recording, without some topics."""
    mission = load_mission(mission) if isinstance(mission, str) else mission
    simulation = start_mission(mission, plant, seed, _START_NS)
    with RecordingWriter(path) as writer:
        for samples in drive(mission, simulation, seed):
            for sample in samples:
                if sample.topic in without:
                    continue
                message = to_bag(sample.message)
                writer.write(sample.topic, sample.message.type_name, message, sample.stamp_ns)
