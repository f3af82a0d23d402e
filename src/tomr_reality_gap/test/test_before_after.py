"""Scores and maps before and after, and where a change shows, on numbers worked by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.explanation import Comparison
from tomr_reality_gap.mismatch.compare import comparison as compared
from tomr_reality_gap.mismatch.compare import score_of
from tomr_reality_gap.mismatch.locate import located, maps_of

from .conftest import comparison


def _channel(kind: str, value: list[float]) -> Channel:
    time = np.arange(1.0, len(value) + 1.0)
    return Channel(kind, kind, 0, "W", time, np.full(len(value), 0.005), np.array(value))  # type: ignore[arg-type]


def _compared(channels: list[Channel], before: list[float], after: list[float]) -> Comparison:
    made = comparison("made", True, 1)
    return evolve(
        made,
        channels=tuple(channels),
        before=tuple(
            np.full(len(item.time), off) for item, off in zip(channels, before, strict=True)
        ),
        after=tuple(item.value - off for item, off in zip(channels, after, strict=True)),
    )


def test_score_by_hand() -> None:
    """Values 1, 3 about 2: deviation 1. Simulated 2 throughout: rms 1; then off by 0.1."""
    power = _channel("power", [1.0, 3.0])
    score = score_of([_compared([power], [2.0], [0.1])])
    assert score is not None
    assert (score.nrmse_before, score.nrmse_after) == pytest.approx((1.0, 0.1))
    assert (score.accuracy_before, score.accuracy_after) == pytest.approx((0.5, 0.95))


def test_score_is_of_the_motors_and_pooled_over_recordings() -> None:
    """The total counts where no motor is measured; each channel's spread is about its own mean."""
    power, total = _channel("power", [1.0, 3.0]), _channel("total", [10.0, 30.0])
    alone = score_of([_compared([total], [20.0], [1.0])])
    assert alone is not None
    assert alone.nrmse_after == pytest.approx(0.1)
    other = evolve(power, value=power.value + 100.0)
    both = score_of(
        [
            _compared([power, total], [2.0, 0.0], [0.3, 9.0]),
            _compared([other], [102.0], [0.1]),
        ]
    )
    assert both is not None
    assert both.nrmse_before == pytest.approx(1.0)
    assert both.nrmse_after == pytest.approx(np.sqrt((0.3**2 + 0.1**2) / 2.0))
    assert score_of([]) is None


def test_what_is_left_is_held_against_the_noise_and_not_against_itself() -> None:
    """Off by 0.5 W with a noise of 0.1 W; of a channel that was not fitted no noise is known."""
    power, other = _channel("power", [1.0, 3.0]), _channel("yaw", [0.3, 0.3])
    simulation = SimpleNamespace(
        channels=(power, other),
        recorded=SimpleNamespace(name="made"),
        timeline=SimpleNamespace(middle=power.time),
    )
    values = np.array([[0.0, 0.0, 0.0, 0.0], [0.5, 2.5, 0.1, 0.1]])
    run = SimpleNamespace(speed=np.zeros((2, 3)))
    found = compared(simulation, values, run, is_held_out=True, noise={"power": 0.1})  # type: ignore[arg-type]
    assert found.sigma == pytest.approx((0.1, 0.2 * 1.4826), rel=1e-3)


def _power(count: int) -> Channel:
    value = np.zeros(count)
    return Channel("wheel_1/power", "power", 0, "W", 0.5 + np.arange(count), value, value)


def test_regime_is_the_narrowest_range_that_holds_the_energy() -> None:
    """Ten samples of one second; four of them change, at speeds from 1 to 1.6 rad/s."""
    speed = np.array([0.0, 0.2, 1.0, 1.2, 1.4, 1.6, 3.0, 4.0, 5.0, 6.0])
    change = np.where((speed >= 1.0) & (speed < 2.0), 1.0, 0.0)
    found = located([_power(10)], change, np.ones(10), 0.5, variables={"|omega| [rad/s]": speed})
    assert found.regime == "1 < |omega| < 1.6 rad/s"
    even = located(
        [_power(10)], np.ones(10), np.ones(10), 0.5, variables={"|omega| [rad/s]": speed}
    )
    assert even.regime == "throughout"


def test_energy_counts_by_the_weight_of_its_channel() -> None:
    """The same change where noise is ten times smaller shows a hundred times more."""
    channels = [_power(10), evolve(_power(10), name="battery_state", kind="total")]
    weight = np.repeat([10.0, 1.0], 10)
    found = located(channels, np.ones(20), weight, 0.5, variables={})
    assert found.channels["wheel_1/power"] == pytest.approx(100.0 / 101.0)


def test_intervals_are_the_few_that_hold_half_of_the_energy() -> None:
    """A burst of 3 s in 60 s holds four fifths; the rest is spread thinly."""
    channel = evolve(_power(600), time=0.1 * np.arange(600) + 0.05)
    burst = (channel.time > 30.0) & (channel.time < 33.0)
    change = np.where(burst, 1.0, np.sqrt(0.25 * burst.sum() / (~burst).sum()))
    found = located([channel], change, np.ones(600), 0.5, variables={})
    assert all(30.0 <= start < end <= 33.0 for start, end in found.intervals)
    length = sum(end - start for start, end in found.intervals)
    assert length == pytest.approx(0.5 / 0.8 * 3.0, abs=0.51)


def test_intervals_are_at_most_five_and_in_order() -> None:
    channel = evolve(_power(600), time=0.1 * np.arange(600) + 0.05)
    change = np.where(np.floor(channel.time) % 4 == 0, 1.0 + 0.01 * channel.time, 0.0)
    found = located([channel], change, np.ones(600), 0.5, variables={}).intervals
    assert len(found) == 5
    assert list(found) == sorted(found)
    assert found[-1][1] > 56.0  # the strongest are the last


def test_maps_show_before_and_after_by_bin() -> None:
    """Speeds 0 to 9: before, residuals of 3 sigma above 5 rad/s; after, 1 sigma everywhere."""
    speed = np.linspace(0.0, 9.0, 1000)
    before, after = np.where(speed > 4.5, 3.0, 1.0), np.ones(1000)
    (found,) = maps_of(
        [_power(1000)],
        0.5 * before,
        0.5 * after,
        np.full(1000, 0.5),
        variables={"speed [rad/s]": speed},
    )
    np.testing.assert_allclose(found.before[0], [1.0] * 6 + [9.0] * 6, atol=0.1)
    np.testing.assert_allclose(found.after[0], np.ones(12))


def test_maps_take_a_channel_of_all_recordings_together() -> None:
    """The first shows a residual where it is slow, the second one where it is fast."""
    speed = np.linspace(0.0, 9.0, 1000)
    slow, fast = np.where(speed > 4.5, 1.0, 3.0), np.where(speed > 4.5, 3.0, 1.0)
    (found,) = maps_of(
        [_power(1000), _power(1000)],
        np.concatenate([slow, fast]),
        np.ones(2000),
        np.ones(2000),
        variables={"speed [rad/s]": np.tile(speed, 2)},
    )
    assert found.channels == ("wheel_1/power",)
    np.testing.assert_allclose(found.before[0], 5.0, atol=0.2)
