"""What the window network sees of a frame: continuous, scaled so that healthy is about 1 or less.

Twenty numbers a tick, two and groups of three by wheel:

    total        residual of the total power / band
    balance      what the battery gives and no motor takes, measured less modelled / least band of
                 a motor: whether what motors seem to draw comes from the battery
    motors 1-3   residuals of the motors' powers against the command / band
    encoders 1-3 the same against the encoders
    drawn 1-3    measured power of the motors / band: a driver without a signal draws next to none
    slower 1-3   measured - expected wheel speed / band, signed as the wheel turns
    expected 1-3, measured 1-3   wheel speeds

each as asinh of a scaled value, so that a thousandfold still counts as more. What is unknown is
"as modelled". By symmetry one network serves all three wheels: for each wheel in turn the other
two follow in their order around the robot, and all speeds are reversed where it turns backwards.
"""

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL, ResidualFrame

Array = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)

CHANNELS = 20
WINDOW = 8  # ticks
INPUTS = CHANNELS * WINDOW
_FINE = 3.0  # per band
_SPEED = 0.5  # rad/s
_TOTALS = 2  # channels that belong to no wheel
_SIGNED = slice(11, CHANNELS)
_EXPECTED = slice(14, 17)
_RATIOS = [0, *range(2, 8), *range(11, 14)]  # total, motors, encoders, speeds
_MOTORS, _SPEEDS, _ENCODERS = list(MOTORS), list(SPEEDS), list(ENCODERS)


def _turned(wheel: int) -> list[int]:
    """Channels as seen from a wheel: it comes first in each group of three."""
    groups = range(_TOTALS, CHANNELS, 3)
    return [
        *range(_TOTALS),
        *(start + (wheel + place) % 3 for start in groups for place in range(3)),
    ]


TURNS = np.array([_turned(wheel) for wheel in range(3)])  # (3, 20)
SIGNED = np.arange(CHANNELS) >= _SIGNED.start  # channels that turn with the wheels' direction


def channels(residual: Array, band: Array, modelled: Array) -> Array:
    """Channels (..., 20) of residuals, bands and modelled values (..., 10), NaN where unknown."""
    scaled = _scaled(residual / band)
    surplus = residual[..., [TOTAL]] - residual[..., _MOTORS].sum(axis=-1, keepdims=True)
    balance = _scaled(surplus / band[..., _MOTORS].min(axis=-1, keepdims=True))
    drawn = _scaled(((modelled + residual) / band)[..., _MOTORS])
    expected = np.nan_to_num(modelled[..., _SPEEDS])
    way = np.where(expected < 0.0, -1.0, 1.0)
    measured = expected + np.nan_to_num(residual[..., _SPEEDS]) * way
    return np.concatenate(
        [
            scaled[..., [TOTAL]],
            balance,
            scaled[..., [*_MOTORS, *_ENCODERS]],
            drawn,
            scaled[..., _SPEEDS] * way,
            np.arcsinh(expected / _SPEED),
            np.arcsinh(measured / _SPEED),
        ],
        axis=-1,
    )


def _scaled(ratio: Array) -> Array:
    """As the network sees a ratio to a band; what is unknown is "as modelled"."""
    found = np.arcsinh(_FINE * ratio)
    return np.where(np.isfinite(found), found, 0.0)


def channels_of(frame: ResidualFrame) -> Array:
    """Channels (20,) of one frame, as `channels`; plain floats, ten are too few for numpy."""
    scaled = [_finite(_FINE * item.residual / item.band) for item in frame.residuals]
    values = [scaled[TOTAL], _balance(frame)]
    values += [*(scaled[k] for k in _MOTORS), *(scaled[k] for k in _ENCODERS)]
    for k in _MOTORS:
        item = frame.residuals[k]
        values.append(_finite(_FINE * (item.modelled + item.residual) / item.band))
    expected, measured = [], []
    for k in _SPEEDS:
        item = frame.residuals[k]
        want = 0.0 if math.isnan(item.modelled) else item.modelled
        way = -1.0 if want < 0.0 else 1.0
        values.append(scaled[k] * way)
        expected.append(math.asinh(want / _SPEED))
        off = 0.0 if math.isnan(item.residual) else item.residual * way
        measured.append(math.asinh((want + off) / _SPEED))
    return np.array(values + expected + measured)


def _balance(frame: ResidualFrame) -> float:
    """What no motor takes of the total; 0 where it is not known, or is the motors' sum."""
    total, motors = frame.residuals[TOTAL], [frame.residuals[k] for k in _MOTORS]
    if total.stale or any(item.stale or item.unit != total.unit for item in motors):
        return 0.0
    surplus = total.residual - sum(item.residual for item in motors)
    return _finite(_FINE * surplus / min(item.band for item in motors))


def _finite(ratio: float) -> float:
    """As the network sees a ratio to a band; what is unknown, or beyond all, is "as modelled"."""
    return math.asinh(ratio) if math.isfinite(ratio) else 0.0


def band_ratios(tick: Array) -> Array:
    """Residuals over their bands (10,) of a tick (20,), 0 where unknown."""
    return np.asarray(np.sinh(tick[_RATIOS]) / _FINE)


def by_wheel(window: NDArray[Real]) -> NDArray[Real]:
    """Inputs (..., 3, WINDOW * 20) as seen from each wheel, of windows (..., WINDOW, 20).

    The newest tick comes last.
    """
    seen = window[..., TURNS]  # (..., WINDOW, 3, 20)
    way = np.where(window[..., -1, _EXPECTED] < 0.0, -1.0, 1.0).astype(window.dtype)  # (..., 3)
    seen = np.where(SIGNED, seen * way[..., None, :, None], seen)
    seen = np.moveaxis(seen, -2, -3)
    return np.ascontiguousarray(seen.reshape(*seen.shape[:-2], INPUTS))


def turning(window: Array, wheel: int) -> tuple[Array, Array]:
    """Expected and measured speed of a wheel in a window; slow ones are expected to stand."""
    expected = np.sinh(window[:, _EXPECTED.start + wheel]) * _SPEED
    measured = np.sinh(window[:, _EXPECTED.stop + wheel]) * _SPEED
    return np.where(np.abs(expected) < _SPEED, 0.0, expected), measured


def _without_total(window: Array) -> Array:
    window[..., :_TOTALS] = 0.0
    return window


def _without_balance(window: Array) -> Array:
    """The total is the motors' sum."""
    window[..., 1] = 0.0
    return window


def _without_motor(wheel: int) -> Callable[[Array], Array]:
    lost = [1, *range(_TOTALS + wheel, _TOTALS + 9, 3)]

    def without(window: Array) -> Array:
        window[..., lost] = 0.0
        return window

    return without


def _without_motors(window: Array) -> Array:
    window[..., 1 : _TOTALS + 9] = 0.0
    return window


def _without_encoders(window: Array) -> Array:
    window[..., [5, 6, 7, 11, 12, 13]] = 0.0
    window[..., 17:20] = window[..., 14:17]
    return window


# What windows look like to a robot that lacks a sensor.
BLIND = (
    _without_total,
    _without_balance,
    _without_motor(0),
    _without_motor(1),
    _without_motor(2),
    _without_motors,
    _without_encoders,
)
