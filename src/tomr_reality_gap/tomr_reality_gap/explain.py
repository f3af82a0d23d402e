"""From recordings to an explanation: align, compare, name, model, show."""

from collections.abc import Collection, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.effects.scales import Scales
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.response import controller_alternatives
from tomr_reality_gap.alignment.simulation import Run, Tick
from tomr_reality_gap.analysis import AnalysisResult, residuals_of, spoils
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.fit.backward_elimination import backward_elimination
from tomr_reality_gap.fit.basis_responses import BasisResponses, basis_responses
from tomr_reality_gap.fit.consistency import check_same_robot
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import (
    Selection,
    finding_cost,
    first_names,
    forward_selection,
)
from tomr_reality_gap.fit.integrator import sums_otherwise
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.learnt import with_terms
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import refined_at_itself
from tomr_reality_gap.fit.remainder import Remainder
from tomr_reality_gap.fit.significance import significant
from tomr_reality_gap.fit.simulator_baseline import (
    Offsets,
    SimulatorBaseline,
    beyond_baseline,
)
from tomr_reality_gap.fit.unmodelled import Unmodelled, refitted, unmodelled_effect
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.mismatch.orders import ripple_orders
from tomr_reality_gap.prepared import Prepared, prepared
from tomr_reality_gap.progress import Progress
from tomr_reality_gap.request import Request
from tomr_reality_gap.rules import is_doubted, is_unmodelled, leaves_much, unexplained
from tomr_reality_gap.verdict import explanation_of

Array = NDArray[np.float64]

_DOUBT = 1.05  # times noise: names that leave as much may stand for what has none
_MORE = 1.2  # times what another model leaves
_LITTLE_MORE = 1.03  # the same where that is noise
_NEARLY = 0.95  # of what names leave out, that what has no name predicts
_FEW = 2  # names: of more the search has been through most
_SLIGHT = 0.03  # of the mismatch: where names leave less, what comes and goes is no finding
_LITTLE = 0.15  # of the noise: what is left of what is drawn is not looked into


@frozen
class _Search:
    """All hypotheses, to be tried on recordings."""

    start: Model  # without any
    candidates: Sequence[Hypothesis]
    basis: BasisResponses
    tick: Tick

    def named(self, data: Dataset, beside: float = 0.0) -> Selection:
        """Names for recordings, beside what else brings a log evidence.

        Where one or two leave more than noise, the first may have done the work of two others: the
        search begins once more without it and what would have done as well.
        """
        found = self._from(data, beside)
        names, sigma = found.best.model.findings, found.noise.sigma
        left = _left(data, found, sigma)
        if not 0 < names <= _FEW or left <= _DOUBT * len(data.value):
            return found
        again = self._from(data, beside, first_names(found))
        no_more = again.best.model.findings <= names
        return again if no_more and _is_less(_left(data, again, sigma), left, data) else found

    def _from(self, data: Dataset, beside: float, barred: Collection[str] = ()) -> Selection:
        found = forward_selection(
            data,
            self.start,
            self.candidates,
            self.basis,
            beside=beside,
            barred=barred,
            tick=self.tick,
        )
        return backward_elimination(data, found, self.candidates, self.tick)

    def unnamed(self, data: Dataset) -> Model:
        """Only what is not exactly known, fitted to recordings."""
        return forward_selection(data, self.start, (), self.basis, tick=self.tick).best.model


@frozen
class _Seen:
    """What no name explains and a term predicts."""

    effect: Unmodelled
    is_much: bool  # enough for a finding beside the names


def explain(request: Request, progress: Progress = lambda stage, part: None) -> Explanation:
    """Explain where reality differs. Raises InputError with one line for bad input."""
    progress("reading", 0.0)
    ready = prepared(request)
    progress("simulating", 0.05)
    analysis = _analysed(request, ready, progress, is_loop_known=bool(ready.simulations))
    progress("what is left", 0.85)
    analysis = evolve(analysis, spoils=spoils(analysis, ready.held))
    explanation = explanation_of(analysis, ready.held, ready.notes)
    progress("done", 1.0)
    return evolve(explanation, recordings=(*request.real, *request.holdout))


