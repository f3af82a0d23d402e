"""From recordings to an explanation: align, compare, name, model, show."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import rows_of
from tomr_reality_gap.alignment.response import controller_alternatives
from tomr_reality_gap.alignment.simulation import Run
from tomr_reality_gap.analysis import AnalysisResult
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.fit.backward_elimination import backward_elimination
from tomr_reality_gap.fit.basis_responses import basis_responses
from tomr_reality_gap.fit.consistency import check_same_robot
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import forward_selection
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.simulator_baseline import SimulatorBaseline, beyond_baseline
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances
from tomr_reality_gap.mismatch.orders import ripple_orders
from tomr_reality_gap.prepared import Prepared, prepared
from tomr_reality_gap.progress import Progress
from tomr_reality_gap.request import Request
from tomr_reality_gap.verdict import explanation_of

Array = NDArray[np.float64]


def explain(request: Request, progress: Progress = lambda stage, part: None) -> Explanation:
    """Explain where reality differs. Raises InputError with one line for bad input."""
    progress("reading", 0.0)
    ready = prepared(request)
    progress("simulating", 0.05)
    analysis = _analysed(request, ready, progress)
    progress("what is left", 0.85)
    explanation = explanation_of(analysis, ready.held, ready.notes)
    progress("done", 1.0)
    return evolve(explanation, recordings=(*request.real, *request.holdout))


def _analysed(request: Request, ready: Prepared, progress: Progress) -> AnalysisResult:
    """All hypotheses tried on what was prepared."""
    base, wheels, dataset = ready.base, ready.robot.wheel_names, Dataset(ready.real)
    parameters = nuisances(base, wheels, request.tolerance, request.tolerances)
    orders = _orders(dataset, ready.runs)
    candidates = catalogue(
        base,
        wheels,
        ready.scales,
        request.tolerance,
        orders=orders,
        alternatives=controller_alternatives(ready.real, ready.robot),
        currents_only={channel.kind for channel in dataset.channels}.isdisjoint(("power", "total")),
    )
    tick = _Counter(progress, 3 * len(candidates) * len(ready.real))
    basis = basis_responses(dataset, base.robot, ready.scales.torque, orders)
    start = Model(base, parameters, (0.0,) * len(parameters))
    found = forward_selection(dataset, start, candidates, basis, tick=tick)
    check_same_robot(dataset, found.rounds[-1])
    found = backward_elimination(dataset, found, tick)
    baseline = SimulatorBaseline.of(ready.simulations, dataset, found.noise, base.robot)
    found, shared = beyond_baseline(dataset, found, baseline, tick)
    return AnalysisResult(
        dataset,
        found,
        base,
        ready.robot,
        str(request.robot),
        candidates,
        basis,
        baseline,
        shared,
    )


class _Counter:
    """Turns counts of simulated robots into progress."""

    def __init__(self, progress: Progress, expected: int) -> None:
        self._progress = progress
        self._expected = expected
        self._done = 0

    def __call__(self, count: int) -> None:
        self._done += count
        part = 1.0 - 0.5 ** (2.0 * self._done / self._expected)
        self._progress("naming", 0.1 + 0.75 * part)


def _orders(dataset: Dataset, runs: Sequence[Run]) -> tuple[float, ...]:
    """Orders of ripples that any recording shows."""
    found: list[float] = []
    for item, run in zip(dataset.simulations, runs, strict=True):
        value = item.predict([item.robot])[0]
        residuals, speeds = [], []
        for channel, part in zip(item.channels, rows_of(item.channels), strict=True):
            residuals.append(channel.value - value[part])
            own = run.speed[:, channel.wheel or 0]
            speeds.append(np.interp(channel.time - 0.5 * channel.span, item.timeline.middle, own))
        found += ripple_orders(item.recorded, item.channels, residuals, speeds)
    return tuple(dict.fromkeys(found))
