"""Effects that remember, tick by tick: monitors, heat, ripple, slope; numbers worked by hand."""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.encoders import Triple
from tomr_power_model.model.monitors import Monitors
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN3 = (math.nan, math.nan, math.nan)
UPHILL = (-0.3, 0.0, 0.0)
PERIOD = 0.05  # s
EVERY = {
    "sensor.power_scale": {"scale": 1.1},
    "sensor.power_bias": {"power": 0.5},
    "sensor.power_lag": {"time_constant": 0.1},
    "sensor.clock_offset": {"delay": 0.03},
    "electrical.winding_heating": {
        "thermal_resistance": 50.0,
        "time_constant": 2.0,
        "initial": 0.0,
    },
    "drivetrain.torque_ripple": {"torque": 0.02, "order": 3.0, "phase": 0.4},
    "body.slope": {"angle": 0.05, "azimuth": 0.0},
}
NEUTRAL = {
    "sensor.power_scale": {"scale": 1.0},
    "sensor.power_bias": {"power": 0.0},
    "sensor.power_lag": {"time_constant": 0.0},
    "sensor.clock_offset": {"delay": 0.0},
    "electrical.winding_heating": {
        "thermal_resistance": 0.0,
        "time_constant": 2.0,
        "initial": 0.0,
    },
    "drivetrain.torque_ripple": {"torque": 0.0, "order": 3.0, "phase": 0.4},
    "body.slope": {"angle": 0.0, "azimuth": 0.0},
}


def _robot(effects: Mapping[str, Mapping[str, float]], name: str = "reference") -> Robot:
    robot = shipped_robot(name)
    added = {effect_id: (values,) * 3 for effect_id, values in effects.items()}
    return evolve(robot, physics={**robot.physics, **added})


def _drive(
    predictor: PowerPredictor,
    twist: Triple,
    until_ms: int = 2000,
    angles: bool = True,
    commands: bool = True,
) -> list[Prediction]:
    """Commands at 20 Hz; encoders at 100 Hz that follow at once, from angle 0 on."""
    speed = twist_to_wheels(shipped_robot("reference")) @ twist
    found: list[Prediction] = []
    for at_ms in range(until_ms):
        stamp = BASE + at_ms * MS
        if commands and at_ms % 50 == 0:
            predictor.command(stamp, twist)
        if at_ms % 10 == 3:
            first, second, third = (float(value) for value in speed)
            turned = (first * at_ms * 1e-3, second * at_ms * 1e-3, third * at_ms * 1e-3)
            predictor.encoders(stamp, turned if angles else NAN3, (first, second, third))
        found.extend(predictor.due())
    return found


def _powers(prediction: Prediction) -> list[float]:
    return [reading.power for reading in (*prediction.motors, *prediction.from_encoders)]


def test_scale_and_bias_are_the_monitors_alone() -> None:
    flawed = _robot({"sensor.power_scale": {"scale": 1.1}, "sensor.power_bias": {"power": 0.5}})
    true = _drive(PowerPredictor(shipped_robot("reference")), UPHILL)[-1]
    shown = _drive(PowerPredictor(flawed), UPHILL)[-1]
    np.testing.assert_allclose(_powers(shown), 1.1 * np.array(_powers(true)) + 0.5, rtol=1e-6)
    assert shown.total == true.total


def test_a_monitor_of_motor_current_shows_its_flaw_in_the_current() -> None:
    true = _drive(PowerPredictor(shipped_robot("robotino_v2")), UPHILL)[-1]
    flawed = _robot({"sensor.power_scale": {"scale": 1.1}}, "robotino_v2")
    shown = _drive(PowerPredictor(flawed), UPHILL)[-1]
    for before, after in zip(true.from_encoders, shown.from_encoders, strict=True):
        assert after.current == pytest.approx(1.1 * before.current, rel=1e-6)
        assert after.voltage == pytest.approx(before.voltage, rel=1e-6)


def test_the_lag_by_hand() -> None:
    # Step 0 -> 1 W, 0.1 s: the mean over the first 0.05 s is 1 - 2 (1 - e^-0.5) = 0.213061 and
    # the next 1 - e^-0.5 * 0.786939 = 0.522697.
    monitors = Monitors.of(_robot({"sensor.power_lag": {"time_constant": 0.1}}), PERIOD)
    assert monitors is not None
    found = [monitors.shown((power,) * 3)[0] for power in (0.0, 1.0, 1.0)]
    np.testing.assert_allclose(found, [0.0, 0.213061, 0.522697], atol=1e-6)


@pytest.mark.parametrize(
    ("delay", "expected"),
    [
        (0.075, [math.nan, math.nan, 1.5, 3.0]),
        (0.05, [math.nan, 1.0, 2.0, 4.0]),
        (-0.03, [1.0, 2.0, 4.0, 8.0]),
    ],
)
def test_the_offset_by_hand(delay: float, expected: list[float]) -> None:
    monitors = Monitors.of(_robot({"sensor.clock_offset": {"delay": delay}}), PERIOD)
    assert monitors is not None
    found = [monitors.shown((power,) * 3)[2] for power in (1.0, 2.0, 4.0, 8.0)]
    np.testing.assert_allclose(found, expected)


def test_warm_windings_draw_more() -> None:
    # 100 K for good: 0.8 ohm become 1.1144. Along -x at 0.4 m/s wheel 3 turns at 6.9282 rad/s
    # against 0.087713 N m, k = 0.7 N m/A, standby 1.2 W.
    heating = {"thermal_resistance": 0.0, "time_constant": 1e9, "initial": 100.0}
    robot = _robot({"electrical.winding_heating": heating})
    last = _drive(PowerPredictor(robot), (-0.4, 0.0, 0.0))[-1]
    current = 0.087713 / 0.7
    expected = current * (1.1144 * current + 0.7 * 6.9282) + 1.2
    assert last.from_encoders[2].power == pytest.approx(expected, rel=1e-5)
    assert last.motors[2].power == pytest.approx(expected, rel=1e-2)


