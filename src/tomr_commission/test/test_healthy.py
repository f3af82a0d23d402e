"""Small faults are looked for where healthy driving shows none."""

import numpy as np
from attrs import evolve

from tomr_commission.healthy import healthy as judged
from tomr_commission.injected import KINDS, injected
from tomr_commission.observed import Observed
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings

ROBOT = "reference"
SETTINGS = ClassifierSettings(commissioned="to be")
BLOCK = 2.0  # s
SCALED = next(kind for kind in KINDS if kind.name == "power sensor scaled")


def test_small_faults_are_looked_for_where_healthy_driving_shows_none(healthy: Observed) -> None:
    found = judged([healthy, healthy], BandSettings(), SETTINGS, ROBOT, BLOCK)
    assert found.settings == evolve(SETTINGS, small_faults=True)
    assert found.gathered < 6.0
    assert np.isclose(found.hours, 2.0 * healthy.hours)
    alone = judged([healthy], BandSettings(), SETTINGS, ROBOT, BLOCK)
    assert found.peaks == 2 * alone.peaks


def test_small_faults_are_not_looked_for_where_healthy_driving_looks_like_one(
    healthy: Observed,
) -> None:
    """As of a robot one of whose motors draws three tenths less at times, for no fault."""
    strange = injected(healthy, SCALED, -0.3, 1)
    bands = BandSettings(power=2.0)
    found = judged([strange, healthy], bands, SETTINGS, ROBOT, BLOCK)
    assert found.gathered > 6.0
    assert found.settings == evolve(SETTINGS, small_faults=False)
    plain = judged([healthy], bands, SETTINGS, ROBOT, BLOCK)
    assert plain.settings.small_faults
    assert len(found.peaks) == 2 * len(plain.peaks)
