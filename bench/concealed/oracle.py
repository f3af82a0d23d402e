"""How far apart simulation and reality are, without and with the truth, and what each effect shows.

The oracle is the plant itself with the true values, driven with the same commands from the same
start, read without noise. Its error is what the sensors leave.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from concealed.driving import BATTERY, Array, Track
from concealed.sensing import BATTERY_NOISE, POWER_RATE, SUPPLIES, Measured, SensorSet

_BARELY = 20.0  # total signal to noise below which a case shows hardly anything
_MOST = 0.9


def errors(
    readings: Mapping[str, Measured], nominal: Track, true: Track
) -> dict[str, dict[str, float] | dict[str, dict[str, float]]]:
    """NRMSE by channel, of the wheels together and of the total: see `nrmse`."""
    channels: dict[str, dict[str, float]] = {}
    squares: dict[str, Array] = {}
    for topic, reading in readings.items():
        supply = SUPPLIES.index(topic)
        power = reading.power
        before = power - nominal.power_at(reading.time, supply)
        after = power - true.power_at(reading.time, supply)
        parts = [float(np.mean(part**2)) for part in (before, after)]
        squares[topic] = np.array([*parts, float(np.var(power))])
        channels[topic] = {
            **_ratios(squares[topic]),
            "mean_power_w": float(power.mean()),
            "mean_shift_w": float(before.mean()),
        }
    found: dict[str, Any] = {"channels": channels, "total": _ratios(squares[SUPPLIES[BATTERY]])}
    wheels = [squares[topic] for topic in SUPPLIES[:BATTERY] if topic in squares]
    if wheels:
        found["wheels"] = _ratios(np.sum(wheels, axis=0))
    return found


def _ratios(squares: Array) -> dict[str, float]:
    """RMS error before and after over the standard deviation; wheels pool squares of all three."""
    before, after, variance = (float(value) for value in squares)
    scale = max(variance, 1e-12)
    return {
        "nrmse_before": float(np.sqrt(before / scale)),
        "nrmse_after": float(np.sqrt(after / scale)),
    }


def visibility(
    true: Track, without: Sequence[Track], sensors: SensorSet, voltage: float
) -> dict[str, Any]:
    """Signal to noise of each effect in the whole drive, per sample, and how it is spread in time.

    Args:
        true: the drive as it was.
        without: the same drive without the first effect, without the second...
        sensors: of the real robot.
        voltage: nominal, of the supply [V].
    """
    when = np.arange(1.0 / POWER_RATE, float(true.time[-1]), 1.0 / POWER_RATE)
    shown: dict[str, Any] = {"snr_by_effect": {}, "snr_per_sample": {}, "time_holding_90pct": {}}
    for number, other in enumerate(without, start=1):
        squares = _signal(true, other, sensors, voltage, when)
        name = f"e{number}"
        shown["snr_by_effect"][name] = float(np.sqrt(squares.sum()))
        shown["snr_per_sample"][name] = float(np.sqrt(squares.mean()))
        held = np.sort(squares.sum(axis=0))[::-1].cumsum()
        share = float(np.searchsorted(held, _MOST * held[-1]) + 1) / len(held)
        shown["time_holding_90pct"][name] = min(share, 1.0)
    return shown


def _signal(true: Track, other: Track, sensors: SensorSet, voltage: float, when: Array) -> Array:
    """Squared difference of power and bus voltage over noise variance, (channels, samples)."""
    quantum = sensors.current_resolution**2 / 12.0
    rows = []
    for supply in range(BATTERY) if sensors.wheel_power else (BATTERY,):
        times = BATTERY_NOISE if supply == BATTERY else 1.0
        power_noise = voltage**2 * ((times * sensors.current_noise) ** 2 + quantum)
        shift = true.power_at(when, supply) - other.power_at(when, supply)
        rows.append(shift**2 / power_noise)
    bus = true.supply_at(when, BATTERY)[0] - other.supply_at(when, BATTERY)[0]
    rows.append(bus**2 / sensors.voltage_noise**2)
    return np.array(rows)


def barely_excited(shown: Mapping[str, Any]) -> bool:
    """Whether some effect leaves next to nothing in the recording."""
    return any(value < _BARELY for value in shown["snr_by_effect"].values())


def mean_shift(true: Track, other: Track) -> float:
    """Mean difference of the power of all motors [W]."""
    when = np.arange(1.0 / POWER_RATE, float(true.time[-1]), 1.0 / POWER_RATE)
    pairs = [(true.power_at(when, wheel), other.power_at(when, wheel)) for wheel in range(BATTERY)]
    return float(np.mean([np.mean(one - two) for one, two in pairs]))
