"""What must not be in a calibration: faults, dead sensors, too little motion, another robot.

Each check looks at one recording and returns what it found, where, and what to do about it.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from tomr_power_model.calibration.motion import median_period
from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels, wheels_to_twist
from tomr_power_model.model.commanded import CommandPath, CommandTiming, Seen
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOVING = 0.3  # rad/s of a wheel
_LEAST_MOTION = 10.0  # s of all recordings together
_LEAST_WHEEL = 3.0  # s
_STUCK = 1.0  # s with the very same reading
_CLIPPED_RUN, _CLIPPED_COUNT = 3, 6  # readings at one and the same peak
_FROZEN = 0.4  # s
_TICK = 0.05  # s
_COMPARED = 0.4  # s, width of the bell over which a wheel's speed is held against its command
_LOST = 0.5  # s
_ASTRAY = 0.65  # rms difference over rms of what is expected
_WORTH_TELLING = 1.5  # rad/s, rms of what is expected
_CUT = "leave it out with --skip {name}={start:.1f}:{end:.1f}"


@frozen
class Finding:
    """Something that a calibration must not swallow."""

    name: str  # of the recording
    where: str  # wheel or topic
    start: float  # s
    end: float  # s
    seen: str
    remedy: str

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.where}, {self.start:.1f} s to {self.end:.1f} s: "
            f"{self.seen}: {self.remedy}"
        )


def runs(mask: Mask, time: Array, least: float, bridge: float = 0.0) -> Iterator[tuple[int, int]]:
    """First and last index of each run of True that lasts `least` [s]; short holes are bridged."""
    index = np.flatnonzero(mask)
    if not len(index):
        return
    breaks = (np.diff(index) > 1) & (np.diff(time[index]) > bridge)
    for run in np.split(index, np.flatnonzero(breaks) + 1):
        if time[run[-1]] - time[run[0]] >= least:
            yield int(run[0]), int(run[-1])


def refuse_faults(
    recordings: Sequence[Recorded], robot: Robot, tick: Callable[[], None] = lambda: None
) -> None:
    """Raise InputError with the first thing found that a healthy recording does not have."""
    findings: list[Finding] = []
    for item in recordings:
        findings += [found for check in CHECKS for found in check(item, robot)]
        tick()
    if findings:
        more = f" ({len(findings) - 1} more findings)" if len(findings) > 1 else ""
        raise InputError(f"{findings[0]}{more}")


def refuse_little_motion(recordings: Sequence[Recorded], robot: Robot) -> None:
    """Raise InputError where all recordings together hold too little to fit."""
    moving = np.zeros(WHEELS)
    anything = 0.0
    for item in recordings:
        speed = np.abs(measured_speed(item)) > _MOVING
        step = np.minimum(np.diff(item.encoder_time, prepend=item.encoder_time[0]), 0.5)
        moving += (speed * step[:, None]).sum(axis=0)
        anything += float(step[speed.any(axis=1)].sum())
    names = ", ".join(item.name for item in recordings)
    if anything < _LEAST_MOTION:
        raise InputError(
            f"{names}: the wheels turn for {anything:.1f} s in all: drive at least "
            f"{_LEAST_MOTION:g} s, several headings and speeds, with starts and stops"
        )
    wheel = int(np.argmin(moving))
    if moving[wheel] < _LEAST_WHEEL:
        raise InputError(
            f"{names}: {robot.wheel_names[wheel]} turns for {moving[wheel]:.1f} s in all: add a "
            f"drive in which it turns for {_LEAST_WHEEL:g} s, e.g. a spin on the spot"
        )


def measured_speed(item: Recorded) -> Array:
    """Wheel speeds at the encoder's samples [rad/s], as told or from differences, (n, 3)."""
    told = item.velocity
    step = np.diff(item.encoder_time, prepend=item.encoder_time[0] - 1.0)[:, None]
    differences = np.diff(item.position, axis=0, prepend=item.position[:1]) / step
    return np.where(np.isnan(told), differences, told)


