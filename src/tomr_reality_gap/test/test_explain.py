"""Bad input of an explanation, and what goes into robot_explained.yaml."""

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.errors import InputError
from tomr_power_model.robot import load_robot
from tomr_power_model.robot.files import robot_file
from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_reality_gap import prepared
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.explain import explain
from tomr_reality_gap.request import Request

from .test_alignment import simulation  # noqa: F401 -- the fixture

BAGS = Path(__file__).parents[3] / "bags"
SQUARE, CIRCLE = BAGS / "square", BAGS / "circle_encoder_lost"


def test_a_simulation_of_another_drive_is_refused() -> None:
    with pytest.raises(InputError, match="its commands are not those of square"):
        explain(Request("reference", (SQUARE,), sim=CIRCLE))


def test_a_tolerance_of_an_unknown_value_is_refused() -> None:
    with pytest.raises(InputError, match=r"--tolerance robot\.weight: reference has no such value"):
        explain(Request("reference", (SQUARE,), tolerances={"robot.weight": 0.1}))


def test_another_robots_recording_is_refused(tmp_path: Path) -> None:
    text = (Path(load_robot.__code__.co_filename).parents[1] / "robots/reference.yaml").read_text()
    other = tmp_path / "other.yaml"
    other.write_text(text.replace("wheel_1_joint", "left_joint"), encoding="utf-8")
    with pytest.raises(InputError):
        explain(Request(other, (SQUARE,)))


def test_wheels_that_stand_elsewhere_belong_to_another_robot() -> None:
    """The wheels have the names of the description, and answer to other headings."""
    with pytest.raises(InputError, match=r"this robot\.yaml belongs to another robot"):
        explain(Request("robotino_v2", (SQUARE,)))


def test_a_radius_that_the_drivers_do_not_share_is_refused_with_the_one_they_have(
    tmp_path: Path,
) -> None:
    text = robot_file("reference").read_text(encoding="utf-8")
    other = tmp_path / "other.yaml"
    other.write_text(re.sub(r"wheel_radius: \S+", "wheel_radius: 0.0515", text), encoding="utf-8")
    with pytest.raises(InputError, match=r"1\.030 times as fast .* robot\.wheel_radius: 0\.05,"):
        prepared.prepared(Request(other, (SQUARE,)))


@pytest.mark.parametrize(
    ("topics", "total_only"),
    [({"battery_state"}, True), ({"battery_state", "wheel_2/power"}, False), (set(), False)],
)
def test_power_of_the_whole_robot_counts_where_no_motor_is_measured(
    topics: set[str], total_only: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prepared, "open_recording", nullcontext)
    monkeypatch.setattr(prepared, "resolve_topic", lambda _, topic: topic in topics)
    values = prepared._described(Request("reference", (Path("tour"),)))
    assert (values.get("measurement.source") == "total_only") is total_only


def test_what_the_users_simulation_resists_resists_in_every_recording(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    robot = simulation.robot
    creeping = SimpleNamespace(torque=lambda motion: 0.01 * motion.sign)
    found = prepared._with(creeping, simulation, robot)  # type: ignore[arg-type]
    expected = 0.01 * np.tanh(simulation.run(robot).speed / 0.1)
    np.testing.assert_allclose(found.resisting, expected)


def test_a_described_learnt_term_resists_and_states_what_lies_beyond_its_table(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """0.02 N m at wheel 1 up to 3 rad/s, in the motion that it leaves; the drive goes faster."""
    knots = (np.array([0.0, 1.5, 3.0]),)
    term = LearntTerm(FAMILIES["torque.speed"], (0,), knots, np.full((1, 3), 0.02))
    robot = evolve(simulation.robot, unmodelled=(term,))
    made = evolve(simulation, robot=robot)
    described = prepared._as_described(made)
    found = described.resisting
    speed = described.run(simulation.robot).speed
    slow = np.abs(speed[:, 0]) < 3.0
    assert found is not None
    np.testing.assert_allclose(found[slow, 0], 0.02 * np.tanh(speed[slow, 0] / 0.1), atol=1e-4)
    assert not found[:, 1:].any()
    (note,) = prepared._beyond((made,))
    assert note.startswith("made: ")
    assert "lies beyond the table of learnt term 1" in note


def test_a_term_over_time_resists_in_the_motion_without_it(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Friction that holds a wheel, and is none of one that stands, would come and go."""
    term = LearntTerm(
        FAMILIES["torque.time"], (0, 1, 2), (np.array([0.0, 40.0]),), np.full((3, 2), 0.3)
    )
    robot = simulation.robot
    found = prepared._as_described(evolve(simulation, robot=evolve(robot, unmodelled=(term,))))
    resists = 0.3 * np.tanh(simulation.run(robot).speed / 0.1)
    assert found.resisting is not None
    driven = simulation.timeline.middle > 0.0
    np.testing.assert_allclose(found.resisting[driven], resists[driven], atol=1e-9)


@pytest.mark.parametrize(("quantum", "expected"), [(0.1, 0), (2.4, 1)])
def test_sensors_that_show_little_but_their_steps_are_noted(
    simulation: RecordingSimulation,  # noqa: F811
    quantum: float,
    expected: int,
) -> None:
    """Of three motors the one that varies least; 2.4 W steps are 2.4 times 1 W."""
    varies = {0: 3.0, 1: 1.0, 2: 3.0}
    channels = tuple(
        evolve(
            item, quantum=quantum, value=varies[item.wheel] * (-1.0) ** np.arange(len(item.time))
        )
        for item in simulation.channels
        if item.kind == "power" and item.wheel is not None
    )
    notes = list(prepared._coarse((evolve(simulation, channels=channels),)))
    assert len(notes) == expected
    assert all("made: wheel_2/power is read in steps of 2.4 W, 2.4 times" in note for note in notes)


def test_notes_on_sensors_are_those_of_a_preparation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prepared, "_coarse", lambda drives: [f"{len(drives)} looked at"])
    assert "1 looked at" in prepared.prepared(Request("reference", (SQUARE,))).notes
