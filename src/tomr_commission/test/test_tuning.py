"""Bands are made wider while shoves would raise too many alarms."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock, patch

import numpy as np

from tomr_commission.commission import _Work
from tomr_commission.observed import Observed
from tomr_commission.rehearsal import Rehearsal, Shoved
from tomr_commission.request import CommissionRequest
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings


def work_on(request: CommissionRequest) -> _Work:
    return _Work(request, lambda stage, part: None, Mock(), "", Mock(), (), ())


def test_healthy_driving_is_judged_as_once_commissioned() -> None:
    settings = work_on(CommissionRequest("reference", (), Path())).classifier(None)
    assert settings.commissioned
    assert settings.caution == ClassifierSettings().caution


def test_bands_widen_until_shoves_pass(steady: Callable[..., Observed]) -> None:
    request = CommissionRequest("reference", (), Path())
    work = work_on(request)
    narrow = np.random.default_rng(1).exponential(9.0, 300)  # decades

    def rehearsed(
        self: object,
        described: object,
        bands: BandSettings,
        settings: ClassifierSettings,
        plan: Rehearsal,
    ) -> Shoved:
        return Shoved(tuple(narrow) if bands.relative < 0.15 else (0.0,) * 300, 1.0)

    with patch.object(_Work, "rehearsed", rehearsed):
        tuned = work.tuned(None, [steady(sigma=0.1, ticks=2500)], ClassifierSettings(), Rehearsal())
    # 8 % of the 4 W hold 99.9 %: times 1.5 they are below 15 %, times 1.7 once more above.
    assert tuned.margin == request.bands.margin * request.bands.wider
    assert tuned.bands.relative > 0.15
    assert tuned.level.needed < request.bands.most_caution


def test_few_shoves_that_hint_at_too_much_are_followed_by_the_others(
    steady: Callable[..., Observed],
) -> None:
    request = CommissionRequest("reference", (), Path())
    needed = iter((1.2, 0.9))  # of the most: after the first shoves, after all
    level = Mock(side_effect=lambda *_: Mock(needed=next(needed) * request.bands.most_caution))
    seen = [steady(sigma=0.1, ticks=2500)]
    with (
        patch("tomr_commission.commission._level", level),
        patch.object(_Work, "rehearsed", return_value=Shoved((1.0,), 0.5)),
    ):
        tuned = work_on(request).tuned(None, seen, ClassifierSettings(), Rehearsal())
    assert tuned.margin == request.bands.margin
    assert tuned.shoved == Shoved((1.0, 1.0), 1.0)