def _geometry(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Wheels that answer to other headings than their places in robot.yaml say."""
    if len(item.command_time) < 2:
        return
    speed, asked = measured_speed(item), _held(item)
    rows = np.isfinite(asked).all(axis=1) & np.isfinite(speed).all(axis=1)
    rows &= np.abs(asked).any(axis=1)
    if np.count_nonzero(rows) < 50 or np.linalg.cond(asked[rows][:, :2]) > 10.0:
        return
    seen, *_ = np.linalg.lstsq(asked[rows], speed[rows], rcond=None)
    expected = twist_to_wheels(robot, nominal=True)
    for wheel, name in enumerate(robot.wheel_names):
        answer, place = seen[:2, wheel], expected[wheel, :2]
        rest = speed[rows, wheel] - asked[rows] @ seen[:, wheel]
        explained = 1.0 - float(rest.var()) / max(float(speed[rows, wheel].var()), 1e-12)
        lengths = float(np.linalg.norm(answer) * np.linalg.norm(place))
        if explained > 0.8 and float(answer @ place) < 0.8 * lengths:
            turned = np.degrees(np.arctan2(answer[0], -answer[1]))
            stands = np.degrees(np.arctan2(place[0], -place[1]))
            yield Finding(
                item.name,
                name,
                float(item.encoder_time[0]),
                float(item.encoder_time[-1]),
                f"it answers to commands as a wheel at {turned % 360.0:.0f} degrees would, "
                f"robot.yaml puts it at {stands % 360.0:.0f}",
                "this robot.yaml belongs to another robot, or mend robot.wheel_names or "
                "robot.wheel_offset",
            )


def _held(item: Recorded) -> Array:
    """The command in force at each encoder sample, NaN before the first, (n, 3)."""
    index = np.searchsorted(item.command_time, item.encoder_time, side="right") - 1
    return np.where((index >= 0)[:, None], item.command[np.maximum(index, 0)], np.nan)


def _not_following(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Wheels that do not turn as the command makes them: a lost driver or encoder."""
    if not len(item.command_time):
        return
    time, expected = _expected(item, robot)
    after = np.clip(np.searchsorted(item.encoder_time, time), 1, len(item.encoder_time) - 1)
    gap = np.diff(item.encoder_time)[after - 1] > max(_TICK, 3.0 * median_period(item.encoder_time))
    known = np.isfinite(expected) & ~gap[:, None]
    speed = np.column_stack(
        [np.interp(time, item.encoder_time, column) for column in measured_speed(item).T]
    )
    width = _COMPARED / _TICK
    error = gaussian_filter1d(np.where(known, speed - expected, 0.0) ** 2, width, axis=0)
    level = gaussian_filter1d(np.where(known, expected, 0.0) ** 2, width, axis=0)
    off = (error > _ASTRAY**2 * level) & (level > _WORTH_TELLING**2)
    for wheel, name in enumerate(robot.wheel_names):
        for first, last in runs(off[:, wheel], time, _LOST, bridge=_LOST):
            rows = slice(first, last + 1)
            seen, wanted = (
                f"{np.sqrt(np.mean(values[rows, wheel] ** 2)):.1f} rad/s"
                for values in (speed, np.nan_to_num(expected))
            )
            what = f"it does not follow its command: it turns at {seen} rms, {wanted} is expected"
            yield _found(item, name, rows, time, what)


def _expected(item: Recorded, robot: Robot) -> tuple[Array, Array]:
    """Wheel speeds that the commands lead to, by the description as it is: (n,), (n, 3)."""
    motion = CommandPath(robot, CommandTiming(to_ns(_TICK)))
    to_twist = wheels_to_twist(robot)
    pending = deque(zip(item.command_time, item.command, strict=True))
    time = np.arange(item.encoder_time[0], item.encoder_time[-1], _TICK) + _TICK
    speeds = np.full((len(time), WHEELS), np.nan)
    x, y, yaw = (float(value) for value in to_twist @ measured_speed(item)[0])
    first = Seen((x, y, yaw), (math.nan,) * WHEELS, math.nan)
    for row, tick in enumerate(time):
        while pending and pending[0][0] <= tick:
            stamp, (vx, vy, wz) = pending.popleft()
            motion.command(to_ns(stamp), (float(vx), float(vy), float(wz)))
        step = motion.over(to_ns(tick), first)
        if step is not None:
            speeds[row] = step.speed
    return time, speeds


def _frozen_encoder(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Encoders that stand still while their motor works and the command asks the wheel to turn."""
    time = item.encoder_time
    asked = np.full((len(time), WHEELS), np.inf)
    if len(item.command_time):
        asked = np.abs(_held(item) @ twist_to_wheels(robot, nominal=True).T)
    for wheel, name in enumerate(robot.wheel_names):
        angle = item.position[:, wheel]
        if np.isnan(angle).all():
            angle = item.velocity[:, wheel]
        known = np.isfinite(item.power[:, wheel])
        if np.count_nonzero(known) < 2:
            continue
        power = np.abs(item.power[known, wheel])
        working = np.interp(time, item.power_time[known], power)
        idle, usual = np.percentile(power, 5), np.percentile(power, 90)
        still = np.concatenate([[False], np.diff(angle) == 0.0])
        for first, last in runs(still, time, _FROZEN):
            rows = slice(first, last + 1)
            drawn = float(np.median(working[rows]))
            if np.median(asked[rows, wheel]) < _WORTH_TELLING:
                continue  # a wheel may hold against a drag along its axle
            if drawn > idle + 0.5 * max(usual - idle, 1e-9) and drawn > 1.5 * idle:
                unit = "A" if robot.measurement.quantity == "motor_current" else "W"
                seen = f"its encoder stands still while it draws {drawn:.1f} {unit}"
                yield _found(item, name, rows, time, seen)


def _stuck_power(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Power sensors that repeat themselves while the wheel's speed changes."""
    for wheel, name in enumerate(robot.wheel_names):
        time, reading, speed = _of_wheel(item, wheel)
        if len(time) < 3:
            continue
        same = np.diff(reading) == 0.0
        repeats = np.concatenate([[False], same]) | np.concatenate([same, [False]])
        moving = np.abs(speed) > _MOVING
        usual = float(np.mean(repeats[moving])) if moving.any() else 1.0
        for first, last in runs(repeats, time, _STUCK):
            rows = slice(first, last + 1)
            equal = reading[rows] == reading[first]
            changes = np.ptp(speed[rows]) > 0.2 * np.abs(speed).max() + _MOVING
            noisy = usual < 0.5 and np.median(np.abs(speed[rows])) > _MOVING
            if equal.all() and (changes or noisy):
                seen = f"its power sensor repeats {reading[first]:.3g} while the wheel turns"
                yield _found(item, name, rows, time, seen)


def _saturated_power(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Power sensors that end at a peak which they hold, again and again."""
    for wheel, name in enumerate(robot.wheel_names):
        time, reading, speed = _of_wheel(item, wheel)
        levels, counts = np.unique(reading, return_counts=True)
        for end, beside in ((-1, -2), (0, 1)) if len(levels) > 1 else ():
            # A peak is the rarest of readings, unless what is beyond is cut off.
            if counts[end] < max(_CLIPPED_COUNT, 3 * counts[beside]) or levels[end] == 0.0:
                continue
            top = float(levels[end])
            at_top = reading == top
            held = [run for run in runs(at_top, time, 0.0) if run[1] - run[0] + 1 >= _CLIPPED_RUN]
            changes = np.ptp(speed[at_top]) > 0.1 * np.abs(speed).max()
            if held and changes:
                rows = slice(held[0][0], held[-1][1] + 1)
                seen = (
                    f"its power sensor is saturated: it never passes {top:.3g}, which it reads "
                    f"{np.count_nonzero(at_top)} times"
                )
                yield _found(item, name, rows, time, seen)


def _wrong_sign(item: Recorded, robot: Robot) -> Iterator[Finding]:
    """Power that flows out of the motors while they drive."""
    for wheel, name in enumerate(robot.wheel_names):
        time, _, speed = _of_wheel(item, wheel)
        power = item.power[np.isfinite(item.power[:, wheel]), wheel]
        moving = np.abs(speed) > _MOVING
        if np.count_nonzero(moving) > 20 and np.median(power[moving]) < 0.0:
            yield Finding(
                item.name,
                name,
                float(time[0]),
                float(time[-1]),
                f"it draws {np.median(power[moving]):.2f} while it turns",
                "BatteryState.current must be negative while power is drawn; mend the driver",
            )


def _of_wheel(item: Recorded, wheel: int) -> tuple[Array, Array, Array]:
    """Time, reading and wheel speed where the wheel's power was measured."""
    known = np.isfinite(item.reading[:, wheel])
    time = item.power_time[known]
    speed = measured_speed(item)[:, wheel]
    return time, item.reading[known, wheel], np.interp(time, item.encoder_time, speed)


def _found(item: Recorded, name: str, rows: slice, time: Array, seen: str) -> Finding:
    start, end = float(time[rows][0]), float(time[rows][-1])
    remedy = _CUT.format(name=item.name, start=max(0.0, start - 1.0), end=end + 1.0)
    return Finding(item.name, name, start, end, seen, f"{remedy}, or record it again")


Check = Callable[[Recorded, Robot], Iterator[Finding]]
CHECKS: tuple[Check, ...] = (
    _geometry,
    _frozen_encoder,
    _not_following,
    _saturated_power,
    _stuck_power,
    _wrong_sign,
)
# Those that need no model of the motion.
SENSOR_CHECKS = tuple(check for check in CHECKS if check is not _not_following)
