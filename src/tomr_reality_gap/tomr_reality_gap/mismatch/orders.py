"""Orders of torque ripples that may be in a recording: a periodogram over the wheels' angles."""

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.motion import median_period
from tomr_power_model.drive.record import Drive
from tomr_power_model.estimation.statistics import robust_scale
from tomr_reality_gap.alignment.channels import MOTOR_KINDS, Channel

Array = NDArray[np.float64]

_ORDERS = np.arange(0.5, 48.0, 0.01)
_TURNS = 100  # orders are whole parts of it
_PER_TURN = 4096  # places of a ring: far finer than a ripple of the highest order
_LEAST = 250  # samples
_MOST = 2  # orders per wheel
_ALONE = 0.1  # orders closer than this are one
_SIGNIFICANT = 30.0  # power over the usual: chi2 of 2, so this is e^-15 by chance
_SLOW = 0.3  # s: what is slower than this is no ripple


def ripple_orders(
    recorded: Drive, channels: tuple[Channel, ...], residuals: list[Array], speeds: list[Array]
) -> tuple[float, ...]:
    """Orders [1/rev] at which a residual of power or current swings with the angle of its wheel.

    Args:
        recorded: the recording.
        channels: its channels.
        residuals: of each channel [W, A].
        speeds: of the wheel at each of the channel's times [rad/s].
    """
    found: list[float] = []
    for channel, residual, speed in zip(channels, residuals, speeds, strict=True):
        if channel.kind not in MOTOR_KINDS or channel.wheel is None or len(channel.time) < _LEAST:
            continue
        middle = channel.time - 0.5 * channel.span
        angle = np.interp(middle, recorded.encoder_time, recorded.position[:, channel.wheel])
        if not np.isfinite(angle).all():
            continue
        lever = speed if channel.kind == "power" else np.sign(speed)
        power = _spectrum(_fast(channel.time, residual), lever, angle)
        usual = float(np.median(power)) / np.log(2.0)
        for _ in range(_MOST):
            best = int(np.argmax(power))
            if power[best] < _SIGNIFICANT * usual:
                break
            found.append(float(_ORDERS[best]))
            power[np.abs(_ORDERS - _ORDERS[best]) < _ALONE] = 0.0
    distinct: list[float] = []
    for order in sorted(found):
        if not distinct or order - distinct[-1] > _ALONE:
            distinct.append(order)
    return tuple(distinct)


def _fast(time: Array, values: Array) -> Array:
    """Without what is slow."""
    width = max(3, round(_SLOW / median_period(time)))
    return np.asarray(values - np.convolve(values, np.ones(width) / width, mode="same"))


def _spectrum(residual: Array, lever: Array, angle: Array) -> Array:
    """Power of residual ~ lever * sin(order * angle + phase), over all orders."""
    scale = robust_scale(residual) + 1e-12
    weighted = np.clip(residual / scale, -4.0, 4.0) * lever
    # After _TURNS turns every order has come round: angles on a ring, and one Fourier transform.
    place = np.floor(angle * (_PER_TURN / (2.0 * np.pi))).astype(np.int64) % (_TURNS * _PER_TURN)
    ring = np.bincount(place, weights=weighted, minlength=_TURNS * _PER_TURN)
    power = np.abs(np.fft.rfft(ring)[np.round(_ORDERS * _TURNS).astype(np.int64)]) ** 2
    return np.asarray(power / max(float(lever @ lever), 1e-12))
