"""Effects that the forward selection must find in made recordings."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, per_wheel
from tomr_power_model.robot import Robot, read_description
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.findings import log_odds_of
from tomr_reality_gap.fit.backward_elimination import backward_elimination
from tomr_reality_gap.fit.basis_responses import basis_responses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import (
    Selection,
    _is_large_enough,
    cost_beside,
    finding_cost,
    forward_selection,
)
from tomr_reality_gap.fit.jacobian import Jacobian
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel, state_at
from tomr_reality_gap.fit.screening import joint_candidates
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.hypotheses.scales import scales_of, traction_ratios_of

from .test_alignment import simulation  # noqa: F401 -- the fixture

NOISE = {"power": 0.1, "total": 0.2, "voltage": 3e-3, "speed": 0.02, "yaw": 2e-3}
TRIED = ("friction.asymmetric", "friction.viscous", "electrical.switching_loss", "body.payload")


def _base(robot: Robot) -> ParameterisedRobot:
    return per_wheel(dict(read_description("reference")), robot.wheel_names, "reference")


def searched(
    made: RecordingSimulation,
    value: np.ndarray,
    tried: tuple[str, ...] = TRIED,
    without: tuple[str, ...] = (),
    beside: float = 0.0,
    barred: tuple[str, ...] = (),
) -> tuple[Dataset, Selection]:
    """Record values with noise, and search with the description of the reference robot, but for
    what is left out of it.
    """
    random = np.random.default_rng(5)
    channels = tuple(
        evolve(c, value=value[part] + NOISE[c.kind] * random.standard_normal(len(c.time)))
        for c, part in zip(made.channels, rows_of(made.channels), strict=True)
    )
    base, wheels = _base(made.robot), made.robot.wheel_names
    kept = {key: item for key, item in base.values.items() if not key.startswith(without)}
    base = evolve(base, values=kept) if without else base
    run = made.run(base.robot)
    scales = scales_of(made.robot, run.speed, run.power, run.copper, duration=30.0)
    ratios = traction_ratios_of(made.robot, run.speed, made.timeline.period)
    scales = evolve(scales, traction_ratios=ratios)
    parameters = nuisances(base, wheels, 0.02)
    candidates = [
        item for item in catalogue(base, wheels, scales, 0.02) if item.effect.startswith(tried)
    ]
    dataset = Dataset((evolve(made, channels=channels),))
    basis = basis_responses(dataset, base.robot, scales.torque)
    model = Model(base, parameters, (0.0,) * len(parameters))
    found = forward_selection(dataset, model, candidates, basis, beside=beside, barred=barred)
    if barred:
        return dataset, found
    return dataset, backward_elimination(dataset, found, candidates)


def _found(made: RecordingSimulation, real: Robot, tried: tuple[str, ...] = TRIED) -> Selection:
    return searched(made, made.predict([real])[0], tried)[1]


def test_a_concealed_friction_is_named_with_its_wheel_and_size(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    robot = simulation.robot
    concealed = (None, {"torque": 0.02}, None)
    real = evolve(
        robot, mass=1.01 * robot.mass, physics={**robot.physics, "friction.asymmetric": concealed}
    )
    selection = _found(simulation, real)
    found = selection.best
    assert [item.name for item in found.model.hypotheses] == [
        "friction.asymmetric at wheel_2_joint"
    ]
    value, sigma = found.model.offsets[0][0], found.own_sigma[0]
    assert abs(value - 0.02) < 4.0 * sigma
    assert sigma < 0.004
    # What is barred is not added; its derivatives are there to replace others with it.
    (name,) = found.model.names
    _, other = searched(simulation, simulation.predict([real])[0], barred=(name,))
    assert name not in other.best.model.names
    first = [item.rounds[0].jacobian.candidates.keys() for item in (selection, other)]
    assert first[0] == first[1]


def test_beside_what_explains_far_more_a_small_finding_is_none(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """It must bring a hundredth of what the other brings: a term without a name is not exact."""
    robot = simulation.robot
    real = evolve(robot, physics={**robot.physics, "friction.asymmetric": ({"torque": 0.02},) * 3})
    value = simulation.predict([real])[0]
    _, alone = searched(simulation, value)
    brings = alone.best.evidence - alone.without.evidence
    taken, dropped = (
        searched(simulation, value, beside=times * brings)[1].best.model.hypotheses
        for times in (50.0, 150.0)
    )
    assert len(taken) == 1
    assert dropped == ()


def test_deviations_within_the_tolerance_are_no_finding(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    robot = simulation.robot
    motors = tuple(
        evolve(motor, resistance=motor.resistance * scale)
        for motor, scale in zip(robot.motors, (1.015, 0.99, 0.985), strict=True)
    )
    real = evolve(robot, mass=0.985 * robot.mass, motors=motors)
    assert not _found(simulation, real).best.model.hypotheses


FRICTION = ("friction.coulomb", "friction.viscous", "electrical.iron_loss")


@pytest.mark.parametrize("beside", [0.0, 1e6])
def test_friction_left_out_altogether_is_friction_and_iron_loss_its_rival(
    simulation: RecordingSimulation,  # noqa: F811
    beside: float,
) -> None:
    """Iron loss brakes as Coulomb and viscous friction do together: no data distinguish them.

    Nor does what viscous friction brings count for less beside what explains far more.
    """
    robot = simulation.robot
    value = simulation.predict([robot])[0]
    left_out = tuple(f"physics.{name}" for name in FRICTION)
    _, found = searched(simulation, value, FRICTION, left_out, beside=beside)
    model = found.best.model
    assert model.names == {"friction.coulomb at all_wheels", "friction.viscous at all_wheels"}
    sizes = {item.effect: own[0] for item, own in zip(model.hypotheses, model.offsets, strict=True)}
    assert sizes == pytest.approx({"friction.coulomb": 0.06, "friction.viscous": 0.004}, rel=0.1)
    for hypothesis, group in zip(model.hypotheses, found.alternatives, strict=True):
        odds = {other.name: odd for odd, other in log_odds_of(hypothesis, group)}
        assert -5.0 < odds["electrical.iron_loss at all_wheels"] < 0.0


def test_coulomb_friction_alone_is_not_taken_for_iron_loss(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Beside a viscous friction a tenth too large, which iron loss would explain as well."""
    robot = simulation.robot
    physics = {**robot.physics, "friction.viscous": ({"coefficient": 0.0044},) * 3}
    value = simulation.predict([evolve(robot, physics=physics)])[0]
    _, found = searched(simulation, value, FRICTION, ("physics.friction.coulomb",))
    (hypothesis,) = found.best.model.hypotheses
    assert hypothesis.name == "friction.coulomb at all_wheels"
    odds = {other.name for _, other in log_odds_of(hypothesis, found.alternatives[0])}
    assert "electrical.iron_loss at all_wheels" in odds


