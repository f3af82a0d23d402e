"""Over how long a motion is fitted to encoders that are coarse, and what a fit makes of them."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.calibrate import Timing, align, calibrate
from tomr_power_model.calibration.parameters import Choice
from tomr_power_model.calibration.span import LEAST, MOST, Span, span_of, span_warnings
from tomr_power_model.drive.motion import wheel_motion
from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import read_description, shipped_robot

MakeDrive = Callable[..., Drive]
ROBOT, VALUES = shipped_robot("reference"), read_description("reference")
CHOICE = Choice(keys=("robot.mass", "physics.friction.coulomb.torque"), shared=("all",))
COUNTS = 2.0 * np.pi / np.array([28672.0, 960.0, 64.0])  # fine, usual on a motor, coarse [rad]


def counted(drive: Drive, count: float) -> Drive:
    """As encoders of whole counts show it, without speeds."""
    position = count * np.floor(drive.position / count)
    return evolve(drive, position=position, velocity=np.full_like(position, np.nan))


def mass(drive: Drive, span: float | None) -> float:
    described = {**VALUES, "robot.mass": 1.1 * ROBOT.mass}
    samples = align([drive], ROBOT, Timing(span=span, window=1e-9))
    return float(calibrate(described, "test", samples, (), choice=CHOICE).fitted.numbers[0])


def test_coarser_encoders_are_fitted_over_longer_spans(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    fine, usual, coarse = (span_of(counted(drive, count)) for count in COUNTS)
    assert fine.length == LEAST
    assert LEAST < usual.length < MOST
    assert coarse.length == MOST
    assert fine.count == pytest.approx(COUNTS[0])
    assert max(fine.rounding, usual.rounding) < 0.0501 < 0.1 < coarse.rounding
    assert span_of(drive) == Span(LEAST, pytest.approx(1e-6, rel=1.0), pytest.approx(0.0, abs=0.01))


def test_rounding_is_what_a_parabola_leaves_of_it(make_drive: MakeDrive) -> None:
    """Angles that are off by up to half a count at random, over 0.1 s of 100 Hz.

    In a drive 0.2 s hold 20 samples of 100 Hz, but of 20 Hz five are 0.25 s.
    """
    random = np.random.default_rng(3)
    time, half = np.arange(-5.0, 5.0) * 0.01 + 0.005, 0.5 * COUNTS[2]
    fits = [np.polyfit(time, random.uniform(-half, half, 10), 2)[0] for _ in range(4000)]
    expected = COUNTS[2] / np.sqrt(12.0) * np.sqrt(720.0 / 10) / 0.1**2
    assert 2.0 * np.std(fits) == pytest.approx(expected, rel=0.05)
    drive = counted(make_drive(ROBOT, 1), COUNTS[2])
    rows = slice(None, None, 5)
    slow = evolve(
        drive,
        encoder_time=drive.encoder_time[rows],
        position=drive.position[rows],
        velocity=drive.velocity[rows],
    )
    for shown, count, length in ((drive, 20, 0.2), (slow, 5, 0.25)):
        at = shown.encoder_time[::5]
        motion = wheel_motion(shown.encoder_time, shown.position, shown.velocity, at, MOST)
        left = COUNTS[2] * np.sqrt(60.0 / count) / length**2
        rounding = left / np.nanstd(motion.acceleration)
        assert span_of(shown).rounding == pytest.approx(rounding, rel=1e-3)


def test_a_mass_is_found_with_the_encoder_of_a_motor(make_drive: MakeDrive) -> None:
    """In the span of finer ones what is counted hides it."""
    drive = counted(make_drive(ROBOT, 1, seconds=80.0), COUNTS[1])
    assert mass(drive, None) == pytest.approx(ROBOT.mass, rel=0.03)
    assert mass(drive, LEAST) < 0.9 * ROBOT.mass


def test_encoders_that_are_too_coarse_are_named(make_drive: MakeDrive) -> None:
    drive = counted(make_drive(ROBOT, 1), COUNTS[2])
    samples = align([drive], ROBOT, Timing(window=1e-9))
    result = calibrate(VALUES, "test", samples, (), choice=CHOICE)
    (line,) = (item for item in result.warnings if "coarse encoders" in item)
    assert "their counts of 0.0982 rad: run tomr_gap explain" in line
    assert span_warnings([Span(MOST, 0.01, 0.09)]) == []


@pytest.mark.parametrize("described", [14.0, 14.3, 15.0, 16.7])
def test_a_value_at_the_end_of_its_range_is_one_within_it(
    make_drive: MakeDrive, described: float
) -> None:
    """The least mass there is: rounding does not lead beyond, where it would be refused."""
    drive = make_drive(evolve(ROBOT, mass=1e-3), 1, noise=0.0)
    samples = align([drive], ROBOT, Timing(window=1e-9))
    values = {**VALUES, "robot.mass": described}
    result = calibrate(values, "test", samples, (), choice=Choice(keys=("robot.mass",)))
    assert 0.01 <= result.fitted.numbers[0] < 0.01 + 1e-9
    assert any("at the end of its range" in item for item in result.warnings)
