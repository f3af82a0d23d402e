"""A drive in MuJoCo, seen by the diagnosis tick by tick, with the truth beside it."""

from collections.abc import Callable, Collection, Iterator
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.dynamics.binding import has_numba
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.topics.inputs import model_inputs
from tomr_sim_bridge.missions.drive import drive
from tomr_sim_bridge.plant import moments
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.simulation import Simulation
from tomr_training.drives import Bump, Drive
from tomr_training.labels import GroundTruth

Array = NDArray[np.float64]

START_NS = 1_700_000_000 * NANOSECONDS
PERIOD_NS = 50_000_000
_BODY = 1  # of MuJoCo's bodies: 0 is the world


class ProbedSimulation(Simulation):
    """A simulation that is pushed about, and that reports what really happens at every tick."""

    def __init__(self, chosen: Drive) -> None:
        mission = chosen.mission
        super().__init__(
            chosen.plant,
            chosen.seed,
            start_ns=START_NS,
            floor_friction=mission.floor_friction,
            payload=mission.payload,
            stamp_jitter=mission.stamp_jitter,
        )
        self._edges = _edges(chosen.bumps)
        self._gravity = self._design.gravity
        self._before = self._memory.latest.values
        self._ticks = 1
        self.rows: list[Array] = []

    def step_to(self, stamp_ns: int) -> list[Sample]:
        """Run up to a time; see Simulation."""
        found: list[Sample] = []
        while True:
            tick = START_NS + self._ticks * PERIOD_NS
            stop = min(tick, self._edges[0][0] if self._edges else tick)
            if stop > stamp_ns:
                break
            found.extend(super().step_to(stop))
            if self._edges and stop == self._edges[0][0]:
                _, push, slope = self._edges.pop(0)
                self.engine.data.xfrc_applied[_BODY] = push
                self._design.gravity = self._gravity + slope / self._design.mass
            if stop == tick:
                self._note()
        return found + super().step_to(stamp_ns)

    def _note(self) -> None:
        now = self._memory.latest.values
        self.rows.append(now - self._before)
        self._before = now
        self._ticks += 1

    @property
    def truth(self) -> GroundTruth:
        """The truth of the ticks so far."""
        change = np.array(self.rows).reshape(-1, moments.LENGTH) * (NANOSECONDS / PERIOD_NS)
        return GroundTruth(
            change[:, moments.SUPPLY_CURRENT] * change[:, [moments.VOLTAGE]],
            change[:, moments.ENCODER],
            change[:, moments.SLIP],
        )


def _edges(bumps: tuple[Bump, ...]) -> list[tuple[int, Array, Array]]:
    """Times [ns] at which the push on the body changes, what it changes to, (6,), and what of that
    is a slope's [N], (3,)."""
    times = sorted({t for bump in bumps for t in (bump.start, bump.start + bump.duration)})
    found = []
    for time in times:
        push, slope = np.zeros(6), np.zeros(3)
        for bump in bumps:
            if bump.start <= time < bump.start + bump.duration:
                push += [*bump.force, 0.0, 0.0, 0.0, bump.moment]
                slope[:2] += bump.is_slope * np.array(bump.force)
        found.append((START_NS + round(time * NANOSECONDS), push, slope))
    return found


@frozen
class LabelledDrive:
    """A drive tick by tick: the residuals of each tick, and the truth of the same ticks."""

    frames: tuple[ResidualFrame, ...]
    truth: GroundTruth
    faulty: NDArray[np.bool_]  # whether the fault is in force, (n,)
    first: int  # tick of the first frame: that of row k is first + k


def simulated_drive(chosen: Drive, without: Collection[str] = ()) -> LabelledDrive:
    """Run a drive through the simulator and the first two stages, without some topics."""
    predictor = PowerPredictor(chosen.believed, is_compiled=has_numba())
    stage = ResidualStage(chosen.believed)
    takers: dict[str, list[Callable[[Any, int], str | None]]] = {}
    for item in (
        *model_inputs(chosen.believed, predictor),
        *residual_inputs(chosen.believed, stage),
    ):
        takers.setdefault(item.topic, []).append(item.take)
    simulation = ProbedSimulation(chosen)
    frames: list[ResidualFrame] = []
    for sample in _samples(chosen, simulation):
        if sample.topic not in takers or sample.topic in without:
            continue
        message = to_bag(sample.message)
        for take in takers[sample.topic]:
            take(message, sample.stamp_ns)
        for prediction in predictor.due():
            stage.prediction(prediction)
        frames.extend(stage.due())
    return _aligned(chosen, tuple(frames), simulation.truth)


def healthy_twin(chosen: Drive) -> GroundTruth:
    """What the same robot in the same drive does without the fault."""
    simulation = ProbedSimulation(chosen)
    for _ in _samples(chosen.healthy, simulation):
        pass
    return simulation.truth


def _samples(chosen: Drive, simulation: Simulation) -> Iterator[Sample]:
    for samples in drive(chosen.mission, simulation, chosen.seed):
        yield from samples


def _aligned(chosen: Drive, frames: tuple[ResidualFrame, ...], truth: GroundTruth) -> LabelledDrive:
    """Frame and truth of the same tick in the same row."""
    ticks = np.array([(frame.stamp_ns - START_NS) // PERIOD_NS for frame in frames])
    known = (ticks >= 1) & (ticks <= len(truth.power))
    rows = ticks[known] - 1
    seconds = ticks[known] * PERIOD_NS / NANOSECONDS
    faulty = np.zeros(len(rows), dtype=bool)
    for fault in chosen.mission.faults:
        end = np.inf if fault.end is None else fault.end
        faulty |= (seconds > fault.start) & (seconds <= end)
    return LabelledDrive(
        tuple(frame for frame, keep in zip(frames, known, strict=True) if keep),
        truth.of_ticks(rows),
        faulty,
        int(ticks[known][0]),
    )
