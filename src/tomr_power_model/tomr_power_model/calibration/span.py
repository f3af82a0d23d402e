"""Over how long a motion is fitted to encoders: what coarse counts leave unknown in short spans."""

import math
from collections.abc import Sequence

import numpy as np
from attrs import frozen

from tomr_power_model.drive.motion import LEAST_PERIODS, median_period, wheel_motion
from tomr_power_model.drive.quantum import count_of
from tomr_power_model.drive.record import Drive

LEAST, MOST = 0.05, 0.2  # s
_QUIET = 0.05  # of the accelerations: what rounding may leave unknown of them
_BIASED = 0.1  # of the accelerations: with so much a mass is a tenth off
_EVERY = 5  # samples, at which accelerations are looked at


@frozen
class Span:
    """How long a fit to the encoders lasts, and how well accelerations are known then."""

    length: float  # s
    count: float = 0.0  # by which the encoders' angles go [rad], 0: not known
    rounding: float = 0.0  # standard deviation of accelerations by rounding, of that of them all


def span_of(drive: Drive) -> Span:
    """The shortest span in which rounding is little of the accelerations, at most 0.2 s.

    n angles rounded to counts c leave the acceleration of a parabola over a span T unknown to
    c sqrt(60 / n) / T^2 (a variance of c^2 / 12), and what changes within T is smoothed.
    """
    count, period = count_of(drive.position), median_period(drive.encoder_time)
    if not count:
        return Span(LEAST)
    at = drive.encoder_time[::_EVERY]
    motion = wheel_motion(drive.encoder_time, drive.position, drive.velocity, at, MOST)
    known = motion.acceleration[np.isfinite(motion.acceleration)]
    usual = max(float(np.std(known)), 1e-9) if len(known) else math.inf
    left = count * math.sqrt(60.0 * period) / usual  # times T^-2.5 with n = T / period
    length = min(max((left / _QUIET) ** 0.4, LEAST), MOST)
    return Span(length, count, left * max(length, LEAST_PERIODS * period) ** -2.5)


def span_warnings(spans: Sequence[Span]) -> list[str]:
    """One line if rounding is so much of the accelerations that what carries mass is biased."""
    worst = max(spans, key=lambda span: span.rounding)
    if worst.rounding < _BIASED:
        return []
    return [
        f"values may be biased by coarse encoders: {100.0 * worst.rounding:.0f} % of the "
        f"accelerations are their counts of {worst.count:.3g} rad: run tomr_gap explain"
    ]
