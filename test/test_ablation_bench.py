"""What is left out of the classifier, and nothing else, is left out."""

import sys
from pathlib import Path
from unittest.mock import Mock, patch

import pytest
from attrs import evolve

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

import ablation
from ablation import (
    ALL,
    LASTING,
    OUTSIDE,
    PARITY,
    PARTS,
    SLIDES,
    SLOPE,
    Seen,
    Tour,
    diagnosed,
    kept,
)
from commissioned import FAULTY, HEALTHY, file_of, seed_of

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_fault_diag.classifier.judges import make_judge
from tomr_fault_diag.classifier.lasting import LastingWatch
from tomr_fault_diag.classifier.misfit import MisfitWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.outside import OutsideWatch
from tomr_fault_diag.classifier.parity import ParityWatch
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.slides import SlideWatch
from tomr_fault_diag.classifier.slope import SlopeFilter
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.robot import shipped_robot
from tomr_training.drives import random_drive
from tomr_training.simulated_drive import simulated_drive

ROBOT = shipped_robot("reference")
SETTINGS = evolve(ClassifierSettings(), commissioned="for a test", small_faults=True)


@pytest.fixture(scope="module")
def frames() -> tuple[ResidualFrame, ...]:
    """Of a drive with a fault."""
    return tuple(simulated_drive(random_drive(ROBOT, 7, "fault")).frames)


def test_with_all_rules_the_classifier_of_the_nodes_speaks(
    frames: tuple[ResidualFrame, ...],
) -> None:
    found = diagnosed(Seen(frames, SETTINGS, ROBOT), [ALL])
    classifier = FaultClassifier.of(SETTINGS, ROBOT)
    said = [diagnosis for frame in frames if (diagnosis := classifier.classify(frame))]
    assert len(said) > 5
    assert [(one.stamp_ns, one.state, one.wheel) for one in found[ALL].values()] == [
        (one.stamp_ns, one.state, one.wheel) for one in said
    ]
    assert found[ALL][said[-1].stamp_ns].probabilities == pytest.approx(said[-1].probabilities)


def test_every_name_can_be_left_out(frames: tuple[ResidualFrame, ...]) -> None:
    names = [ALL, *ablation.WINDOW_RULES, *ablation.STATE_RULES, *PARTS]
    found = diagnosed(Seen(frames[:80], SETTINGS, ROBOT), names)
    assert list(found) == names
    assert all(found.values())


@pytest.mark.parametrize(
    ("part", "without"),
    [
        (SLIDES, "slides"),
        (OUTSIDE, "outside"),
        (SLOPE, "slope"),
        (LASTING, "lasting"),
        (PARITY, "parity"),
    ],
)
def test_a_part_that_is_left_out_is_not_there(
    frames: tuple[ResidualFrame, ...], part: str, without: str
) -> None:
    given = {
        "slides": SlideWatch(ROBOT),
        "outside": OutsideWatch(ROBOT),
        "slope": SlopeFilter(ROBOT),
        "lasting": LastingWatch(ROBOT),
        "parity": ParityWatch(ROBOT),
        without: None,
    }
    misfits = MisfitWatch(Motors(ROBOT).idle.tolist(), BrakingWatch(ROBOT))
    classifier = FaultClassifier(make_judge(SETTINGS), misfits=misfits, **given)  # type: ignore[arg-type]
    said = {one.stamp_ns: one for frame in frames if (one := classifier.classify(frame))}
    found = diagnosed(Seen(frames, SETTINGS, ROBOT), [part])[part]
    assert {at: (one.state, one.probabilities) for at, one in found.items()} == {
        at: (one.state, one.probabilities) for at, one in said.items()
    }


def test_what_is_kept_is_of_one_robot_file(tmp_path: Path) -> None:
    """Two folders may have one name, and a robot may be commissioned anew."""
    robots = [tmp_path / name for name in "ab"]
    for robot in robots:
        robot.write_text(robot.name)
    made = [kept(tmp_path, robot, "1", robot.read_text) for robot in robots]
    again = [kept(tmp_path, robot, "1", lambda: "anew") for robot in robots]
    assert made == again == ["a", "b"]
    robots[0].write_text("commissioned anew")
    assert kept(tmp_path, robots[0], "1", lambda: "anew") == "anew"


@pytest.mark.parametrize("fault", ["fault", None])
def test_healthy_tours_lead_over_ramps_and_faulty_ones_do_not(
    tmp_path: Path, fault: str | None
) -> None:
    (tmp_path / "robot_4" / "commissioned").mkdir(parents=True)
    file_of(tmp_path / "robot_4").write_text("a robot")
    plain, sloping = Mock(), Mock()
    with (
        patch("ablation.commissioned_kind", return_value=(Mock(), ROBOT)),
        patch("ablation.tour", return_value=plain) as tour,
        patch("ablation.over_ramps", return_value=sloping),
        patch("ablation.simulated_drive", side_effect=RuntimeError) as simulate,
        pytest.raises(RuntimeError),
    ):
        Tour(tmp_path, 4, 3, fault, ("imu/data",))([ALL], tmp_path)
    assert simulate.call_args.args == (plain if fault else sloping, ("imu/data",))
    assert tour.call_args.args[2] == seed_of(4, (FAULTY if fault else HEALTHY) + 3)


def test_a_name_that_none_has_is_refused(frames: tuple[ResidualFrame, ...]) -> None:
    with pytest.raises(KeyError, match="nobody's rule"):
        diagnosed(Seen(frames[:3], SETTINGS, ROBOT), ["nobody's rule"])
