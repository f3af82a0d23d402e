"""Diagnoses held against labels: numbers worked out by hand on small tracks."""

import math
from collections import Counter

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.diagnosis.labels import Label
from tomr_fault_diag.diagnosis.score import (
    Case,
    Scores,
    Seen,
    binomial_interval,
    delays,
    poisson_interval,
    seen,
)
from tomr_fault_diag.diagnosis.track import Said, Track

START = 1_700_000_000_000_000_000
FAULT = Label("drive", "motor system fault", 2, onset=4.0, end=8.0)


def track(*spans: tuple[float, str, int]) -> Track:
    """A track of 10 s in ticks of 0.1 s: (from [s], state, wheel), each until the next."""
    time = np.arange(1, 101) / 10.0
    said = [Said("normal", 0)] * len(time)
    for begin, state, wheel in spans:
        said = [
            Said(state, wheel) if t >= begin - 1e-9 else s for t, s in zip(time, said, strict=True)
        ]
    none = np.zeros((len(time), 10))
    stamps = START + np.round(time * 1e9).astype(np.int64)
    return Track(stamps, tuple(said), np.zeros(len(time)), none, none, none)


def one(found: Seen) -> Case:
    (case,) = found.cases
    return case


def test_delay_and_time_of_a_fault_named_right() -> None:
    found = seen(
        track((4.3, "motor system fault 2", 2), (8.2, "normal", 0)), START, [FAULT], (0, 1)
    )
    case = one(found)
    assert case.delay == pytest.approx(0.3)
    assert case.named == {"motor system fault": 31}  # ticks from 5.0 to 8.0 s
    assert case.verdicts == {"right": 31}
    assert found.alarms == ()
    # Nothing is wrong before 4 s, and from 3 s after the end on, which the drive does not reach.
    assert found.healthy_seconds == pytest.approx(3.9)


def test_naming_counts_for_half_a_second_after_the_end() -> None:
    late = seen(track((8.4, "motor system fault 2", 2)), START, [FAULT], (0, 1))
    assert one(late).delay == pytest.approx(4.4)
    too_late = seen(track((8.6, "motor system fault 2", 2)), START, [FAULT], (0, 1))
    assert math.isinf(one(too_late).delay)


def test_naming_a_fault_before_it_shows_is_no_false_alarm_but_another_is() -> None:
    label = evolve(FAULT, begun=1.0)
    early = track((2.0, "motor system fault 2", 2))
    assert seen(early, START, [label], (0, 1)).alarms == ()
    # From 2.0 to 3.9 s it is neither right nor wrong.
    assert seen(early, START, [label], (0, 1)).healthy_seconds == pytest.approx(1.9)
    assert seen(early, START, [FAULT], (0, 1)).alarms == ("motor system fault 2",)
    assert seen(early, START, [evolve(FAULT, begun=2.5)], (0, 1)).alarms == (
        "motor system fault 2",
    )
    other = track((2.0, "motor system fault 3", 3))
    assert seen(other, START, [label], (0, 1)).alarms == ("motor system fault 3",)
    stamped = evolve(label, begun=START / 1e9 + 1.0, onset=START / 1e9 + 4.0)
    assert stamped.times(START).begun == pytest.approx(1.0, abs=1e-6)


def test_another_wheel_is_another_fault() -> None:
    case = one(seen(track((4.3, "motor system fault 3", 3)), START, [FAULT], (0, 1)))
    assert math.isinf(case.delay)
    assert case.delay_any == pytest.approx(0.3)
    assert case.named == {"motor system fault (other wheel)": 31}
    assert case.verdicts == {"another_named": 31}


def test_unknown_silence_and_normal_are_distinguished() -> None:
    named = track((4.5, "unknown", 0), (6.0, "stale", 0), (7.0, "normal", 0))
    case = one(seen(named, START, [FAULT], (0, 1)))
    assert case.named == {"unknown": 10, "nothing decided": 10, "normal": 11}
    assert case.verdicts == {"unknown": 10, "normal_or_nothing": 21}
    accepting = evolve(FAULT, accept=("unknown",))
    assert one(seen(named, START, [accepting], (0, 1))).verdicts["right"] == 10


