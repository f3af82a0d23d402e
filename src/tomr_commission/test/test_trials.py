"""Faults put into recordings, and the floors that trials amount to."""

from collections.abc import Callable

import numpy as np
import pytest

from tomr_commission.evidence import Episode
from tomr_commission.injected import KINDS, injected, try_injected
from tomr_commission.observed import Observed
from tomr_commission.trials import Trial, floors_of, smallest_found
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings

BY_NAME = {kind.name: kind for kind in KINDS}


@pytest.mark.parametrize("limit", [0.0, 0.15, 0.3, 0.7, 2.0])
def test_bisection_finds_what_a_walk_down_finds(limit: float) -> None:
    sizes = (1.0, 0.6, 0.4, 0.2, 0.1)

    def attempt(size: float) -> Trial:
        return Trial("fault", size, "", 0, 0.5 if size >= limit else None, "slip")

    trials = smallest_found(sizes, attempt)
    (floor,) = floors_of(trials)
    walked = [size for size in sizes if size >= limit]
    assert floor.everywhere == (min(walked) if walked else None)
    assert len(trials) <= 3


def test_delay_counts_from_the_beginning_of_the_fault() -> None:
    alarm = Episode("slip", None, 4.5, 9.0)
    assert Trial.of("f", 0.2, "W", wheel=1, begin=3.0, alarm=alarm) == Trial(
        "f", 0.2, "W", 1, 1.5, "slip"
    )
    nothing = Trial.of("f", 0.2, "W", wheel=1, begin=3.0, alarm=None)
    assert nothing == Trial("f", 0.2, "W", 1, None, "")


def test_floor_everywhere_is_that_of_the_worst_wheel() -> None:
    found = [Trial("f", 0.2, "W", 0, 0.3, "a"), Trial("f", 0.5, "W", 1, 0.5, "b")]
    assert floors_of(found)[0].everywhere == 0.5
    assert floors_of(found)[0].somewhere == 0.2
    (floor,) = floors_of([*found, Trial("f", 1.0, "W", 2, None, "")])
    assert floor.everywhere is None
    assert floor.somewhere == 0.2


def test_floors_in_words() -> None:
    found = [Trial("f", 0.5, "W", 0, 0.5, "b"), Trial("f", 0.2, "W", 1, 0.3, "a")]
    (floor,) = floors_of(found)
    assert (floor.words, floor.best) == ("0.5 W", "0.2 W, wheel 2")
    (floor,) = floors_of([*found, Trial("f", 1.0, "W", 2, None, "")])
    assert (floor.words, floor.best) == ("not found at every wheel up to 1 W", "0.2 W, wheel 2")
    (floor,) = floors_of([Trial("f", 1.0, "W", 0, None, "")])
    assert (floor.words, floor.best) == ("not found up to 1 W", "not found")
    (floor,) = floors_of([Trial("f", 1.0, "", wheel, 0.1, "a") for wheel in range(3)])
    assert (floor.words, floor.best) == ("found", "found")


def test_scaled_motor_shows_in_its_own_and_the_total(steady: Callable[..., Observed]) -> None:
    drive = steady(sigma=0.0, ticks=300)
    change = injected(drive, BY_NAME["motor draws more"], 0.5, 1).residual - drive.residual
    # Half of 4 W, from tick 100 on.
    expected = np.zeros((300, 10))
    expected[100:, [0, 2, 8]] = 2.0
    assert np.allclose(change, expected)


def test_frozen_sensor_reports_what_it_reported_first(steady: Callable[..., Observed]) -> None:
    drive = steady(sigma=0.3, ticks=300)
    after = injected(drive, BY_NAME["power sensor frozen"], 1.0, 0)
    measured = (after.residual + after.modelled)[100:, 1]
    assert np.allclose(measured, (drive.residual + drive.modelled)[100, 1])
    assert (after.residual[:, 0] == drive.residual[:, 0]).all()


def test_dead_sensor_is_found_in_a_real_drive(healthy: Observed) -> None:
    kinds = [BY_NAME["power sensor biased"]]
    trials = try_injected(healthy, BandSettings(), ClassifierSettings(), kinds, "reference")
    (floor,) = floors_of(trials)
    assert floor.everywhere is not None
    assert floor.everywhere <= 20.0
