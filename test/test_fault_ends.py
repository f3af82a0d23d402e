"""Normal is named soon after a fault has ended: a moment of a long drive in which it was not."""
# ruff: noqa: E402 (bench/ is no package)

import math
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "bench"))

from fault_ends import Ending, Said, accusing, back_after, random_ending, said_of

from tomr_power_model.model.ticks import to_ns

SOAKED = Ending(
    fault="encoder_lost",
    wheel=1,
    begin_ns=1_700_001_080_000_000_000,
    comes=11.95,
    ends=21.9,
    rest=(16.32, 20.32),
    seed=5,
)


def test_normal_is_named_soon_after_a_lost_encoder_s_end() -> None:
    """The other wheels feel the one that catches up: it took 1.9 s, and takes 1.3."""
    said, _ = said_of(SOAKED)
    assert [name for time, name in said if time <= SOAKED.ends][-1] == "motor system fault 1"
    back = next(time for time, name in said if time > SOAKED.ends and name == "normal")
    assert back - SOAKED.ends < 1.4


@pytest.mark.parametrize(
    ("said", "after"),
    [
        ([(1.0, "normal"), (2.0, "slip"), (4.0, "slip"), (5.5, "normal"), (6.0, "slip")], 1.5),
        ([(2.0, "slip"), (4.5, "not observable in this motion")], 0.5),
        ([(2.0, "slip"), (4.5, "slip")], math.inf),
        ([(2.0, "normal"), (4.5, "normal")], math.nan),
    ],
)
def test_how_soon_is_counted_from_the_end_of_what_was_named(said: Said, after: float) -> None:
    ending = Ending("floor_slippery", 0, 0, 1.5, 4.0)
    assert back_after(ending, said) == pytest.approx(after, nan_ok=True)


def test_a_seed_gives_one_moment() -> None:
    endings = [random_ending("encoder_lost", seed) for seed in (1, 1, 2)]
    assert endings[0] == endings[1] != endings[2]
    assert {ending.wheel for ending in (random_ending("", seed) for seed in range(20))} == {1, 2, 3}


@pytest.mark.parametrize(("fault", "seed"), [("control_signal_lost", 8), ("encoder_lost", 6)])
def test_a_classifier_that_begins_after_a_fault_accuses_nobody(fault: str, seed: int) -> None:
    """The stamps leapt while a driver summed up what its motor lacked: nobody knows how much that
    is, and wheels that turn back agree with any for a moment."""
    ending = random_ending(fault, seed, leap=60.0)
    _, frames = said_of(ending)
    ends = ending.begin_ns + to_ns(ending.ends + ending.leap)
    assert accusing(frames, ends - to_ns(1.0))
    assert not any(accusing(frames, ends + to_ns(seconds)) for seconds in (2.0, 3.0))
