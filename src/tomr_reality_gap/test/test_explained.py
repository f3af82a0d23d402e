"""robot_explained.yaml: what was found, as the nodes and the simulator take it."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve
from effect_samples import MODERATE

from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, per_wheel
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import Robot, load_robot, read_description
from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_reality_gap import explain
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.analysis import AnalysisResult, spoils
from tomr_reality_gap.described import described, for_users
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.fit.learnt import with_terms
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.hypotheses.catalogue import nuisances
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.request import Request
from tomr_reality_gap.verdict import _comparisons, _term_notes, edge_notes
from tomr_reality_gap.verdict import _notes as _notes_of
from tomr_sim_bridge.plant.simulation import Simulation

from .test_alignment import as_recorded, simulation  # noqa: F401 -- the fixture

WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
MODELLED = [effect for effect in MODERATE if effect != "contact.slip"]


def explained(
    folder: Path,
    effects: Mapping[str, Mapping[str, float]],
    wheels: int = 3,
    unmodelled: object = None,
    spoils: bool = False,
) -> Robot:
    """The reference robot with effects at its first wheels, through robot_explained.yaml."""
    base = per_wheel(dict(read_description("reference")), WHEELS, "reference")
    values = dict(base.values)
    for effect, numbers in effects.items():
        for key, number in numbers.items():
            if EFFECTS[effect].place == "wheel":
                names = WHEELS[:wheels]
                values |= {f"physics.{effect}.{wheel}.{key}": number for wheel in names}
            else:
                values[f"physics.{effect}.{key}"] = number
    analysis = SimpleNamespace(
        robot=SimpleNamespace(wheel_names=WHEELS, unmodelled=()),
        term=_term(unmodelled, spoils),
        source="reference",
        dataset=SimpleNamespace(simulations=()),
    )
    path = folder / "robot_explained.yaml"
    path.write_text(
        described(analysis, Model(ParameterisedRobot(values, "made"), (), ())), encoding="utf-8"
    )
    return load_robot(path)


def _term(effect: object, spoils: bool = False) -> LearntTerm | None:
    analysis = SimpleNamespace(unmodelled=effect, spoils=spoils)
    return AnalysisResult.term.fget(analysis)  # type: ignore[attr-defined, no-any-return]


def _notes(effect: object, spoils: bool = False) -> tuple[str, ...]:
    robot = load_robot("reference")
    best = SimpleNamespace(model=SimpleNamespace(described=SimpleNamespace(robot=robot)))
    found = SimpleNamespace(best=best)
    return _term_notes(SimpleNamespace(unmodelled=effect, spoils=spoils, found=found))  # type: ignore[arg-type]


def test_values_at_the_edge_of_their_tolerance_are_named() -> None:
    base = per_wheel(dict(read_description("reference")), WHEELS, "reference")
    held = nuisances(base, WHEELS, 0.02, {"motor.resistance": 0.1})
    edges = {"robot.mass": 1.0, "robot.inertia_z": 0.9, "motor.wheel_1_joint.resistance": -1.0}
    offsets = tuple(edges.get(item.keys[0], 0.0) * item.upper for item in held)
    (note,) = edge_notes(Model(base, held, offsets))
    listed = "robot.mass +2.5%, motor.wheel_1_joint.resistance -12.5%"
    assert note.startswith(f"as far off as the tolerance lets them be: {listed}: measure them")
    (note,) = edge_notes(Model(base, held, tuple(item.upper for item in held)))
    assert note.count("%") == 6
    assert f" and {len(held) - 6} more: " in note
    assert edge_notes(Model(base, held, (0.0,) * len(held))) == ()
    found = SimpleNamespace(best=SimpleNamespace(model=Model(base, held, offsets)))
    heeded = _notes_of(SimpleNamespace(unmodelled=None, found=found))  # type: ignore[arg-type]
    assert heeded == edge_notes(Model(base, held, offsets))


def _draws(power: float, is_repeatable: bool) -> SimpleNamespace:
    """A driver that draws so much more at any speed [W]."""
    knots, values = (np.array([0.0, 50.0]),), np.full((1, 2), power)
    term = LearntTerm(FAMILIES["driver.speed"], (1,), knots, values)
    return SimpleNamespace(term=term, is_repeatable=is_repeatable, family=term.family)


@pytest.mark.parametrize(
    ("is_repeatable", "spoils", "more"),
    [(True, False, 2.0), (False, False, 0.0), (True, True, 0.0)],
)
def test_nodes_draw_what_was_learnt_if_another_drive_repeats_it(
    tmp_path: Path, is_repeatable: bool, spoils: bool, more: float
) -> None:
    twist = (0.2, 0.1, 0.3)
    plain = predicted(explained(tmp_path, {}), twist, 2.0)
    effect = _draws(2.0, is_repeatable)
    learnt = explained(tmp_path, {}, unmodelled=effect, spoils=spoils)
    np.testing.assert_allclose(predicted(learnt, twist, 2.0) - plain, [0.0, more, 0.0], atol=1e-3)
    assert len(_notes(effect, spoils)) == (0 if more else 1)


@pytest.mark.parametrize(("there", "expected"), [(1.0, False), (0.6, False), (0.3, True)])
def test_a_term_with_which_held_out_drives_are_predicted_worse_spoils_them(
    simulation: RecordingSimulation,  # noqa: F811
    there: float,
    expected: bool,
) -> None:
    """Of what a driver was learnt to draw a part is there: of less than half nothing is better."""
    effect, robot = _draws(2.0, is_repeatable=True), simulation.robot
    shown = with_terms(simulation, robot, (_draws(2.0 * there, is_repeatable=True).term,))
    held = as_recorded(simulation, shown.predict([robot])[0])
    best = SimpleNamespace(model=SimpleNamespace(described=SimpleNamespace(robot=robot)))
    analysis = SimpleNamespace(term=effect.term, found=SimpleNamespace(best=best))
    assert spoils(analysis, [held]) is expected  # type: ignore[arg-type]
    assert spoils(analysis, []) is False  # type: ignore[arg-type]
    assert spoils(SimpleNamespace(term=None), [held]) is False  # type: ignore[arg-type]


@pytest.mark.parametrize("spoils_them", [False, True])
def test_held_out_drives_are_predicted_with_a_term_unless_it_spoils_them(
    simulation: RecordingSimulation,  # noqa: F811
    spoils_them: bool,
) -> None:
    """2 W more at wheel 2."""
    robot, effect = simulation.robot, _draws(2.0, is_repeatable=True)
    model = SimpleNamespace(described=SimpleNamespace(robot=robot))
    found = SimpleNamespace(
        best=SimpleNamespace(model=model), noise=SimpleNamespace(sigma=np.empty(0))
    )
    analysis = SimpleNamespace(
        dataset=SimpleNamespace(simulations=(), channels=()),
        runs=(),
        base=SimpleNamespace(robot=robot),
        found=found,
        term=_term(effect, spoils_them),
    )
    (shown,) = _comparisons(analysis, [simulation])  # type: ignore[arg-type]
    more = [after - before for before, after in zip(shown.before, shown.after, strict=True)]
    expected = [0.0 if spoils_them or wheel != 1 else 2.0 for wheel in range(3)]
    assert [np.median(item) for item in more[:3]] == pytest.approx(expected)


def test_held_out_drives_are_asked_about_a_term(
    monkeypatch: pytest.MonkeyPatch, match: Explanation
) -> None:
    """`explain` looks at them before anything is written."""
    said: list[bool] = []
    nothing = AnalysisResult(*[None] * 7)  # type: ignore[arg-type]
    ready = SimpleNamespace(simulations=(), held=("held",), notes=())

    def explained_of(analysis: AnalysisResult, *_: object) -> Explanation:
        said.append(analysis.spoils)
        return match

    monkeypatch.setattr(explain, "prepared", lambda _: ready)
    monkeypatch.setattr(explain, "_analysed", lambda *_, **__: nothing)
    monkeypatch.setattr(explain, "spoils", lambda _, held: held == ("held",))
    monkeypatch.setattr(explain, "explanation_of", explained_of)
    explain.explain(Request("reference", (Path("tour"),)))
    assert said == [True]


def test_a_curve_that_no_driver_holds_is_reported_and_not_written(tmp_path: Path) -> None:
    """A resistance that falls by 3 N m over 1 rad/s; the drivers hold 1.7 N m s/rad."""
    knots, values = (np.array([0.0, 1.0, 2.0]),), np.array([[0.0, 3.0, 0.0]])
    term = LearntTerm(FAMILIES["torque.speed"], (0,), knots, values)
    effect = SimpleNamespace(term=term, is_repeatable=True, family=term.family)
    assert explained(tmp_path, {}, unmodelled=effect).unmodelled == ()
    (note,) = _notes(effect)
    assert "is not in the explained description: its curve is as steep as 3 N m s/rad" in note
    gentle = SimpleNamespace(
        term=evolve(term, values=0.1 * values), is_repeatable=True, family=term.family
    )
    assert explained(tmp_path, {}, unmodelled=gentle).unmodelled
    assert _notes(gentle) == ()


def test_a_long_table_is_read_again_as_it_was_written(tmp_path: Path) -> None:
    line = np.linspace(-3.0, 3.0, 60)
    values = np.random.default_rng(1).standard_normal((2, 3600))
    term = LearntTerm(FAMILIES["force.place"], (), (line, line), values)
    learnt = explained(tmp_path, {}, unmodelled=SimpleNamespace(term=term, is_repeatable=True))
    np.testing.assert_allclose(learnt.unmodelled[0].values, values, rtol=1e-4)


def predicted(robot: Robot, twist: tuple[float, float, float], until: float) -> np.ndarray:
    """Powers of the motors as the nodes' core expects them in the last half second [W]."""
    predictor = PowerPredictor(robot)
    speed, found = twist_to_wheels(robot) @ twist, []
    for step in range(round(100.0 * until)):
        stamp = 10**15 + step * 10_000_000
        predictor.command(stamp, twist)
        predictor.encoders(stamp, tuple(speed * 0.01 * step), tuple(speed))
        found += [[motor.power for motor in item.motors] for item in predictor.due()]
    return np.array(found[-10:]).mean(axis=0)


