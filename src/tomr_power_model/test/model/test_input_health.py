"""Continuity of a stream, and what is said of it."""

import pytest

from tomr_power_model.messages.plain import Level
from tomr_power_model.model.continuity import POWER_TOLERANCE, Continuity
from tomr_power_model.model.input_health import InputReporter, InputState
from tomr_power_model.model.ticks import Arrival, to_ns

MS = 1_000_000
BASE = 1_700_000_000_000 * MS


def flow(until_ms: int, every_ms: int = 20, start_ms: int = 0) -> Continuity:
    found = Continuity(POWER_TOLERANCE)
    for t in range(start_ms, until_ms, every_ms):
        found.take(BASE + t * MS)
    return found


def said(state: InputState, at_ms: int) -> tuple[Level, str]:
    return state.verdict(BASE + at_ms * MS)


def test_a_sensor_never_seen_is_stale_and_commands_are_waited_for() -> None:
    assert said(InputState("x", flow(0)), 50) == (Level.STALE, "no message yet")
    assert said(InputState("x", flow(0), is_optional=True), 50) == (Level.OK, "waiting")


def test_a_sensor_that_dies_is_a_warning_and_commands_may_end() -> None:
    assert said(InputState("x", flow(1000)), 1000)[0] is Level.OK
    assert said(InputState("x", flow(1000)), 4180) == (Level.WARN, "silent for 3.2 s")
    assert said(InputState("x", flow(1000), is_optional=True), 4180)[0] is Level.OK


def test_what_comes_may_be_bad() -> None:
    stream = flow(1000)
    assert said(InputState("x", stream, "frozen"), 1000) == (Level.WARN, "frozen")
    stream.refuse("in mV")
    words = "sends what cannot be used at times: in mV"
    assert said(InputState("x", stream), 1000) == (Level.WARN, words)
    stream.refuse("in mA")
    stream.refuse("in\nmV")
    assert said(InputState("x", stream), 1000) == (Level.WARN, "sends what cannot be used: in mV")
    for t in range(1000, 4000, 20):
        stream.take(BASE + t * MS)
    assert said(InputState("x", stream), 4000)[0] is Level.OK


def test_why_it_cannot_be_used_is_said_as_of_the_tick() -> None:
    stream = flow(1000)
    stream.refuse("in mV")
    stream.take(BASE + 1100 * MS)
    stream.refuse("in mA")
    for at_ms, unit in ((1020, "mV"), (1120, "mA")):
        words = f"sends what cannot be used at times: in {unit}"
        assert said(InputState("x", stream), at_ms) == (Level.WARN, words)


def test_a_gap_is_a_warning_for_a_while() -> None:
    stream = flow(1000)
    for t in range(1300, 4000, 20):
        stream.take(BASE + t * MS)
    assert said(InputState("x", stream), 2000) == (Level.WARN, "a gap a moment ago")
    assert said(InputState("x", stream), 3900)[0] is Level.OK
    assert (stream.gaps, stream.refused) == (1, 0)


def test_what_comes_too_rarely_to_be_compared_says_so_steadily() -> None:
    stream, said_at = Continuity(POWER_TOLERANCE), []
    for t in range(0, 8000, 50):
        if t % 1000 == 0:
            stream.take(BASE + t * MS)
        if t >= 3000:
            assert stream.is_broken(BASE + t * MS)
            said_at.append(said(InputState("x", stream), t))
    words = "comes every 1.0 s: too rarely to be compared"
    assert set(said_at) == {(Level.WARN, words)}
    assert said(InputState("x", stream), 10_100) == (Level.WARN, "silent for 3.1 s")
    for t in range(18_000, 18_200, 20):
        stream.take(BASE + t * MS)
    assert not stream.is_broken(BASE + 18_190 * MS)


@pytest.mark.parametrize(
    ("ahead_s", "words"),
    [
        (7.46, "stamped 7.5 s ahead of the other inputs: synchronise the clocks"),
        (-0.5, "stamped 0.5 s behind the other inputs: synchronise the clocks"),
        (1.7e9, "stamped 1700000000.0 s ahead of the other inputs: set use_sim_time everywhere"),
    ],
)
def test_how_far_a_clock_is_off_says_what_to_see_to(ahead_s: float, words: str) -> None:
    stream = flow(1000)
    for _ in range(3):
        stream.ignore(Arrival.FOREIGN, BASE, to_ns(ahead_s))
    assert said(InputState("x", stream), 1000) == (Level.WARN, words)
    stream.take(BASE + 1020 * MS)
    assert said(InputState("x", stream), 1020)[0] is Level.OK


def test_a_usual_interval_between_gaps_is_no_rare_stream() -> None:
    stream = Continuity(POWER_TOLERANCE)
    for t in range(0, 8000, 1000):
        stream.take(BASE + t * MS)
        stream.take(BASE + (t + 300) * MS)
    assert not stream.is_broken(BASE + 7500 * MS)


@pytest.mark.parametrize(("ms", "level"), [(480, Level.WARN), (520, Level.OK), (60_000, Level.OK)])
def test_commands_that_end_and_begin_anew_are_no_gap_to_warn_of(ms: int, level: Level) -> None:
    stream = flow(1000)
    for t in range(980 + ms, 980 + ms + 1000, 20):
        stream.take(BASE + t * MS)
    assert said(InputState("x", stream, is_optional=True), 980 + ms + 500)[0] is level
    assert said(InputState("x", stream), 980 + ms + 500)[0] is Level.WARN


