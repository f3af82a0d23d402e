"""Recordings that must not be taken for physics: refused in a line with place and remedy."""

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.following import lost_wheels
from tomr_power_model.drive.cut import measured_when, without
from tomr_power_model.drive.excitation import check_excitation
from tomr_power_model.drive.quality import Finding, refuse, sensor_faults
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import shipped_robot

MakeDrive = Callable[..., Drive]
ROBOT = shipped_robot("reference")


def faults(drive: Drive) -> list[Finding]:
    return [*sensor_faults(drive, ROBOT), *lost_wheels(drive, ROBOT)]


def during(time: np.ndarray, start: float = 10.0, end: float = 16.0) -> np.ndarray:
    return (time >= start) & (time <= end)


def lose_encoder(drive: Drive) -> Drive:
    """Wheel 3 as its encoder reports it when it is cut off: still, while its driver gives all."""
    position, velocity, power = drive.position.copy(), drive.velocity.copy(), drive.power.copy()
    rows = during(drive.encoder_time)
    position[rows, 2] = position[rows, 2][0]
    velocity[rows, 2] = 0.0
    power[during(drive.power_time), 2] = 18.0
    return evolve(drive, position=position, velocity=velocity, power=power)


def lose_drive(drive: Drive) -> Drive:
    """Wheel 2 hardly turns."""
    speed = drive.velocity.copy()
    speed[during(drive.encoder_time), 1] *= 0.1
    return evolve(drive, velocity=speed, position=0.01 * np.cumsum(speed, axis=0))


def stick(drive: Drive) -> Drive:
    reading = drive.reading.copy()
    reading[during(drive.power_time), 0] = 0.25
    return evolve(drive, reading=reading)


def saturate(drive: Drive) -> Drive:
    reading = drive.reading.copy()
    reading[:, 1] = np.minimum(reading[:, 1], 0.2 * reading[:, 1].max())
    return evolve(drive, reading=reading)


def reverse(drive: Drive) -> Drive:
    return evolve(drive, power=drive.power * np.array([1.0, 1.0, -1.0]))


@pytest.mark.parametrize(
    ("damage", "wheel", "seen", "remedy"),
    [
        (lose_encoder, 3, "encoder stands still while it draws 18.0 W", "--skip tour=9.0:17.0"),
        (lose_drive, 2, "does not follow its command", "--skip tour="),
        (stick, 1, "power sensor repeats 0.25", "--skip tour=9."),
        (saturate, 2, "power sensor is saturated", "record it again"),
        (reverse, 3, "it draws -", "or set measurement.signed: false"),
    ],
)
def test_faults_are_refused_with_wheel_interval_and_remedy(
    make_drive: MakeDrive,
    damage: Callable[[Drive], Drive],
    wheel: int,
    seen: str,
    remedy: str,
) -> None:
    healthy = make_drive(ROBOT, 1)
    assert faults(healthy) == []
    with pytest.raises(InputError) as caught:
        refuse(faults(damage(healthy)))
    text = str(caught.value)
    assert text.startswith(f"tour: wheel_{wheel}_joint, ")
    assert seen in text
    assert remedy in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("quantity", "given", "volts", "unit"),
    [
        ("power", 1e3, 24.0, "A"),  # power is current times voltage
        ("power", 1e3, math.nan, "W"),
        ("power", 1.0, 24e3, "V"),
        ("supply_current", 1e3, math.nan, "A"),
        ("motor_current", 1e3 / 24.0, 0.0, "A"),
    ],
)
def test_other_units_are_refused(
    make_drive: MakeDrive,
    quantity: Literal["power", "motor_current", "supply_current"],
    given: float,
    volts: float,
    unit: str,
) -> None:
    motors = tuple(evolve(motor, resistance=8.0) for motor in ROBOT.motors)  # of 3 A
    measurement = evolve(ROBOT.measurement, quantity=quantity)
    robot = evolve(ROBOT, motors=motors, measurement=measurement)
    drive = make_drive(ROBOT, 1)
    plain = evolve(drive, power=drive.power / (24.0 if quantity == "motor_current" else 1.0))
    assert list(sensor_faults(plain, robot)) == []
    voltage = np.full_like(drive.power, volts)
    found = list(sensor_faults(evolve(drive, power=given * drive.power, voltage=voltage), robot))
    assert [item.where for item in found] == list(robot.wheel_names)
    assert f"more {unit} of motor 3 than can be" in found[2].seen
    assert f"is it in m{unit}?" in found[2].seen


