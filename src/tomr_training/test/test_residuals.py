"""Residuals of a whole drive at once: the same as those of the streaming stages."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot.description import PerWheel
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive
from tomr_training.planar.plant import run_plant
from tomr_training.planar.residuals import compare
from tomr_training.planar.sensors import Signals

BASE = 1_700_000_000 * 1_000_000_000


def _stamp(seconds: float) -> int:
    return BASE + round(seconds * 1e9)


NONE: Mapping[str, PerWheel] = {}
SCALED: Mapping[str, PerWheel] = {"sensor.encoder_scale": (None, {"scale": 1.02}, None)}
ECCENTRIC: Mapping[str, PerWheel] = {
    "sensor.encoder_eccentricity": ({"cosine": 0.02, "sine": -0.01}, None, None)
}


# The stages put a simulated wheel where a disc that is not centred shows it.
@pytest.mark.parametrize(
    ("seed", "flaws", "within"), [(3, NONE, 2e-4), (4, SCALED, 2e-4), (4, ECCENTRIC, 0.02)]
)
def test_the_same_residuals_as_the_stages(
    chosen: Callable[..., Drive], seed: int, flaws: Mapping[str, PerWheel], within: float
) -> None:
    fault = PlannedFault("encoder_lost", 3.0, 5.0, {"severity": 0.8, "wheel": 2})
    drive = chosen(seed, phases=chosen(seed).mission.phases[:10], faults=(fault,))
    plant, believed = (
        evolve(robot, physics={**robot.physics, **flaws}) for robot in (drive.plant, drive.believed)
    )
    drive = evolve(drive, plant=plant, believed=believed)
    signals = Signals.of(drive, run_plant(drive))
    compared = compare(drive, signals)
    residual, band = compared.residuals(BandSettings())
    predictor, stage = PowerPredictor(drive.believed), ResidualStage(drive.believed)
    events: list[tuple[int, int, tuple[object, ...]]] = []
    for time, twist in drive.mission.plan(drive.believed).commands():
        events.append((_stamp(time), 0, twist))
    for k, time in enumerate(signals.encoder_time):
        events.append((_stamp(time), 1, tuple(signals.position[k].tolist())))
    for k, time in enumerate(signals.power_time):
        readings = zip(signals.voltage[k].tolist(), signals.drawn[k].tolist(), strict=True)
        events.append((_stamp(time), 2, tuple(readings)))
    frames = []
    unknown = (float("nan"),) * 3
    for stamp, kind, values in sorted(events, key=lambda event: event[:2]):
        if kind == 0:
            predictor.command(stamp, values)  # type: ignore[arg-type]
        elif kind == 1:
            predictor.encoders(stamp, values, unknown)  # type: ignore[arg-type]
            stage.encoders(stamp, values, unknown)  # type: ignore[arg-type]
        else:
            for wheel, (voltage, drawn) in enumerate(values):  # type: ignore[misc]
                stage.power(PowerReading(wheel, stamp, voltage * drawn, drawn, voltage))
                predictor.measured(wheel, stamp)
        for prediction in predictor.due():
            stage.prediction(prediction)
        frames.extend(stage.due())
    assert len(frames) > 80
    streamed = np.array([[(r.residual, r.band) for r in frame.residuals] for frame in frames])
    ticks = np.array([(frame.stamp_ns - BASE) // 50_000_000 for frame in frames]) - 1
    # A wheel that is to stand still has a direction by rounding only.
    still = np.abs(compared.modelled[ticks]) < 1e-6
    found, wanted = residual[ticks], streamed[..., 0]
    found[still], wanted[still] = np.abs(found[still]), np.abs(wanted[still])
    np.testing.assert_allclose(found, wanted, atol=within)
    np.testing.assert_allclose(band[ticks], streamed[..., 1], atol=within)
    volts = np.array([[(v.residual, v.modelled) for v in frame.voltages] for frame in frames])
    beyond = compared.held - compared.voltage
    assert np.abs(beyond[ticks]).max() > 3.0  # of a driver whose encoder reads standstill
    np.testing.assert_allclose(beyond[ticks], volts[..., 0], atol=within)
    np.testing.assert_allclose(compared.voltage[ticks], volts[..., 1], atol=within)
