"""Speed and acceleration of the wheels from encoder samples of the last moments."""

import math
from collections import deque
from collections.abc import Sequence
from functools import lru_cache
from itertools import compress
from typing import Protocol

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.model.continuity import ENCODER_TOLERANCE, Continuity
from tomr_power_model.model.stamps import RecentStamps

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
LONG_S = 0.2  # of the fit beside a simulation
_FIT, _LINE = 6, 3  # samples that it takes, and a straight one
_SLOW = 40_000_000  # ns between samples, from which on they are few in any window
_PART = 50_000_000  # ns of a window for which a fit stands
_ALONE = 3.0  # times as far as the others' does the angle of one wheel scatter that is at fault
_FREE = 2  # more samples than unknowns, to show how they scatter
_MOVING = 1.0  # rad/s of the fastest wheel, likewise
_LEEWAY = 0.05  # s that a stamp may be late: angles that no motor reaches till then are bad
_NEW_ZERO = 3  # such angles in a row are those of an encoder that counts from elsewhere
UNKNOWN: Triple = (float("nan"), float("nan"), float("nan"))


@frozen
class EncoderSample:
    """One message: angle [rad] and speed [rad/s] of each wheel, NaN where it says nothing."""

    stamp_ns: int
    position: Triple
    velocity: Triple


@frozen
class WheelEstimate:
    """Motion of the wheels in a window, at its middle; shape (3,), NaN where unknown."""

    speed: Array  # rad/s
    acceleration: Array  # rad/s^2
    angle: Array = field(factory=lambda: np.full(3, np.nan))  # rad
    scatter: float = math.nan  # of the samples' times about the fit [s], NaN where it does not show
    gain: float = 0.0  # standard deviation of the speed over that of the angles [1/s]


UNKNOWN_MOTION = WheelEstimate(np.full(3, np.nan), np.full(3, np.nan))


class Reference(Protocol):
    """A simulation of the motion that encoders measure."""

    def beside(
        self, times_ns: Sequence[int], tick_ns: int, period_ns: int
    ) -> tuple[Array, Array, Array, Array]:
        """Angles at some times [rad], (k, 3), and at the middle of the window that ends at a tick;
        mean speed and acceleration in that window, (3,) each.
        """
        ...


