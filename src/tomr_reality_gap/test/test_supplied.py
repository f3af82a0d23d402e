"""Whether the supply gives what drivers seem to draw, on channels made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_reality_gap.fit.remainder import Remainder
from tomr_reality_gap.fit.supplied import is_supplied

COUNT, SLOTS = 1200, 24
NOISE = 1.0  # of every channel, from one sample to the next
SLOT = np.repeat(np.eye(SLOTS), COUNT // SLOTS, axis=0)  # (n, slots): when
SLOW = 3.0 * np.random.default_rng(5).standard_normal((3, SLOTS))  # of each motor, slot by slot


def _rest(
    motors: np.ndarray, total: np.ndarray, kinds: str = "mmmt", noise: float = NOISE
) -> tuple[Remainder, list[np.ndarray]]:
    """What is left of three motors and of the total, and columns of drivers that draw."""
    names, random = {"m": "power", "t": "total"}, np.random.default_rng(6)
    channels = [SimpleNamespace(kind=names[kind], time=np.arange(COUNT)) for kind in kinds]
    left = [*motors, total][: len(kinds)]
    residual = np.concatenate(left) + NOISE * random.standard_normal(COUNT * len(kinds))
    residual[3 * COUNT :] += noise * random.standard_normal(COUNT * (len(kinds) - 3))
    weight = np.ones(len(residual))
    weight[3 * COUNT :] = 1.0 / np.hypot(NOISE, noise)
    columns = []
    for wheel in range(3):
        parts = [SLOT if place in (wheel, 3) else 0.0 * SLOT for place in range(len(kinds))]
        columns.append(np.concatenate(parts) * weight[:, None])
    dataset = SimpleNamespace(channels=channels)
    base = 1e-3 * random.standard_normal((len(residual), 1))
    return Remainder(dataset, residual * weight, base, weight), columns  # type: ignore[arg-type]


DRAWN = SLOW @ SLOT.T  # (3, n)


def test_what_drivers_draw_the_total_shows() -> None:
    assert is_supplied(*_rest(DRAWN, DRAWN.sum(axis=0)))


def test_what_sensors_make_up_it_does_not() -> None:
    assert not is_supplied(*_rest(DRAWN, np.zeros(COUNT)))


@pytest.mark.parametrize(("share", "expected"), [(0.2, False), (0.8, True)])
def test_what_shows_for_the_most_part_is_drawn(share: float, expected: bool) -> None:
    assert is_supplied(*_rest(DRAWN, share * DRAWN.sum(axis=0))) is expected


def test_a_total_that_is_slow_noise_itself_bears_nothing_out() -> None:
    """Its noise must not be fitted with the motors'."""
    other = 5.0 * np.random.default_rng(7).standard_normal(SLOTS) @ SLOT.T
    assert not is_supplied(*_rest(DRAWN, other - other.mean()))


def test_without_a_total_or_with_a_coarse_one_nobody_can_tell() -> None:
    assert is_supplied(*_rest(DRAWN, np.zeros(COUNT), kinds="mmm"))
    assert is_supplied(*_rest(DRAWN, -0.5 * DRAWN.sum(axis=0), noise=300.0))
    assert not is_supplied(*_rest(DRAWN, -0.5 * DRAWN.sum(axis=0)))
