"""The grid of decisions: what it waits for, what it refuses, when it starts afresh."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.model.ticks import Arrival, TickClock, TickSettings, to_ns

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
SETTINGS = TickSettings()


def _clock(*stamps_ms: int) -> TickClock:
    clock = TickClock(SETTINGS)
    for stamp in stamps_ms:
        assert clock.arrive("a", BASE + stamp * MS) is Arrival.TAKEN
    return clock


def _ms(clock: TickClock) -> list[int]:
    return [(tick - BASE) // MS for tick in clock.due()]


def test_ticks_lie_on_the_grid_and_settle() -> None:
    clock = _clock(10, 60)
    assert _ms(clock) == []  # 50 ms is reached, but 20 ms for late messages have not passed
    clock.arrive("a", BASE + 75 * MS)
    assert _ms(clock) == [50]


def test_a_live_stream_is_waited_for() -> None:
    clock = _clock(10)
    clock.arrive("b", BASE + 20 * MS)
    clock.arrive("a", BASE + 130 * MS)
    assert _ms(clock) == []
    clock.arrive("b", BASE + 101 * MS)
    assert _ms(clock) == [50, 100]


def test_a_silent_stream_is_not_waited_for() -> None:
    clock = _clock(10)
    clock.arrive("b", BASE + 20 * MS)
    clock.arrive("a", BASE + 290 * MS)
    assert _ms(clock) == [50, 100, 150, 200, 250]


def test_what_is_waited_for_may_be_later_than_a_gap() -> None:
    """A stream that two stages of `patience` 5 s wait for comes up to 10 s late."""
    for late, arrival in ((9_900, Arrival.TAKEN), (10_100, Arrival.RESTARTED)):
        clock = TickClock(TickSettings(patience=5_000 * MS, gap=1_000 * MS))
        clock.arrive("a", BASE + 20_000 * MS)
        assert clock.arrive("b", BASE + (20_000 - late) * MS) is arrival


def test_an_expected_stream_is_waited_for_before_its_first_message() -> None:
    clock = TickClock(SETTINGS, expected=("b",))
    for at in range(10, 300, 10):
        clock.arrive("a", BASE + at * MS)
    assert _ms(clock) == []
    clock.arrive("b", BASE + 100 * MS)
    assert _ms(clock) == [50, 100]
    for at in range(300, 420, 10):
        clock.arrive("a", BASE + at * MS)
    assert _ms(clock) == [150]


def test_after_a_silence_of_all_an_expected_stream_gets_its_time() -> None:
    clock = TickClock(SETTINGS, expected=("b",))
    for at in (10, 60):
        clock.arrive("a", BASE + at * MS)
        clock.arrive("b", BASE + at * MS)
    clock.arrive("a", BASE + 480 * MS)  # 0.42 s of nothing, then "a" is the first to go on
    assert _ms(clock) == [50]
    clock.arrive("b", BASE + 450 * MS)
    assert _ms(clock) == list(range(100, 451, 50))


def test_sparse_streams_are_not_waited_for() -> None:
    clock = _clock(10)
    clock.arrive("commands", BASE + 20 * MS, periodic=False)
    clock.arrive("a", BASE + 80 * MS)
    assert _ms(clock) == [50]


@pytest.mark.parametrize("ahead", [0, 15, 400, 900])
def test_commands_that_are_ahead_do_not_leave_the_sensors_behind(ahead: int) -> None:
    """Every tick has the samples up to it; ticks go on where sensors die and commands do not."""
    clock, early = TickClock(SETTINGS), []
    for at in range(0, 6000, 10):
        if at % 50 == 0:
            clock.arrive("commands", BASE + (at + ahead) * MS, periodic=False)
        if at < 4000:
            clock.arrive("a", BASE + (at + 5) * MS)
            clock.arrive("b", BASE + at * MS)
        early += [(tick, at) for tick in _ms(clock)]
    late = [(tick, at) for tick, at in early if 1500 < at < 4000]
    assert len(late) >= 49
    assert all(tick <= at for tick, at in late)
    assert 5700 <= early[-1][0] <= 6000


def test_a_lead_that_is_gone_counts_no_more() -> None:
    """Clocks that were set: from then on a command is as good as a sample again."""
    for restarts in (False, True):
        clock = TickClock(SETTINGS)
        for at in range(0, 2000, 10):
            clock.arrive("commands", BASE + (at + 400) * MS, periodic=False)
            clock.arrive("a", BASE + at * MS)
        begin = 60_000 if restarts else 2500
        if not restarts:
            clock.arrive("a", BASE + begin * MS)
        clock.arrive("commands", BASE + (begin + 90) * MS, periodic=False)
        list(clock.due())
        clock.arrive("commands", BASE + (begin + 500) * MS, periodic=False)
        assert _ms(clock)[-1] == begin + 450


def test_refused_stamps() -> None:
    clock = _clock(10, 60)
    assert clock.arrive("a", 0) is Arrival.UNSTAMPED
    assert clock.arrive("a", -5) is Arrival.UNSTAMPED
    assert clock.arrive("a", BASE + 60 * MS) is Arrival.REPEATED
    assert clock.arrive("a", BASE + 40 * MS) is Arrival.REPEATED
    assert clock.arrive("b", BASE + 40 * MS) is Arrival.TAKEN


def test_jumps_start_afresh_either_way() -> None:
    clock = _clock(10, 60)
    assert clock.arrive("a", BASE + 5_000 * MS) is Arrival.RESTARTED
    clock.arrive("a", BASE + 5_080 * MS)
    assert _ms(clock) == [5_050]
    assert clock.arrive("a", BASE + 10 * MS) is Arrival.RESTARTED
    clock.arrive("a", BASE + 90 * MS)
    assert _ms(clock) == [50]


@given(st.permutations(range(24)))
def test_the_ticks_do_not_depend_on_the_order_across_streams(order: list[int]) -> None:
    """Three streams of eight samples, interleaved at will: the same ticks in the same order."""
    taken = dict.fromkeys("abc", 0)
    clock = TickClock(TickSettings(patience=to_ns(10.0)))
    for stream in "abc":  # all are live from the start
        clock.arrive(stream, BASE + 1 * MS)
    ticks: list[int] = []
    for number in order:
        stream = "abc"[number % 3]
        taken[stream] += 1
        clock.arrive(stream, BASE + taken[stream] * 20 * MS)
        ticks.extend(_ms(clock))
    assert ticks == [50, 100]


def test_a_phase_shifts_the_grid() -> None:
    clock = TickClock(TickSettings(phase=20 * MS))
    for stamp in (10, 60, 95):
        clock.arrive("a", BASE + stamp * MS)
    assert _ms(clock) == [20, 70]