def test_only_observable_time_counts() -> None:
    label = evolve(FAULT, observable=((5.0, 5.5), (7.0, 7.2)))
    case = one(seen(track((4.3, "motor system fault 2", 2)), START, [label], (0, 1)))
    assert case.named.total() == 5 + 2


def test_false_alarms_before_a_fault_count_and_those_close_together_are_one() -> None:
    named = track(
        (0.5, "slip", 0), (0.8, "normal", 0), (1.2, "slip", 0), (1.3, "normal", 0),
        (3.0, "control system fault", 1), (3.2, "normal", 0), (8.5, "slip", 0),
    )  # fmt: skip
    found = seen(named, START, [FAULT], (0, 1))
    assert found.alarms == ("slip", "control system fault")  # 8.5 s: the robot recovers


def test_a_push_is_no_fault() -> None:
    pushed = Label("drive", "normal", onset=3.0, end=3.2, kind="pushed")
    found = seen(track((3.1, "slip", 0), (3.5, "normal", 0)), START, [pushed], (0, 1))
    assert found.cases == ()
    assert found.alarms == ("slip",)
    assert found.healthy_seconds == pytest.approx(10.0)


def test_times_may_be_stamps() -> None:
    label = evolve(FAULT, onset=1_700_000_004.0, end=1_700_000_008.0)
    case = one(seen(track((4.3, "motor system fault 2", 2)), START, [label], (0, 1)))
    assert case.delay == pytest.approx(0.3, abs=1e-5)


def case(kind: str, delay: float, severity: float | None = None) -> Case:
    named = Counter({kind: 10})
    return Case(kind, severity, delay, delay, named, Counter(right=10))


def test_scores_of_phases_count_each_recording_once() -> None:
    found = Scores(
        tuple(
            Seen((case("slip", 0.2 + 0.1 * phase),), ("slip",) * phase, 1800.0, phase, 2)
            for _ in range(4)
            for phase in range(2)
        )
    ).as_dict()
    assert found["false_alarms"]["hours"] == 2.0
    assert found["false_alarms"]["count_by_phase"] == [0, 4]
    assert found["false_alarms"]["per_hour"] == 1.0
    assert found["false_alarms"]["ci95_per_hour"] == [0.0, pytest.approx(10.242 / 2, abs=1e-3)]
    assert found["faults"]["all"]["count"] == 4
    assert found["faults"]["slip"]["found"]["share"] == 1.0
    assert found["faults"]["slip"]["found"]["ci95"][0] == pytest.approx(0.025**0.25, abs=1e-4)
    assert found["faults"]["slip"]["delay_s"]["median"] == 0.25  # between both phases


@pytest.mark.parametrize(
    ("missed", "floor"),
    [
        ((0.1, 0.2, 0.3), 0.4),
        ((0.2, 0.3, 0.4), 0.5),  # a lucky one below does not count
        ((0.1,), 0.2),  # nine of ten, but the floor itself was found
    ],
)
def test_the_detection_floor_is_where_nine_of_ten_are_found(
    missed: tuple[float, ...], floor: float
) -> None:
    sizes = [size / 10 for size in range(1, 11)]
    cases = [case("drag", math.inf if size in missed else 0.5, size) for size in sizes]
    found = Scores((Seen(tuple(cases), (), 0.0, 0, 1),)).as_dict()
    assert found["detection_floor"]["drag"]["severity"] == floor


def test_intervals_are_the_exact_ones() -> None:
    assert poisson_interval(0) == (0.0, pytest.approx(3.6889, abs=1e-4))  # -ln 0.025
    assert poisson_interval(3) == pytest.approx((0.6187, 8.7673), abs=1e-4)
    assert poisson_interval(7) == pytest.approx((2.814, 14.423), abs=1e-3)
    assert binomial_interval(10, 10) == (pytest.approx(0.025**0.1), 1.0)
    assert binomial_interval(0, 10)[1] == pytest.approx(1 - 0.025**0.1)


def test_a_delay_that_never_ends_is_null() -> None:
    found = delays([0.1, 0.2, math.inf])
    assert found["median"] == 0.2
    assert found["p95"] is None
    assert found["never"] == 1
