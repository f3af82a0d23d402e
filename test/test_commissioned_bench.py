"""Benches of commissioned robots that have no IMU: nothing of them is recorded, nor simulated."""

import sys
from pathlib import Path
from unittest.mock import Mock, patch

import pytest
from attrs import evolve

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

import commissioned
import extended
from extended import Fleet
from record import record_mission

from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions import load_mission

IMU = ("imu/data",)


class Simulated(Exception):
    """As far as a test goes."""


def test_a_recording_may_lack_a_topic(tmp_path: Path) -> None:
    mission = load_mission("square")
    short = evolve(mission, phases=mission.phases[:1])
    topics = {}
    for name, without in (("with", ()), ("without", IMU)):
        record_mission(short, shipped_robot("reference"), 1, tmp_path / name, without)
        with open_recording(tmp_path / name) as recording:
            topics[name] = {one[0].lstrip("/") for one in recording.messages()}
    assert topics["with"] - topics["without"] == set(IMU)


@pytest.mark.parametrize(
    ("given", "without", "rates"),
    [([], (), ()), (["--without-imu"], IMU, ()), (["--rates", "50", "10"], (), (50.0, 10.0))],
)
def test_robots_are_commissioned_and_driven_alike(
    tmp_path: Path, given: list[str], without: tuple[str, ...], rates: tuple[float, ...]
) -> None:
    options = ["--out", str(tmp_path), "--robots", "4", "--drives", "1", "--hours", "0.005", *given]
    with (
        patch("commissioned.commissioned", return_value={}) as commission,
        patch("commissioned._outcomes", return_value=[]) as outcomes,
    ):
        commissioned._main(options)
    assert commission.call_args.args[2:] == (without, rates)
    tasks = [task for call in outcomes.call_args_list for task in call.args[1]]
    assert len(tasks) == 2
    kind = (Mock(), shipped_robot("reference"))
    for task in tasks:
        with (
            patch("commissioned.commissioned_kind", return_value=kind),
            patch("commissioned.simulated_drive", side_effect=Simulated) as simulate,
            pytest.raises(Simulated),
        ):
            commissioned.scored(task)
        drive, left_out = simulate.call_args.args
        assert left_out == without
        measured = drive.plant.sensors.encoder_rate, drive.plant.sensors.power_rate
        assert not rates or measured == rates


@pytest.mark.parametrize(("given", "without"), [([], ()), (["--without-imu"], IMU)])
def test_other_faults_are_simulated_alike(
    tmp_path: Path, given: list[str], without: tuple[str, ...]
) -> None:
    (tmp_path / "robot_4").mkdir()
    assert Fleet.of(tmp_path, without).without == without
    with patch("extended.Fleet.of", side_effect=Simulated) as fleet, pytest.raises(Simulated):
        extended._main(given)
    assert fleet.call_args.args[1] == without
    robots = Fleet.of(None, without)
    with patch("extended.simulated_drive", side_effect=Simulated) as simulate:
        with pytest.raises(Simulated):
            extended.pushed(robots, 4_000_000)
        with pytest.raises(Simulated):
            extended.faulty(robots, 4_000_000, "windy")
    assert [call.args[1] for call in simulate.call_args_list] == [without] * 2


def test_commissioning_records_without_it(tmp_path: Path) -> None:
    with (
        patch("commissioned.record_mission") as record,
        patch("commissioned.commission", side_effect=Simulated),
        pytest.raises(Simulated),
    ):
        commissioned.commissioned(4, tmp_path, IMU)
    assert [call.args[3].name for call in record.call_args_list] == ["plan_1", "plan_2", "held_out"]
    assert all(call.args[4] == IMU for call in record.call_args_list)
