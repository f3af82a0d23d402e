"""What bench/extended.py draws and how it cuts time; no drive is simulated."""

import sys
from collections import Counter
from pathlib import Path
from unittest.mock import Mock, patch

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

from commissioned import made
from diagnosis import Kind as Diagnosed
from extended import Fleet, Scenario, faulty, scored, spans, targets
from faults.drawn import EXTENDED, KINDS, faulty_drive, pushed_drive

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.diagnosis.score import Case, Seen
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.errors import InputError
from tomr_power_model.robot import load_robot
from tomr_sim_bridge.faults import natures
from tomr_training.labels import SLIPPING
from tomr_training.simulated_drive import START_NS


def test_every_fault_beyond_the_papers_is_drawn() -> None:
    drawn = {kind.fault_id: kind.group == EXTENDED for kind in KINDS.values()}
    for fault_id, nature in natures().items():
        if nature == "disturbance" or fault_id in ("encoder_lost", "floor_slippery"):
            continue
        assert drawn[fault_id] == (nature == "fault")


@pytest.mark.parametrize("name", KINDS)
def test_a_seed_makes_a_drive(name: str) -> None:
    drive, size = faulty_drive(Fleet().drive(4_000_000), name)
    again, _ = faulty_drive(Fleet().drive(4_000_000), name)
    fault = drive.mission.faults[0]
    assert again.mission == drive.mission
    assert size > 0.0
    assert 0.0 < fault.start < (fault.end or 0.0) <= drive.length
    assert (fault.settings["severity"] == 1.0) == (fault.fault_id != "floor_slippery")
    seconds = [second.fault_id for second in drive.mission.faults[1:]]
    assert seconds == [KINDS[name].also] * bool(KINDS[name].also)


def test_a_fleet_is_the_robots_of_a_folder(tmp_path: Path) -> None:
    for number in (0, 2, 10):
        (tmp_path / f"robot_{number}").mkdir()
    assert [folder.name for folder in Fleet.of(tmp_path).robots] == [
        "robot_0",
        "robot_2",
        "robot_10",
    ]
    with pytest.raises(InputError, match="no robot_"):
        Fleet.of(tmp_path / "robot_0")


def test_a_commissioned_robot_drives_as_it_is_and_is_judged_as_commissioned(tmp_path: Path) -> None:
    described = {}
    for number, caution in ((4, 12.5), (5, 13.5)):
        folder = tmp_path / f"robot_{number}"
        text = made(number, folder).described.read_text()
        described[number] = load_robot(folder / "robot.yaml")
        (folder / "commissioned").mkdir()
        section = f"fault_classifier:\n  ros__parameters: {{caution: {caution}}}\n"
        (folder / "commissioned" / "commissioned.yaml").write_text(text + section)
    fleet = Fleet.of(tmp_path)
    for seed, number, caution in ((6, 4, 12.5), (7, 5, 13.5)):
        assert fleet.kind(seed).settings.caution == caution
        drive = fleet.drive(seed)
        assert drive.believed == described[number]
        assert drive.plant == made(number, tmp_path / f"robot_{number}").real


def test_residuals_are_judged_in_the_bands_of_the_robot() -> None:
    power, speed = Residual(0.0, 2.0, 4.0), Residual(0.0, 0.2, 5.0, "rad/s")
    frame = ResidualFrame(START_NS, (*[power] * 4, *[speed] * 3, *[power] * 3))
    seen = Mock(side_effect=lambda frame: None)
    fleet = Mock(kind=lambda seed: Diagnosed(ClassifierSettings(), BandSettings(power=9.0)))
    with (
        patch("extended.FaultClassifier.of", return_value=Mock(classify=seen)),
        patch("extended.scenario_of", return_value=Scenario(Mock(frames=(frame,)))),
    ):
        scored((fleet, 1, ""))
    ((judged,),) = (call.args for call in seen.call_args_list)
    assert [item.band for item in judged.residuals[:4]] == [9.0] * 4


def test_slip_under_a_load_counts_where_a_wheel_slides_and_no_other_name_is_right() -> None:
    found = faulty(Fleet(), 4_000_001, "floor_slippery and load_towed")
    assert found is not None
    (label,) = found.labels
    assert label.is_right("slip", 0)
    assert not label.is_right("external load", 0)
    assert not label.is_right("unknown", 0)
    slides = found.labelled.truth.slip.max(axis=1) > SLIPPING
    first = found.labelled.first
    begins = [round(begin / 0.05) - first for begin, _ in label.observable]
    assert begins
    assert slides[begins].all()
    drive, _ = faulty_drive(Fleet().drive(4_000_001), "floor_slippery and load_towed")
    towed = drive.mission.faults[1]
    assert 0.15 <= float(str(towed.settings["drag"])) / drive.plant.mass <= 0.6


def test_pushes_follow_one_another_within_what_is_no_fault() -> None:
    for seed in range(4_000_000, 4_000_020):
        faults = pushed_drive(Fleet().drive(seed)).mission.faults
        for fault in faults:
            assert fault.fault_id == "pushed"
            assert float(str(fault.settings["force"])) <= 3.0
        ends = [fault.end or 0.0 for fault in faults]
        assert all(end <= fault.start for end, fault in zip(ends, faults[1:], strict=False))


def test_spans_close_short_gaps() -> None:
    flags = np.zeros(100, dtype=bool)
    flags[[10, 11, 30, 31, 80]] = True  # 0.95 s apart, then 2.45 s
    assert np.array(spans(flags, 1)) == pytest.approx(np.array([[0.55, 1.65], [4.05, 4.1]]))
    assert spans(flags & False, 1) == ()


def test_targets_count_each_fault_by_what_it_was_called_most() -> None:
    def case(kind: str, **verdicts: int) -> Case:
        return Case(kind, 1.0, 0.5, 0.5, Counter(), Counter(verdicts))

    cases = (
        case("wheel_stuck", right=9, unknown=1),
        case("wheel_stuck", unknown=9, right=1),
        case("windy", another_named=5),
        case("windy", normal_or_nothing=5),
    )
    found = targets([Seen(cases, (), 0.0, 0, 1)])
    known, unknown = found["extended states"], found["unknown kinds"]
    assert known["right"]["share"] == 0.5  # type: ignore[index]
    assert known["right or unknown"]["share"] == 1.0  # type: ignore[index]
    assert unknown["a wrong fault"]["share"] == 0.5  # type: ignore[index]
    assert unknown["unknown or a fault"]["share"] == 0.5  # type: ignore[index]
