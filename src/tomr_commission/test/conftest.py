"""Drives that the tests of commissioning share."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tomr_commission.observed import Observed, observe
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.robot import shipped_robot

BAGS = Path(__file__).resolve().parents[3] / "bags"


@pytest.fixture(scope="session")
def healthy() -> Observed:
    """A healthy drive of the reference robot."""
    return _observed("square")


@pytest.fixture(scope="session")
def faulty() -> Observed:
    """A drive in which the encoder of wheel 3 fails from 8 s to 15 s."""
    return _observed("circle_encoder_lost")


def _observed(name: str) -> Observed:
    settings = DiagnosisSettings.of({}, "")
    return observe(BAGS / name, name, shipped_robot("reference"), settings)


@pytest.fixture
def steady() -> Callable[..., Observed]:
    """Ticks of 50 ms at 5 rad/s and 4 W a motor, with residuals of a normal distribution."""

    def make(
        name: str = "steady", sigma: float = 0.1, ticks: int = 4000, seed: int = 1
    ) -> Observed:
        random = np.random.default_rng(seed)
        modelled = np.tile([24.0, 4.0, 4.0, 4.0, 5.0, 5.0, 5.0, 4.0, 4.0, 4.0], (ticks, 1))
        residual = random.normal(0.0, sigma, modelled.shape)
        units = np.array(["W"] * 4 + ["rad/s"] * 3 + ["W"] * 3)
        stamps = 50_000_000 * np.arange(1, ticks + 1, dtype=np.int64)
        missing = np.full(modelled.shape, "", dtype="<U1")
        yaw, along = np.full((ticks, 2), np.nan), np.full((ticks, 4), np.nan)
        volts = np.full((ticks, 6), np.nan)
        return Observed(name, stamps, residual, modelled, missing, units, yaw, along, volts)

    return make
