"""The scores of bench/diagnosis.py, on a drive made by hand."""

import sys
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

from diagnosis import episodes, score_faulty, score_healthy, true_state
from diagnosis_report import report

from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive, random_drive
from tomr_training.labels import GroundTruth
from tomr_training.simulated_drive import LabelledDrive

TICKS = 200  # the fault is in force in 60..139 and shows from 63 on, its wheel idle at the end
LOST = PlannedFault("encoder_lost", 3.0, 7.0, {"severity": 0.8, "wheel": 2})
STATE = MOTOR + 1


def drive_with(fault: PlannedFault) -> Drive:
    drive = random_drive(shipped_robot("reference"), 3, None)
    return evolve(drive, mission=evolve(drive.mission, faults=(fault,)))


def drives() -> tuple[LabelledDrive, GroundTruth]:
    """The drive and its healthy twin."""
    zero = np.zeros((TICKS, 3))
    speed = np.full((TICKS, 3), 5.0)
    speed[120:, 1] = 0.1
    twin = GroundTruth(np.full((TICKS, 3), 4.0), speed, zero)
    power = twin.power.copy()
    power[63:140, 1] += 5.0
    faulty = np.zeros(TICKS, dtype=bool)
    faulty[60:140] = True
    return LabelledDrive((), GroundTruth(power, speed, zero), faulty, 1), twin


def test_a_named_fault_is_scored_by_delay_decisions_and_use_of_its_wheel() -> None:
    labelled, twin = drives()
    named = np.full(TICKS, NORMAL)
    named[20:25] = SLIP  # nobody slipped: a false alarm
    named[70:130] = STATE
    found = score_faulty(drive_with(LOST), labelled, twin, named)
    (onset,) = found.onsets
    assert (onset.state, onset.severity) == (STATE, 0.8)
    assert onset.delay == pytest.approx(0.05 * 8)  # from the start of tick 63 to the end of 70
    assert found.alarms == (SLIP,)
    # Shown from 66 on, 0.2 s after it began; a second from 63 on is the delay's.
    assert found.decisions[STATE].sum() == 140 - 83
    assert found.decisions[STATE, STATE] == 130 - 83
    assert found.idle[STATE, STATE] == 10
    assert found.idle[STATE, NORMAL] == 10
    assert found.by_severity == {"0.70 to 0.85": (130 - 83, 140 - 83)}
    assert found.unseen.sum() == 3  # ticks 60 to 62
    assert found.decisions[NORMAL].sum() == 60  # before; the 3 s after it count for nothing
    assert found.healthy_seconds == pytest.approx(3.0)


@pytest.mark.parametrize(("tick", "delay"), [(149, 0.05 * 87), (150, np.inf)])
def test_a_name_counts_until_half_a_second_after_the_fault_showed(tick: int, delay: float) -> None:
    labelled, twin = drives()
    named = np.full(TICKS, NORMAL)
    named[tick] = STATE
    found = score_faulty(drive_with(LOST), labelled, twin, named)
    assert found.onsets[0].delay == pytest.approx(delay)
    figures = report([found], [])
    assert figures["delay_s"]["all"]["never_named"] == int(np.isinf(delay))  # type: ignore[index]
    alarms = figures["false_alarms"]  # in no healthy drive at all
    assert isinstance(alarms, dict)
    assert (alarms["per_hour"], alarms["ci95_per_hour"]) == (None, [None, None])


def test_slip_is_excused_where_a_wheel_slipped_just_before() -> None:
    labelled, _ = drives()
    slip = np.zeros((TICKS, 3))
    slip[50] = 0.1
    truth = evolve(labelled.truth, slip=slip)
    named = np.full(TICKS, NORMAL)
    named[55:58] = named[100:103] = SLIP
    named[150:152] = STATE
    found = score_healthy(evolve(labelled, truth=truth), named)
    assert (found.excused, found.alarms) == (1, (SLIP, STATE))
    assert found.healthy_seconds == pytest.approx(10.0)


def test_shows_a_second_apart_are_onsets_of_their_own() -> None:
    flags = np.zeros(TICKS, dtype=bool)
    flags[10:20] = flags[35:40] = flags[70:80] = True
    assert episodes(flags) == [(7, 39), (67, 79)]
    assert episodes(flags[:5]) == []


@pytest.mark.parametrize(
    ("kind", "state"),
    [("floor_slippery", SLIP), ("control_signal_lost", CONTROL), ("encoder_lost", STATE)],
)
def test_what_a_fault_is_to_be_named(kind: str, state: int) -> None:
    assert true_state(drive_with(evolve(LOST, fault_id=kind))) == state
