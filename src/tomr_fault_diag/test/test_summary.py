"""When enough was decided of a recording, and whose clock is said to be behind."""

from types import SimpleNamespace

import pytest

from tomr_fault_diag.diagnosis.heard import Heard, out_of_step
from tomr_fault_diag.diagnosis.summary import LACKING, Episode, Summary
from tomr_power_model.model.ticks import to_ns


def summary(**seconds: float) -> Summary:
    """Of a recording in which each state stood so long [s], one after the other."""
    episodes, begin = [], 0
    for name, length in seconds.items():
        end = begin + to_ns(length)
        episodes.append(Episode(name.replace("_", " "), begin, end, begin))
        begin = end
    shares = {item.state: (item.end_ns - item.start_ns) / begin for item in episodes}
    return Summary(100, shares, (0.0,), tuple(episodes))


@pytest.mark.parametrize(
    ("seconds", "is_decided"),
    [
        ({"normal": 5.0}, True),
        ({"normal": 0.45}, False),  # every start at rest is normal for a moment
        ({"normal": 2.0, "not_observable_in_this_motion": 60.0}, True),  # it stands most of the day
        ({"normal": 2.0, "waiting": 60.0}, True),
        ({"normal": 2.0, "not_enough_data": 3.0}, False),
        ({"normal": 2.0, "stale": 3.0}, False),
        ({"normal": 2.0, "not_enough_data": 1.0}, True),
        ({"slip": 0.3, "not_enough_data": 9.0}, True),  # what was named was named
    ],
)
def test_a_recording_is_decided_where_more_was_said_than_missed(
    seconds: dict[str, float], is_decided: bool
) -> None:
    assert summary(**seconds).is_decided() is is_decided


def test_where_commands_come_late_to_wait_for_them_is_to_miss_something() -> None:
    found = summary(normal=2.0, waiting=60.0)
    assert not found.is_decided(LACKING | {"waiting"})


def heard(late: dict[str, float]) -> Heard:
    """Two messages of each topic, that come so long after their stamps [s]."""
    found = Heard()
    for topic, seconds in late.items():
        for number in range(2):
            stamp = SimpleNamespace(sec=100 + number, nanosec=0)
            message = SimpleNamespace(header=SimpleNamespace(stamp=stamp))
            found.note(topic, message, to_ns(100 + number + seconds))
    return found


@pytest.mark.parametrize(
    ("late", "words"),
    [
        ({"cmd_vel": 0.02, "joint_states": 0.01}, ""),
        ({"cmd_vel": 500.0, "joint_states": 500.0}, ""),  # recorded much later
        ({"joint_states": 0.4}, ""),
        ({"cmd_vel": 0.21, "joint_states": 0.01}, "cmd_vel comes 0.20 s later"),
        ({"cmd_vel": 0.0, "joint_states": 0.4}, "joint_states comes 0.40 s later"),
    ],
)
def test_commands_and_encoders_of_different_clocks_are_named(
    late: dict[str, float], words: str
) -> None:
    found = out_of_step(heard(late))
    assert found.startswith(words)
    assert bool(found) == bool(words)
