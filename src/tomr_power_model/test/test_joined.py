"""Wheels in messages of their own make samples of all wheels."""

from collections.abc import Iterator, Sequence
from typing import Any

import pytest

from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.intake import Unusable, Wheels
from tomr_power_model.messages.joined import Joined, Sample, WheelStream

MS = 1_000_000
START = 1_700_000_000_000 * MS
NAMES = ("left", "right", "back")
PERIOD = 20  # ms


def _speed(wheel: int) -> float:
    return 2.0 - wheel  # rad/s


def _reading(wheel: int, ms: float) -> tuple[float, ...]:
    """Of a wheel that turns evenly: angle, speed, current."""
    return 1e-3 * _speed(wheel) * ms, _speed(wheel), 0.1 * wheel


def _message(wheels: Sequence[int], ms: float) -> Sample:
    readings = tuple(_reading(wheel, ms) if wheel in wheels else None for wheel in range(3))
    return Sample(START + round(ms * MS), readings)


def _joined(messages: Iterator[Sample] | Sequence[Sample]) -> list[Sample]:
    joined = Joined(3)
    return [sample for message in messages for sample in joined.add(message)]


def _apart(offsets: Sequence[float], rounds: int = 20) -> list[Sample]:
    """Each wheel in messages of its own, so late in each round [ms], as they come in time."""
    found = [
        _message([wheel], PERIOD * number + offset)
        for number in range(rounds)
        for wheel, offset in enumerate(offsets)
    ]
    return sorted(found, key=lambda item: item.stamp_ns)


def test_messages_with_all_wheels_go_on_as_they_are() -> None:
    messages = [_message([0, 1, 2], PERIOD * number) for number in range(5)]
    joined = Joined(3)
    assert [sample for message in messages for sample in joined.add(message)] == messages
    assert joined.is_idle


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_parts_of_one_stamp_are_as_the_whole(order: Sequence[int]) -> None:
    parts = [_message([wheel], PERIOD * number) for number in range(20) for wheel in order]
    found = _joined(parts)
    # Of the first message nobody knows that others follow.
    assert found[0] == parts[0]
    assert found[1:] == [_message([0, 1, 2], PERIOD * number) for number in range(1, 20)]


@pytest.mark.parametrize(
    ("offsets", "late"),
    [
        ((0.0, 0.4, 0.8), 0),  # as one loop reads three motors
        ((0.8, 0.4, 0.0), 0),
        ((0.0, 7.0, 13.0), 1),  # clocks of their own: the next reading is awaited
        ((5.0, 19.0, 2.0), 1),
    ],
)
def test_readings_of_other_times_are_those_of_the_first_wheels(
    offsets: Sequence[float], late: int
) -> None:
    found = _joined(_apart(offsets))
    samples = [sample for sample in found if None not in sample.wheels]
    assert None in found[0].wheels  # of the first wheel alone
    assert len(samples) >= 20 - 2 - late
    for sample in samples:
        ms = (sample.stamp_ns - START) / MS
        assert (ms - offsets[0]) % PERIOD == pytest.approx(0.0)
        for wheel, reading in enumerate(sample.wheels):
            assert reading is not None
            if late:
                assert reading == pytest.approx(_reading(wheel, ms), abs=1e-9)
            else:  # within a millisecond: as they were read, counts of an encoder stay counts
                assert reading == _reading(wheel, ms - offsets[0] + offsets[wheel])
    stamps = [sample.stamp_ns for sample in samples]
    assert stamps == sorted(set(stamps))
    if not late:
        assert stamps[-1] == START + round((PERIOD * 19 + offsets[0]) * MS)


def test_a_wheel_that_falls_silent_is_not_there_a_quarter_second_later() -> None:
    parts = _apart((0.0, 0.0, 0.0), rounds=50)
    dies = START + 400 * MS
    left = [item for item in parts if item.wheels[1] is None or item.stamp_ns < dies]
    samples = _joined(left)
    without = [item for item in samples[1:] if item.wheels[1] is None]
    assert [item.stamp_ns for item in samples[1:]] == [
        START + PERIOD * number * MS for number in range(1, 50)
    ]
    assert without[0].stamp_ns == dies  # what had waited for it is not lost
    assert all(item.wheels[0] and item.wheels[2] for item in without)


