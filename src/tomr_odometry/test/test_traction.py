"""Forces of contacts from power: what inverse dynamics make of a motion is found again."""

import math

import pytest
from attrs import evolve

from tomr_odometry.traction import Tractions
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import Robot, shipped_robot
from tomr_power_model.slides.body import body_of

ROBOT = shipped_robot("reference")
WHEELS = 3


def _motion(speed: float, change: float) -> list[float]:
    wheel = [speed, change, 0.0, 0.0, 0.0, math.nan]
    return [math.nan, math.nan, *wheel, *wheel, *wheel]


@pytest.mark.parametrize(
    ("speed", "change"), [(6.0, 0.0), (6.0, 12.0), (-3.0, -20.0), (8.0, -30.0)]
)
def test_one_of_two_currents_is_that_of_inverse_dynamics(speed: float, change: float) -> None:
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    motion, power, both = _motion(speed, change), [0.0] * (WHEELS * at.POWER_WHEEL), [0.0] * 6
    laws.drive_power(numbers, motion, power, WHEELS)
    drawn = power[at.POWER_DRAWN :: at.POWER_WHEEL]
    laws.motor_currents(numbers, motion, drawn, both, WHEELS)
    current = power[at.POWER_CURRENT]
    assert min(abs(one - current) for one in both[:2]) < 1e-3
    assert both[0] <= both[1]


@pytest.mark.parametrize("speed", [6.0, 0.02, 0.0, -3.0])
@pytest.mark.parametrize("drawn", [-40.0, 0.5, 2.0, 60.0])
def test_both_currents_leave_the_power_or_are_where_it_is_least(speed: float, drawn: float) -> None:
    """P(i) = R i^2 + k w i + standby, either side of i = -k w / 2 R: what is less leaves that."""
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    both = [0.0] * 6
    laws.motor_currents(numbers, _motion(speed, 0.0), [drawn] * 3, both, WHEELS)
    motor, standby = ROBOT.motors[0], ROBOT.everywhere("electrical.driver_standby", "power")[0]
    back = motor.wheel_constant * speed
    least = -0.5 * back / motor.resistance
    lowest = standby - 0.25 * back**2 / motor.resistance
    for current, way in ((both[0], -1.0), (both[1], 1.0)):
        assert way * (current - least) >= 0.0
        power = motor.resistance * current**2 + back * current + standby
        assert power == pytest.approx(max(drawn, lowest), abs=0.01)


def test_the_motion_that_is_shown_is_of_the_last_sample_that_was_asked_for() -> None:
    """Angles of 2 t + 3 t^2, -t and 1 rad."""
    found = Tractions(ROBOT)
    for sample in range(12):
        assert (found.speeds is None) == (sample < 8)
        seconds = 0.01 * sample
        found.encoders(10_000_000 * sample, (2.0 * seconds + 3.0 * seconds**2, -seconds, 1.0))
    speed = [2.0 + 6.0 * 0.11, -1.0, 0.0]
    assert found.speeds == pytest.approx(speed, abs=1e-9)
    found.encoders(120_000_000, (0.0, 0.0, 0.0))  # nothing asks for it
    assert found.shown is not None
    assert found.shown[0] == pytest.approx(speed, abs=1e-9)
    assert found.shown[1] == pytest.approx([6.0, 0.0, 0.0], abs=1e-6)


def test_force_of_a_contact_is_what_accelerates_the_body() -> None:
    # Turning on the spot: each of three wheels gives a third of I alpha / R.
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    motion, power, found = _motion(5.0, 10.0), [0.0] * (WHEELS * at.POWER_WHEEL), [0.0] * 6
    laws.drive_power(numbers, motion, power, WHEELS)
    laws.tractions(numbers, motion, power[at.POWER_CURRENT :: at.POWER_WHEEL], found, WHEELS)
    turning = -ROBOT.wheel_radius / ROBOT.robot_radius * 10.0
    assert found[0] == pytest.approx(
        -ROBOT.inertia_z * turning / ROBOT.robot_radius / 3.0, rel=0.01
    )
    assert found[1] < 0.01