def test_two_wrongs_that_hide_each_other_are_found_together(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Rollers that drag, behind a Coulomb friction that is stated too large."""
    robot = simulation.robot
    coulomb = robot.effect("friction.coulomb")
    assert coulomb is not None
    physics = {
        **robot.physics,
        "friction.coulomb": ({"torque": 0.6 * coulomb["torque"]},) * 3,
        "contact.roller_drag": ({"coefficient": 0.02, "slip": 0.0},) * 3,
    }
    tried = ("contact.roller_drag", "parameter.physics.friction.coulomb", "friction.quadratic")
    best = _found(simulation, evolve(robot, physics=physics), tried).best
    assert best.model.names == {
        "contact.roller_drag at all_wheels",
        "parameter.physics.friction.coulomb.torque at all_wheels",
    }


def test_a_wheel_that_slides_is_named_with_its_friction(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """Far from where nothing slides: no derivative there shows it."""
    robot = simulation.robot
    slips = (None, {"friction": 0.2}, None)
    real = evolve(robot, physics={**robot.physics, "contact.slip": slips})
    tried = ("contact.slip", "friction.viscous")
    best = _found(simulation, real, tried).best
    assert [item.name for item in best.model.hypotheses] == ["contact.slip at wheel_2_joint"]
    start = best.model.hypotheses[0].start[best.model.own[0].keys[0]]
    assert start + best.model.offsets[0][0] == pytest.approx(0.2, abs=0.004)


def test_a_parameter_that_an_addition_pushes_far_out_of_its_tolerance_comes_along() -> None:
    key = "motor.wheel_1_joint.resistance"
    tolerated = Parameter(key, (key,), "", 1.0, lower=-1.25, upper=1.25)
    model = Model(ParameterisedRobot({}, "made"), (tolerated,), (0.0,))
    wrong = Hypothesis(
        "parameter.motor.resistance",
        ("wheel_1_joint",),
        (Parameter("value", (key,), "ohm", 1.0),),
    )
    friction = Parameter("torque", ("physics.friction.coulomb.torque",), "N m", 1.0)
    added = Hypothesis("friction.coulomb", ("all_wheels",), (friction,))
    for offset, expected in ((3.0, (wrong,)), (-3.0, (wrong,)), (1.2, ())):
        assert joint_candidates(model, np.array([offset]), added, [added, wrong]) == expected


def test_late_power_sensors_are_distinguished_from_slow_ones(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """15 ms, longer than a step in power lasts: its derivative at none shows nothing."""
    robot = simulation.robot
    late = ({"delay": 0.015},) * 3
    real = evolve(robot, physics={**robot.physics, "sensor.clock_offset": late})
    tried = ("sensor.clock_offset", "sensor.power_lag")
    best = _found(simulation, real, tried).best
    assert [item.name for item in best.model.hypotheses] == ["sensor.clock_offset at all_wheels"]
    assert best.model.offsets[0][0] == pytest.approx(0.015, abs=0.002)


def test_a_sensor_nuisance_is_off_by_a_little_or_not_at_all() -> None:
    """A clock's column is a straight line: far out it would pass for a slow sensor."""
    nothing = np.empty((0, 3))
    jacobian = Jacobian(
        Model(ParameterisedRobot({}, "made"), (), ()),
        *np.empty((2, 0)),
        nothing,
        slice(0),
        slice(3),
        (),
        {},
    )
    offsets = np.array([0.5, 7.0, -20.0])
    _, sensors = state_at(jacobian.model, offsets, jacobian)
    np.testing.assert_array_equal(sensors, [0.5, 4.0, -4.0])


def test_delays_of_power_sensors_are_tried_far_from_none(
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    base, run = _base(simulation.robot), simulation.run(simulation.robot)
    scales = scales_of(simulation.robot, run.speed, run.power, run.copper, duration=30.0)
    alternatives = {
        item.parameters[0].discrete_offset
        for item in catalogue(base, simulation.robot.wheel_names, scales, 0.02)
        if item.name == "sensor.clock_offset at all_wheels"
    }
    assert 0.0 in alternatives
    assert max(alternatives) > 0.05
    assert min(alternatives) < -0.01


def test_a_finding_costs_more_among_many_samples_and_beside_large_ones() -> None:
    assert finding_cost(1000) == 20.0
    assert finding_cost(100_000) == pytest.approx(300.0)
    assert finding_cost(1000, 5000.0) == pytest.approx(50.0)


def test_a_fifth_of_what_is_left_is_a_finding_beside_whatever_others_explain() -> None:
    assert finding_cost(1000, 5000.0, 200.0) == pytest.approx(40.0)
    assert finding_cost(1000, 5000.0, 400.0) == pytest.approx(50.0)
    assert finding_cost(1000, 5000.0, 10.0) == 20.0
    assert cost_beside(1000, _fitted(-500.0), _fitted(-9_500.0), 0.0) == pytest.approx(90.0)
    assert cost_beside(1000, _fitted(-300.0), _fitted(-9_300.0), 0.0) == pytest.approx(60.0)


def test_what_a_learnt_term_is_off_by_is_no_finding_however_much_of_the_rest_it_is() -> None:
    assert cost_beside(1000, _fitted(-300.0), _fitted(-9_300.0), 1000.0) == pytest.approx(100.0)


def _fitted(evidence: float) -> FittedModel:
    none = np.empty(0)
    return FittedModel(
        Model(ParameterisedRobot({}, "made"), (), (), (), ()), evidence, 0.0, none, none, none
    )


@pytest.mark.parametrize(
    ("size", "least", "expected"), [(3.1, 0.0, True), (2.9, 0.0, False), (3.1, 3.2, False)]
)
def test_an_addition_must_be_larger_than_noise_and_than_sampling_shows(
    size: float, least: float, expected: bool
) -> None:
    """Standard deviations of 0.5 and 1; the first was there before."""
    known, added = (
        Hypothesis(name, ("body",), (Parameter("size", (name,), "", 1.0),), least=least)
        for name in ("known", "added")
    )
    model = Model(ParameterisedRobot({}, "made"), (), (), (known, added), ((0.0,), (size,)))
    none = np.empty(0)
    fitted = FittedModel(model, 0.0, 0.0, none, np.diag([0.25, 1.0]), none)
    assert _is_large_enough(fitted, 1) is expected
