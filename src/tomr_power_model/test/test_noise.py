"""What a sample weighs: on made residuals whose noise is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.linear_gaussian import AT_A_TIME
from tomr_power_model.estimation.noise import Local, _cross, noise_of

COUNT = 4000
NOTHING = np.zeros((COUNT, 1))
STILL = np.zeros(COUNT)


def _channel(kind: str = "voltage") -> SimpleNamespace:
    return SimpleNamespace(kind=kind, time=0.02 * np.arange(COUNT), quantum=0.0)


@pytest.fixture
def white() -> np.ndarray:
    return np.random.default_rng(0).standard_normal(COUNT)


def test_white_noise_weighs_by_its_size(white: np.ndarray) -> None:
    found = noise_of([_channel()], 0.5 * white, NOTHING, STILL, time_derivative=STILL)
    assert found.time[0] == pytest.approx(1.0, abs=0.1)
    assert np.median(found.weight) == pytest.approx(2.0, rel=0.05)


def test_correlated_noise_weighs_as_few_samples(white: np.ndarray) -> None:
    """n_k = 0.9 n_(k-1) + white: time (1 + 0.9) / (1 - 0.9) = 19, variance 1 / (1 - 0.81)."""
    noise = np.empty(COUNT)
    noise[0] = white[0]
    for row in range(1, COUNT):
        noise[row] = 0.9 * noise[row - 1] + white[row]
    found = noise_of([_channel()], noise, NOTHING, STILL, time_derivative=STILL)
    assert found.time[0] == pytest.approx(19.0, rel=0.25)
    usual = np.sqrt(0.19 / 19.0)
    assert np.median(found.weight) == pytest.approx(usual, rel=0.2)


def test_outliers_weigh_less(white: np.ndarray) -> None:
    """20 deviations off weigh as 4: a fifth."""
    noise = white.copy()
    noise[100] = 20.0
    weight = noise_of([_channel()], noise, NOTHING, STILL, time_derivative=STILL).weight
    assert weight[100] / np.median(weight) == pytest.approx(0.2, rel=0.1)


def test_jitter_and_noise_of_scale_are_separated_from_constant_noise(white: np.ndarray) -> None:
    phase = 2.0 * np.pi * np.arange(COUNT) / 500.0
    time_derivative, value = 10.0 * np.cos(phase), 5.0 * np.sin(phase)
    for shape in (time_derivative, value):
        noise = white * np.hypot(0.1, 0.1 * shape)
        sigma = noise_of(
            [_channel("power")], noise, NOTHING, value, time_derivative=time_derivative
        ).sigma
        np.testing.assert_allclose(sigma[::50], np.hypot(0.1, 0.1 * shape)[::50], rtol=0.3)


def test_what_can_be_explained_is_no_noise(white: np.ndarray) -> None:
    column = np.sign(np.sin(0.01 * np.arange(COUNT)))
    residual = 3.0 * column + 0.2 * white
    sigma = noise_of([_channel()], residual, column[:, None], STILL, time_derivative=STILL).sigma
    assert np.median(sigma) == pytest.approx(0.2, rel=0.1)


def test_what_can_be_explained_in_some_rows_only_is_no_noise_there(white: np.ndarray) -> None:
    """Jacobian of two halves, beside one of all rows that they overlap with."""
    whole = np.sign(np.sin(0.01 * np.arange(COUNT)))
    first, last = np.arange(COUNT // 2), np.arange(COUNT // 2, COUNT)
    part = np.cos(0.02 * np.arange(COUNT))
    residual = 2.0 * whole + np.where(np.arange(COUNT) < COUNT // 2, 3.0, -1.0) * part
    local = [Local(rows, part[rows, None]) for rows in (first, last)]
    sigma = noise_of(
        [_channel()],
        residual + 0.2 * white,
        whole[:, None],
        STILL,
        time_derivative=STILL,
        local=local,
    ).sigma
    assert np.median(sigma) == pytest.approx(0.2, rel=0.1)


def test_a_channel_that_mostly_stands_still_is_not_taken_to_be_exact(white: np.ndarray) -> None:
    """Without noise at rest a sample there would weigh all."""
    value = np.where(np.arange(COUNT) % 1000 < 500, 0.0, 8.0)
    noise = 0.02 * white * (value > 0.0)
    sigma = noise_of([_channel("speed")], noise, NOTHING, value, time_derivative=STILL).sigma
    assert sigma.min() > 0.3 * 4e-3 * value.std()


def test_a_coarse_channel_is_no_more_exact_than_its_quantum(white: np.ndarray) -> None:
    coarse = SimpleNamespace(kind="current", time=0.02 * np.arange(COUNT), quantum=0.5)
    sigma = noise_of([coarse], 0.01 * white, NOTHING, STILL, time_derivative=STILL).sigma
    np.testing.assert_allclose(sigma, 0.5 / np.sqrt(12.0))


def test_noise_of_a_voltage_does_not_grow_with_it(white: np.ndarray) -> None:
    value = 5.0 * np.sin(2.0 * np.pi * np.arange(COUNT) / 500.0)
    noise = white * np.hypot(0.1, 0.1 * value)
    sigma = noise_of([_channel("voltage")], noise, NOTHING, value, time_derivative=STILL).sigma
    assert np.ptp(sigma) == pytest.approx(0.0, abs=1e-12)


def test_a_channel_that_repeats_a_value_is_no_more_exact_than_a_sensor() -> None:
    value = np.full(COUNT, 24.0)
    sigma = noise_of([_channel()], STILL, value[:, None], value, time_derivative=STILL).sigma
    np.testing.assert_allclose(sigma, 24e-6)


def test_products_of_some_rows_are_those_of_all_at_once() -> None:
    dice = np.random.default_rng(6)
    rows = np.arange(3, 3 + 2 * AT_A_TIME + 7)
    columns = dice.standard_normal((len(rows) + 5, 4)).astype(np.float32)
    chosen, other = np.array([0, 2, 3]), dice.standard_normal((len(rows), 2))
    found = _cross(columns, chosen, rows, other)
    assert found == pytest.approx(columns[rows][:, chosen].T @ other)
