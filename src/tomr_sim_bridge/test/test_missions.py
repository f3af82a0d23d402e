"""Mission files: what is read, refused, planned and driven."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions import (
    drive,
    load_mission,
    parse_mission,
    shipped_missions,
    start_mission,
)

HEAD = "name: test\nphases:\n"
PAUSE = HEAD + "  - {pause: 1.0}\n"
REFERENCE = "reference"


def mission_of(*phases: str, **keys: Any) -> Any:
    text = HEAD + "".join(f"  - {phase}\n" for phase in phases)
    return parse_mission(text + "".join(f"{key}: {value}\n" for key, value in keys.items()), "test")


@pytest.mark.parametrize("name", shipped_missions())
def test_shipped_missions_can_be_planned_for_every_robot(name: str) -> None:
    mission = load_mission(name)
    assert mission.name == name
    assert mission.description
    for robot in ("reference", "robotino_v2"):
        plan = mission.plan(shipped_robot(robot))
        assert 10.0 < plan.duration < 120.0
        for fault in mission.faults:
            assert fault.start < plan.duration
            assert fault.settings["severity"] > 0


@pytest.mark.parametrize("base", ["paper_phases", "square", "circle"])
def test_shipped_missions_come_with_each_fault(base: str) -> None:
    for fault in ("control_signal_lost", "encoder_lost", "floor_slippery"):
        faulty = load_mission(f"{base}_{fault}")
        assert [planned.fault_id for planned in faulty.faults] == [fault]
        assert faulty.phases == load_mission(base).phases


def test_directions_of_the_paper() -> None:
    plan = load_mission("paper_phases").plan(shipped_robot(REFERENCE))
    moves = [piece.twist for piece in plan.pieces if piece.twist != (0.0, 0.0, 0.0)]
    # wheels at 0, 120, 240 degrees; 20 degrees from -Y; the planes of wheels 2 and 1; axle of 1
    degrees = [math.degrees(math.atan2(y, x)) for x, y, _ in moves]
    assert degrees == pytest.approx([-70.0, 30.0, -90.0, 0.0], abs=1e-9)
    assert [math.hypot(x, y) for x, y, _ in moves] == pytest.approx([0.4] * 4)


def test_commands_come_at_their_rate_with_the_twist_of_their_time() -> None:
    mission = mission_of("{twist: [0.1, 0.2, 0.3], duration: 0.25}", "{pause: 0.1}", repeat=2)
    commands = list(mission.plan(shipped_robot(REFERENCE)).commands())
    assert [time for time, _ in commands] == pytest.approx([0.05 * count for count in range(14)])
    moving = [twist == (0.1, 0.2, 0.3) for _, twist in commands]
    assert moving == [True] * 5 + [False] * 2 + [True] * 5 + [False] * 2


def test_circle_turns_the_velocity_only() -> None:
    mission = mission_of("{circle: {speed: 0.5, rate: 1.0, duration: 7.0}}", command_rate=10.0)
    for time, (x, y, turning) in mission.plan(shipped_robot(REFERENCE)).commands():
        assert (x, y) == pytest.approx((0.5 * math.cos(time), 0.5 * math.sin(time)))
        assert turning == 0.0


def test_random_tour_depends_on_the_seed_alone() -> None:
    robot, tour = shipped_robot(REFERENCE), load_mission("random_tour")
    assert tour.plan(robot, 1) == tour.plan(robot, 1)
    assert tour.plan(robot, 1) != tour.plan(robot, 2)
    fixed = mission_of("{random: {count: 3, speed: [0.1, 0.2], duration: [1.0, 2.0]}}", seed=7)
    assert fixed.plan(robot, 1) == fixed.plan(robot, 2)


@given(seed=st.integers(0, 10_000))
def test_random_tour_keeps_its_bounds(seed: int) -> None:
    for piece in load_mission("random_tour").plan(shipped_robot(REFERENCE), seed).pieces[1:]:
        x, y, turning = piece.twist
        speed = math.hypot(x, y)
        assert 0.1 - 1e-12 <= speed <= 0.5 + 1e-12 or piece.twist == (0.0, 0.0, 0.0)
        assert abs(turning) <= 0.6
        assert 0.5 <= piece.duration <= 3.0


def test_base_is_taken_over_and_changed(tmp_path: Path) -> None:
    file = tmp_path / "heavy.yaml"
    file.write_text("base: square\nname: heavy\npayload: 3.0\nfloor_friction: 0.3\n")
    mission = load_mission(file)
    assert mission.phases == load_mission("square").phases
    assert (mission.name, mission.payload, mission.floor_friction) == ("heavy", 3.0, 0.3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no mapping: start with name: and phases:"),
        ("name: [", "line 1: .*: mend the YAML"),
        ("name: test\n", "phases is missing or empty"),
        ("phases: [{pause: 1.0}]\n", "name is missing: add it"),
        (PAUSE + "speed: 3\n", "speed is unknown: give name, description"),
        (PAUSE + "command_rate: 0.0\n", "command_rate = 0 Hz: out of range, give at least 0.1"),
        (PAUSE + "command_rate: .nan\n", "give a finite number"),
        (PAUSE + "payload: heavy\n", "payload = 'heavy': give a number"),
        (PAUSE + "base: nowhere\n", "base = 'nowhere' is no shipped mission"),
        (PAUSE + "base: square_encoder_lost\n", "has a base itself"),
        ("name: test\nphases: {pause: 1.0}\n", "is no list: write one entry per line"),
        (HEAD + "  - 3\n", r"phases\[0\]: 3 is no mapping"),
        (HEAD + "  - {jump: 1.0}\n", r"phases\[0\]: .* exactly one of pause, twist, move"),
        (HEAD + "  - {pause: 1.0, twist: [0, 0, 0]}\n", "names 2 kinds of phase"),
        (HEAD + "  - {pause: 1.0, duration: 2.0}\n", "duration is unknown beside pause"),
        (HEAD + "  - {pause: -1.0}\n", "pause = -1 s: out of range"),
        (HEAD + "  - {twist: [0.1, 0.2], duration: 1.0}\n", "needs 3 values, has 2"),
        (HEAD + "  - {twist: [0.1, 0.2, 0.3]}\n", "duration is missing"),
        (HEAD + "  - {move: {speed: 0.1, duration: 1.0}}\n", "exactly one of heading_deg"),
        (
            HEAD + "  - {move: {along_wheel: 4, speed: 0.1, duration: 1.0}}\n",
            "along_wheel = 4: out of range",
        ),
        (
            HEAD + "  - {random: {count: 1, speed: [0.3, 0.1], duration: [1.0, 1.0]}}\n",
            r"speed = \[0.3, 0.1\]: give \[least, most\]",
        ),
        (PAUSE + "faults: [{start: 1.0}]\n", r"faults\[0\]: fault is missing: name one"),
        (PAUSE + "faults: [{fault: rust, start: 1.0}]\n", "fault 'rust' is unknown"),
        (PAUSE + "faults: [{fault: encoder_lost}]\n", "start is missing"),
        (
            PAUSE + "faults: [{fault: encoder_lost, start: 2.0, end: 1.0}]\n",
            "end = 1 s is not after start = 2 s",
        ),
        (
            PAUSE + "faults: [{fault: encoder_lost, start: 2.0, wheel: 5}]\n",
            "wheel = 5: out of range",
        ),
        (
            PAUSE + "faults:\n  - {fault: encoder_lost, start: 2.0}\n"
            "  - {fault: encoder_lost, start: 4.0, end: 5.0, wheel: 2}\n",
            r"faults\[1\]: encoder_lost overlaps an earlier entry",
        ),
    ],
)
def test_bad_missions_are_refused_in_one_line(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        parse_mission(text, "bad.yaml")
    assert str(caught.value).startswith("bad.yaml:")
    assert "\n" not in str(caught.value)


def test_missing_file_names_the_shipped_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing.yaml: cannot be read .* circle, .*square"):
        load_mission(tmp_path / "nothing.yaml")


def test_faults_are_in_force_from_start_to_end(make_robot: Callable[..., Robot]) -> None:
    mission = mission_of(
        "{twist: [0.2, 0.0, 0.0], duration: 2.0}",
        faults="[{fault: encoder_lost, start: 0.52, end: 1.03, wheel: 2, severity: 0.5}, "
        "{fault: encoder_lost, start: 1.03, wheel: 3}]",
    )
    simulation = start_mission(mission, make_robot(), seed=1, start_ns=5_000_000_000)
    found = {}
    for samples in drive(mission, simulation, seed=1):
        for sample in samples:
            if sample.topic == "ground_truth/faults":
                statuses = [item.fields for item in sample.message.fields["status"]]
                status = next(item for item in statuses if item["name"] == "encoder_lost")
                values = {p.fields["key"]: float(p.fields["value"]) for p in status["values"]}
                time = round((sample.stamp_ns - 5_000_000_000) / 1e9, 3)
                found[time] = (values["active"], values["wheel"], values["severity"])
    assert found[0.5] == (0.0, 1.0, 0.0)
    assert found[0.55] == found[1.0] == (1.0, 2.0, 0.5)
    assert found[1.05] == found[2.0] == (1.0, 3.0, 1.0)


def test_mission_sets_load_and_floor(make_robot: Callable[..., Robot]) -> None:
    mission = mission_of("{pause: 1.0}", payload=2.5, floor_friction=0.33)
    simulation = start_mission(mission, make_robot())
    assert simulation.engine.model.body_mass.sum() == pytest.approx(17.5)
    assert simulation.engine.model.geom_friction.max() == pytest.approx(
        1.0  # geometries that touch nothing keep MuJoCo's own
    )
    rollers = [
        geom for geom in range(simulation.engine.model.ngeom)
        if simulation.engine.model.geom_priority[geom] == 1
    ]  # fmt: skip
    assert np.ptp(simulation.engine.model.geom_friction[rollers, 0]) == 0.0
    assert simulation.engine.model.geom_friction[rollers[0], 0] == pytest.approx(0.33)


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("repeat: 10000\nphases: [{pause: 1.0e+5}]", "MISSION_SECONDS"),
        (
            "repeat: 10000\nphases: [{random: "
            "{count: 10000, speed: [0.1, 0.2], duration: [1.0e-4, 1.0e-4]}}]",
            "MISSION_PHASES",
        ),
        ("phases: [{pause: !!int abc}]", "no int"),
    ],
)
def test_missions_without_an_end_are_refused(text: str, limit: str) -> None:
    with pytest.raises(InputError, match=limit):
        parse_mission(f"name: long\n{text}", "long.yaml")