def test_nothing_is_said_without_a_command_or_power() -> None:
    tractions = Tractions(ROBOT)
    for sample in range(20):
        tractions.encoders(10_000_000 * (sample + 1), (0.05 * sample,) * 3)
    assert tractions.power(200_000_000, 0, 5.0) is None
    tractions.command(200_000_000, (0.3, 0.0, 0.0))
    assert tractions.power(200_000_000, 0, math.nan) is None
    assert tractions.power(200_000_000, 0, 5.0) is not None


def test_commands_without_encoders_are_forgotten_in_time() -> None:
    tractions = Tractions(ROBOT)
    for number in range(5000):
        tractions.command(50_000_000 * number, (0.3, 0.0, 0.0))
    assert len(tractions._commands) < 2000


def _started(robot: Robot, last: int, change: float = 20.0) -> Tractions:
    """Wheels at 10 rad/s that change their speed from 0.8 s on [rad/s^2], until `last` [10 ms]."""
    tractions = Tractions(robot)
    tractions.command(0, (0.3, 0.0, 0.0))
    for sample in range(1, last + 1):
        time = 0.01 * sample
        angle = 10.0 * time + 0.5 * change * max(time - 0.8, 0.0) ** 2
        tractions.encoders(10_000_000 * sample, (angle,) * 3)
    return tractions


def test_speeds_are_those_in_the_middle_of_what_a_power_averages() -> None:
    robot = evolve(ROBOT, sensors=evolve(ROBOT.sensors, power_window=0.02))
    found = _started(robot, 100).power(1_000_000_000, 0, 20.0)
    assert found is not None
    assert found.speed == pytest.approx(10.0 + 20.0 * 0.19, abs=1e-6)


def test_a_power_long_after_the_last_encoder_sample_shows_nothing() -> None:
    assert _started(ROBOT, 100).power(1_200_000_000, 0, 20.0) is not None
    assert _started(ROBOT, 100).power(1_300_000_000, 0, 20.0) is None


@pytest.mark.parametrize(("signed", "speed", "sign"), [(True, -1.0, 1.0), (False, -1.0, -1.0)])
def test_a_magnitude_of_current_is_taken_to_drive(signed: bool, speed: float, sign: float) -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current", signed=signed)
    tractions = Tractions(evolve(ROBOT, measurement=measurement))
    tractions.command(0, (0.3, 0.0, 0.0))
    for sample in range(1, 20):
        tractions.encoders(10_000_000 * sample, (0.1 * speed * sample,) * 3)
    found = tractions.power(190_000_000, 0, 2.0)
    assert found is not None
    assert math.copysign(1.0, found.force) == sign


def test_a_power_leaves_two_forces_of_which_one_is_named() -> None:
    found = _started(ROBOT, 100).power(1_000_000_000, 0, 20.0)
    assert found is not None
    (one, other), (std, _) = found.either
    assert found.force in (one, other)
    assert other - one > 20.0
    assert found.nearer(one - 5.0) == (one, std)
    assert found.nearer(other + 5.0)[0] == other
    # Both currents draw the same power.
    motor, speed = ROBOT.motors[0], found.speed
    apart = (other - one) * ROBOT.wheel_radius / motor.wheel_constant
    middle = -0.5 * motor.wheel_constant * speed / motor.resistance
    law = motor.resistance * ((0.5 * apart) ** 2 - middle**2)
    assert law == pytest.approx(20.0, rel=0.1)


def test_a_measured_current_leaves_one_force() -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current", signed=True)
    found = _started(evolve(ROBOT, measurement=measurement), 100).power(1_000_000_000, 0, 2.0)
    assert found is not None
    assert found.either[0] == (found.force, found.force)
    assert math.isfinite(found.rolling)
    unsigned = evolve(measurement, signed=False)
    blunt = _started(evolve(ROBOT, measurement=unsigned), 100).power(1_000_000_000, 0, 2.0)
    assert blunt is not None
    assert math.isnan(blunt.rolling)  # magnitudes have nothing to compare


