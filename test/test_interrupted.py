"""Whole drives in which data are missing or bad: no fault is named because of that."""
# ruff: noqa: E402 (bench/ is no package)

import math
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "bench"))

import disturbances
from disturbances import (
    REPEATING_GYRO,
    REPEATING_IMU,
    START_NS,
    STREAMS,
    Change,
    Drive,
    Item,
    absurd,
    begun_anew_each_turn,
    both,
    dead,
    disobeyed,
    inertial,
    leap,
    loss,
    pause,
    power,
    scatter,
    unseen,
    zeros_of_imu,
)
from interrupted import WINDING, accused, recorded, states
from winding import winding

from tomr_fault_diag.classifier.states import DISOBEYS, POWER_SENSOR
from tomr_power_model.messages.intake import stamp_of
from tomr_power_model.recordings import open_recording

FAULT = "motor system fault 3"  # in bags/circle_encoder_lost, from 8 s to 14 s


@cache
def drive(bag: str) -> Drive:
    topics = {f"/{topic}" for topic in STREAMS["all"]}
    with open_recording(ROOT / "bags" / bag) as recording:
        return tuple(
            Item(stamp_of(message, received), topic.removeprefix("/"), message)
            for topic, _, message, received in recording.messages(topics)
        )


@pytest.fixture(autouse=True)
def _start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times of disturbances count from the start of the recordings."""
    monkeypatch.setattr(disturbances, "START_NS", drive("square")[0].stamp_ns)


def pauses(streams: str, length: float) -> Change:
    return both(*(pause(streams, at, length) for at in (1.9, 4.3, 6.7, 9.1, 11.5, 13.9)))


CASES = {
    "0.3 s": lambda: pauses("all", 0.3),
    "0.5 s": lambda: pauses("all", 0.5),
    "0.5 s of commands": lambda: pauses("cmd_vel", 0.5),
    "0.3 s of encoders": lambda: pauses("joint_states", 0.3),
    "leaps": lambda: both(leap(5.3, 0.3), leap(9.0, -0.3), leap(12.7, 0.3)),
    "half is lost": lambda: loss(0.5),
    "5 ms": lambda: scatter(0.005),
    "2 %, 5 ms, a second without power": lambda: both(
        loss(0.02), scatter(0.005), pause("motors", 7.0, 1.0)
    ),
    "one absurd sample": lambda: power(1, 6.0, absurd, 0.015),
    "absurd samples": lambda: power(1, 6.0, absurd),
    "a dead sensor": lambda: power(2, 6.0, dead),
}


# What may be said, for it is so.
TRUE = {"absurd samples": POWER_SENSOR[1], "a dead sensor": POWER_SENSOR[2]}


@pytest.mark.parametrize("name", CASES)
def test_a_healthy_robot_is_not_accused(name: str) -> None:
    found = states(CASES[name]()(drive("square"), np.random.default_rng(3)))
    assert accused(found, TRUE.get(name)) == []
    assert any(d.state.name == "normal" for d in found)


def test_angles_that_begin_anew_each_turn_make_no_difference() -> None:
    square = drive("square")
    turned = begun_anew_each_turn()(square, np.random.default_rng(3))
    angles = [max(np.abs(i.message.position)) for i in turned if i.topic == "joint_states"]
    assert max(angles) <= math.pi
    assert [d.state for d in states(turned)] == [d.state for d in states(square)]


@pytest.mark.parametrize("make", [REPEATING_IMU, REPEATING_GYRO, zeros_of_imu])
def test_an_imu_that_dies_accuses_nobody(make: Callable[[Any, Any], Any]) -> None:
    """While the robot winds, so that what a dead one says soon is wrong."""
    winds = (item for item in recorded(WINDING, 100, True) if item.stamp_ns < START_NS + 14e9)
    assert accused(states(inertial(8.0, make)(tuple(winds), np.random.default_rng(3)))) == []


def test_where_others_are_obeyed_the_command_before_is_recorded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    circle = drive("circle_encoder_lost")
    monkeypatch.setattr(disturbances, "START_NS", start := circle[0].stamp_ns)
    found = disobeyed(3.5, 0.2)(circle, np.random.default_rng(3))
    changed = [(was, now) for was, now in zip(circle, found, strict=True) if was is not now]
    at = [1e-9 * (was.stamp_ns - start) for was, _ in changed]
    assert len(at) == 4
    assert 3.5 <= at[0] < at[-1] < 3.7
    commands = [item for item in circle if item.topic == "cmd_vel"]
    before = commands[commands.index(changed[0][0]) - 1].message.twist
    for was, now in changed:
        assert (now.stamp_ns, now.message.header) == (was.stamp_ns, was.message.header)
        assert now.message.twist == before != was.message.twist


def test_a_winding_drive_changes_all_three_parts_of_its_command() -> None:
    """After half a second of rest, within 0.5 m/s and 1 rad/s."""

    def commands(seed: int) -> np.ndarray[Any, Any]:
        given: list[tuple[float, ...]] = []
        simulation: Any = SimpleNamespace(
            stamp_ns=10**9,
            step_to=lambda _: [],
            command=lambda *twist, stamp_ns: given.append((stamp_ns, *twist)),
        )
        recorded = [sample for samples in winding(simulation, seed, 10.0) for sample in samples]
        assert [sample.stamp_ns for sample in recorded] == [int(stamp) for stamp, *_ in given]
        return np.array(given)

    given = commands(3)
    assert np.allclose(np.diff(given[:, 0]), 5e7)
    assert given.shape == (200, 4)
    rest, rest_of_it = given[:11, 1:], given[11:, 1:]
    assert not rest.any()
    assert (np.abs(rest_of_it) <= [0.5, 0.5, 1.0]).all()
    assert (np.ptp(rest_of_it, axis=0) > 0.1).all()
    assert (given == commands(3)).all()
    assert (given != commands(4)).any()


@pytest.mark.parametrize("length", [0.1, 0.2, 0.3])
def test_commands_that_are_late_accuse_nobody(
    length: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In bags/circle_encoder_lost, before that fault comes."""
    circle = drive("circle_encoder_lost")
    monkeypatch.setattr(disturbances, "START_NS", start := circle[0].stamp_ns)
    well = tuple(item for item in circle if item.stamp_ns < start + 7.9e9)
    found = states(disobeyed(3.5, length)(well, np.random.default_rng(3)))
    assert accused(found, DISOBEYS) == []
    assert found[-1].state.name == "normal"


