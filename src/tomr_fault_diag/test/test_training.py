"""The planar model for training: the same residuals as the stages, and sane physics."""

from typing import Any

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_fault_diag.training.drives import Bump, Drive, random_drive
from tomr_fault_diag.training.labels import Noise, deviates, lasting
from tomr_fault_diag.training.planar.fleet import Fleet
from tomr_fault_diag.training.planar.generate import CONTROL, MOTOR, UNTOLD, simulate
from tomr_fault_diag.training.planar.plant import Motion, Plant
from tomr_fault_diag.training.planar.residuals import compare
from tomr_fault_diag.training.planar.schedule import STEPS, TICK, Schedule
from tomr_fault_diag.training.planar.sensors import Signals
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.errors import InputError
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault, TwistPhase

BASE = 1_700_000_000 * 1_000_000_000
REFERENCE = shipped_robot("reference")


def _drive(seed: int = 3, kind: str | None = "encoder_lost", **changes: object) -> Drive:
    drive = random_drive(REFERENCE, seed, kind)
    return evolve(drive, mission=evolve(drive.mission, **changes)) if changes else drive


def _straight(duration: float = 4.0, bumps: tuple[Bump, ...] = (), **changes: object) -> Drive:
    """The reference robot itself, 0.5 m/s ahead after a second at rest."""
    phases = (TwistPhase((0.0, 0.0, 0.0), 1.0), TwistPhase((0.5, 0.0, 0.0), duration))
    plain: dict[str, object] = {"faults": (), "payload": 0.0, "floor_friction": 0.8}
    drive = _drive(**{**plain, "phases": phases, **changes})
    return evolve(drive, plant=REFERENCE, believed=REFERENCE, bumps=bumps)


def _run(*drives: Drive) -> Motion:
    return Plant(Fleet.of([drive.plant for drive in drives])).run(Schedule.of(drives))


def _stamp(seconds: float) -> int:
    return BASE + round(seconds * 1e9)