def _standing_start(predictor: PowerPredictor) -> float:
    """Wheel speed expected in the first tick after a command that finds the robot standing."""
    for at_ms in range(3, 100, 10):
        predictor.encoders(BASE + at_ms * MS, (0.0, 0.0, 0.0), NAN3)
    predictor.command(BASE + 1 * MS, UPHILL)
    return predictor.due()[0].speed[2]


def test_the_ripple_follows_the_measured_angle() -> None:
    # At constant speed w the ripple's mean over the tick around t is
    # torque sin(3 w t + 0.4) sin(x) / x, x = 3 w T / 2, for the angle w t; copper besides is small.
    ripple = EVERY["drivetrain.torque_ripple"]
    rippled, plain = _robot({"drivetrain.torque_ripple": ripple}), shipped_robot("reference")
    with_it, without = (
        _drive(PowerPredictor(robot), UPHILL, commands=False) for robot in (rippled, plain)
    )
    speed = float((twist_to_wheels(shipped_robot("reference")) @ UPHILL)[2])
    half = 1.5 * speed * PERIOD
    for shown, smooth in zip(with_it[10:], without[10:], strict=True):
        middle = 1e-9 * (shown.stamp_ns - BASE) - 0.5 * PERIOD
        mean = 0.02 * math.sin(3.0 * speed * middle + 0.4) * math.sin(half) / half
        change = shown.from_encoders[2].power - smooth.from_encoders[2].power
        assert change == pytest.approx(mean * speed, abs=0.012)


def test_without_angles_there_is_no_ripple() -> None:
    ripple = EVERY["drivetrain.torque_ripple"]
    rippled = PowerPredictor(_robot({"drivetrain.torque_ripple": ripple}))
    plain = PowerPredictor(shipped_robot("reference"))
    for one, other in zip(
        _drive(rippled, UPHILL, angles=False), _drive(plain, UPHILL, angles=False), strict=True
    ):
        np.testing.assert_allclose(_powers(one), _powers(other), rtol=1e-6)


def test_the_heading_is_summed_up_over_ticks() -> None:
    # At heading h wheel 1, -4 rad/s, meets -2/3 F r sin h besides its friction of -0.076 N m.
    twist = (0.0, 0.0, 1.0)
    slope = _drive(PowerPredictor(_robot({"body.slope": EVERY["body.slope"]})), twist)[-1]
    flat = _drive(PowerPredictor(shipped_robot("reference")), twist)[-1]
    heading = 1e-9 * (slope.stamp_ns - BASE) - 0.5 * PERIOD
    torque = -2.0 / 3.0 * 7.35192 * 0.05 * math.sin(heading)
    expected = -4.0 * torque + 0.8 / 0.49 * ((torque - 0.076) ** 2 - 0.076**2)
    added = slope.from_encoders[0].power - flat.from_encoders[0].power
    # The simulation keeps the heading for each of its steps of 2.5 ms.
    assert added == pytest.approx(expected, rel=1e-3)


def test_drivers_hold_a_robot_that_stands_on_a_slope() -> None:
    """As it stands when the first command finds it, so it goes on: 0.212 N m on two wheels."""
    predictor = PowerPredictor(_robot({"body.slope": EVERY["body.slope"]}))
    found = _drive(predictor, (0.0, 0.0, 0.0))
    assert max(abs(speed) for prediction in found for speed in prediction.speed) < 1e-6
    # i = 0.212231 / 0.7 A: 0.8 ohm i^2 = 0.073537 W besides standby.
    assert found[-1].motors[1].power == pytest.approx(1.2 + 0.073537, abs=1e-4)


def test_uphill_lifts_the_body() -> None:
    # 7.35192 N * 0.3 m/s = 2.2056 W, and copper: 0.8 ohm on two wheels that carry 0.080785 and
    # then 0.293016 N m: 2 * 0.8 * (0.293016^2 - 0.080785^2) / 0.49 = 0.2590 W.
    slope = _drive(PowerPredictor(_robot({"body.slope": EVERY["body.slope"]})), UPHILL)[-1]
    flat = _drive(PowerPredictor(shipped_robot("reference")), UPHILL)[-1]
    added = np.array(_powers(slope)) - np.array(_powers(flat))
    assert added[3:].sum() == pytest.approx(2.2056 + 0.2590, rel=1e-3)
    assert added[:3].sum() == pytest.approx(added[3:].sum(), rel=2e-2)


def test_neutral_effects_change_nothing() -> None:
    plain = _drive(PowerPredictor(shipped_robot("reference")), UPHILL)
    neutral = _drive(PowerPredictor(_robot(NEUTRAL)), UPHILL)
    for one, other in zip(neutral, plain, strict=True):
        np.testing.assert_allclose(_powers(one), _powers(other), rtol=1e-6, atol=1e-9)


def test_a_restart_forgets_all_states() -> None:
    """A bag in a loop: the second round says what the first said, to the last bit."""
    predictor = PowerPredictor(_robot(EVERY))
    first, second = _drive(predictor, (0.2, 0.1, 0.5)), _drive(predictor, (0.2, 0.1, 0.5))
    assert len(first) == len(second)
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(_powers(one), _powers(other))
    assert np.isfinite(_powers(first[-1])).all()
