"""Simulated steps read over the windows in which sensors average, by hand."""

import math

import pytest

from tomr_power_model.dynamics.vehicle import plant_numbers, vehicle_of
from tomr_power_model.model.trace import Monitor, Trace
from tomr_power_model.robot import shipped_robot

MS = 1_000_000


def _trace() -> Trace:
    """Means of 2 W and 4 W over two steps of 10 ms; in the first it rises from 1.5 W to 2.5 W."""
    trace = Trace(1_000 * MS)
    trace.add(0, 10 * MS, [(2.0, 1.0)])
    trace.add(10 * MS, 10 * MS, [(4.0, 0.0)])
    return trace


@pytest.mark.parametrize(
    ("end", "window", "expected"),
    [
        (10, 10, 2.0),
        (5, 5, 1.75),  # from 1.5 W to 2 W
        (15, 10, 0.5 * 2.25 + 0.5 * 4.0),  # the first one's second half: 2 W to 2.5 W
        (30, 20, 4.0),  # of what of it was simulated
    ],
)
def test_means_over_windows(end: int, window: int, expected: float) -> None:
    assert _trace().mean(0, end * MS, window * MS) == pytest.approx(expected)


def test_nothing_is_known_of_what_was_not_simulated() -> None:
    assert math.isnan(_trace().mean(0, 60 * MS, 5 * MS))


def test_old_steps_are_forgotten() -> None:
    trace = Trace(15 * MS)
    for k in range(4):
        trace.add(10 * k * MS, 10 * MS, [(float(k), 0.0)])
    assert math.isnan(trace.mean(0, 10 * MS, 10 * MS))
    assert trace.mean(0, 40 * MS, 10 * MS) == 3.0


def test_a_monitor_follows_with_its_lag() -> None:
    # A step of 1 W over 10 ms at 20 ms: 1 - e^-0.5 = 0.393469; scale 2 and 0.1 W on top.
    numbers = plant_numbers(vehicle_of(shipped_robot("reference")))
    numbers.power_lag[0], numbers.power_scale[0], numbers.power_bias[0] = 0.02, 2.0, 0.1
    monitor = Monitor(numbers, 0)
    assert monitor.follow((0.0, 0.0), 0.01)[0] == 0.0
    seen, _ = monitor.follow((1.0, 0.0), 0.01)
    assert seen == pytest.approx(0.393469, abs=1e-6)
    assert monitor.shown(seen) == pytest.approx(2.0 * 0.393469 + 0.1, abs=1e-6)