@pytest.mark.parametrize("seed", [3, 4])
def test_the_same_residuals_as_the_streaming_stages(seed: int) -> None:
    drive = _drive(seed)
    fault = PlannedFault("encoder_lost", 3.0, 5.0, {"severity": 0.8, "wheel": 2})
    drive = _drive(seed, phases=drive.mission.phases[:4], faults=(fault,))
    fleet, believed, schedule = (
        Fleet.of([drive.plant]),
        Fleet.of([drive.believed]),
        Schedule.of([drive]),
    )
    signals = Signals.of(fleet, [drive], Plant(fleet).run(schedule))
    compared = compare(believed, schedule, signals)
    residual, band = compared.residuals(BandSettings())
    predictor, stage = PowerPredictor(drive.believed), ResidualStage(drive.believed)
    events: list[tuple[int, int, tuple[object, ...]]] = []
    for time, twist in drive.mission.plan(drive.believed).commands():
        events.append((_stamp(time), 0, twist))
    for k, time in enumerate(signals.encoder_time[:, 0]):
        events.append((_stamp(time), 1, tuple(signals.position[k, :, 0].tolist())))
    for k, time in enumerate(signals.power_time[:, 0]):
        readings = zip(
            signals.voltage[k, :, 0].tolist(), signals.drawn[k, :, 0].tolist(), strict=True
        )
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
        for prediction in predictor.due():
            stage.prediction(prediction)
        frames.extend(stage.due())
    assert len(frames) > 80
    streamed = np.array([[(r.residual, r.band) for r in frame.residuals] for frame in frames])
    ticks = np.array([(frame.stamp_ns - BASE) // 50_000_000 for frame in frames]) - 1
    # A wheel that is told to stand still has a direction by rounding only.
    still = np.abs(compared.modelled[ticks, :, 0]) < 1e-6
    found, wanted = residual[ticks, :, 0], streamed[..., 0]
    np.testing.assert_allclose(found[~still], wanted[~still], atol=2e-4)
    np.testing.assert_allclose(np.abs(found[still]), np.abs(wanted[still]), atol=2e-4)
    np.testing.assert_allclose(band[ticks, :, 0], streamed[..., 1], atol=2e-4, rtol=1e-4)


def test_a_drive_is_the_same_alone_and_among_others() -> None:
    drives = [_drive(seed, "floor_slippery") for seed in (5, 6, 7)]
    together = Plant(Fleet.of([d.plant for d in drives])).run(Schedule.of(drives))
    alone = Plant(Fleet.of([drives[1].plant])).run(Schedule.of(drives[1:2]))
    length = len(alone.power)
    np.testing.assert_allclose(together.power[:length, :, 1], alone.power[:, :, 0], atol=1e-9)


def test_steady_driving_by_hand() -> None:
    """Wheel 1 sits at 0 degrees: driving ahead it is idle, the others turn at v sin(120) / r."""
    motion = _run(_straight())
    speed = np.diff(motion.encoder[-21:, :, 0], axis=0).mean(axis=0) * 200.0
    wanted = 0.5 * np.sin(2.0 * np.pi / 3.0) / 0.05
    np.testing.assert_allclose(speed, [0.0, wanted, -wanted], atol=0.02)
    torque = 0.06 + 0.004 * wanted  # N m of friction
    current = torque / 0.7
    power = (0.8 * current + 0.7 * wanted) * current + 1.2
    np.testing.assert_allclose(
        motion.power[-20:, :, 0].mean(axis=0), [1.2, power, power], rtol=0.02
    )


def test_traction_bounds_acceleration() -> None:
    """On ice of friction mu no robot accelerates faster than mu g."""
    slow = _straight(faults=(PlannedFault("floor_slippery", 0.5, None, {"severity": 1.0}),))
    motion = _run(slow)
    assert np.abs(motion.slip[300:320, 1:, 0]).max() > 0.1
    rolled = 0.05 * np.diff(motion.encoder, axis=0)[:, 1, 0] * 200.0 - motion.slip[:, 1, 0]
    ahead = rolled / np.sin(2.0 * np.pi / 3.0)
    assert np.diff(ahead[:400:20]).max() / 0.1 < 0.02 * 9.81 * 1.05


def test_a_bump_is_over_soon_and_shows() -> None:
    bump = Bump(2.0, 0.1, (30.0, 0.0), 0.0)
    motion, calm = _run(_straight(bumps=(bump,))), _run(_straight())
    change = np.abs(motion.power - calm.power)[:, :, 0].max(axis=1)
    assert change[400:430].max() > 2.0
    assert change[:400].max() == 0.0
    assert change[560:].max() < 0.5


def test_labels_follow_the_fault() -> None:
    drive = _drive(
        11,
        "control_signal_lost",
        phases=_drive(11).mission.phases[:5],
        faults=(PlannedFault("control_signal_lost", 2.0, 4.0, {"severity": 1.0, "wheel": 2}),),
    )
    other = _drive(12, None)
    batch = simulate(
        [drive, evolve(other, mission=evolve(other.mission, phases=other.mission.phases[:3]))]
    )
    labels = batch.labels[:, 0]
    assert set(labels[41:79].tolist()) == {CONTROL + 1}
    assert set(labels[20:40].tolist()) <= {0, UNTOLD}
    assert labels[80] == UNTOLD
    assert MOTOR not in batch.labels
    ends = int(batch.labels.shape[0])
    assert (batch.labels[:, 1] == UNTOLD).sum() >= ends - _ticks(other.mission.phases[:3])


def _ticks(phases: tuple[Any, ...]) -> float:
    """Whole ticks of some phases."""
    return float(sum(phase.duration for phase in phases) // TICK)


def test_what_differs_measurably() -> None:
    power = np.full((10, 3, 1), 4.0)
    speed = np.full((10, 3, 1), 5.0)
    noise = Noise(np.array([0.1]), np.array([0.0]))
    # 3 sigma and 15 % of 4 W: 0.9 W.
    more, less = power.copy(), power.copy()
    more[3:, 0], less[3:, 0] = 4.91, 4.89
    assert deviates(more, speed, power, speed, noise)[:, 0].tolist() == [False] * 3 + [True] * 7
    assert not deviates(less, speed, power, speed, noise).any()
    # 0.01 rad/s and 0.2 % of 5 rad/s: 0.02 rad/s.
    assert deviates(power, speed + 0.021, power, speed, noise).all()
    assert not deviates(power, speed + 0.019, power, speed, noise).any()
    flags = deviates(more, speed, power, speed, noise)[:, 0]
    assert lasting(flags).tolist() == [False] * 6 + [True] * 4


def test_a_robot_that_the_model_cannot_follow_is_refused() -> None:
    slow = evolve(REFERENCE, controller=evolve(REFERENCE.controller, rate=100.0))
    with pytest.raises(InputError, match="200 Hz"):
        Fleet.of([slow])


def test_steps_make_ticks() -> None:
    assert STEPS == 10
    assert TICK == 0.05
