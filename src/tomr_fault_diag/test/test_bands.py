"""Bands calibrated on healthy residuals."""

import numpy as np
import pytest

from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.calibrated import fit_band, fit_bands
from tomr_fault_diag.residuals.settings import LEAST_BAND, LEAST_FACTOR, BandSettings
from tomr_fault_diag.residuals.widths import moved, transient_ticks
from tomr_power_model.errors import InputError

COUNT = 20_000


def _healthy(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals of 5 % of the model, 10 % of its change and 0.1 W of noise."""
    random = np.random.default_rng(seed)
    modelled = random.uniform(0.0, 10.0, (COUNT, 10))
    change = random.exponential(1.0, (COUNT, 10))
    scale = 0.1 + 0.05 * modelled + 0.1 * change
    return scale * random.standard_normal((COUNT, 10)), modelled, change


def test_the_share_asked_for_stays_within() -> None:
    residual, modelled, change = _healthy()
    residual[:, 0] *= 3.0
    residual[:, 4:7] *= 0.2
    change[:, 4:7] *= 0.5
    bands = fit_bands(residual, modelled, change, within=0.99)
    total = bands.power * bands.total_factor, bands.total_relative, 3.0 * bands.transient
    motor = bands.power, bands.relative, bands.transient
    speed = bands.speed, bands.speed_relative, bands.speed_transient
    size, modelled, change = _healthy(1)
    change[:, 4:7] *= 0.5
    for columns, scale, (least, relative, transient) in (
        (slice(0, 1), 3.0, total),
        (slice(1, 4), 1.0, motor),
        (slice(4, 7), 0.2, speed),
    ):
        band = np.maximum(least, relative * modelled[:, columns]) + transient * change[:, columns]
        inside = np.abs(scale * size[:, columns]) <= band
        assert inside.mean() == pytest.approx(0.99, abs=0.004)
    assert 0.05 < bands.transient < 0.5


def test_more_mismatch_makes_wider_bands() -> None:
    residual, modelled, change = _healthy()
    narrow, wide = (fit_band(k * residual, modelled, change, 0.99) for k in (1.0, 3.0))
    assert narrow is not None
    assert wide is not None
    assert wide.least == pytest.approx(3.0 * narrow.least, rel=1e-6)
    assert wide.relative == pytest.approx(3.0 * narrow.relative, rel=1e-6)


def test_currents_and_missing_residuals() -> None:
    residual, modelled, change = _healthy()
    residual[:, 0] = np.nan  # no battery_state
    bands = fit_bands(residual, modelled, change, unit="A")
    assert bands.current != pytest.approx(0.15)
    assert bands.power == BandSettings().power
    assert bands.total_relative == BandSettings().total_relative


def test_too_little_is_refused() -> None:
    residual, modelled, change = (part[:100] for part in _healthy())
    with pytest.raises(InputError, match="a minute of driving"):
        fit_bands(residual, modelled, change)


def test_residuals_that_are_all_nothing_leave_bands_that_can_be_set() -> None:
    """As those of a simulation compared with itself: what is written must be taken again."""
    residual, modelled, change = _healthy()
    residual[:, 1:] = 0.0
    bands = fit_bands(residual, modelled, change)
    assert bands.power == bands.speed == LEAST_BAND
    residual[:] = 0.0
    residual[:, 1:4] = 50.0
    assert fit_bands(residual, modelled, change).total_factor == LEAST_FACTOR


@pytest.mark.parametrize("name", ["power", "current", "total_factor", "speed"])
def test_a_least_band_of_nothing_is_refused(name: str) -> None:
    key = f"band.{name}"
    with pytest.raises(InputError, match=key):
        DiagnosisSettings.of({key: -0.0}, "")
    lowest = LEAST_FACTOR if name == "total_factor" else LEAST_BAND
    bands = DiagnosisSettings.of({key: lowest}, "").residuals.bands
    assert getattr(bands, name) == lowest


@pytest.mark.parametrize(
    ("milliseconds", "ticks"), [(10, 15), (20, 8), (50, 3), (100, 2), (200, 2)]
)
def test_a_change_counts_over_as_many_ticks_as_it_takes(milliseconds: int, ticks: int) -> None:
    assert transient_ticks(milliseconds * 1_000_000) == ticks


def test_how_far_a_model_moved_is_of_the_last_ticks_and_of_what_is_known() -> None:
    values = np.array([[0.0], [1.0], [np.nan], [4.0], [4.0], [4.0]])
    assert moved(values, 3)[:, 0].tolist() == [0.0, 1.0, 1.0, 3.0, 0.0, 0.0]
    assert moved(values, 2)[:, 0].tolist() == [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
