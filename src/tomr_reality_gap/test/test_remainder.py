"""What a term predicts of blocks that it was not fitted to, on residuals made by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.fit.remainder import Prediction, Remainder, predicted

SAMPLES, BLOCKS = 4000, 8
LABELS = np.tile(np.arange(SAMPLES // 2) * 2 * BLOCKS // SAMPLES, 2)  # of two channels alike


def _share(residual: np.ndarray, *columns: np.ndarray) -> float:
    return _predicted(residual, *columns).share


def _predicted(
    residual: np.ndarray, *columns: np.ndarray, base: np.ndarray | None = None
) -> Prediction:
    """Some columns, beside one of what is not exactly known."""
    half = SimpleNamespace(time=np.arange(SAMPLES // 2))
    rest = Remainder(
        SimpleNamespace(channels=(half, half)),  # type: ignore[arg-type]
        residual,
        np.empty((SAMPLES, 0)) if base is None else base[:, None],
        np.ones(SAMPLES),
    )
    return predicted(rest, [np.stack(columns, axis=1)], LABELS)


def _made() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    return random.standard_normal(SAMPLES), random.standard_normal(SAMPLES)


def test_a_column_predicts_its_part_of_what_is_left_beyond_noise() -> None:
    """Two columns of the same size, of which one is tried."""
    noise, column = _made()
    other = np.random.default_rng(5).standard_normal(SAMPLES)
    assert _share(2.0 * column + noise, column) == pytest.approx(1.0, abs=0.02)
    assert _share(2.0 * column + 2.0 * other + noise, column) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("scale", [1.0, 0.5, 0.0])
def test_of_noise_alone_no_share_is_stated(scale: float) -> None:
    """Nor where its size was taken for larger than it is."""
    noise, column = _made()
    assert math.isnan(_share(scale * noise, column))


def test_a_channel_known_better_than_its_noise_hides_nothing_of_another() -> None:
    """The first half hardly differs at all: less is left on the whole than noise would."""
    noise, column = _made()
    known = np.arange(SAMPLES) < SAMPLES // 2
    residual = np.where(known, 0.01 * noise, noise + 0.5 * column)
    assert residual @ residual < SAMPLES
    assert _share(residual, np.where(known, 0.0, column)) == pytest.approx(1.0, abs=0.05)


def test_a_share_is_bounded_either_way() -> None:
    """Nothing left once predicted, noise included; a column that is far larger in one block."""
    _, column = _made()
    assert _share(2.0 * column, column) == 1.0
    assert _share(2.0 * column, np.where(LABELS == 3, 30.0, 1.0) * column) == -1.0


def test_what_other_blocks_hardly_tell_does_not_spoil_a_block() -> None:
    """A column that is large in one block alone, and elsewhere follows what is none of it."""
    noise, column = _made()
    elsewhere = np.where(LABELS == 3, 3.0 * column, 0.03 * noise)
    found = _predicted(2.0 * column + noise, column, elsewhere)
    assert found.share > 0.9
    assert found.size < 0.5
    assert _predicted(2.0 * column + noise, column).size == 1.0
    # What is not exactly known is as free as it was.
    base = 0.1 * np.random.default_rng(6).standard_normal(SAMPLES)
    assert _predicted(2.0 * column + noise + 10.0 * base, column, elsewhere, base=base).share > 0.9


def test_what_a_coarse_sensor_rounds_off_is_noise() -> None:
    """1.0 W, read as 0 by one of 2.4 W steps: what is left is one of its standard deviations."""
    time, value = 0.02 * np.arange(200), np.zeros(200)
    exact = Channel("wheel_1/power", "power", 0, "W", time, time, value)
    for channel, least in ((exact, 1e9), (evolve(exact, quantum=2.4), 1.0)):
        dataset = SimpleNamespace(channels=(channel,), value=value)
        rest = Remainder.of(dataset, np.ones(200), np.zeros((200, 1)))  # type: ignore[arg-type]
        left = np.abs(rest.residual).max()
        assert left >= least if channel is exact else left == pytest.approx(least)


def test_what_a_term_is_known_to_add_is_no_noise() -> None:
    random = np.random.default_rng(11)
    change = 30.0 * random.standard_normal(4000)
    measured = change + random.standard_normal(4000)
    channel = SimpleNamespace(time=np.arange(4000.0), value=measured, rounding=lambda _: 0.0)
    dataset = SimpleNamespace(value=measured, channels=(channel,))
    none = np.zeros(4000)
    alone, beside = (
        Remainder.of(dataset, none, none[:, None], known)  # type: ignore[arg-type]
        for known in (None, change)
    )
    assert alone.weight[0] == pytest.approx(1.0 / 30.0, rel=0.1)
    assert beside.weight[0] == pytest.approx(1.0, rel=0.1)
    assert beside.explained(change) == pytest.approx(1.0 - 1.0 / 901.0, rel=1e-3)
