"""Stamps of a stream as it is collected."""

import numpy as np
import pytest

from tomr_power_model.drive.series import Series
from tomr_power_model.errors import InputError
from tomr_power_model.limits import limits

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def series(*seconds: float, jumps: bool = True) -> Series:
    """Samples that hold their number, at times after a start."""
    made = Series(1)
    for number, time in enumerate(seconds):
        made.add(START + round(time * SECOND), START, number)
    made.finish("tour: joint_states", jumps)
    return made


def rows(made: Series) -> list[float]:
    return [float(row[0]) for row in made.since(made.first)[1]]


def test_stamps_that_repeat_or_go_back_are_dropped() -> None:
    made = series(1.0, 2.0, 2.0, 1.5, 3.0, -START / SECOND)
    assert rows(made) == [0.0, 1.0, 4.0]
    assert (made.dropped, made.strays) == (3, 0)
    assert made.since(made.first)[0].tolist() == pytest.approx([0.0, 1.0, 2.0])


@pytest.mark.parametrize("late", [9, 11])
@pytest.mark.parametrize("lost", [False, True])
def test_too_many_stamps_that_go_back_are_refused(late: int, lost: bool) -> None:
    # Ten samples apart, each with the stamp of the one three before, or with none.
    times = np.arange(100.0) * 0.1
    for number in range(late):
        at = 5 + 8 * number
        times[at] = -START / SECOND if lost else times[at - 3] + 0.05
    if late < 10:
        assert series(*times).dropped == late
        return
    with pytest.raises(InputError, match="joint_states: 11 % of its stamps precede"):
        series(*times)


def test_a_topic_whose_stamps_all_come_twice_is_read() -> None:
    made = series(*np.repeat(np.arange(100.0) * 0.1, 2))
    assert (len(made), made.dropped) == (100, 100)


@pytest.mark.parametrize("stray", [3.2e7, -3.2e7, 3600.0])
@pytest.mark.parametrize("place", [0, 40, 80])
def test_a_stray_stamp_does_not_take_the_others_with_it(stray: float, place: int) -> None:
    times = np.arange(80.0) * 0.1
    made = series(*times[:place], stray, *times[place:])
    assert rows(made) == [number for number in range(81) if number != place]
    assert made.strays == 1


def test_stamps_that_jump_for_good_are_refused() -> None:
    times = [0.1 * number + (3600.0 if number > 40 else 0.0) for number in range(80)]
    with pytest.raises(InputError, match=r"tour: joint_states: its stamps jump by 3,600 s"):
        series(*times)
    assert len(series(*times, jumps=False)) == 80


def test_silences_are_no_jumps() -> None:
    assert len(series(0.0, 1.0, 28.0, 29.0)) == 4


def test_too_many_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOMR_LIMIT_SAMPLES", "3")
    limits.cache_clear()
    try:
        with pytest.raises(InputError, match="TOMR_LIMIT_SAMPLES"):
            series(1.0, 2.0, 3.0, 4.0)
    finally:
        limits.cache_clear()
