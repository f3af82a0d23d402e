"""Evidence is the caution that a classifier would need not to name a fault."""

import numpy as np
import pytest
from attrs import evolve

from tomr_commission.evidence import (
    MOST_CAUTION,
    SURE,
    Decided,
    Episode,
    decisions,
    evidence_in,
    first_alarm,
    together,
)
from tomr_commission.injected import KINDS, InjectedKind, injected
from tomr_commission.observed import Observed, frames_of
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import GAP
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
SETTINGS = ClassifierSettings()
COMMISSIONED = evolve(SETTINGS, caution=20.0)


def test_healthy_driving_has_no_evidence_and_no_alarm(healthy: Observed) -> None:
    frames = frames_of(healthy, BandSettings())
    assert evidence_in(frames, SETTINGS, ROBOT).max() < SETTINGS.caution
    assert decisions(frames, SETTINGS, ROBOT).alarms == ()


def test_alarm_comes_where_evidence_passes_the_caution(faulty: Observed) -> None:
    frames = frames_of(faulty, BandSettings())
    evidence = evidence_in(frames, SETTINGS, ROBOT)
    assert evidence.max() >= MOST_CAUTION
    for caution in (4.0, 8.0, 11.0, 20.0):
        alarms = decisions(frames, evolve(SETTINGS, caution=caution), ROBOT).alarms
        first = faulty.seconds[np.argmax(evidence >= caution + SURE)]
        assert abs(alarms[0].begin - first) <= 0.1001
        assert alarms[0].state == "motor system fault 3"
        assert alarms[0].wheel == 2


def test_first_alarm_is_the_first_that_begins_after_a_time(faulty: Observed) -> None:
    frames = frames_of(faulty, BandSettings())
    begins = [alarm.begin for alarm in decisions(frames, COMMISSIONED, ROBOT).alarms]
    for begin in (0.0, begins[0], begins[0] + 0.01, 1e3):
        alarm = first_alarm(frames, COMMISSIONED, ROBOT, begin)
        later = [time for time in begins if time >= begin]
        assert (alarm is None) == (not later)
        if alarm is not None:
            assert alarm.begin == later[0]
            assert alarm.state == "motor system fault 3"


@pytest.mark.parametrize("kind", KINDS[2:4], ids=lambda kind: kind.name)
def test_evidence_of_a_fault_that_is_rarer_than_others(
    healthy: Observed, kind: InjectedKind
) -> None:
    frames = frames_of(injected(healthy, kind, kind.sizes[0], 1), BandSettings())
    evidence = evidence_in(frames, SETTINGS, ROBOT)
    for caution in (8.0, 11.0, 20.0, 27.0):
        alarms = decisions(frames, evolve(SETTINGS, caution=caution), ROBOT).alarms
        first = healthy.seconds[np.argmax(evidence >= caution + SURE)]
        assert alarms[0].state == "power sensor fault 2"
        assert abs(alarms[0].begin - first) <= 0.0501


@pytest.mark.parametrize("jump", [-3600, 3600], ids=["back", "ahead"])
def test_clock_that_jumps_in_a_fault_does_not_lose_it(faulty: Observed, jump: int) -> None:
    stamps = faulty.stamp_ns + np.where(faulty.seconds > 11.0, jump * 1_000_000_000, 0)
    jumped = evolve(faulty, stamp_ns=stamps)
    frames = frames_of(jumped, BandSettings())
    alarms = decisions(frames, COMMISSIONED, ROBOT).alarms
    assert {alarm.state for alarm in alarms} == {"motor system fault 3"}
    # Of the three seconds that are left of the fault.
    assert any(alarm.end - jump > 12.5 for alarm in alarms if abs(alarm.end) > 3000.0)


def test_diagnosis_restarted_in_a_fault_names_it(faulty: Observed) -> None:
    rest = faulty.without([(0.0, 10.0)])
    alarms = decisions(frames_of(rest, BandSettings()), COMMISSIONED, ROBOT).alarms
    assert [alarm.state for alarm in alarms] == ["motor system fault 3"]
    assert alarms[0].begin < 2.0


def test_ticks_without_data_in_a_fault_are_no_evidence(faulty: Observed) -> None:
    lost = (faulty.seconds > 11.0) & (faulty.seconds < 12.0)
    residual, missing = faulty.residual.copy(), faulty.missing.astype("<U32")
    residual[lost], missing[lost] = np.nan, GAP
    gappy = evolve(faulty, residual=residual, missing=missing)
    evidence = evidence_in(frames_of(gappy, BandSettings()), SETTINGS, ROBOT)
    assert evidence[lost].max() == 0.0
    assert evidence[faulty.seconds < 11.0].max() > 0.0


def test_evidence_before_the_fault_is_none(faulty: Observed) -> None:
    evidence = evidence_in(frames_of(faulty, BandSettings()), SETTINGS, ROBOT)
    assert evidence[faulty.seconds < 7.5].max() < SETTINGS.caution


def test_what_is_said_of_drives_adds_up() -> None:
    one, other = Episode("slip", None, 1.0, 2.0), Episode("unknown", None, 3.0, 4.0)
    said = [Decided(100, 10, (one,)), Decided(50, 5, (other,))]
    assert together(said) == Decided(150, 15, (one, other))