def test_a_robot_that_another_commands_does_not_follow_and_no_motor_is_accused() -> None:
    """It is told to rest, and winds: for three seconds no motor's law says what it gives."""
    winds = (item for item in recorded(WINDING, 101) if item.stamp_ns < START_NS + 14e9)
    items = unseen(8.0, 3.0, is_silent=False)(tuple(winds), np.random.default_rng(3))
    found = states(items)
    assert set(accused(found)) == {DISOBEYS.name}
    named = next(d.stamp_ns for d in found if d.state == DISOBEYS)
    assert named < START_NS + 10e9
    assert found[-1].state.name == "normal"


@pytest.mark.parametrize("streams", ["all", "cmd_vel", "joint_states", "motors"])
def test_a_fault_is_neither_cleared_nor_missed(
    streams: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    circle = drive("circle_encoder_lost")
    monkeypatch.setattr(disturbances, "START_NS", start := circle[0].stamp_ns)
    at_onset, within = pause(streams, 7.8, 0.5), pause(streams, 11.0, 0.5)
    found = states(both(at_onset, within)(circle, np.random.default_rng(3)))
    assert accused(found) == [FAULT]
    (named,) = [d for d in found if d.changed and d.state.name == FAULT]
    assert 8.0 < 1e-9 * (named.stamp_ns - start) < 8.3 + 2.0
    during = {d.state.name for d in found if named.stamp_ns <= d.stamp_ns < start + 14 * 10**9}
    assert during == {FAULT}


def test_a_dead_sensor_excuses_no_other() -> None:
    found: Any = [SimpleNamespace(state=state, changed=True) for state in POWER_SENSOR]
    assert accused(found, POWER_SENSOR[1]) == [POWER_SENSOR[0].name, POWER_SENSOR[2].name]
