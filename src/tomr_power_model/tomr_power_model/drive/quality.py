"""What no tool must swallow: dead or saturated sensors, lost wheels, another robot.

Each check looks at one recording and returns what it found, where, and what to do about it.
"""

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.exchanged import draws_by, exchange_words, exchanged
from tomr_power_model.drive.mistakes import gross_mistake
from tomr_power_model.drive.motion import measured_speed, median_period
from tomr_power_model.drive.plausible import PowerLimits
from tomr_power_model.drive.quantum import quantum_of
from tomr_power_model.drive.record import Drive
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOVING = 0.3  # rad/s of a wheel
_STUCK, _STUCK_COUNT = 1.0, 5  # s with the very same reading, and how often it is read
_GAP = 5.0  # usual periods between two samples
_CLIPPED_RUN, _CLIPPED_COUNT = 3, 6  # readings at one and the same peak
_HIDDEN = 2.0  # quanta by which readings would pass the peak, were it no limit
_FROZEN = 0.4  # s
_NOTABLE = 1.5  # rad/s that a wheel is asked for
_MUCH = 90.0  # percentile of what moving motors draw
_CUT = "leave it out with --skip {name}={start:.1f}:{end:.1f}"


@frozen
class Finding:
    """Something that must not be taken for physics."""

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


def runs(
    mask: Mask, time: Array, least: float, *, bridge: float = 0.0, gap: float = math.inf
) -> Iterator[tuple[int, int]]:
    """First and last index of each run of True that lasts `least` [s].

    Args:
        mask: of samples, (n,).
        time: of each [s], (n,).
        least: s.
        bridge: holes in a run that are as short are bridged [s].
        gap: samples that are further apart are of two runs [s].
    """
    index = np.flatnonzero(mask)
    if not len(index):
        return
    apart = np.diff(time[index])
    breaks = ((np.diff(index) > 1) & (apart > bridge)) | (apart > gap)
    for run in np.split(index, np.flatnonzero(breaks) + 1):
        if time[run[-1]] - time[run[0]] >= least:
            yield int(run[0]), int(run[-1])


def _gap(time: Array) -> float:
    """From which on nothing is known of what was between two samples [s]."""
    return _GAP * median_period(time)


def refuse(findings: Iterable[Finding]) -> None:
    """Raise InputError with the first finding, if there is any."""
    found = list(findings)
    if found:
        more = f" ({len(found) - 1} more findings)" if len(found) > 1 else ""
        raise InputError(f"{found[0]}{more}")


def sensor_faults(drive: Drive, robot: Robot) -> Iterator[Finding]:
    """Faults of sensors, and signs of another robot: what needs no model of the motion."""
    for check in SENSOR_CHECKS:
        yield from check(drive, robot)