def test_a_wheel_that_is_never_there_is_not_waited_for() -> None:
    together = [_message([0, 2], PERIOD * number) for number in range(20)]
    assert _joined(together) == together
    apart = [_message([wheel], PERIOD * number) for number in range(20) for wheel in (0, 2)]
    assert _joined(apart)[1:] == together[1:]


def test_time_that_goes_back_begins_anew_and_repeats_add_nothing() -> None:
    parts = _apart((0.0, 0.0, 0.0))
    first = _joined(parts)
    back = [Sample(item.stamp_ns - 5000 * MS, item.wheels) for item in parts]
    again = [item.stamp_ns + 5000 * MS for item in _joined([*parts, *back])[len(first) :]]
    assert again[1:] == [item.stamp_ns for item in first[1:]]
    twice = [item for item in parts for _ in range(2)]
    assert _joined(twice)[-1] == first[-1]
    stamps = [item.stamp_ns for item in _joined(twice)[2:]]
    assert stamps == [item.stamp_ns for item in first[1:]]


def test_a_message_with_all_wheels_ends_it() -> None:
    joined = Joined(3)
    for item in _apart((0.0, 0.0, 0.0), rounds=3):
        joined.add(item)
        assert max(map(len, joined._readings)) < 4  # however long it goes on
    assert not joined.is_idle
    whole = _message([0, 1, 2], 60.0)
    assert joined.add(whole) == (whole,)
    assert joined.is_idle
    unstamped = Sample(0, (*whole.wheels[:2], None))
    assert joined.add(unstamped) == (unstamped,)


def _joints(names: Sequence[str], ms: float) -> Any:
    angles = [1e-3 * ms * (1 + NAMES.index(name)) if name in NAMES else 9.0 for name in names]
    header = bag_header(START + round(ms * MS))
    return bag_message(
        "sensor_msgs/msg/JointState", header=header, name=list(names), position=angles
    )


def _samples(stream: WheelStream, names: Sequence[str], ms: float) -> Sequence[tuple[int, Wheels]]:
    return stream.samples(_joints(names, ms), START + round(ms * MS))


def test_a_stream_of_single_wheels_and_an_arm() -> None:
    stream = WheelStream(NAMES)
    with pytest.raises(Unusable, match="elbow"):
        _samples(stream, ["elbow"], 0.0)
    found = []
    for number in range(5):
        for names in (["right"], ["elbow"], ["back", "elbow"], ["left"]):
            found += _samples(stream, names, 20.0 * number)
    assert [stamp - START for stamp, _ in found[1:]] == [20 * number * MS for number in range(1, 5)]
    for stamp, wheels in found[1:]:
        ms = (stamp - START) / MS
        assert wheels.position == pytest.approx([1e-3 * ms * turns for turns in (1, 2, 3)])
        assert wheels.absent == ()
    with pytest.raises(Unusable, match="no joint"):
        _samples(stream, [], 100.0)


def test_two_stages_read_the_same_message() -> None:
    stream = WheelStream(NAMES)
    message = _joints(["left"], 0.0)
    (first,) = stream.samples(message, START)
    assert stream.samples(message, START) == [first]
    assert first[1].absent == ("right", "back")
    for names in (["right"], ["back"]):
        _samples(stream, names, 0.0)
    for names in (["left"], ["right"]):
        assert _samples(stream, names, 10.0) == []
    completing = _joints(["back"], 10.0)
    (sample,) = stream.samples(completing, START + 10 * MS)
    assert sample[1].absent == ()
    assert stream.samples(completing, START + 10 * MS) == [sample]
    assert stream.newest == 0
    whole = _joints(NAMES, 20.0)
    assert stream.samples(whole, START + 20 * MS)[0][1].absent == ()
    assert stream.newest == START + 20 * MS
