"""Over how long power sensors average, read off a recording."""

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray
from scipy.signal import lfilter

from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit import window
from tomr_reality_gap.fit.window import WINDOW, window_of
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.request import Request

from .test_alignment import _recorded as recorded_drive
from .test_alignment import as_recorded

Array = NDArray[np.float64]

ROBOT = shipped_robot("reference")
SQUARE = Path(__file__).resolve().parents[3] / "bags" / "square"
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


def test_no_window_is_longer_than_any_that_was_tried(
    true: RecordingSimulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The longest is what a description may have: 1 s, here 0.4."""
    assert window._TRIED[-1] == 1.0
    monkeypatch.setattr(window, "_TRIED", tuple(np.geomspace(0.02, 0.4, 16)))
    assert window_of(_measured(true, _mean_of(21))) == 0.4


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


class _Mean:
    """Currents that are averaged over the last samples of each topic."""

    def __init__(self, samples: int) -> None:
        self._samples = samples
        self._last: dict[str, deque[float]] = {}

    def __call__(self, topic: str, message: Any) -> Any:
        if topic.endswith(("/power", "battery_state")):
            last = self._last.setdefault(topic, deque(maxlen=self._samples))
            last.append(message.current)
            message.current = sum(last) / len(last)
        return message


def test_what_is_found_is_taken_and_said(tmp_path: Path) -> None:
    mean, averaged = _Mean(20), tmp_path / "averaged"
    with open_recording(SQUARE) as recording, RecordingWriter(averaged) as writer:
        for topic, type_name, message, receive_ns in recording.messages():
            writer.write(topic, type_name, mean(topic, message), receive_ns)
    ready = prepared(Request("reference", (averaged,)))
    assert ready.robot.sensors.power_window == pytest.approx(0.39, abs=0.03)
    assert ready.base.values[WINDOW] == ready.robot.sensors.power_window
    (said,) = (note for note in ready.notes if WINDOW in note)
    assert said.startswith("what power sensors say is averaged over 0.")
    span = {float(item.span[0]) for item in ready.real[0].channels if item.kind == "power"}
    assert span == {ready.robot.sensors.power_window}
    # The user's simulation has the sensors that are described.
    given = prepared(Request("reference", (averaged,), sim=SQUARE))
    (simulated,) = given.simulations
    assert {float(item.span[0]) for item in simulated.channels if item.kind == "power"} == {
        ROBOT.sensors.power_window
    }
    plain = prepared(Request("reference", (SQUARE,)))
    assert plain.robot.sensors.power_window == ROBOT.sensors.power_window
    assert not any(WINDOW in note for note in plain.notes)