def simulated(robot: Robot, twist: tuple[float, float, float], until: float) -> np.ndarray:
    """The same, measured in the simulator."""
    plant = Simulation(robot, seed=1)
    plant.command(*twist)
    found: dict[str, list[float]] = {topic: [] for topic in robot.wheel_topics}
    for sample in plant.step_to(round(until * 1e9)):
        wheel = sample.topic.removesuffix("/power")
        if wheel in found and sample.stamp_ns > (until - 0.5) * 1e9:
            fields = sample.message.fields
            found[wheel].append(-fields["voltage"] * fields["current"])
    return np.array([np.mean(values) for values in found.values()])


@pytest.mark.parametrize("effect", MODELLED)
def test_nodes_and_simulator_load_it_as_it_is(effect: str, tmp_path: Path) -> None:
    """At one wheel only, which needs neutral values for the others."""
    robot = explained(tmp_path, {effect: MODERATE[effect]}, wheels=1)
    assert robot.everywhere(effect, next(iter(MODERATE[effect])))[0] != 0.0
    assert np.isfinite(predicted(robot, (0.2, 0.0, 0.0), 0.6)).all()
    assert np.isfinite(simulated(robot, (0.2, 0.0, 0.0), 0.2 + 0.5)).all()


def test_all_effects_at_once_cost_the_same_in_nodes_and_simulator(tmp_path: Path) -> None:
    robot = explained(tmp_path, {effect: MODERATE[effect] for effect in MODELLED})
    twist = (0.0, 0.3, 0.3)
    expected = predicted(robot, twist, 3.0)
    before = predicted(load_robot("reference"), twist, 3.0)
    np.testing.assert_allclose(simulated(robot, twist, 3.0), expected, rtol=0.06)
    assert expected.sum() > 1.5 * before.sum()


