"""What loads leave in the drivers' voltages, tick by tick."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_fault_diag.classifier.driver_sums import DriverSums
from tomr_power_model.model.ticks import to_ns

TICK = to_ns(0.05)
ALL = np.full(3, True)
NONE = np.full(3, False)
LOAD = np.array([1.0, -0.5, 0.1])  # V
OUTSIDE = np.array([True, True, False])
LEFT = np.array([-0.2, 0.1, 0.6])


def after(
    ticks: int,
    volts: NDArray[np.float64],
    sums: DriverSums | None = None,
    outside: NDArray[np.bool_] = NONE,
    shows: NDArray[np.bool_] = ALL,
) -> DriverSums:
    """So many ticks at which all is the same."""
    sums = sums or DriverSums()
    for _ in range(ticks):
        sums.take(volts, outside, shows, TICK)
    return sums


def loaded() -> DriverSums:
    return after(40, LOAD, outside=OUTSIDE)


def test_without_a_load_nothing_stays() -> None:
    np.testing.assert_array_equal(DriverSums().stays, 0.0)
    np.testing.assert_array_equal(after(100, LOAD).stays, 0.0)


def test_one_wheel_alone_is_no_load() -> None:
    alone = after(40, LOAD, outside=np.array([True, False, False]))
    np.testing.assert_array_equal(alone.stays, 0.0)
    unseen = after(40, LOAD, outside=OUTSIDE, shows=np.array([True, False, True]))
    np.testing.assert_array_equal(unseen.stays, 0.0)


def test_what_has_stayed_for_half_a_second_is_known() -> None:
    """The median of a second, and no more of each wheel than the load was."""
    sums = after(9, LEFT, loaded())
    np.testing.assert_allclose(sums.stays, np.clip(LOAD, -1.0, 1.0), rtol=0.05)
    sums = after(2, LEFT, sums)
    np.testing.assert_allclose(sums.stays, [-0.2, 0.1, 0.1], rtol=0.05)


def test_a_stray_tick_does_not_count() -> None:
    sums = after(3, np.full(3, 9.0), after(20, LEFT, loaded()))
    np.testing.assert_allclose(sums.stays, [-0.2, 0.1, 0.1], rtol=0.05)


def test_it_fades_as_in_the_driver_s_law() -> None:
    sums = after(20 * 33, LOAD, loaded())
    np.testing.assert_allclose(sums.stays, LOAD * np.exp(-0.03 * 33.0), rtol=1e-6)


def test_a_wheel_that_stands_keeps_what_was_seen() -> None:
    sums = after(20, LEFT, loaded())
    stands = np.array([False, True, True])
    after(40, np.zeros(3), sums, shows=stands)
    assert sums.stays[0] == pytest.approx(-0.2)
    np.testing.assert_array_equal(sums.stays[1:], 0.0)


def test_it_is_forgotten() -> None:
    sums = after(20, LEFT, loaded())
    sums.clear()
    np.testing.assert_array_equal(sums.stays, 0.0)
    np.testing.assert_array_equal(after(20, LEFT, sums).stays, 0.0)
