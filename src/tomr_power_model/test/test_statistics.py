"""Robust scales and correlation times of series that are known."""

import numpy as np
import pytest

from tomr_power_model.estimation.statistics import (
    autocorrelation,
    autocorrelation_time,
    robust_scale,
)


def _process(seed: int, phi: float, count: int = 2000) -> np.ndarray:
    """First-order autoregressive noise of standard deviation 1."""
    noise = np.random.default_rng(seed).standard_normal(count) * np.sqrt(1.0 - phi**2)
    for row in range(1, count):
        noise[row] += phi * noise[row - 1]
    return noise


def test_autocorrelation_time_of_a_known_process() -> None:
    times = [autocorrelation_time([_process(seed, 0.9)]) for seed in range(12)]
    # (1 + phi) / (1 - phi) = 19 samples.
    assert np.mean(times) == pytest.approx(19.0, rel=0.2)
    assert autocorrelation_time([_process(1, 0.0)]) == pytest.approx(1.0, abs=0.3)


def test_pieces_are_not_joined() -> None:
    """Every piece begins afresh, and an offset of a whole piece is correlated throughout."""
    pieces = [np.full(50, sign) for sign in (1.0, -1.0)]
    assert autocorrelation_time(pieces) > 20.0
    assert autocorrelation_time([np.concatenate(pieces * 20)]) > 20.0
    # (1, -1, 1, -1) twice: three pairs of product -1 over four squares in each.
    alternating = np.array([1.0, -1.0, 1.0, -1.0])
    assert autocorrelation([alternating, alternating])[1] == pytest.approx(-6.0 / 8.0)


def test_correlation_is_summed_up_to_what_is_negligible() -> None:
    """Pulses 100 samples apart, each five long: triangles 1, 0.8, 0.6, 0.4, 0.2, then nothing."""
    pulses = (np.arange(1000) % 100 < 5).astype(float)
    assert autocorrelation_time([pulses], 400, 0.03) == pytest.approx(2.0 * 3.0 - 1.0)
    assert autocorrelation_time([pulses], 3, 0.03) == pytest.approx(2.0 * 2.4 - 1.0)


def test_a_robust_scale_ignores_knocks_and_blanks() -> None:
    noise = 0.3 * np.random.default_rng(2).standard_normal(5000)
    noise[::50] = 40.0
    noise[1::50] = np.nan
    assert robust_scale(noise) == pytest.approx(0.3, rel=0.06)