def test_what_all_wheels_share_is_written_once(tmp_path: Path) -> None:
    explained(tmp_path, {"friction.quadratic": {"coefficient": 5e-4}})
    values = read_description(tmp_path / "robot_explained.yaml")
    assert values["physics.friction.quadratic.coefficient"] == 5e-4
    assert not [key for key in values if "wheel_1_joint" in key]
    explained(tmp_path, {"friction.quadratic": {"coefficient": 5e-4}}, wheels=1)
    values = read_description(tmp_path / "robot_explained.yaml")
    assert values["physics.friction.quadratic.wheel_1_joint.coefficient"] == 5e-4


def test_the_users_simulation_is_not_given_twice_what_it_shows() -> None:
    """Of 0.04 that was found it has 0.015 by itself; another finding was dropped."""
    model = Model(ParameterisedRobot({}, "made"), (), ())
    for name in ("friction.viscous", "friction.coulomb"):
        model = model.joined(Hypothesis(name, ("all_wheels",), (Parameter("size", (), "", 1.0),)))
    model = evolve(model, offsets=((0.03,), (0.04,)))
    best = SimpleNamespace(model=model)
    analysis = SimpleNamespace(found=SimpleNamespace(best=best), shared=((0.01,), (0.015,)))
    kept = for_users(analysis, model.without(0))
    assert [offsets[0] for offsets in kept.offsets] == pytest.approx([0.025])


def test_what_one_of_them_cannot_do_is_said_in_one_line(tmp_path: Path) -> None:
    early = explained(tmp_path, {"sensor.clock_offset": {"delay": -0.02}})
    assert np.isfinite(predicted(early, (0.2, 0.0, 0.0), 0.6)).all()
    with pytest.raises(InputError, match=r"sensor\.clock_offset: delay = -0\.02 s"):
        Simulation(early)
