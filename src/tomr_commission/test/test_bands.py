"""Bands of one robot, and what each drive asks of them."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_commission.bands import bands_of, outside, regime_table, regimes, steady_drag
from tomr_commission.observed import Observed
from tomr_commission.request import BandChoice
from tomr_fault_diag.residuals.frame import SPEEDS
from tomr_fault_diag.residuals.settings import BandSettings

Steady = Callable[..., Observed]


def test_margin_multiplies_the_bands(steady: Steady) -> None:
    plain = bands_of([steady()], BandChoice(margin=1.0, speed_factor=1.0))
    wide = bands_of([steady()], BandChoice(margin=2.0, speed_factor=1.5))
    assert wide.power == pytest.approx(2.0 * plain.power, rel=1e-3)
    assert wide.speed == pytest.approx(3.0 * plain.speed, rel=1e-3)
    assert wide.total_factor == pytest.approx(plain.total_factor, rel=1e-3)


def test_bands_hold_the_share_that_was_asked_for(steady: Steady) -> None:
    drive = steady(ticks=8000)
    shares = outside([drive], bands_of([drive], BandChoice(0.99, 1.0, 1.0)))
    assert all(0.002 < share < 0.03 for share in shares.values())


def test_the_band_of_a_gyro_is_widened_where_healthy_driving_asks_for_it(steady: Steady) -> None:
    usual, drive = BandSettings(), steady()
    random = np.random.default_rng(2)

    def band(sigma: float) -> BandSettings:
        yaw = np.stack([random.normal(0.0, sigma, 4000), np.full(4000, 0.5)], axis=1)
        return bands_of([evolve(drive, yaw=yaw)], BandChoice(margin=1.5))

    assert bands_of([drive], BandChoice()).yaw == usual.yaw  # without a gyro
    assert band(0.01).yaw == usual.yaw
    # 99.9 % of |normal|: 3.29 sigma, with a margin of 1.5.
    assert band(0.1).yaw == pytest.approx(1.5 * 3.29 * 0.1, rel=0.1)
    assert band(0.1).yaw_relative / usual.yaw_relative > 4.0


def test_the_band_of_an_accelerometer_as_well(steady: Steady) -> None:
    usual, drive = BandSettings(), steady()
    random = np.random.default_rng(2)

    def band(sigma: float) -> BandSettings:
        along = np.hstack([random.normal(0.0, sigma, (4000, 2)), np.full((4000, 2), 0.5)])
        return bands_of([evolve(drive, along=along)], BandChoice(margin=1.5))

    assert bands_of([drive], BandChoice()).along == usual.along
    assert band(0.02).along == usual.along
    assert band(0.2).along == pytest.approx(1.5 * 3.29 * 0.2, rel=0.1)
    assert band(0.2).along_relative / usual.along_relative > 3.0
    assert band(0.2).yaw == usual.yaw


def test_the_bands_of_voltages_are_those_of_healthy_drivers(steady: Steady) -> None:
    usual, drive, random = BandSettings(), steady(), np.random.default_rng(2)
    volts = np.hstack([random.normal(0.0, 0.03, (4000, 3)), np.full((4000, 3), 6.0)])
    found = bands_of([evolve(drive, volts=volts)], BandChoice(margin=1.5))
    width = max(found.voltage, 6.0 * found.voltage_relative)
    assert width == pytest.approx(1.5 * 3.29 * 0.03, rel=0.1)
    plain = bands_of([evolve(drive, volts=volts)], BandChoice(margin=1.0))
    for name in ("voltage", "voltage_relative", "voltage_transient"):
        assert getattr(found, name) == pytest.approx(1.5 * getattr(plain, name), rel=1e-3)
    unknown = bands_of([drive], BandChoice())  # its drivers' law is not known
    assert unknown.voltage == usual.voltage
    assert unknown.voltage_relative == usual.voltage_relative


def test_regimes_of_a_start_and_a_reversal(steady: Steady) -> None:
    drive = steady(ticks=60)
    modelled = drive.modelled.copy()
    modelled[:20, 4], modelled[20:40, 4], modelled[40:, 4] = 0.0, 5.0, -5.0
    found = regimes(evolve(drive, modelled=modelled))
    assert found["at rest"][:20, 0].all()
    assert found["starts and stops"][20, 0]
    assert found["steady"][35, 0]
    assert found["reversals"][41, 0]
    assert sum(mask.astype(int) for mask in found.values()).max() == 1


def test_table_shows_the_scatter(steady: Steady) -> None:
    drive = steady(sigma=0.1)
    lines = regime_table([drive], bands_of([drive], BandChoice()))
    line = next(one for one in lines if one.kind == "motor power, command path")
    assert line.regime == "steady"
    assert line.rms == pytest.approx(0.1, rel=0.05)
    assert line.high == pytest.approx(0.329, rel=0.1)  # 99.9 % of |normal|: 3.29 sigma
    assert not any(one.kind == "driver's voltage" for one in lines)  # which is not known


def test_table_shows_the_drivers_voltages(steady: Steady) -> None:
    drive = steady()
    volts = np.full((len(drive.stamp_ns), 6), 0.2)
    volts[:, 3:] = 5.0
    bands = evolve(BandSettings(), voltage=0.1, voltage_relative=0.0)
    lines = regime_table([evolve(drive, volts=volts)], bands)
    line = next(one for one in lines if one.kind == "driver's voltage")
    assert (line.regime, line.unit, line.count) == ("steady", "V", 3 * len(volts))
    assert (line.rms, line.high, line.outside) == pytest.approx((0.2, 0.2, 1.0))


def test_drag_is_power_over_speed(steady: Steady) -> None:
    drive = steady(sigma=0.0)
    residual = drive.residual.copy()
    residual[:, 2] = 1.0  # W more at 5 rad/s: 0.2 N m, a quarter of the 0.8 N m that are usual
    drag = steady_drag(evolve(drive, residual=residual))
    assert np.allclose(drag.added, [0.0, 0.2, 0.0])
    assert np.allclose(drag.usual, 0.8)


def test_drag_of_currents_does_not_hang_on_the_speed(steady: Steady) -> None:
    drive = steady(sigma=0.0)
    residual, modelled, units = drive.residual.copy(), drive.modelled.copy(), drive.units.copy()
    residual[:, 2] = 1.0
    modelled[:, list(SPEEDS)] = [5.0, 0.5, 2.0]
    units[[0, 1, 2, 3, 7, 8, 9]] = "A"
    drag = steady_drag(evolve(drive, residual=residual, modelled=modelled, units=units))
    assert np.allclose(drag.added, [0.0, 1.0, 0.0])  # A
    assert np.allclose(drag.usual, 4.0)


def test_drag_of_a_wheel_that_is_seldom_steady_is_not_known(steady: Steady) -> None:
    assert np.isnan(steady_drag(steady(ticks=39)).added).all()
    assert np.isfinite(steady_drag(steady(ticks=50)).added).all()
