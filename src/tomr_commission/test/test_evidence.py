"""Evidence is the caution that a classifier would need not to name a fault."""

import numpy as np
from attrs import evolve

from tomr_commission.evidence import MOST_CAUTION, SURE, decisions, evidence_in
from tomr_commission.observed import Observed, frames_of
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings

SETTINGS = ClassifierSettings()


def test_healthy_driving_has_no_evidence_and_no_alarm(healthy: Observed) -> None:
    frames = frames_of(healthy, BandSettings())
    assert evidence_in(frames, SETTINGS).max() < SETTINGS.caution
    assert decisions(frames, SETTINGS).alarms == ()


def test_alarm_comes_where_evidence_passes_the_caution(faulty: Observed) -> None:
    frames = frames_of(faulty, BandSettings())
    evidence = evidence_in(frames, SETTINGS)
    assert evidence.max() >= MOST_CAUTION
    for caution in (8.0, 11.0, 20.0):
        alarms = decisions(frames, evolve(SETTINGS, caution=caution)).alarms
        first = faulty.seconds[np.argmax(evidence >= caution + SURE)]
        assert abs(alarms[0].begin - first) <= 0.1001
        assert alarms[0].state == "motor system fault 3"
        assert alarms[0].wheel == 2


def test_evidence_before_the_fault_is_none(faulty: Observed) -> None:
    evidence = evidence_in(frames_of(faulty, BandSettings()), SETTINGS)
    assert evidence[faulty.seconds < 7.5].max() < SETTINGS.caution