def _geometry(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Wheels that answer to other headings than their places in robot.yaml say."""
    if len(item.command_time) < 2:
        return
    speed, asked = measured_speed(item), item.command_at(item.encoder_time)
    mistake, remedy = gross_mistake(asked, speed, robot, slower=False)
    if mistake:
        start, end = float(item.encoder_time[0]), float(item.encoder_time[-1])
        yield Finding(item.name, "all wheels", start, end, mistake, remedy)
        return
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


def _frozen_encoder(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Encoders that stand still while their motor works and the command asks the wheel to turn."""
    time = item.encoder_time
    asked = np.full((len(time), WHEELS), np.inf)
    if len(item.command_time):
        asked = np.abs(item.command_at(item.encoder_time) @ twist_to_wheels(robot, nominal=True).T)
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
            if np.median(asked[rows, wheel]) < _NOTABLE:
                continue  # a wheel may hold against a drag along its axle
            if drawn > idle + 0.5 * max(usual - idle, 1e-9) and drawn > 1.5 * idle:
                unit = "A" if robot.measurement.quantity == "motor_current" else "W"
                seen = f"its encoder stands still while it draws {drawn:.1f} {unit}"
                yield found_in(item, name, rows, time, seen)


def _stuck_power(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Power sensors that repeat themselves while the wheel's speed changes."""
    for wheel, name in enumerate(robot.wheel_names):
        time, reading, speed = _of_wheel(item, wheel)
        if len(time) < 3:
            continue
        same = np.diff(reading) == 0.0
        repeats = np.concatenate([[False], same]) | np.concatenate([same, [False]])
        moving = np.abs(speed) > _MOVING
        usual = float(np.mean(repeats[moving])) if moving.any() else 1.0
        for first, last in runs(repeats, time, _STUCK, gap=_gap(time)):
            rows = slice(first, last + 1)
            equal = reading[rows] == reading[first]
            changes = np.ptp(speed[rows]) > 0.2 * np.abs(speed).max() + _MOVING
            changes = changes and _changes(time, reading, speed, repeats, rows)
            noisy = usual < 0.5 and np.median(np.abs(speed[rows])) > _MOVING
            if last - first + 1 >= _STUCK_COUNT and equal.all() and (changes or noisy):
                seen = f"its power sensor repeats {reading[first]:.3g} while the wheel turns"
                yield found_in(item, name, rows, time, seen)


def _saturated_power(item: Drive, robot: Robot) -> Iterator[Finding]:
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
            way = 1.0 if end else -1.0  # of the peak: upper or lower
            if held and _passes(time, reading, speed, at_top, way):
                rows = slice(held[0][0], held[-1][1] + 1)
                seen = (
                    f"its power sensor is saturated: it never passes {top:.3g}, which it reads "
                    f"{np.count_nonzero(at_top)} times"
                )
                yield found_in(item, name, rows, time, seen)


def _passes(time: Array, reading: Array, speed: Array, at_top: Mask, way: float) -> bool:
    """Whether by the wheel's motion readings would pass their peak, upwards or downwards (-1).

    Readings of a coarse sensor repeat at their peak, too, but have nothing to hide there.
    """
    expected = _by_motion(time, reading, speed, ~at_top)
    if expected is None:
        return bool(np.ptp(speed[at_top]) > 0.1 * np.abs(speed).max())
    rest = float(np.std((reading - expected)[~at_top]))
    beyond = float(np.percentile(way * (expected - reading)[at_top], 75))
    return beyond > max(_HIDDEN * quantum_of(reading), rest)


def _changes(time: Array, reading: Array, speed: Array, repeats: Mask, rows: slice) -> bool:
    """Whether by the wheel's motion readings would change by more than a coarse sensor's quanta."""
    expected = _by_motion(time, reading, speed, ~repeats)
    return expected is None or float(np.ptp(expected[rows])) > _HIDDEN * quantum_of(reading)


def _by_motion(time: Array, reading: Array, speed: Array, fitted: Mask) -> Array | None:
    """Readings as the wheel's speed and acceleration explain the fitted; None: too few."""
    acceleration = np.gradient(speed, time)
    features = np.stack(
        [np.ones_like(speed), np.abs(speed), speed**2, speed * acceleration], axis=1
    )
    if np.count_nonzero(fitted) < 5 * features.shape[1]:
        return None
    shape, *_ = np.linalg.lstsq(features[fitted], reading[fitted], rcond=None)
    return np.asarray(features @ shape)


def _wrong_sign(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Power that flows out of the motors while they drive."""
    for wheel, name in enumerate(robot.wheel_names):
        time, _, speed = _of_wheel(item, wheel)
        # A current may be read where no voltage is known: there is no power then.
        power = item.power[np.isfinite(item.reading[:, wheel]), wheel]
        moving = (np.abs(speed) > _MOVING) & np.isfinite(power)
        if np.count_nonzero(moving) > 20 and np.median(power[moving]) < 0.0:
            yield Finding(
                item.name,
                name,
                float(time[0]),
                float(time[-1]),
                f"it draws {np.median(power[moving]):.2f} while it turns",
                "BatteryState.current must be negative while power is drawn; mend the driver, "
                "or set measurement.signed: false if the sensor gives magnitudes",
            )


def _power_that_cannot_be(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Power beyond what motors can draw, again and again: in another unit, say."""
    limits = PowerLimits.of(robot)
    for wheel, name in enumerate(robot.wheel_names):
        time, _, speed = _of_wheel(item, wheel)
        drawn, volts = (
            values[np.isfinite(item.reading[:, wheel]), wheel]
            for values in (item.power, item.voltage)
        )
        moving = (np.abs(speed) > _MOVING) & np.isfinite(drawn)
        if np.count_nonzero(moving) <= 20:
            continue
        much = float(np.percentile(np.abs(drawn[moving]), _MUCH))
        seen = limits.problem(_as_read(wheel, much, float(np.median(volts[moving])), robot))
        if seen is not None:
            remedy = "messages are in V, A and W: mend the driver, or motor.resistance is far off"
            yield Finding(item.name, name, float(time[0]), float(time[-1]), seen, remedy)


def _as_read(wheel: int, drawn: float, volts: float, robot: Robot) -> PowerReading:
    """What a sensor of W or A that are drawn, and of V, must have said."""
    quantity = robot.measurement.quantity
    if quantity == "motor_current":
        return PowerReading(wheel, 0, math.nan, drawn, volts)
    supplied = robot.supply.nominal_voltage if quantity == "supply_current" else volts
    current = drawn / supplied if supplied > 0.0 else math.nan
    return PowerReading(wheel, 0, drawn, current, volts)


def _exchanged_power(item: Drive, robot: Robot) -> Iterator[Finding]:
    """Powers that go with the motion of other wheels than their own."""
    time, power = item.power_time, item.power
    if len(time) < 2:
        return
    at_power = [np.interp(time, item.encoder_time, speed) for speed in measured_speed(item).T]
    order = exchanged(power, draws_by(np.column_stack(at_power), time))
    if order is not None:
        seen, remedy = exchange_words(order, robot)
        yield Finding(item.name, "all wheels", float(time[0]), float(time[-1]), seen, remedy)


def _of_wheel(item: Drive, wheel: int) -> tuple[Array, Array, Array]:
    """Time, reading and wheel speed where the wheel's power was measured."""
    known = np.isfinite(item.reading[:, wheel])
    time = item.power_time[known]
    speed = measured_speed(item)[:, wheel]
    return time, item.reading[known, wheel], np.interp(time, item.encoder_time, speed)


def found_in(item: Drive, name: str, rows: slice, time: Array, seen: str) -> Finding:
    """What was found in some rows, which may be left out."""
    start, end = float(time[rows][0]), float(time[rows][-1])
    remedy = _CUT.format(name=item.name, start=max(0.0, start - 1.0), end=end + 1.0)
    return Finding(item.name, name, start, end, seen, f"{remedy}, or record it again")


Check = Callable[[Drive, Robot], Iterator[Finding]]
SENSOR_CHECKS: tuple[Check, ...] = (
    _geometry,
    _frozen_encoder,
    _saturated_power,
    _stuck_power,
    _wrong_sign,
    _power_that_cannot_be,
    _exchanged_power,
)