def _analysed(
    request: Request, ready: Prepared, progress: Progress, *, is_loop_known: bool
) -> AnalysisResult:
    """All hypotheses tried on what was prepared.

    How the drivers sum is known where the user's simulation shows it; else what is found may
    show that it is the other way.
    """
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
    search = _Search(start, candidates, basis, tick)
    found = search.named(dataset)
    if not is_loop_known and sums_otherwise(dataset, found, tick):
        return _analysed(request, ready.summed_otherwise(), progress, is_loop_known=True)
    check_same_robot(dataset, found.rounds[-1])
    seen, plain = _unmodelled(dataset, found, ready), None
    effect = seen.effect if seen is not None and seen.is_much else None
    if effect is not None:
        plain = dataset
        dataset, found, effect = _beside(plain, found, effect, search, ready.scales)
    elif (tried := _instead(dataset, found, search, ready.scales, seen)) is not None:
        plain = dataset
        dataset, found, effect = tried
    baseline = SimulatorBaseline.of(ready.simulations, dataset, found.noise, base.robot)
    if effect is not None and baseline is not None and baseline.shows(effect):
        effect, dataset, plain = None, plain or dataset, None
        found = search.named(dataset)
    found, shared = _held(dataset, found, candidates, baseline, tick)
    found = evolve(found, best=refined_at_itself(dataset, found.best, found.noise, tick=tick))
    return AnalysisResult(
        dataset,
        found,
        base,
        ready.robot,
        str(request.robot),
        candidates,
        basis,
        shared,
        plain,
        effect,
    )


def _held(
    dataset: Dataset,
    found: Selection,
    candidates: Sequence[Hypothesis],
    baseline: SimulatorBaseline | None,
    tick: Tick,
) -> tuple[Selection, Offsets]:
    """Findings that are sure, and that the user's simulation does not show as well; and how much
    of each of them it shows.
    """
    while True:
        kept, shared = beyond_baseline(dataset, significant(dataset, found, tick), baseline, tick)
        if len(kept.best.model.hypotheses) == len(found.best.model.hypotheses):
            return kept, shared
        # What could stand in for the others was barred by what is gone.
        found = backward_elimination(dataset, kept, candidates, tick)


def _beside(
    plain: Dataset,
    found: Selection,
    effect: Unmodelled,
    search: _Search,
    scales: Scales,
) -> tuple[Dataset, Selection, Unmodelled]:
    """Names sought once more, beside an unnamed term, and the term fitted anew beside them.

    Names that only stood in for what no name has have bent it. What depends on nothing that names
    depend on, or is a law where it was none, is sought without any of them, and comes first if
    fewer names then leave less.
    """
    if found.best.model.hypotheses:
        bare = found.without.model
        rest = _remainder(plain, bare)
        alone = unmodelled_effect(rest, bare.described.robot, scales)
        is_lawful = alone is not None and bool(alone.laws) and not effect.laws
        if alone is not None and (alone.family.is_strange or is_lawful):
            effect = alone
        first = _at_its_best(plain, bare, effect, search)
        tried = _settled(plain, first, search)
        names = [item.best.model.findings for item in (found, tried[1])]
        sigma = tried[1].noise.sigma
        left = [_left(data, item, sigma) for data, item in ((plain, found), tried[:2])]
        if names[1] < names[0] and left[1] < left[0]:
            return tried
    return _settled(plain, effect, search, found.best.model)


def _instead(
    plain: Dataset, found: Selection, search: _Search, scales: Scales, seen: _Seen | None
) -> tuple[Dataset, Selection, Unmodelled] | None:
    """What has no name in the place of one name or several, if less is left with it.

    A law, or what it depends on predicts nearly all. It is sought where all names are at one place,
    or leave more than noise, or something that another drive would repeat is `seen` beside them.
    """
    names, sigma = found.best.model.findings, found.noise.sigma
    left = _left(plain, found, sigma)
    is_seen = seen is not None and seen.effect.is_repeatable
    is_one_place = len({item.where for item in found.best.model.hypotheses}) == 1
    if not names or not (is_one_place or is_seen or left > _DOUBT * len(plain.value)):
        return None
    bare = found.without.model
    rest = _remainder(plain, bare)
    alone = unmodelled_effect(rest, bare.described.robot, scales, is_repeatable=True)
    if alone is None or not (alone.laws or alone.share > _NEARLY) or not alone.is_repeatable:
        return None
    tried = _settled(plain, _at_its_best(plain, bare, alone, search), search)
    no_more = tried[1].best.model.findings < names
    return tried if no_more and _is_less(_left(*tried[:2], sigma), left, plain) else None