@pytest.mark.parametrize(("samples", "is_gap"), [(5, False), (6, True), (9, True)])
def test_what_is_a_gap_is_known_from_the_first_five_intervals_on(
    samples: int, is_gap: bool
) -> None:
    silent = 20 * (samples - 1) + 150
    assert flow(20 * samples).is_silent(BASE + silent * MS) == is_gap
    assert flow(20 * samples).is_silent(BASE + (silent + 250) * MS)


@pytest.mark.parametrize("every_ms", [5, 20, 100])
def test_rates_and_ages_are_numbers(every_ms: int) -> None:
    status = InputState("wheel_1/power", flow(3000, every_ms)).status(BASE + 3000 * MS, "robot_7")
    values = dict(status.values)
    assert status.name == "inputs: wheel_1/power"
    assert status.hardware_id == "robot_7"
    assert float(values["rate"]) == pytest.approx(1000 / every_ms, rel=0.01)
    assert float(values["age"]) == pytest.approx(every_ms / 1000)


def test_no_silence_that_is_usual_is_a_gap() -> None:
    """A sensor of 5 Hz may stay away for 0.35 s, one of 50 Hz for 0.1 s."""
    slow, fast = flow(4000, 200), flow(4000, 20)
    assert not slow.is_silent(BASE + (3800 + 350) * MS)
    assert slow.is_silent(BASE + (3800 + 351) * MS)
    assert not fast.is_silent(BASE + (3980 + 100) * MS)
    assert fast.is_silent(BASE + (3980 + 101) * MS)


def test_a_tick_rests_on_what_came_up_to_it() -> None:
    """Stamps that were read already but lie after the tick change nothing."""
    early, late = flow(1000), flow(1000)
    late.take(BASE + 1500 * MS)
    for at in (1000, 1050, 1100, 1200):
        assert early.is_broken(BASE + at * MS) == late.is_broken(BASE + at * MS)
    assert late.gaps == 0


def test_after_a_leap_of_the_stamps_comes_a_gap_and_not_at_the_start() -> None:
    first, leapt = flow(1000), flow(1000)
    for _ in range(2):
        leapt.leap()
        assert leapt.is_misplaced(BASE + 5000 * MS)  # heard before the leap and not since
    leapt.take(BASE + 5000 * MS)
    assert not first.is_broken(BASE)
    assert leapt.is_broken(BASE + 5040 * MS)
    assert not leapt.is_broken(BASE + 5050 * MS)
    assert not leapt.is_misplaced(BASE + 5050 * MS)
    never = Continuity(POWER_TOLERANCE)
    never.clear()
    assert not never.is_misplaced(BASE)


@pytest.mark.parametrize("stamp", [0, BASE + 980 * MS, BASE + 500 * MS])
def test_a_sensor_whose_stamps_do_not_fit_is_not_silent_and_says_so(stamp: int) -> None:
    """Messages without a stamp, with the last one's, and with an older one."""
    stream = flow(1000)
    stream.precedes(stamp)
    stream.precedes(stamp)
    assert not stream.is_misplaced(BASE + 1000 * MS)
    stream.precedes(stamp)
    assert said(InputState("x", stream), 1000) == (Level.WARN, "its stamps do not fit")
    stream.take(BASE + 1020 * MS)
    assert not stream.is_misplaced(BASE + 1020 * MS)


@pytest.mark.parametrize("stamp", [0, BASE], ids=["without a stamp", "old"])
def test_nothing_is_known_of_a_stream_most_of_which_cannot_be_placed(stamp: int) -> None:
    ordered, mixed = flow(1000), flow(1000)
    for t in range(1000, 2000, 20):
        for stream, strays in ((ordered, 1), (mixed, 3)):
            stream.take(BASE + t * MS)
            for _ in range(strays):
                stream.precedes(stamp)
    assert not ordered.is_broken(BASE + 1980 * MS)
    assert mixed.is_broken(BASE + 1980 * MS)


@pytest.mark.parametrize("refused", [True, False], ids=["refused", "repeated"])
def test_what_is_no_sample_takes_nothing_from_the_order_of_those_that_are(refused: bool) -> None:
    stream = flow(1000)
    for t in range(1000, 2000, 20):
        stream.take(BASE + t * MS)
        for _ in range(3):
            if refused:
                stream.refuse("why")
            else:
                stream.precedes(BASE + t * MS)
    stream.misplace()
    assert not stream.is_broken(BASE + 1980 * MS)
    assert stream.refused == (150 if refused else 0)


def test_it_is_said_once_a_second_and_on_a_change() -> None:
    reporter, stream = InputReporter(), flow(1520)
    for t in range(50, 4000, 50):
        reporter.take(BASE + t * MS, (InputState("x", stream),), "")
    found = [((r.stamp_ns - BASE) // MS, r.statuses[0].level) for r in reporter.due()]
    assert found == [
        (50, Level.OK),
        (1000, Level.OK),
        (1650, Level.WARN),
        (2000, Level.WARN),
        (3000, Level.WARN),
    ]
    assert reporter.due() == []
