"""The rules of a verdict, on numbers made by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.analysis import residuals_of
from tomr_reality_gap.rules import (
    Residuals,
    confidence_of,
    energy_shares,
    estimate_of,
    is_doubted,
    is_rival,
    is_unmodelled,
    unexplained,
)

COUNT = 3000


def _channel(before: float, after: float, is_drawn: bool = True) -> Residuals:
    """White noise of 0.1 about offsets."""
    noise = 0.1 * np.random.default_rng(1).standard_normal(COUNT)
    return Residuals(before + noise, after + noise, 1.0, is_drawn)


def test_an_interval_holds_noise_simulator_and_what_the_simulation_shows() -> None:
    found = estimate_of(0.5, 0.3, offset=20.0, baseline=0.0)
    assert found.high - found.value == pytest.approx(1.96 * 0.5)  # 3, 4, 5 with 2 % of 20
    found = estimate_of(0.5, 0.3, offset=0.0, baseline=0.8)
    assert found.value - found.low == pytest.approx(1.96 * 0.5)


def test_what_is_not_named_may_move_a_value_by_so_much() -> None:
    found = estimate_of(0.5, 0.3, offset=0.0, shift=1.96 * 0.4)
    assert found.high - found.value == pytest.approx(1.96 * 0.5)


def test_an_interval_ends_at_the_bounds_and_an_angle_turns() -> None:
    found = estimate_of(0.1, 1.0, offset=0.1, bounds=(0.0, 1.5))
    assert (found.low, found.high) == (0.0, 1.5)
    assert estimate_of(math.pi + 0.1, 0.1, offset=0.0, unit="rad").value < 0.0


def test_rivals_are_what_comes_within_five_of_log_evidence() -> None:
    assert [is_rival(odds) for odds in (1.0, -4.9, -5.1)] == [True, True, False]


def test_confidence_is_the_tempered_odds_of_a_finding_and_its_rivals() -> None:
    assert confidence_of([]) == pytest.approx(0.97)
    near, rest = 1.0 + math.exp(-1.0), math.exp(-4.0)
    assert confidence_of([-3.0, -12.0]) == pytest.approx(0.97 * near / (near + rest))
    assert confidence_of([-1e9]) == pytest.approx(0.97)


@pytest.mark.parametrize(
    ("evidence", "named", "cost", "expected"),
    [(59.0, 0.0, 20.0, False), (61.0, 0.0, 20.0, True), (90.0, 0.0, 100.0, False),
     (119.0, 1000.0, 20.0, False), (121.0, 1000.0, 20.0, True)],
)  # fmt: skip
def test_what_has_no_name_must_bring_more_than_a_name(
    evidence: float, named: float, cost: float, expected: bool
) -> None:
    assert is_unmodelled(evidence, named, cost) is expected


def test_names_that_leave_much_are_doubted_and_a_small_rest_casts_no_doubt() -> None:
    """Small against the noise, or against what was explained."""
    assert is_doubted(0.5, 2.0, has_findings=True)
    assert not is_doubted(0.5, 0.8, has_findings=True)
    assert not is_doubted(0.2, 5.0, has_findings=True)


def test_slow_noise_is_a_match_and_much_more_is_none() -> None:
    assert not is_doubted(0.9, 2.0, has_findings=False)
    assert is_doubted(0.9, 50.0, has_findings=False)


def test_findings_share_what_they_explain_by_what_is_lost_without_them() -> None:
    """Three parts to one of what is not left: with that they add up to all."""
    assert energy_shares([600.0, 200.0], 0.2) == pytest.approx([0.6, 0.2])
    assert energy_shares([600.0, -1.0], 0.5) == pytest.approx([0.5, 0.0])
    assert energy_shares([], 0.1) == []


def test_what_is_left_counts_beyond_noise_and_a_part_of_the_spread() -> None:
    """Noise 0.1 and 3 % of 1: what is 1.0 off is 1 / 0.0109 = 92 times that."""
    share, size = unexplained([_channel(1.0, 1.0)])
    assert share == pytest.approx(1.0)
    assert size == pytest.approx(92.0, rel=0.05)
    share, size = unexplained([_channel(1.0, 0.0)])
    assert share < 0.01
    assert size < 0.1
    assert unexplained([_channel(0.0, 0.0)])[0] <= 1.0
    assert unexplained([]) == (0.0, 0.0)


def test_speeds_count_for_the_share_only() -> None:
    share, size = unexplained([_channel(1.0, 0.0), _channel(1.0, 1.0, is_drawn=False)])
    assert share == pytest.approx(0.5, abs=0.02)
    assert size < 0.1


@pytest.mark.parametrize("value", [1.2, 3.4, 5.0])
def test_what_a_coarse_sensor_rounds_off_is_nothing_that_is_left(value: float) -> None:
    """Levels 2.4 apart, without and with some noise: a value between two stays with one of them."""
    random = np.random.default_rng(2)
    for noise in (0.0, 0.7):
        shown = 2.4 * np.round((value + noise * random.standard_normal(COUNT)) / 2.4)
        off = (value - 2.4 * round(value / 2.4)) ** 2
        left = shown - value
        assert unexplained([Residuals(left, left, 3.0, True, 2.4, off)])[1] < 0.5
        assert unexplained([Residuals(left + 6.0, left + 6.0, 3.0, True, 2.4, off)])[1] > 4.0


def test_what_a_model_leaves_of_a_coarse_channel_knows_how_coarse_it_is() -> None:
    """1.0 and 1.4 W, shown as 0 and 2.4: by the explained values, not by those as described."""
    time, value = np.arange(4.0), np.array([0.0, 0.0, 2.4, 2.4])
    channel = Channel("wheel_1/power", "power", 0, "W", time, time, value, 2.4)
    after = np.array([1.0, 1.0, 1.4, 1.4])
    (left,) = residuals_of(SimpleNamespace(channels=(channel,), value=value), 0.0 * after, after)  # type: ignore[arg-type]
    assert (left.quantum, left.rounding, left.is_drawn) == (2.4, pytest.approx(1.0), True)
