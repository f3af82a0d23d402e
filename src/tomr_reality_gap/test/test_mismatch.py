"""Where a mismatch is, and what depends on what: on series made by hand."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.record import Drive
from tomr_power_model.effects.scales import Scales
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import ParameterisedRobot, per_wheel
from tomr_power_model.robot import read_description, shipped_robot
from tomr_power_model.unmodelled import FAMILIES
from tomr_reality_gap import explain
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit import unmodelled
from tomr_reality_gap.fit.basis_responses import basis_responses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.learnt import Table, with_terms
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.remainder import Remainder
from tomr_reality_gap.fit.simulator_baseline import SimulatorBaseline, beyond_baseline
from tomr_reality_gap.fit.simulator_discrepancy import discrepancy_torques
from tomr_reality_gap.fit.unmodelled import (
    Tried,
    fitted,
    refitted,
    shape_of,
    unmodelled_effect,
)
from tomr_reality_gap.hypotheses.catalogue import nuisances
from tomr_reality_gap.hypotheses.scales import scales_of
from tomr_reality_gap.mismatch.locate import located
from tomr_reality_gap.mismatch.orders import ripple_orders

from .test_alignment import _recorded as recorded_drive
from .test_alignment import as_recorded, simulation  # noqa: F401 -- the fixture
from .test_forward_selection import searched

POWER_TIME = np.arange(0.02, 60.0, 0.02)


def _channel(value: np.ndarray) -> Channel:
    span = np.full(len(POWER_TIME), 0.005)
    return Channel("wheel_1/power", "power", 0, "W", POWER_TIME, span, value)


def test_the_regime_and_the_intervals_are_where_the_change_is() -> None:
    speed = 6.0 * np.abs(np.sin(0.3 * POWER_TIME))
    shows = (POWER_TIME > 20.0) & (POWER_TIME < 23.0) & (speed < 2.0)
    found = located(
        [_channel(speed)],
        1.0 * shows,
        np.full(len(speed), 10.0),
        0.8,
        variables={"|omega| [rad/s]": speed, "load [W]": np.cos(POWER_TIME)},
    )
    assert "|omega|" in found.regime
    assert found.intervals
    assert all(start >= 20.0 and end <= 23.0 for start, end in found.intervals)
    assert found.channels == {"wheel_1/power": pytest.approx(1.0)}


def test_a_ripple_is_found_by_its_order_and_noise_has_none() -> None:
    speed = 5.0 + 3.0 * np.sin(0.4 * POWER_TIME)
    angle = np.cumsum(speed) * 0.02
    noise = np.random.default_rng(1).standard_normal(len(angle))
    made: Drive = evolve(
        recorded_drive(shipped_robot("reference")),
        encoder_time=POWER_TIME - 0.0025,
        position=np.stack([angle] * 3, axis=1),
    )
    channels = (_channel(noise),)
    swinging = 0.1 * speed * np.sin(7.0 * angle + 0.4) + 0.2 * noise
    assert ripple_orders(made, channels, [swinging], [speed])[0] == pytest.approx(7.0, abs=0.02)
    assert ripple_orders(made, channels, [0.2 * noise], [speed]) == ()


def _scales(made: RecordingSimulation) -> Scales:
    run = made.run(made.robot)
    return scales_of(made.robot, run.speed, run.power, run.copper, duration=30.0)


def _table(made: RecordingSimulation, family: str) -> Table:
    """Over the motion in it."""
    table = Table.over(FAMILIES[family], [motion_in(made, made.robot)], _scales(made))
    assert table is not None
    return table


def _rest(dataset: Dataset, found: Selection) -> Remainder:
    jacobian = linearise(dataset, found.best.model, ())
    return Remainder.of(dataset, jacobian.value, jacobian.matrix)


def test_what_has_no_name_is_found_with_its_wheel_and_variable(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """A torque with a peak at one speed of wheel 3, outside the vocabulary."""
    robot = simulation.robot
    speed = simulation.run(robot).speed
    torque = np.zeros((1, *speed.shape))
    moving = np.tanh(speed[:, 2] / 0.1)
    torque[0, :, 2] = 0.15 * np.exp(-(((np.abs(speed[:, 2]) - 4.0) / 1.5) ** 2)) * moving
    dataset, found = searched(simulation, next(simulation.respond(robot, torque)), ())
    effect = unmodelled_effect(_rest(dataset, found), robot, _scales(simulation))
    assert effect is not None
    assert effect.family.family_id in ("torque.speed", "torque.signed_speed")
    assert effect.term.wheels == (2,)
    assert effect.evidence > 60.0
    assert effect.is_repeatable
    assert effect.is_large
    shape = shape_of(effect, robot)
    assert abs(shape.at[np.argmax(np.abs(shape.value))]) == pytest.approx(4.0, abs=1.0)
    # A simulation of the user's that has the same is no other than reality in this.
    plain, resisting = simulation.predict([robot])[0], next(simulation.respond(robot, torque))
    for theirs, expected in ((resisting, True), (plain, False)):
        recorded = [as_recorded(simulation, theirs)]
        baseline = SimulatorBaseline.of(recorded, dataset, found.noise, robot)
        assert baseline is not None
        assert baseline.shows(effect) is expected
    # It is laid on any drive beside what is named.
    termed = with_terms(simulation, robot, (effect.term,)).predict([robot])[0]
    assert (termed - resisting).std() < 0.4 * (plain - resisting).std()


@pytest.mark.parametrize(("wheels", "expected"), [((0, 1, 2), (0, 1, 2)), ((1,), (1,))])
def test_a_law_holds_at_wheels_that_hardly_show_it_but_not_where_it_is_not(
    simulation: RecordingSimulation,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    wheels: tuple[int, ...],
    expected: tuple[int, ...],
) -> None:
    """A cubic drag, of which only the wheel that shows most of it is looked at first."""
    monkeypatch.setattr(unmodelled, "_WHEEL_SHARE", 0.99)
    robot = simulation.robot
    speed = simulation.run(robot).speed
    torque = np.zeros((1, *speed.shape))
    torque[0][:, list(wheels)] = 3e-4 * speed[:, list(wheels)] ** 3
    dataset, found = searched(simulation, next(simulation.respond(robot, torque)), ())
    motions = [motion_in(simulation, robot)]
    table = _table(simulation, "torque.speed")
    enough, best_law = [], unmodelled.best_law

    def asked(*arguments: Any, **settings: Any) -> Any:
        enough.append(settings["enough"])
        return best_law(*arguments, **settings)

    monkeypatch.setattr(unmodelled, "best_law", asked)
    effect = fitted(_rest(dataset, found), Tried(table, 1.0), robot, motions)
    # As much as the table, of what is left with its noise.
    assert all(effect.explained - 0.02 < item < effect.explained for item in enough[-1:])
    assert effect.term.wheels == expected
    assert effect.laws[0].name == "power law"
    assert effect.laws[0].parameters["exponent"].value == pytest.approx(3.0, abs=0.1)


def test_a_strong_drag_is_fitted_in_the_motion_that_it_leaves(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """0.03 N m s^2/rad^2: wheels lag by up to 0.9 rad/s, and motors draw many times the power."""
    robot = simulation.robot
    drag = ({"coefficient": 0.03},) * 3
    real = evolve(robot, physics={**robot.physics, "friction.quadratic": drag})
    dataset, found = searched(simulation, simulation.predict([real])[0], ())
    motions = [motion_in(simulation, robot)]
    bare, table = found.without.model, _table(simulation, "torque.speed")
    first = fitted(_rest(dataset, found), Tried(table, 1.0), bare.described.robot, motions)
    base = evolve(bare, offsets=(), hypotheses=())
    basis = basis_responses(dataset, robot, _scales(simulation).torque)
    search = explain._Search(base, (), basis, lambda _: None)
    effect = explain._at_its_best(dataset, bare, first, search)
    assert effect.laws[0].name == "power law"
    assert len({item.name for item in effect.laws}) == len(effect.laws)
    law = {name: item.value for name, item in effect.laws[0].parameters.items()}
    assert law == pytest.approx({"size": 0.03, "exponent": 2.0}, rel=0.008)
    left = [
        (dataset.value - explain._with_term(dataset, robot, item).predict([robot])[0]).std()
        for item in (first, effect)
    ]
    assert left[1] < 0.9 * left[0]


def test_a_patch_of_the_floor_is_one_for_all_wheels_and_the_users_simulation_may_have_it(
    simulation: RecordingSimulation,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """0.2 N m more within 0.3 m of a place where wheel 1 has been."""
    robot, motion = simulation.robot, motion_in(simulation, simulation.robot)
    place = motion.contact_x[2000, 0], motion.contact_y[2000, 0]
    near = np.hypot(motion.contact_x - place[0], motion.contact_y - place[1])
    torque = 0.2 * motion.sign / (1.0 + np.exp((near - 0.3) / 0.02))
    value = next(simulation.respond(robot, torque[None]))
    dataset, found = searched(simulation, value, ())
    table = _table(simulation, "torque.place")
    rest = _rest(dataset, found)
    effect = refitted(rest, fitted(rest, Tried(table, 1.0), robot, [motion]), robot)
    assert effect.term.wheels == (0, 1, 2)
    assert effect.share > 0.8  # by moments: each stretch is on ground of its own
    # A smaller table stays near nothing where nobody has been, and says so.
    wide, small = (fitted(rest, Tried(table, 1.0, 1.0, size), robot, [motion]) for size in (1, 0.1))
    assert small.learnt.values.std() < 0.7 * wide.learnt.values.std()
    assert small.sigma.max() == pytest.approx(0.1 * wide.sigma.max(), rel=0.3)
    law = {name: item.value for name, item in effect.laws[0].parameters.items()}
    expected = {"size": 0.2, "radius": 0.3, "x": place[0], "y": place[1]}
    assert law == pytest.approx(expected, abs=0.02)
    for theirs, expected in ((value, True), (simulation.predict([robot])[0], False)):
        recorded = [as_recorded(simulation, theirs)]
        baseline = SimulatorBaseline.of(recorded, dataset, found.noise, robot)
        assert baseline is not None
        assert baseline.shows(effect) is expected
    # A law that does not explain as much as the table at once may do so at its best.
    for least, names in ((1.0, ["patch"]), (2.0, [])):
        monkeypatch.setattr(unmodelled, "AS_WELL", least)
        again = fitted(rest, Tried(table, 1.0), robot, [motion])
        assert [law.name for law in again.laws] == names
        assert all(law.share > least for law in again.laws)


@pytest.mark.parametrize("recordings", [1, 2])
def test_what_runs_in_is_repeatable_only_if_it_does_so_in_several_recordings(
    simulation: RecordingSimulation,  # noqa: F811
    recordings: int,
) -> None:
    """0.2 N m that dies out over 8 s."""
    robot, motion = simulation.robot, motion_in(simulation, simulation.robot)
    torque = 0.2 * np.exp(-motion.time / 8.0) * motion.sign
    _, found = searched(simulation, next(simulation.respond(robot, torque[None])), ())
    value = next(simulation.respond(robot, torque[None]))
    dataset = Dataset((as_recorded(simulation, value),) * recordings)
    motions = [motion] * recordings
    table = _table(simulation, "torque.time")
    effect = fitted(_rest(dataset, found), Tried(table, 1.0), robot, motions)
    assert effect.laws[0].name == "exponential"
    assert effect.laws[0].parameters["decay"].value == pytest.approx(8.0, rel=0.1)
    assert effect.is_repeatable == (recordings > 1)


def test_a_tether_is_named_with_its_anchor_and_a_gust_as_what_comes_and_goes(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """8 N/m beyond 0.3 m from (0.2, 0.0); 3 N along x for four seconds in eight."""
    robot = simulation.robot
    motion = motion_in(simulation, robot)
    away = np.hypot(motion.x - 0.2, motion.y)
    pull = 8.0 * np.maximum(away - 0.3, 0.0) / away
    tether = motion.resisting(-(pull * (motion.x - 0.2))[:, 0], -(pull * motion.y)[:, 0])
    blows = 3.0 * (np.floor(motion.time[:, 0] / 4.0) % 2)
    gust = motion.resisting(blows, 0.0 * blows)
    found = []
    for torque in (tether, gust):
        value = next(simulation.respond(robot, torque[None]))
        dataset = Dataset((as_recorded(simulation, value),))
        base = ParameterisedRobot(dict(read_description("reference")), "reference")
        parameters = nuisances(per_wheel(base.values, robot.wheel_names, "x"), robot.wheel_names, 0)
        jacobian = linearise(dataset, Model(base, parameters, ()), ())
        rest = Remainder.of(dataset, jacobian.value, jacobian.matrix)
        found.append(unmodelled_effect(rest, robot, _scales(simulation)))
    pulls, comes = found
    assert pulls is not None
    assert comes is not None
    assert (pulls.family.family_id, pulls.is_repeatable) == ("force.place", True)
    law = {name: item.value for name, item in pulls.laws[0].parameters.items()}
    expected = {"stiffness": 8.0, "slack": 0.3, "x": 0.2, "y": 0.0}
    assert law == pytest.approx(expected, abs=0.03)
    assert (comes.family.family_id, comes.is_repeatable, comes.laws) == ("force.time", False, ())


def test_what_the_users_simulation_resists_more_is_taken_off(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """A simulation whose contacts creep, on another drive than the one to be explained."""
    robot = simulation.robot
    creeps = ({"coefficient": 0.01},) * 3
    theirs = evolve(robot, physics={**robot.physics, "contact.rolling_resistance": creeps})
    recorded = as_recorded(simulation, simulation.predict([theirs])[0])
    more = discrepancy_torques([recorded], robot, 0.3)
    assert more is not None
    turned = evolve(
        simulation,
        recorded=evolve(simulation.recorded, command=simulation.recorded.command[:, [1, 0, 2]]),
    )
    torque = more.torque(motion_in(turned, robot))
    wanted, ours = turned.predict([theirs, robot])
    corrected = evolve(turned, resisting=torque).predict([robot])[0]
    powers = np.concatenate(
        [
            np.arange(p.start, p.stop)
            for c, p in zip(turned.channels, rows_of(turned.channels), strict=True)
            if c.kind == "power"
        ]
    )
    left, before = ((wanted - item)[powers].std() for item in (corrected, ours))
    assert left < 0.25 * before


def test_a_simulation_like_ours_is_left_alone(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    random = np.random.default_rng(2)
    value = simulation.predict([simulation.robot])[0]
    value += 0.05 * random.standard_normal(len(value))
    theirs = [as_recorded(simulation, value)]
    assert discrepancy_torques(theirs, simulation.robot, 0.3) is None


def test_what_the_users_simulation_shows_of_a_finding_is_taken_off(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """0.02 N m in reality: of 0.005 in the simulation a part, of 0.02 nothing is left."""
    robot = simulation.robot

    def resisting(torque: float) -> np.ndarray:
        physics = {**robot.physics, "friction.asymmetric": (None, {"torque": torque}, None)}
        return simulation.predict([evolve(robot, physics=physics)])[0]

    dataset, found = searched(simulation, resisting(0.02), ("friction.asymmetric",))
    for shown, left in ((0.005, 1), (0.02, 0)):
        simulation = as_recorded(simulation, resisting(shown))
        baseline = SimulatorBaseline.of([simulation], dataset, found.noise, robot)
        kept, theirs = beyond_baseline(dataset, found, baseline)
        assert len(kept.best.model.hypotheses) == left
        assert [offsets[0] for offsets in theirs] == pytest.approx([shown] * left, rel=0.1)
