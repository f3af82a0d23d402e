"""How coarse a sensor is, from readings made by hand."""

import numpy as np
import pytest

from tomr_power_model.drive.quantum import count_of, quantum_of


def test_a_quantum_is_the_distance_to_the_next_level() -> None:
    """0.3 and 0.4 were never read beside 0.1; float32 currents are levels as well."""
    reading = np.array([0.0, 0.1, 0.1, 0.2, 0.5, 0.0, np.nan], dtype=np.float32)
    assert quantum_of(reading.astype(np.float64)) == pytest.approx(0.1)


def test_a_peak_of_which_few_levels_are_read_is_no_coarse_sensor() -> None:
    dense, sparse = np.arange(0.0, 1.0, 0.001), np.arange(1.0, 50.0, 0.5)
    assert quantum_of(np.concatenate([dense, sparse])) == pytest.approx(0.001)


def test_products_of_one_level_are_one_level() -> None:
    """0.1 A at voltages that are divided out again differ in the last digit."""
    volts = np.random.default_rng(1).uniform(23.0, 25.0, 500)
    current = np.repeat([0.1, 0.7, 0.8], [200, 200, 100])
    assert quantum_of((current * volts) / volts) == pytest.approx(0.1)


@pytest.mark.parametrize("reading", [[], [np.nan, np.nan], [0.3, 0.3]])
def test_one_level_tells_no_quantum(reading: list[float]) -> None:
    assert quantum_of(np.array(reading)) == 0.0


def test_encoders_go_by_what_their_steps_differ_by() -> None:
    """Three counts a sample and then five; a lost sample makes a step of two."""
    counts = np.cumsum([0, 3, 3, 3, 5, 5, 10, 5, 3])
    position = np.stack([0.01 * counts, np.full(9, 0.4), np.full(9, np.nan)], axis=1)
    assert count_of(position) == pytest.approx(0.02)
    assert count_of(position[:, 1:]) == 0.0
    assert count_of(position[:2]) == 0.0
