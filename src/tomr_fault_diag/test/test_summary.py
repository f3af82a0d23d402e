"""When enough was decided of a recording, and whose clock is said to be behind."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_fault_diag.diagnosis.heard import Heard, out_of_step, rare_commands
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
        ({"joint_states": 0.0, "wheel_1/power": -0.3}, "wheel_1/power is stamped 0.30 s later"),
        ({"joint_states": 0.0, "wheel_1/power": 0.3, "battery_state": 0.0}, ""),  # slow to come
    ],
)
def test_commands_and_encoders_of_different_clocks_are_named(
    late: dict[str, float], words: str
) -> None:
    found = out_of_step(heard(late))
    assert found.startswith(words)
    assert bool(found) == bool(words)


@pytest.mark.parametrize(
    ("times", "is_rare"),
    [
        (np.arange(0.0, 30.0, 0.1), False),
        (np.arange(0.0, 30.0, 1.5), True),
        (
            np.concatenate([np.arange(0.0, 9.0, 0.1), [60.0, 120.0], np.arange(200.0, 209.0, 0.1)]),
            False,
        ),
        (np.array([0.0, 5.0, 10.0]), False),  # too few to know
    ],
    ids=["steady", "on a change", "with rests", "few"],
)
def test_commands_that_come_on_a_change_only_need_no_timeout(
    times: np.ndarray, is_rare: bool
) -> None:
    for timeout, is_said in ((0.5, is_rare), (2.0, False), (0.0, False)):
        heard = Heard(to_ns(timeout))
        for time in times:
            heard.note("cmd_vel", SimpleNamespace(), to_ns(100.0 + time))
        assert ("set command_timeout: 0" in rare_commands(heard)) is is_said
    assert rare_commands(Heard(to_ns(0.5))) == ""
