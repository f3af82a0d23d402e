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
    for late, arrival in ((9_900, Arrival.TAKEN), (10_100, Arrival.FOREIGN)):
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


def _arrivals(clock: TickClock, *heard: tuple[str, int]) -> list[Arrival]:
    return [
        clock.arrive(stream, BASE + at * MS, periodic=stream != "commands") for stream, at in heard
    ]


@pytest.mark.parametrize("ahead", [-30_000, 30_000])
def test_commands_of_another_clock_are_left_out(ahead: int) -> None:
    """Whichever comes first; the sensors go on."""
    clock, found, ticks = TickClock(SETTINGS), set(), []
    for at in range(0, 2000, 10):
        if at % 50 == 0:
            found.add(clock.arrive("commands", BASE + (at + ahead) * MS, periodic=False))
            assert at < 50 or clock.off("commands") == pytest.approx(ahead * MS, abs=10 * MS)
        assert clock.arrive("a", BASE + at * MS) is (Arrival.TAKEN if at else Arrival.RESTARTED)
        ticks += _ms(clock)
    assert found == {Arrival.TAKEN, Arrival.FOREIGN}
    assert ticks == list(range(50, 1951, 50))


def test_a_sensor_of_another_clock_is_left_out() -> None:
    """Most sensors say what time it is, whichever came first."""
    clock = TickClock(SETTINGS)
    assert _arrivals(clock, ("imu", 70_000), ("a", 0)) == [Arrival.TAKEN, Arrival.FOREIGN]
    assert _arrivals(clock, ("b", 1), ("imu", 70_010)) == [Arrival.RESTARTED, Arrival.FOREIGN]
    assert _arrivals(clock, ("a", 10), ("b", 11)) == [Arrival.TAKEN] * 2
    assert _arrivals(clock, ("imu", 90_000)) == [Arrival.FOREIGN]  # it has leapt, and nobody else
    assert _arrivals(clock, ("imu", 20)) == [Arrival.TAKEN]  # its clock was set


def test_where_one_clock_is_set_the_others_go_on() -> None:
    clock = TickClock(SETTINGS)
    _arrivals(clock, ("a", 0), ("b", 1), ("c", 2), ("a", 10))
    heard = ("c", 9_000), ("a", 20), ("c", 9_010), ("b", 21), ("a", 30)
    restarted, taken, foreign = Arrival.RESTARTED, Arrival.TAKEN, Arrival.FOREIGN
    assert _arrivals(clock, *heard) == [restarted, restarted, foreign, taken, taken]


def test_a_loop_is_followed_though_some_of_the_old_comes_late() -> None:
    clock = TickClock(SETTINGS)
    _arrivals(clock, ("a", 60_000), ("b", 60_001), ("c", 60_002), ("commands", 60_003))
    _arrivals(clock, ("commands", 5), ("a", 0), ("c", 60_010), ("b", 1), ("c", 2), ("a", 10))
    heard = ("commands", 55), ("a", 20), ("b", 21), ("c", 22)
    assert _arrivals(clock, *heard) == [Arrival.TAKEN] * 4


def test_commands_that_drift_away_or_were_held_up_disturb_nobody() -> None:
    clock, found = TickClock(SETTINGS), []
    for at in range(0, 10_000, 50):
        found += _arrivals(clock, ("a", at), ("commands", at + at // 4))
    assert found.count(Arrival.RESTARTED) == 0
    assert found[-1] is Arrival.FOREIGN
    clock = TickClock(SETTINGS)
    _arrivals(clock, ("commands", 0), ("a", 0))
    found = [
        *_arrivals(clock, *(("a", at) for at in range(500, 9_000, 500))),
        *_arrivals(clock, ("commands", 5_000)),
    ]
    assert found == [Arrival.TAKEN] * 17 + [Arrival.FOREIGN]


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