def test_units_are_judged_by_motors_that_turn_and_not_by_spikes(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    far, rows = 1e5 * drive.power, np.arange(len(drive.power))[:, None]
    spikes = evolve(drive, power=np.where(rows % 20 == 0, far, drive.power))
    standing = evolve(drive, power=far, velocity=0.0 * drive.velocity)
    for item in (spikes, standing):
        assert not any("than can be" in found.seen for found in sensor_faults(item, ROBOT))
    gaps = evolve(drive, power=np.where(rows % 20 == 0, math.nan, far))
    assert sum("than can be" in found.seen for found in sensor_faults(gaps, ROBOT)) == 3
    dead = evolve(drive, voltage=np.zeros_like(drive.power))
    assert sum("V feed nothing of" in found.seen for found in sensor_faults(dead, ROBOT)) == 3


def test_a_sign_is_judged_where_power_is_known(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    unknown, reversed_ = drive.power.copy(), reverse(drive).power
    unknown[::7, 1] = reversed_[::7, 2] = np.nan  # a current without a voltage
    assert faults(evolve(drive, power=unknown)) == []
    with pytest.raises(InputError, match="must be negative while power is drawn"):
        refuse(faults(evolve(drive, power=reversed_)))


def test_powers_of_other_wheels_are_refused(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    swapped = evolve(drive, power=drive.power[:, [0, 2, 1]], reading=drive.reading[:, [0, 2, 1]])
    with pytest.raises(InputError, match="the power of wheel_2 is that of wheel_3_joint"):
        refuse(faults(swapped))


def test_a_bag_of_another_robot_is_refused(make_drive: MakeDrive) -> None:
    turned = evolve(ROBOT, wheel_offset=ROBOT.wheel_offset + np.pi / 4)
    with pytest.raises(
        InputError, match=r"as a wheel at 45 degrees would, robot.yaml puts it at 0"
    ):
        refuse(faults(make_drive(turned, 1)))


def test_a_mistake_that_has_a_name_is_named(make_drive: MakeDrive) -> None:
    turned = evolve(ROBOT, wheel_offset=ROBOT.wheel_offset + np.pi / 3)
    with pytest.raises(InputError, match="stand 60 degrees further around"):
        refuse(faults(make_drive(turned, 1)))
    drive, order = make_drive(ROBOT, 1), [1, 0, 2]
    swapped = evolve(drive, position=drive.position[:, order], velocity=drive.velocity[:, order])
    with pytest.raises(InputError, match="the order of the wheels is wrong"):
        refuse(faults(swapped))


def test_too_little_motion_is_refused(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    check_excitation([drive], ROBOT)
    with pytest.raises(
        InputError, match=r"the wheels turn for \d.\d s in all: drive at least 10 s"
    ):
        check_excitation([make_drive(ROBOT, 1, seconds=8.0)], ROBOT)
    idle = drive.velocity * np.array([1.0, 0.0, 1.0])
    with pytest.raises(InputError, match=r"wheel_2_joint turns for 0.0 s"):
        check_excitation([evolve(drive, velocity=idle)], ROBOT)


def coarse(drive: Drive, quantum: float, top: float) -> Drive:
    """Mostly at full speed, which a coarse sensor sees as one and the same reading."""
    speed = np.clip(3.0 * drive.velocity, -4.0, 4.0)
    seen = np.stack(
        [np.interp(drive.power_time, drive.encoder_time, own) for own in speed.T], axis=1
    )
    noise = np.random.default_rng(1).normal(0.0, 0.003, seen.shape)
    reading = quantum * np.round((0.05 + 0.02 * np.abs(seen) + noise) / quantum)
    return evolve(drive, velocity=speed, reading=np.minimum(reading, top))


@pytest.mark.parametrize(("quantum", "top", "clipped"), [(0.05, np.inf, False), (0.01, 0.08, True)])
def test_a_coarse_sensor_is_not_a_saturated_one(
    make_drive: MakeDrive, quantum: float, top: float, clipped: bool
) -> None:
    """Its readings repeat at their peak, too, but would not pass it."""
    drive = coarse(make_drive(ROBOT, 1), quantum, top)
    _, counts = np.unique(drive.reading[:, 0], return_counts=True)
    assert counts[-1] > 3 * counts[-2:].min()
    assert any("saturated" in str(found) for found in faults(drive)) == clipped


def uniform(drive: Drive, twist: tuple[float, float, float]) -> Drive:
    """One motion after two seconds at rest."""
    speed = np.where(drive.encoder_time[:, None] >= 2.0, twist_to_wheels(ROBOT) @ twist, 0.0)
    return evolve(drive, velocity=speed)


def test_one_speed_and_heading_show_nothing(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    creep, other = uniform(drive, (0.05, 0.02, 0.1)), uniform(drive, (0.3, 0.0, 0.1))
    with pytest.raises(InputError, match=r"tour: the wheels turn at one speed .* 100 % of the"):
        check_excitation([creep], ROBOT)
    check_excitation([creep, other], ROBOT)


def test_readings_alike_on_either_side_of_a_gap_are_no_stuck_sensor(make_drive: MakeDrive) -> None:
    """What `--skip` and lost commands leave out ends at one reading and goes on with the same."""
    drive = make_drive(ROBOT, 1)
    left = without(drive, [(12.0, 14.0)])
    reading = left.reading.copy()
    after = int(np.searchsorted(left.power_time, 13.0))
    reading[after - 4 : after + 4] = 0.25
    assert left.power_time[after] - left.power_time[after - 1] > 1.9
    assert faults(evolve(left, reading=reading)) == []


def test_a_slow_sensor_that_reads_the_same_twice_is_not_stuck(make_drive: MakeDrive) -> None:
    """One of 1 Hz: two readings are a second apart."""
    drive = make_drive(ROBOT, 1)
    slow = measured_when(drive, lambda time: np.isin(time, drive.power_time[::50]))
    reading = slow.reading.copy()
    reading[10:12, 0] = 0.25
    assert np.diff(slow.power_time)[10] >= 1.0
    assert faults(evolve(slow, reading=reading)) == []
    reading[10:16, 0] = 0.25
    assert any("repeats 0.25" in str(found) for found in faults(evolve(slow, reading=reading)))
