"""Whether wheels of a recording turn as its commands make them: what is otherwise, and where."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from tomr_power_model.drive.motion import LEAST_PERIODS, median_period, wheel_motion
from tomr_power_model.drive.quality import Finding, found_in, runs
from tomr_power_model.drive.radii import SPAN, answer, misdescribed
from tomr_power_model.drive.ramp import misdescribed_ramp, ramp_shown
from tomr_power_model.drive.record import Drive
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SPAN = 0.1  # s, of the fit to the encoders
_COMPARED = 0.4  # s, width of the bell over which a wheel's speed is held against its command
_LOST = 1.5  # s: a wheel that does not follow for a shorter time may be slow
_ASTRAY = 0.65  # rms difference over rms of what is expected or measured
_NOTABLE = 1.5  # rad/s, rms of what is expected or measured
_MOSTLY = 0.5  # of the time in which wheels turn: no fault, the description


def not_following(drive: Drive, robot: Robot, time: Array, expected: Array) -> Iterator[Finding]:
    """Wheels that do not turn as the commands make them: a lost driver or encoder.

    Args:
        drive: the recording.
        robot: its description.
        time: evenly spaced [s], (n,).
        expected: wheel speeds that a simulation gives then [rad/s], (n, 3), NaN where unknown.
    """
    if len(time) < 2:
        return
    motion = wheel_motion(drive.encoder_time, drive.position, drive.velocity, time, _SPAN)
    known = np.isfinite(expected) & np.isfinite(motion.speed)
    expected, speed = (np.where(known, values, 0.0) for values in (expected, motion.speed))
    width = _COMPARED / median_period(time)
    error = gaussian_filter1d((speed - expected) ** 2, width, axis=0)
    level = gaussian_filter1d(np.maximum(expected**2, speed**2), width, axis=0)
    notable = level > _NOTABLE**2
    off = (error > _ASTRAY**2 * level) & notable
    mostly = (off.sum(axis=0) > _MOSTLY * notable.sum(axis=0)).all()
    found = list(_astray(drive, robot, time, off, (speed, expected)))
    if mostly and {item.where for item in found} == set(robot.wheel_names):
        found = [_other_controller(drive, time)]
    yield from found


def otherwise_than_commanded(
    drive: Drive, robot: Robot, time: Array, expected: Array
) -> Iterator[Finding]:
    """Another ramp than described, or else wheels that do not follow and other radii."""
    if ramp := list(other_ramp(drive, robot, time, expected)):
        yield from ramp
        return
    yield from not_following(drive, robot, time, expected)
    yield from other_radii(drive, robot, time, expected)


def other_ramp(drive: Drive, robot: Robot, time: Array, expected: Array) -> Iterator[Finding]:
    """Another ramp of the commands than described; as `not_following`."""
    shown = ramp_in(drive, robot, time, expected)
    yield from _throughout(drive, time, misdescribed_ramp(shown, robot))


def ramp_in(drive: Drive, robot: Robot, time: Array, expected: Array) -> float | None:
    """Limit of the acceleration [m/s^2] that a recording shows and the robot has not, else None; as
    `not_following`.

    What is expected is blurred as the fit to the encoders blurs what is measured, by a variance of
    a quarter of half its span squared: a step that is blurred and late looks like a ramp.
    """
    if len(time) < 2:
        return None
    period = median_period(time)
    span = max(_SPAN, LEAST_PERIODS * median_period(drive.encoder_time))
    variance = (0.5 * span) ** 2 / 4.0 - period**2 / 12.0  # means of periods are blurred as well
    width = float(np.sqrt(max(variance, 0.0))) / period
    blurred = gaussian_filter1d(expected, width, axis=0) if width > 0.0 else expected
    return ramp_shown(time, _speed(drive, time, span), blurred, robot)


def other_radii(drive: Drive, robot: Robot, time: Array, expected: Array) -> Iterator[Finding]:
    """Other radii, or places of wheels, than the drivers go by; as `not_following`."""
    if len(time) > 1:
        shown = answer(time, _speed(drive, time, SPAN), expected, robot)
        yield from _throughout(drive, time, misdescribed(shown, robot))


def _speed(drive: Drive, time: Array, span: float) -> Array:
    return wheel_motion(drive.encoder_time, drive.position, drive.velocity, time, span).speed


def _throughout(drive: Drive, time: Array, said: tuple[str, str]) -> Iterator[Finding]:
    """What is seen of all wheels in the whole drive and what to write, empty where nothing."""
    seen, remedy = said
    if seen:
        yield Finding(drive.name, "all wheels", float(time[0]), float(time[-1]), seen, remedy)


def _astray(
    drive: Drive, robot: Robot, time: Array, off: Mask, speeds: tuple[Array, Array]
) -> Iterator[Finding]:
    """Each time that a wheel is `off` (n, 3); speeds: as measured and as expected, (n, 3)."""
    for wheel, name in enumerate(robot.wheel_names):
        for first, last in runs(off[:, wheel], time, _LOST, bridge=_COMPARED):
            rows = slice(first, last + 1)
            seen, wanted = (float(np.sqrt(np.mean(values[rows, wheel] ** 2))) for values in speeds)
            what = (
                f"it does not follow its command: it turns at {seen:.1f} rad/s rms, {wanted:.1f} "
                "rad/s is expected: a fault, lost commands or another robot's description"
            )
            yield found_in(drive, name, rows, time, what)


def _other_controller(drive: Drive, time: Array) -> Finding:
    return Finding(
        drive.name,
        "all wheels",
        float(time[0]),
        float(time[-1]),
        "they turn otherwise than commanded for most of the drive",
        "mend controller.proportional and controller.integral, which are per rad/s and rad of the "
        "wheel (a gain at the motor times motor.gear_ratio), or motor.gear_ratio and "
        "robot.wheel_radius; or it is another robot's description, or most commands are lost",
    )
