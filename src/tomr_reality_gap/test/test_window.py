"""Over how long power sensors average, read off a recording."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray
from scipy.signal import lfilter

from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.window import window_of

from .test_alignment import _recorded as recorded_drive
from .test_alignment import as_recorded

Array = NDArray[np.float64]

ROBOT = shipped_robot("reference")
PERIOD = 0.02  # s between two samples of power


def _simulation(robot: Robot = ROBOT) -> RecordingSimulation:
    recorded = recorded_drive(robot)
    return RecordingSimulation.of(recorded, robot, channels_of(recorded, robot))


@pytest.fixture(scope="module")
def true() -> RecordingSimulation:
    """What sensors that are as described measure, of a robot that draws a tenth more."""
    made = _simulation()
    heavier = evolve(ROBOT, mass=1.1 * ROBOT.mass)
    return as_recorded(made, made.predict([heavier])[0])


def _measured(true: RecordingSimulation, sensor: Callable[[Array], Array]) -> RecordingSimulation:
    """By other sensors of power."""
    return evolve(
        true,
        channels=tuple(
            evolve(item, value=sensor(item.value)) if item.kind in ("power", "total") else item
            for item in true.channels
        ),
    )


def _mean_of(samples: int) -> Callable[[Array], Array]:
    return lambda value: np.convolve(value, np.full(samples, 1.0 / samples))[: len(value)]


def _late_by(samples: int) -> Callable[[Array], Array]:
    return lambda value: np.concatenate([np.full(samples, value[0]), value[:-samples]])


def _lagging(time_constant: float) -> Callable[[Array], Array]:
    keep = float(np.exp(-PERIOD / time_constant))
    return lambda value: np.asarray(lfilter([1.0 - keep], [1.0, -keep], value))


def test_sensors_that_are_as_described_have_no_other_window(true: RecordingSimulation) -> None:
    assert window_of(true) is None


@pytest.mark.parametrize("samples", [10, 20, 40])
def test_averages_are_found(true: RecordingSimulation, samples: int) -> None:
    found = window_of(_measured(true, _mean_of(samples)))
    assert found == pytest.approx(samples * PERIOD, abs=0.5 * PERIOD + 0.01)
    noise = np.random.default_rng(1).normal
    noisy = _measured(true, lambda v: _mean_of(samples)(v) + noise(0.0, 0.05, len(v)))
    assert window_of(noisy) == pytest.approx(found, abs=0.02)


@pytest.mark.parametrize(
    "sensor", [_late_by(10), _lagging(0.1), _lagging(0.3)], ids=["late", "lags", "lags long"]
)
def test_what_has_another_name_is_left_to_it(
    true: RecordingSimulation, sensor: Callable[[Array], Array]
) -> None:
    assert window_of(_measured(true, sensor)) is None


def test_a_window_that_is_described_is_none_to_be_found(true: RecordingSimulation) -> None:
    described = evolve(ROBOT, sensors=evolve(ROBOT.sensors, power_window=0.4))
    averaged = _measured(true, _mean_of(20))
    assert window_of(evolve(averaged, robot=described)) is None


def test_without_signs_or_power_nothing_shows(true: RecordingSimulation) -> None:
    unsigned = evolve(ROBOT, measurement=evolve(ROBOT.measurement, signed=False))
    averaged = _measured(true, _mean_of(20))
    assert window_of(evolve(averaged, robot=unsigned)) is None
    speeds = tuple(item for item in averaged.channels if item.kind == "speed")
    assert window_of(evolve(averaged, channels=speeds)) is None
    still = _measured(true, lambda value: 0.0 * value)
    assert window_of(still) is None
