"""From recordings to an explanation: align, compare, name, model, show."""

from collections.abc import Callable, Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_reality_gap.alignment.response import leaps_of
from tomr_reality_gap.alignment.simulation import Run
from tomr_reality_gap.evidence import Evidence
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.fit.alike import refuse_strangers
from tomr_reality_gap.fit.mirrored import Mirror, beyond
from tomr_reality_gap.fit.noise import rows_of
from tomr_reality_gap.fit.probed import probed
from tomr_reality_gap.fit.prune import second_thoughts
from tomr_reality_gap.fit.search import search
from tomr_reality_gap.fit.study import Model, Study
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances
from tomr_reality_gap.mismatch.orders import ripple_orders
from tomr_reality_gap.prepared import Prepared, prepared
from tomr_reality_gap.request import Request
from tomr_reality_gap.verdict import explanation_of

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]


def explain(request: Request, progress: Progress = lambda stage, part: None) -> Explanation:
    """Explain where reality differs. Raises InputError with one line for bad input."""
    progress("reading", 0.0)
    ready = prepared(request)
    progress("simulating", 0.05)
    evidence = _searched(request, ready, progress)
    progress("what is left", 0.85)
    explanation = explanation_of(evidence, ready.held, ready.notes)
    progress("done", 1.0)
    return evolve(explanation, recordings=(*request.real, *request.holdout))


def _searched(request: Request, ready: Prepared, progress: Progress) -> Evidence:
    """All hypotheses tried on what was prepared."""
    base, wheels, study = ready.base, ready.robot.wheel_names, Study(ready.real)
    knobs = nuisances(base, wheels, request.tolerance, request.tolerances)
    orders = _orders(study, ready.runs)
    candidates = catalogue(
        base,
        wheels,
        ready.scales,
        request.tolerance,
        orders,
        leaps_of(ready.real, ready.robot),
        {channel.kind for channel in study.channels}.isdisjoint(("power", "total")),
    )
    tick = _Counter(progress, 3 * len(candidates) * len(ready.real))
    nameless = probed(study, base.robot, ready.scales.torque, orders)
    start = Model(base, knobs, (0.0,) * len(knobs))
    found = search(study, start, candidates, nameless, tick)
    refuse_strangers(study, found.rounds[-1])
    found = second_thoughts(study, found, tick)
    mirror = Mirror.of(ready.simulations, study, found.noise, base.robot)
    found, shared = beyond(study, found, mirror, tick)
    return Evidence(
        study,
        found,
        base,
        ready.robot,
        str(request.robot),
        ready.scales,
        candidates,
        nameless,
        mirror,
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


def _orders(study: Study, runs: Sequence[Run]) -> tuple[float, ...]:
    """Orders of ripples that any recording shows."""
    found: list[float] = []
    for item, run in zip(study.simulations, runs, strict=True):
        value = item.predict([item.robot])[0]
        residuals, speeds = [], []
        for channel, part in zip(item.channels, rows_of(item.channels), strict=True):
            residuals.append(channel.value - value[part])
            own = run.speed[:, channel.wheel or 0]
            speeds.append(np.interp(channel.time - 0.5 * channel.span, item.timeline.middle, own))
        found += ripple_orders(item.recorded, item.channels, residuals, speeds)
    return tuple(dict.fromkeys(found))
