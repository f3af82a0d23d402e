"""Evidence, optimiser, loss and parameters of the estimation, on problems solved by hand."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray
from scipy.linalg import cho_solve
from scipy.optimize import least_squares, lsq_linear
from scipy.stats import multivariate_normal

from tomr_power_model.estimation.factor import posterior_factor
from tomr_power_model.estimation.gauss_newton import (
    GaussNewtonSettings,
    Linearisation,
    Start,
    maximise,
)
from tomr_power_model.estimation.intervals import block_jackknife, block_length
from tomr_power_model.estimation.linear_gaussian import (
    AT_A_TIME,
    Gram,
    product,
    solve,
    transposed_product,
)
from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, per_wheel
from tomr_power_model.estimation.robust import soft_l1
from tomr_power_model.robot import read_description

Array = NDArray[np.float64]

WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
PRECISE = GaussNewtonSettings(most_steps=60, settled=1e-12)


@pytest.fixture
def linear() -> tuple[Array, Array]:
    random = np.random.default_rng(0)
    return random.normal(size=(12, 3)), 3.0 * random.normal(size=12)


def _start(units: Sequence[float], edge: float = np.inf) -> Start:
    wide = np.full(len(units), np.inf)
    return Start(np.array(units), np.full(len(units), -edge), np.full(len(units), edge), wide)


def test_evidence_is_the_ratio_of_gaussian_densities(linear: tuple[Array, Array]) -> None:
    columns, residual = linear
    with_all = multivariate_normal(np.zeros(12), np.eye(12) + columns @ columns.T)
    nothing = multivariate_normal(np.zeros(12), np.eye(12))
    expected = with_all.logpdf(residual) - nothing.logpdf(residual)
    assert solve(Gram.of(columns, residual), [0, 1, 2]).evidence == pytest.approx(expected)


def test_normal_equations_of_many_rows_weigh_each() -> None:
    random = np.random.default_rng(1)
    columns, residual = random.normal(size=(20_000, 2)), random.normal(size=20_000)
    weight = random.uniform(0.5, 2.0, 20_000)
    found, whitened = Gram.of(columns, residual, weight), columns * weight[:, None]
    np.testing.assert_allclose(found.matrix, whitened.T @ whitened)
    np.testing.assert_allclose(found.vector, whitened.T @ (residual * weight))
    assert found.square == pytest.approx(((residual * weight) ** 2).sum())
    second = Gram.of(columns, residual, weight, np.array([1]))
    np.testing.assert_allclose(second.matrix, found.matrix[1:, 1:])
    np.testing.assert_allclose(second.vector, found.vector[1:])
    np.testing.assert_allclose(transposed_product(columns, residual), columns.T @ residual)


def test_normal_equations_of_parameters_with_other_priors(linear: tuple[Array, Array]) -> None:
    """Columns times their prior standard deviations; one of next to none is not fitted."""
    columns, residual = linear
    scale = np.array([1.0, 0.1, 1e-9])
    scaled = Gram.of(columns, residual).scaled(scale)
    expected = Gram.of(columns * scale, residual)
    np.testing.assert_allclose(scaled.matrix, expected.matrix, atol=1e-12)
    np.testing.assert_allclose(scaled.vector, expected.vector, atol=1e-12)
    assert abs(scale * solve(scaled, range(3)).mean)[2] < 1e-12


def test_several_products_at_a_time(linear: tuple[Array, Array]) -> None:
    columns = np.tile(linear[0], (400, 1))
    units = np.stack([np.ones(3), np.arange(3.0)], axis=1)
    assert len(columns) > AT_A_TIME
    np.testing.assert_allclose(product(columns, units), columns @ units)
    np.testing.assert_allclose(product(columns, units[:, 1]), columns @ units[:, 1])


def test_a_linear_problem_takes_one_step(linear: tuple[Array, Array]) -> None:
    columns, measured = linear
    (found,) = maximise(
        [_start([0.5, 0.0, -1.0])],
        lambda _, points: [Linearisation.of(measured - columns @ points[0], columns)],
        GaussNewtonSettings(most_steps=2, settled=-1.0),
    )
    whole = solve(Gram.of(columns, measured), [0, 1, 2])
    assert found.best is not None
    np.testing.assert_allclose(found.best.units, whole.mean)
    np.testing.assert_allclose(found.best.covariance, whole.covariance)
    expected = whole.evidence - 0.5 * measured @ measured
    assert found.best.log_evidence == pytest.approx(expected)


def test_an_unknown_at_its_bound_is_held_and_the_others_go_on(linear: tuple[Array, Array]) -> None:
    columns, measured = linear
    columns = columns @ np.array([[1.0, 0.9, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]])  # correlated
    (found,) = maximise(
        [_start([0.0, 0.0, 0.0], edge=0.3)],
        lambda _, points: [Linearisation.of(measured - columns @ points[0], columns)],
        PRECISE,
    )
    stacked = np.concatenate([columns, np.eye(3)]), np.concatenate([measured, np.zeros(3)])
    expected = lsq_linear(*stacked, bounds=(-0.3, 0.3), tol=1e-14).x
    assert np.isclose(np.abs(expected), 0.3, atol=1e-6).any()
    assert found.best is not None
    np.testing.assert_allclose(found.best.units, expected, atol=1e-6)


def test_a_robust_nonlinear_problem_agrees_with_scipy() -> None:
    time = np.linspace(0.0, 2.0, 40)
    measured = 2.0 * np.exp(-1.3 * time)
    measured[7] += 30.0

    def standard(x: Array) -> Array:
        return np.asarray((measured - x[0] * np.exp(-x[1] * time)) / 0.1)

    def evaluate(_: Sequence[int], points: Sequence[Array]) -> list[Linearisation]:
        (a, b) = points[0]
        root, change = soft_l1(standard(points[0]))
        slope = np.stack([np.exp(-b * time), -a * time * np.exp(-b * time)], axis=1) / 0.1
        return [Linearisation.of(root, change[:, None] * slope)]

    (found,) = maximise([_start([1.0, 0.2])], evaluate, PRECISE)
    expected = least_squares(
        lambda x: np.concatenate([soft_l1(standard(x))[0], x]), [1.0, 0.2], xtol=1e-12
    ).x
    assert found.best is not None
    np.testing.assert_allclose(found.best.units, expected, rtol=1e-5)
    np.testing.assert_allclose(expected, [2.0, 1.3], rtol=0.1)


def test_hopeless_problems_are_left_alone(linear: tuple[Array, Array]) -> None:
    columns, measured = linear
    asked: list[list[int]] = []

    def evaluate(numbers: Sequence[int], points: Sequence[Array]) -> list[Linearisation]:
        asked.append(list(numbers))
        scale = [1.0 if number else 100.0 for number in numbers]
        return [
            Linearisation.of(s * (measured - 0.1 * columns @ point), 1e-3 * columns)
            for s, point in zip(scale, points, strict=True)
        ]

    maximise([_start([1.0] * 3)] * 2, evaluate, GaussNewtonSettings(settled=-1.0))
    assert asked[0] == [0, 1]
    assert all(numbers == [1] for numbers in asked[1:])


def test_a_step_that_makes_things_worse_is_taken_back_and_a_part_of_it_tried() -> None:
    """10 atan(x) from x = 2: the step to -2.8 overshoots what it is aimed at, 0."""
    tried: list[float] = []

    def evaluate(_: Sequence[int], points: Sequence[Array]) -> list[Linearisation]:
        (x,) = points[0]
        tried.append(x)
        return [Linearisation.of(np.array([-10.0 * np.arctan(x)]), np.array([[10 / (1 + x * x)]]))]

    (found,) = maximise([_start([2.0])], evaluate, PRECISE)
    assert tried[1] < -2.0
    assert tried[2] == pytest.approx(2.0 + PRECISE.back * (tried[1] - 2.0))
    assert found.best is not None
    assert found.best.units == pytest.approx([0.0], abs=1e-6)

    tried.clear()
    short = evolve(_start([2.0]), largest_step=np.array([0.5]))
    maximise([short], evaluate, PRECISE)
    assert tried[:2] == [2.0, 1.5]


def test_offsets_stay_within_the_bounds_of_the_description() -> None:
    base = per_wheel(read_description("reference"), WHEELS, "reference")
    keys = tuple(f"physics.friction.coulomb.{wheel}.torque" for wheel in WHEELS)
    torque = Parameter("torque", keys, "N m", 0.01)
    assert base.offset([torque], [0.02]).values[keys[1]] == pytest.approx(0.08)
    assert base.offset([torque], [-1.0]).values[keys[1]] == 0.0


def test_an_offset_of_what_is_left_out_begins_at_its_neutral_value() -> None:
    base = per_wheel(read_description("reference"), WHEELS, "reference")
    key = "physics.sensor.power_scale.wheel_2_joint.scale"
    assert base.offset([Parameter("scale", (key,), "", 0.1)], [0.05]).values[key] == 1.05


def test_a_wheels_own_value_goes_before_that_of_all() -> None:
    own = {"physics.friction.coulomb.wheel_2_joint.torque": 0.1}
    values = per_wheel({**read_description("reference"), **own}, WHEELS, "reference").values
    torques = [values[f"physics.friction.coulomb.{wheel}.torque"] for wheel in WHEELS]
    assert torques == [0.06, 0.1, 0.06]


def test_a_derivative_steps_to_the_permitted_side() -> None:
    share = Parameter("efficiency", ("x",), "", 0.1, step=0.01, lower=0.0, upper=1.0)
    assert [share.step_at(value) for value in (0.5, 0.995)] == [0.01, -0.01]


def test_blocks_are_long_against_correlation_and_drives_where_there_are_many() -> None:
    """Seven drives of 9.9 s leave blocks of 5.775 s, if there are to be twelve."""
    assert block_length([9.9] * 8, 0.1) == 9.9
    lengths = [block_length([9.9] * 7, time) for time in (0.1, 0.5, 1.0)]
    assert lengths == pytest.approx([1.0, 4.0, 5.775])


def test_the_longest_correlation_of_any_channel_makes_the_blocks() -> None:
    random = np.random.default_rng(2)
    drive = SimpleNamespace(time=0.1 * np.arange(1000), stretch=np.zeros(1000, dtype=int))
    white, lasting = random.normal(size=1000), np.repeat(random.normal(size=100), 10)  # for 1 s
    estimated = block_jackknife(
        [drive],
        np.stack([white, lasting], axis=1),
        np.ones((1000, 2, 1)),
        np.ones(2),
        robust=False,
    )
    assert estimated.block_length == pytest.approx(8.0, rel=0.3)
    assert estimated.blocks == pytest.approx(100.0 / estimated.block_length, abs=1)


def test_coordinates_of_the_mass_centre_are_set_one_by_one() -> None:
    base = ParameterisedRobot(read_description("reference"), "reference")
    assert base.given({"robot.mass_center.y": 0.03}).robot.mass_center[1] == 0.03


def test_large_columns_that_are_alike_do_not_end_a_fit() -> None:
    column = np.random.default_rng(3).normal(size=(2000, 1)) * 1e8
    columns = column * np.array([[1.0, 3.0, 1.0 + 1e-16, 0.3]])
    factor = posterior_factor(columns.T @ columns)
    found = cho_solve(factor, columns.T @ column[:, 0])
    np.testing.assert_allclose(columns @ found, column[:, 0], rtol=1e-6)


def test_the_factor_is_of_the_prior_and_the_data() -> None:
    root = np.tril(posterior_factor(np.array([[3.0, 1.0], [1.0, 5.0]]))[0])
    np.testing.assert_allclose(root @ root.T, [[4.0, 1.0], [1.0, 6.0]])