def _settled(
    plain: Dataset,
    effect: Unmodelled,
    search: _Search,
    model: Model | None = None,
) -> tuple[Dataset, Selection, Unmodelled]:
    """Recordings with a term, the names beside it, and the term as fitted beside these."""
    robot = plain.simulations[0].robot if model is None else model.described.robot
    found = search.named(_with_term(plain, robot, effect), effect.evidence)
    again = _refitted(plain, found.best.model, effect)
    if effect.laws and not again.laws and model is None:
        # Names that take the law away only made up for what it was off by.
        return (
            _with_term(plain, robot, effect),
            evolve(found, best=found.without, alternatives=()),
            effect,
        )
    effect = again
    return _with_term(plain, found.best.model.described.robot, effect), found, effect


def _at_its_best(plain: Dataset, bare: Model, effect: Unmodelled, search: _Search) -> Unmodelled:
    """The term without any name, and what is not exactly known, fitted in turn."""
    data = _with_term(plain, bare.described.robot, effect)
    return _refitted(plain, search.unnamed(data), effect)


def _refitted(plain: Dataset, model: Model, effect: Unmodelled) -> Unmodelled:
    """The term fitted anew beside a model, whose derivatives are those of a robot with the term."""
    robot = model.described.robot
    value = plain.predict([robot])[0]
    there = linearise(_with_term(plain, robot, effect), model, ())
    rest = Remainder.of(
        plain, value, np.asarray(there.matrix, dtype=np.float64), there.value - value
    )
    return refitted(rest, effect, robot)


def _left(dataset: Dataset, found: Selection, sigma: Array) -> float:
    """Sum of squares that a selection leaves, in units of a noise."""
    value = dataset.predict([found.best.model.described.robot])[0]
    return float((((dataset.value - value) / sigma) ** 2).sum())


def _is_less(then: float, left: float, data: Dataset) -> bool:
    """Whether another model leaves clearly less: beside errors of the simulator much, where only
    noise is left a little.
    """
    return then < left / (_MORE if then > len(data.value) else _LITTLE_MORE)


def _remainder(dataset: Dataset, model: Model) -> Remainder:
    jacobian = linearise(dataset, model, ())
    return Remainder.of(dataset, jacobian.value, np.asarray(jacobian.matrix, dtype=np.float64))


def _unmodelled(dataset: Dataset, found: Selection, ready: Prepared) -> _Seen | None:
    """What no name explains, if anything, and a term predicts it."""
    robot = found.best.model.described.robot
    described, explained = dataset.predict([ready.base.robot, robot])
    share, size = unexplained(residuals_of(dataset, described, explained))
    has_names = bool(found.best.model.hypotheses)
    # Names that leave much may only stand in for what has none, however small it is.
    if size < _LITTLE and not (has_names and leaves_much(share)):
        return None
    gross = is_doubted(share, size, has_names)
    rest = _remainder(dataset, found.best.model)
    effect = unmodelled_effect(rest, robot, ready.scales, is_sure=gross)
    if effect is not None and has_names and share < _SLIGHT and not effect.is_repeatable:
        return None
    cost = finding_cost(len(dataset.value))
    named = found.best.evidence - found.without.evidence
    if effect is None:
        return None
    is_much = effect.is_large and is_unmodelled(effect.evidence, named, cost)
    return _Seen(effect, gross or is_much)


def _with_term(dataset: Dataset, robot: Robot, effect: Unmodelled) -> Dataset:
    return Dataset(tuple(with_terms(item, robot, (effect.term,)) for item in dataset.simulations))


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