def _one_of_two(law: float, change: float = -20.0) -> tuple[list[float], float, float, float]:
    """Both currents of a power, which is taken for a law's voltage between them, noise, rolling."""
    tractions, motion = Tractions(ROBOT), _motion(4.0, change)
    numbers, laws = laid_out(vehicle_of(ROBOT)).tolist(), plain(tuple(ROBOT.physics))
    power, both = [0.0] * (WHEELS * at.POWER_WHEEL), [0.0] * 6
    laws.drive_power(numbers, motion, power, WHEELS)
    laws.motor_currents(numbers, motion, power[at.POWER_DRAWN :: at.POWER_WHEEL], both, WHEELS)
    current = both[0] + law * (both[1] - both[0])
    motor = ROBOT.motors[0]
    held = motor.resistance * current + motor.wheel_constant * 4.0
    motion[at.MOTION_HEADER + at.MOTION_VOLTAGE] = held
    found, noise, _ = tractions._current(
        0, power[at.POWER_DRAWN], motion, both[:2], power[at.POWER_CURRENT]
    )
    return both[:2], found, noise, power[at.POWER_CURRENT]


def test_the_drivers_law_shows_which_current_it_is_and_rolling_where_that_does_not() -> None:
    for law, side in ((0.0, 0), (1.0, 1)):
        both, found, noise, _ = _one_of_two(law)
        assert found == both[side]
        assert noise < 0.1 * (both[1] - both[0])
    sure = noise
    both, found, noise, rolling = _one_of_two(0.5)
    assert abs(found - rolling) < 0.5 * (both[1] - both[0])
    assert noise > 1.05 * sure  # the other one is not beyond doubt


def test_what_a_driver_has_summed_up_follows_the_measured_power() -> None:
    """So its law gives the voltage that it holds, whatever it held when it was heard first."""
    measurement, motor = evolve(ROBOT.measurement, quantity="motor_current"), ROBOT.motors[0]
    tractions, (body, radius) = Tractions(evolve(ROBOT, measurement=measurement)), body_of(ROBOT)
    x, y, turning = (body.to_twist @ (10.0 * radius)).tolist()  # what the wheels do is asked for
    tractions.command(0, (x, y, turning))
    for sample in range(1, 200):
        tractions.encoders(10_000_000 * sample, (0.1 * sample,) * 3)
        tractions.power(10_000_000 * sample, 0, 0.5)
    motion = tractions._motion(2_000_000_000)
    assert motion is not None
    held = motor.resistance * 0.5 + motor.wheel_constant * 10.0
    assert motion[at.MOTION_HEADER + at.MOTION_VOLTAGE] == pytest.approx(held, rel=0.02)


@pytest.mark.parametrize("quantity", ["power", "motor_current"])
@pytest.mark.parametrize("wheel", range(WHEELS))
def test_a_contact_s_force_hangs_on_its_own_wheel(wheel: int, quantity: str) -> None:
    """Of a robot with unlike motors: that of a robot whose motors are all as the one asked for."""
    plain_motor = ROBOT.motors[0]
    first, second, third = (
        evolve(plain_motor, torque_constant=scale * plain_motor.torque_constant)
        for scale in (1.0, 1.2, 0.8)
    )
    found = []
    for motors in ((first, second, third), ((first, second, third)[wheel],) * 3):
        measurement = evolve(ROBOT.measurement, quantity=quantity)
        tractions = Tractions(evolve(ROBOT, motors=motors, measurement=measurement))
        tractions.command(0, (0.3, 0.0, 0.0))
        for sample in range(1, 20):
            tractions.encoders(10_000_000 * sample, (0.05 * sample, 0.1 * sample, -0.08 * sample))
        found.append(tractions.power(190_000_000, wheel, 2.0))
    one, other = found
    assert one is not None
    assert one == other
    assert one.speed == pytest.approx((5.0, 10.0, -8.0)[wheel])