class EncoderWindow:
    """Keeps the samples of the last moments and fits a motion of constant acceleration to them.

    Least squares over the samples in (t - span, t]: positions by p + v s + a s^2 / 2, or, where a
    robot gives no positions, velocities by v + a s; evaluated at t - period / 2. Stamps that only
    jitter are put on their grid first. Around a gap nothing is known, and no fit spans one.
    """

    def __init__(
        self, span_ns: int, period_ns: int, stale_ns: int, fastest: float = math.inf
    ) -> None:
        """Times in nanoseconds; `fastest` that a wheel can turn [rad/s]."""
        self._span = span_ns
        self._period = period_ns
        self._stale = stale_ns
        self._fastest = fastest
        self._samples: deque[EncoderSample] = deque()
        self._stamps = RecentStamps()
        self.continuity = Continuity(ENCODER_TOLERANCE)
        self._leaps = 0

    def clear(self) -> None:
        """Forget all samples."""
        self._forget()
        self.continuity.clear()

    def leap(self) -> None:
        """Forget all samples where the stamps leap: a gap, if there were any."""
        self._forget()
        self.continuity.leap()

    def _forget(self) -> None:
        self._samples.clear()
        self._stamps = RecentStamps()
        self._leaps = 0

    def add(self, sample: EncoderSample) -> bool:
        """Take a sample newer than those before; returns whether it can be true."""
        if _exceeds(sample.velocity, (0.0, 0.0, 0.0), self._fastest):
            if any(map(math.isnan, sample.position)):
                return False
            sample = EncoderSample(sample.stamp_ns, sample.position, UNKNOWN)  # angles tell more
        if self._leaps_to(sample):
            self._leaps += 1
            if self._leaps < _NEW_ZERO:
                return False
            self.continuity.restart(sample.stamp_ns)
        self._leaps = 0
        self._samples.append(sample)
        self._stamps.add(sample.stamp_ns, sample.position)
        self.continuity.take(sample.stamp_ns)
        return True

    def absent(self, tick_ns: int) -> list[int]:
        """Wheels of which the newest message up to a tick says nothing."""
        for sample in reversed(self._samples):
            if sample.stamp_ns <= tick_ns:
                pairs = zip(sample.position, sample.velocity, strict=True)
                return [wheel for wheel, (p, v) in enumerate(pairs) if p != p and v != v]  # NaN
        return []

    def _leaps_to(self, sample: EncoderSample) -> bool:
        """Whether no wheel can have turned so far since the last sample."""
        if not self._samples:
            return False
        last = self._samples[-1]
        furthest = self._fastest * (1e-9 * (sample.stamp_ns - last.stamp_ns) + _LEEWAY)
        return _exceeds(sample.position, last.position, furthest)

    @property
    def resolution(self) -> float:
        """Of the angles, as the samples show it [rad]; 0 where that is not known."""
        return self._stamps.resolution

    def at(self, tick_ns: int) -> WheelEstimate:
        """Estimate for the window that ends at a tick; NaN if its samples are missing or stale.

        The mean over a window that is longer than a fit spans comes of fits to its parts.
        """
        parts = max(round(self._period / _PART), 1)
        length = self._period // parts
        return _mean([self._over(tick_ns - k * length, length) for k in reversed(range(parts))])

    def _over(self, tick_ns: int, length: int) -> WheelEstimate:
        """Estimate for the last moments [ns] before a tick."""
        samples = self._until(tick_ns)
        if len(samples) < 2:
            return UNKNOWN_MOTION
        times = self._times(samples, tick_ns - length // 2)
        positions = np.array([sample.position for sample in samples])
        if len(samples) > 2 and not np.isnan(positions).any():
            return _from_positions(times, positions)
        return self._mixed(samples, times, positions)

    def beside(self, tick_ns: int, reference: Reference) -> tuple[WheelEstimate, WheelEstimate]:
        """As `at`, where a simulation of the same motion is known; and as simulated, at the angles
        that are measured.

        What is measured less what is simulated changes slowly: it is fitted over a longer span,
        which leaves less of the noise in the acceleration.
        """
        samples = self._until(tick_ns, max(self._span, round(1e9 * LONG_S)))
        positions = np.array([sample.position for sample in samples])
        middle = tick_ns - self._period // 2
        times = self._times(samples, middle)
        simulated, angle, speed, acceleration = reference.beside(
            [middle + time for time in times], tick_ns, self._period
        )
        if len(samples) < _LINE or np.isnan(positions).any():
            measured = self.at(tick_ns)
        else:
            ahead = positions - simulated
            # Of few samples a line: they span as long, and are not many enough for more.
            degree = 2 if len(samples) >= _FIT else 1
            weights = _weights(times, degree)
            offset = weights @ (ahead - ahead[0])
            bent = 2.0 * offset[2] if degree > 1 else 0.0
            gain = math.sqrt(float((weights[1] ** 2).sum()))
            measured = WheelEstimate(
                speed + offset[1], acceleration + bent, angle + ahead[0] + offset[0], gain=gain
            )
        return measured, WheelEstimate(speed, acceleration, measured.angle)

    def slow_since(self, tick_ns: int) -> int | None:
        """When the samples begin that `beside` fits [ns], where they come rarely; else None."""
        samples = self._until(tick_ns, max(self._span, round(1e9 * LONG_S)))
        if len(samples) < _LINE or samples[-1].stamp_ns - samples[-3].stamp_ns < 2 * _SLOW:
            return None
        return samples[0].stamp_ns

    def _until(self, tick_ns: int, span: int | None = None) -> list[EncoderSample]:
        """Samples of the window, and the two newest where encoders are slower than it."""
        while len(self._samples) > 2 and self._samples[1].stamp_ns <= tick_ns - self._stale:
            self._samples.popleft()
        if self.continuity.is_broken(tick_ns):
            return []
        oldest = tick_ns - (self._span if span is None else span)
        joined = self.continuity.resumed
        window: list[EncoderSample] = []
        for sample in reversed(self._samples):
            if sample.stamp_ns < joined or (len(window) > 2 and sample.stamp_ns <= oldest):
                break
            if sample.stamp_ns <= tick_ns:
                window.append(sample)
        if not window or window[0].stamp_ns <= tick_ns - self._stale:
            return []
        window.reverse()
        return window

    def _times(self, samples: Sequence[EncoderSample], middle: int) -> tuple[int, ...]:
        """When samples were taken, against the middle of the window [ns]."""
        taken = self._stamps.times([sample.stamp_ns for sample in samples])
        return tuple(time - middle for time in taken)

    @staticmethod
    def _mixed(
        samples: Sequence[EncoderSample], times: tuple[int, ...], positions: Array
    ) -> WheelEstimate:
        """Wheel by wheel, from what each one has."""
        velocities = np.array([sample.velocity for sample in samples])
        speed, acceleration, angle = np.full((3, 3), np.nan)
        for wheel in range(3):
            seen = ~np.isnan(positions[:, wheel])
            timed = ~np.isnan(velocities[:, wheel])
            if np.count_nonzero(seen) > 2:
                fit = _from_positions(_chosen(times, seen), positions[seen][:, [wheel]])
                speed[wheel], acceleration[wheel] = fit.speed[0], fit.acceleration[0]
                angle[wheel] = fit.angle[0]
            elif np.count_nonzero(timed) > 1:
                line = _weights(_chosen(times, timed), 1) @ velocities[timed][:, [wheel]]
                speed[wheel], acceleration[wheel] = line[0, 0], line[1, 0]
        return WheelEstimate(speed, acceleration, angle)


def _mean(parts: Sequence[WheelEstimate]) -> WheelEstimate:
    """Of a window, from those of its parts."""
    if len(parts) == 1:
        return parts[0]
    return WheelEstimate(
        np.mean([part.speed for part in parts], axis=0),
        np.mean([part.acceleration for part in parts], axis=0),
        np.mean([part.angle for part in parts], axis=0),
        parts[-1].scatter,
        max(part.gain for part in parts),
    )


def _exceeds(values: Triple, others: Triple, most: float) -> bool:
    """Whether any two differ by more; NaN differs by nothing. Written out: it is asked often."""
    (a, b, c), (x, y, z) = values, others
    return abs(a - x) > most or abs(b - y) > most or abs(c - z) > most


def _chosen(times: tuple[int, ...], which: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(compress(times, which))


def _from_positions(times: tuple[int, ...], positions: Array) -> WheelEstimate:
    weights = _weights(times, 2)
    shape = weights @ (positions - positions[0])
    gain = math.sqrt(float((weights[1] ** 2).sum()))
    estimate = WheelEstimate(shape[1], 2.0 * shape[2], positions[0] + shape[0], gain=gain)
    free = len(times) - 3
    if free < _FREE or not float(np.abs(shape[1]).max()) > _MOVING:
        return estimate
    powers = (1e-9 * np.array(times))[:, None] ** np.arange(3)
    rest = positions - positions[0] - powers @ shape
    off = (rest**2).sum(axis=0).tolist()
    return evolve(estimate, scatter=math.sqrt(_of_times(off, (shape[1] ** 2).tolist()) / free))


def _of_times(rest: Sequence[float], speed: Sequence[float]) -> float:
    """Of each wheel's squared rest and speed, how far the samples' times scatter, squared.

    All wheels are read at once: what scatters is when. But where all others agree about that, it is
    the angle of one that scatters, whose encoder loses counts.
    """
    scatter = sum(rest) / sum(speed)
    for off, turns in zip(rest, speed, strict=True):
        others = sum(speed) - turns
        if others > _MOVING**2 and (sum(rest) - off) / others < scatter / _ALONE**2:
            return (sum(rest) - off) / others
    return scatter


@lru_cache(maxsize=64)
def _weights(times: tuple[int, ...], degree: int) -> Array:
    """What takes values at some times [ns] to the coefficients of the least-squares polynomial.

    Lowest power first, in seconds; (degree + 1, n). Stamps that do not jitter fall on the same
    few patterns again and again.
    """
    seconds = 1e-9 * np.array(times)
    # Times in units of the window keep the normal equations well conditioned.
    unit = np.abs(seconds).max()
    exponents = np.arange(degree + 1)
    powers = (seconds[:, None] / unit) ** exponents
    try:
        scaled = np.linalg.solve(powers.T @ powers, powers.T)
    except np.linalg.LinAlgError:  # stamps too close together to measure a speed
        scaled = np.full((degree + 1, len(times)), np.nan)
    return np.asarray(scaled / unit ** exponents[:, None])
