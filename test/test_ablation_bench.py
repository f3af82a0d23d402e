"""What is left out of the classifier, and nothing else, is left out."""

import sys
from pathlib import Path

import pytest
from attrs import evolve

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

import ablation
from ablation import ALL, PARTS, SLIDES, Seen, diagnosed

from tomr_fault_diag.classifier.settings import ClassifierSettings
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
    assert [(one.stamp_ns, one.state, one.wheel) for one in found[ALL]] == [
        (one.stamp_ns, one.state, one.wheel) for one in said
    ]
    assert found[ALL][-1].probabilities == pytest.approx(said[-1].probabilities)


def test_every_name_can_be_left_out(frames: tuple[ResidualFrame, ...]) -> None:
    names = [ALL, *ablation.WINDOW_RULES, *ablation.STATE_RULES, *PARTS]
    found = diagnosed(Seen(frames[:80], SETTINGS, ROBOT), names)
    assert list(found) == names
    assert all(found.values())


def test_without_particles_no_force_is_known(frames: tuple[ResidualFrame, ...]) -> None:
    """As if nothing hinted at a slide, which rules go by."""
    found = diagnosed(Seen(frames, SETTINGS, ROBOT), [SLIDES, "forces"])
    without = [one.probabilities for one in found[SLIDES]]
    assert without != [one.probabilities for one in found["forces"]]


def test_a_name_that_none_has_is_refused(frames: tuple[ResidualFrame, ...]) -> None:
    with pytest.raises(KeyError, match="nobody's rule"):
        diagnosed(Seen(frames[:3], SETTINGS, ROBOT), ["nobody's rule"])
