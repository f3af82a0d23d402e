"""How well values of findings are known, on recordings made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.parameter import Parameter
from tomr_reality_gap.fit.uncertainty import blocks_of, own_sigma

STD = 0.5  # N m, prior standard deviation of the one parameter


def _dataset(recordings: int, seconds: float = 30.0, step: float = 0.02) -> SimpleNamespace:
    """Two channels each, the second of half the rate."""
    time = np.arange(0.5 * step, seconds, step)
    pair = tuple(SimpleNamespace(time=item) for item in (time, time[::2]))
    items = tuple(SimpleNamespace(channels=pair) for _ in range(recordings))
    channels = pair * recordings
    value = np.zeros(sum(len(item.time) for item in channels))
    return SimpleNamespace(simulations=items, channels=channels, value=value)


def _sigma(
    dataset: SimpleNamespace,
    residual: np.ndarray,
    column: np.ndarray,
    weight: np.ndarray | None = None,
) -> float:
    information = 1.0 + float(column @ column)
    best = SimpleNamespace(
        value=dataset.value - residual,
        own_sigma=np.array([STD / np.sqrt(information)]),
        model=SimpleNamespace(own=(Parameter("torque", ("made",), "N m", STD),)),
    )
    noise = SimpleNamespace(weight=np.ones(len(residual)) if weight is None else weight)
    found = SimpleNamespace(best=best, noise=noise)
    jacobian = SimpleNamespace(matrix=column[:, None])
    return float(own_sigma(dataset, found, jacobian)[0])  # type: ignore[arg-type]


def test_where_only_noise_is_left_its_interval_is_that_of_the_noise() -> None:
    dataset = _dataset(1)
    random = np.random.default_rng(1)
    noise, column = random.standard_normal((2, len(dataset.value)))
    expected = STD / np.sqrt(1.0 + float(column @ column))
    noise -= column * (noise @ column) / (column @ column)
    assert _sigma(dataset, 0.1 * noise, column) == pytest.approx(expected)
    assert _sigma(dataset, noise, column) == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("recordings", [12, 8])
def test_what_each_drive_says_otherwise_makes_it_as_uncertain_as_their_mean_is(
    recordings: int,
) -> None:
    """Every drive has a value of its own, 0.2 N m apart: their mean is known to 0.2 / sqrt(n)."""
    dataset = _dataset(recordings)
    random = np.random.default_rng(2)
    rows = len(dataset.value) // recordings
    own = random.standard_normal(recordings)
    own = 0.2 / STD * (own - own.mean()) / own.std(ddof=1)
    column = random.choice([-10.0, 10.0], rows * recordings)
    sigma = _sigma(dataset, column * own.repeat(rows), column)
    factor = {12: 2.201, 8: 2.365}[recordings] / 1.96  # Student, of so many drives
    assert sigma == pytest.approx(factor * 0.2 / np.sqrt(recordings), rel=0.02)


def test_samples_weigh_by_their_own_noise() -> None:
    """In units of each sample's noise it is all the same."""
    dataset = _dataset(8)
    random = np.random.default_rng(4)
    column = random.choice([-10.0, 10.0], len(dataset.value))
    residual = 0.3 * column + random.standard_normal(len(column))
    weight = random.uniform(0.5, 2.0, len(column))
    plain = _sigma(dataset, residual, column)
    # The noise's own share, which `_sigma` makes for weights of 1, is far below.
    weighed = _sigma(dataset, residual / weight, column / weight, weight)
    assert weighed == pytest.approx(plain, rel=1e-6)


def test_blocks_are_as_long_as_what_is_left_is_correlated_and_no_fewer_than_twelve() -> None:
    dataset = _dataset(2)
    white = np.random.default_rng(3).standard_normal(len(dataset.value))
    slow = np.concatenate([np.sin(0.5 * item.time) for item in dataset.channels])
    for residual, count in ((white, 60), (slow, 12)):
        block = blocks_of(dataset, residual)  # type: ignore[arg-type]
        assert block.max() + 1 == pytest.approx(count, abs=2)
        ends = np.cumsum([len(item.time) for item in dataset.channels])
        first, second = block[: ends[0]], block[ends[0] : ends[1]]
        # Both channels of a moment are in one block; no block reaches into another recording.
        np.testing.assert_array_equal(first[::2], second)
        assert set(block[: ends[1]]).isdisjoint(block[ends[1] :])


def test_of_many_recordings_each_is_a_block() -> None:
    dataset = _dataset(8)
    block = blocks_of(dataset, np.ones(len(dataset.value)))  # type: ignore[arg-type]
    rows = len(dataset.value) // 8
    np.testing.assert_array_equal(block, np.arange(8).repeat(rows))
