"""Calibration on drives whose truth is known: values, intervals, what is not determined."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from scipy.ndimage import maximum_filter1d

from tomr_power_model.calibration.calibrate import Result, Timing, align, calibrate
from tomr_power_model.calibration.fit import fit
from tomr_power_model.calibration.identify import warnings_of
from tomr_power_model.calibration.parameters import Choice, choose
from tomr_power_model.calibration.problem import Problem, determined, modelled_power
from tomr_power_model.calibration.samples import Samples, samples_of
from tomr_power_model.calibration.structure import structure_warnings
from tomr_power_model.drive.motion import wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.dynamics.drives import InverseDynamics, WheelMotion
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import ParameterisedRobot, prior_stds
from tomr_power_model.robot import (
    GRAVITY,
    Robot,
    read_description,
    robot_from_parameters,
    shipped_robot,
)

MakeDrive = Callable[..., Drive]
VALUES = read_description("reference")
ROBOT = shipped_robot("reference")
# Samples without a window: the drives of these tests are sampled in an instant.
TIMING = Timing(span=0.05, window=1e-9)
FRICTION = (
    "physics.friction.coulomb.torque",
    "physics.friction.viscous.coefficient",
    "physics.electrical.driver_standby.power",
)


def calibrated(recorded: list[Drive], choice: Choice, held_out: tuple[Drive, ...] = ()) -> Result:
    """A calibration of the reference robot on recordings."""
    return calibrate(
        VALUES,
        "test",
        align(recorded, ROBOT, TIMING),
        align(held_out, ROBOT, TIMING),
        choice=choice,
    )


def fitted_values(result: Result) -> dict[str, tuple[float, float]]:
    """Value and half of the 95 % interval by key."""
    rows = zip(result.parameters, result.fitted.numbers, result.half_widths, strict=True)
    return {item.keys[0]: (number, half) for item, number, half in rows}


def test_values_are_recovered_within_their_intervals(
    make_drive: MakeDrive, other_values: Callable[[Robot], Robot]
) -> None:
    real = other_values(ROBOT)
    drives = [make_drive(real, seed, noise=0.2, name=f"tour{seed}") for seed in (1, 2)]
    unseen = make_drive(real, 7, name="unseen")
    result = calibrated(drives, Choice(keys=(*FRICTION, "robot.mass")), (unseen,))
    found = fitted_values(result)
    for wheel, name in enumerate(ROBOT.wheel_names):
        truth = real.effect("friction.coulomb", wheel)
        assert truth is not None
        value, half = found[f"physics.friction.coulomb.{name}.torque"]
        # 95 % intervals of ten values: one in ten tests may miss by a little.
        assert value == pytest.approx(truth["torque"], abs=1.5 * half)
        assert half < 0.12 * truth["torque"]
    value, half = found["robot.mass"]
    assert value == pytest.approx(real.mass, abs=1.5 * half)
    assert result.held_out_scores.whole is not None
    assert result.held_out_scores_before.whole is not None
    motors, before = 3, result.held_out_scores_before.whole
    assert result.held_out_scores.whole.accuracy[motors] > 0.975 > before.accuracy[motors]


def test_a_knock_does_not_bend_the_result(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 3)
    knocked = drive.power.copy()
    knocked[300:312, 1] += 40.0
    choice = Choice(keys=FRICTION)
    clean = fitted_values(calibrated([drive], choice))
    robust = fitted_values(calibrated([evolve(drive, power=knocked)], choice))
    key = f"physics.friction.coulomb.{ROBOT.wheel_names[1]}.torque"
    assert robust[key][0] == pytest.approx(clean[key][0], rel=0.03)


def correlated_samples(seed: int, phi: float, truth: Robot) -> Samples:
    """Exact motion, and power with first-order autoregressive noise of 0.2 W."""
    random = np.random.default_rng(seed)
    count, step = 2000, 0.02
    corners = np.arange(0, count, 40)
    targets = random.uniform(-8.0, 8.0, (len(corners), 3))
    time = np.arange(count)
    speed = np.column_stack([np.interp(time, corners, column) for column in targets.T])
    motion = WheelMotion(speed, np.gradient(speed, step, axis=0))
    noise = 0.2 * np.sqrt(1.0 - phi**2) * random.standard_normal((count, 4))
    for row in range(1, count):
        noise[row] += phi * noise[row - 1]
    measured = modelled_power(truth, motion) + noise
    measured[:, 3] = np.nan
    return Samples("x", time * step, measured, motion, 1, np.zeros(count, dtype=np.int64))


def test_intervals_hold_for_correlated_noise() -> None:
    choice = Choice(keys=(*FRICTION, "robot.mass"), shared=("all",))
    parameters = tuple(choose(VALUES, ROBOT.wheel_names, choice, "test"))
    described = ParameterisedRobot(VALUES, "test")
    inside = []
    for seed in range(40):
        random = np.random.default_rng(seed + 500)
        truth = {
            item.name: item.prior_mean * (1.0 + 0.05 * random.standard_normal())
            for item in parameters
        }
        robot = described.given(truth).robot
        samples = correlated_samples(seed, 0.9, robot)
        found = fit(Problem(described, parameters, (samples,)))
        width = found.uncertainty.factor * found.uncertainty.deviation * prior_stds(parameters)
        inside.append(np.abs(found.numbers - list(truth.values())) < width)
    # 160 intervals; counted as independent they would cover 91.6 % to 98.4 % in 19 of 20 runs.
    assert 0.90 < np.mean(inside) < 0.995


def test_recordings_of_different_encoder_rates_are_fitted_together(make_drive: MakeDrive) -> None:
    fast, slow = make_drive(ROBOT, 1), make_drive(ROBOT, 2, name="slow")
    every_second = {
        name: getattr(slow, name)[::2] for name in ("encoder_time", "position", "velocity")
    }
    samples = align([fast, evolve(slow, **every_second)], ROBOT, Timing(span=0.1, window=0.02))
    assert [item.parts for item in samples] == [2, 1]
    described = ParameterisedRobot(VALUES, "test")
    together = Problem(described, (), samples).residual([])
    alone = [Problem(described, (), (item,)).residual([]) for item in samples]
    np.testing.assert_array_equal(together, np.concatenate(alone))


@pytest.mark.parametrize(("shift", "word"), [(0.03, "late"), (-0.03, "early")])
def test_a_power_sensor_that_comes_late_is_named(
    make_drive: MakeDrive, shift: float, word: str
) -> None:
    drive = make_drive(ROBOT, 1)
    shifted = evolve(drive, power_time=drive.power_time + shift)
    warnings = structure_warnings(align([shifted], ROBOT, TIMING), ROBOT)
    late = [line for line in warnings if f"{word} against joint_states" in line]
    topics = [line.partition(" ")[0] for line in late]
    assert topics == [f"{name}/power" for name in ROBOT.wheel_topics]


def test_missing_physics_is_suspected_where_the_misfit_follows_speed(make_drive: MakeDrive) -> None:
    windy = {"friction.quadratic": ({"coefficient": 2e-3},) * 3}
    real = evolve(ROBOT, physics={**ROBOT.physics, **windy})
    samples = align([make_drive(real, 1)], ROBOT, TIMING)
    (line,) = structure_warnings(samples, ROBOT)
    assert "missing physics: run tomr_gap explain" in line
    assert line.endswith("depends on speed)")
    assert structure_warnings(samples, real) == []


def test_missing_physics_is_suspected_beneath_a_coarse_sensors_noise(make_drive: MakeDrive) -> None:
    """Friction that is left out, in readings of 2.4 W steps; the steps alone are no physics."""
    windy = {"friction.quadratic": ({"coefficient": 4e-4},) * 3}
    real = evolve(ROBOT, physics={**ROBOT.physics, **windy})
    for seed, robot, expected in ((3, ROBOT, 1), (4, ROBOT, 1), (3, real, 0), (4, real, 0)):
        drive = make_drive(real, seed, seconds=240.0, noise=0.8)
        coarse = evolve(drive, power=2.4 * np.round(drive.power / 2.4))
        assert len(structure_warnings(align([coarse], robot, TIMING), robot)) == expected


def test_a_trace_of_missing_physics_in_a_long_drive_is_none(make_drive: MakeDrive) -> None:
    """Surely there, but half a percent of the power."""
    real = evolve(
        ROBOT, physics={**ROBOT.physics, "friction.quadratic": ({"coefficient": 2e-5},) * 3}
    )
    drive = make_drive(real, 3, seconds=240.0, noise=0.05)
    assert structure_warnings(align([drive], ROBOT, TIMING), ROBOT) == []


def test_wheels_at_rest_say_nothing_where_drivers_hold_them(make_drive: MakeDrive) -> None:
    (samples,) = align([make_drive(ROBOT, 1)], ROBOT, TIMING)
    still = np.abs(samples.motion.speed) < 0.15
    assert still.any()
    left_out = np.isnan(determined(samples, ROBOT)) & np.isfinite(samples.measured)
    np.testing.assert_array_equal(left_out[:, :3], still & np.isfinite(samples.measured[:, :3]))
    assert left_out[still.all(axis=1), 3].all()
    loose = evolve(ROBOT, controller=evolve(ROBOT.controller, integral=0.0))
    np.testing.assert_array_equal(determined(samples, loose), samples.measured)


def test_what_the_drives_do_not_determine_is_said(make_drive: MakeDrive) -> None:
    result = calibrated([make_drive(ROBOT, 1)], Choice())
    warnings = "\n".join(result.warnings)
    # Supply power depends on R and k through R / k^2 alone.
    assert "motor.resistance and motor.torque_constant are determined only together" in warnings
    assert "motor.torque_constant of every wheel: not determined" in warnings
    assert "robot.inertia_z:" not in warnings
    steady = make_drive(ROBOT, 1)
    change = np.abs(np.gradient(steady.velocity, axis=0)).max(axis=1)
    still = maximum_filter1d(change, 11) < 1e-9
    power = np.where(still[4::4, None], steady.power, np.nan)
    result = calibrated(
        [evolve(steady, power=power, total=np.full_like(steady.total, np.nan))],
        Choice(keys=("robot.inertia_z", *FRICTION)),
    )
    assert any(
        "robot.inertia_z: not determined" in line and "spins" in line for line in result.warnings
    )


def test_what_is_not_determined_and_yet_far_off_is_no_value_to_stay_with() -> None:
    (mass,) = choose(VALUES, ROBOT.wheel_names, Choice(keys=("robot.mass",)), "test")
    uncertainty = SimpleNamespace(shrinkage=[0.9], correlation=np.eye(1))
    for off, words in ((1.0, "stays near the description"), (5.0, "run tomr_gap explain")):
        number = mass.prior_mean + off * mass.prior_std
        fitted: Any = SimpleNamespace(uncertainty=uncertainty, numbers=[number], converged=True)
        (line,) = warnings_of([mass], fitted, ROBOT.wheel_names)
        assert words in line


def test_motor_currents_without_sign_and_total_power_alone(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 2, noise=0.0)
    empty = np.full_like(drive.power, np.nan)
    choice = Choice(keys=("physics.friction.coulomb.torque",), shared=("all",))
    heavier = {**VALUES, "physics.friction.coulomb.torque": 0.09}
    total = align([evolve(drive, power=empty)], ROBOT, TIMING)
    found = calibrate(heavier, "test", total, (), choice=choice)
    assert found.fitted.numbers[0] == pytest.approx(0.06, rel=0.05)

    unsigned = {"measurement.quantity": "motor_current", "measurement.signed": False}
    robot = robot_from_parameters({**VALUES, **unsigned}, "test")
    motion = samples_of(drive, ROBOT, TIMING.span, TIMING.window)
    rows = np.isin(drive.power_time, motion.time)
    current = empty.copy()
    current[rows] = np.abs(InverseDynamics.of(ROBOT).power(motion.motion).current)
    currents = evolve(drive, power=current, total=drive.total[:0], total_time=drive.total_time[:0])
    found = calibrate(
        {**heavier, **unsigned}, "test", align([currents], robot, TIMING), (), choice=choice
    )
    assert found.fitted.numbers[0] == pytest.approx(0.06, rel=0.02)
    with pytest.raises(InputError, match="measures motor currents"):
        choose(
            {**VALUES, **unsigned},
            ROBOT.wheel_names,
            evolve(choice, keys=("motor.resistance",), quantity="motor_current"),
            "test",
        )


def test_magnitudes_of_power_are_no_driving_where_a_motor_brakes(make_drive: MakeDrive) -> None:
    """With the signs left out, what flows back is neither lost nor driven with."""
    drive = make_drive(ROBOT, 2, noise=0.0)
    assert drive.power.min() < -0.5
    keys = (*FRICTION[:2], "robot.mass", "motor.torque_constant")
    unsigned = {**VALUES, "measurement.signed": False, "robot.mass": 16.0}
    magnitudes = evolve(
        drive, power=np.abs(drive.power), total=drive.total[:0], total_time=drive.total_time[:0]
    )
    robot = robot_from_parameters(unsigned, "test")
    choice = Choice(keys=keys, shared=("all",))
    found = calibrate(unsigned, "test", align([magnitudes], robot, TIMING), (), choice=choice)
    assert found.fitted.numbers == pytest.approx([VALUES[key] for key in keys], rel=0.01)


def test_power_is_an_average_over_the_described_window(make_drive: MakeDrive) -> None:
    wide = evolve(ROBOT, sensors=evolve(ROBOT.sensors, power_window=0.02))
    described, given = (samples_of(make_drive(ROBOT, 1), wide, 0.05, w) for w in (None, 0.03))
    assert (described.parts, given.parts) == (2, 3)


def test_motion_between_irregular_samples() -> None:
    random = np.random.default_rng(0)
    time = np.cumsum(random.uniform(0.007, 0.013, 300))
    time[150:] += 0.05  # a gap within the span of the fit
    angle = np.stack([2.0 * time + 1.5 * time**2, -time, 0.0 * time], axis=1)
    # In mid-drive, before the gap, in it, after it, and just before the end.
    at = np.array([0.5, time[149] - 0.02, time[149] + 0.025, 2.0, time[-1] - 0.01])
    none = np.full_like(angle, np.nan)
    motion = wheel_motion(time, angle, none, at, 0.12)
    np.testing.assert_allclose(motion.speed[0], [3.5, -1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(motion.acceleration[0], [3.0, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(motion.speed[3], [8.0, -1.0, 0.0], atol=1e-9)
    assert np.isnan(motion.speed[[1, 2, 4]]).all()
    speed = np.stack([2.0 + 3.0 * time, -1.0 + 0.0 * time, 0.0 * time], axis=1)
    from_speed = wheel_motion(time, none, speed, at, 0.12)
    np.testing.assert_allclose(from_speed.speed[0], [3.5, -1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(from_speed.acceleration[0], [3.0, 0.0, 0.0], atol=1e-7)


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        (("robot.weight",), "did you mean robot.wheel"),
        (("physics.friction.coulomb.wheel_9_joint.torque",), "no such value"),
        (("robot.wheel_names",), "no such value"),
    ],
)
def test_a_key_that_cannot_be_fitted_is_refused(keys: tuple[str, ...], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        choose(VALUES, ROBOT.wheel_names, Choice(keys=keys), "test")


def dragged(slip: float) -> Robot:
    drag = {"physics.contact.roller_drag.coefficient": 0.3}
    bare = {key: value for key, value in VALUES.items() if not key.startswith("physics.")}
    return robot_from_parameters({**bare, **drag, "physics.contact.roller_drag.slip": slip}, "test")


def test_roller_drag_turns_with_the_slip_by_hand() -> None:
    # Wheels at 0, 120, 240 degrees; travel along +x at 0.4 m/s: sliding along the axles 0.4, -0.2,
    # -0.2 m/s, rolling at 0, 0.3464, -0.3464 m/s. Drag 0.3 * 15 g / 3 = 14.71 N, times u / hypot(
    # u, 0.5 v): 1, and 0.2 / hypot(0.2, 0.1732) = 0.7559. Along x: 14.71 (1 + 0.7559) = 25.83 N.
    force = 0.3 * 15.0 * GRAVITY / 3.0 * (1.0 + 0.2 / np.hypot(0.2, 0.5 * 0.4 * np.sqrt(0.75)))
    robot = dragged(0.5)
    model = InverseDynamics.of(robot)
    speed = np.array([[0.0, 0.4 * np.sqrt(0.75) / 0.05, -0.4 * np.sqrt(0.75) / 0.05]])
    torque = model.power(WheelMotion(speed, np.zeros((1, 3)))).torque
    np.testing.assert_allclose(
        torque, force * 0.05 / np.sqrt(3.0) * np.array([[0, 1, -1]]), atol=1e-9
    )


def test_a_tolerance_is_half_of_a_range_in_which_all_is_equally_likely() -> None:
    choice = Choice(keys=("robot.mass",), tolerances={"robot.mass": 0.03})
    (mass,) = choose(VALUES, ROBOT.wheel_names, choice, "test")
    assert mass.prior_mean == ROBOT.mass
    assert mass.prior_std == pytest.approx(0.03 * ROBOT.mass / 3.0**0.5)
