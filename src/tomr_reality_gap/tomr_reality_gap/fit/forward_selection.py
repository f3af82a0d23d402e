"""Which hypotheses explain the recordings: forward selection by evidence.

Each round linearises everything at the model so far, ranks all additions by the evidence of the
linear Gaussian model, refines the best few with the simulator, and takes the one whose evidence,
now of the nonlinear model (Laplace), is highest:

    log p = -1/2 |r|^2 - 1/2 |u|^2 - 1/2 log|I + G| + log prior

with r the whitened residual, u all offsets in prior standard deviations, G their normal matrix.
"""

import math
from collections.abc import Collection, Sequence

from attrs import evolve, field, frozen

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.estimation.noise import Local, Noise, noise_of
from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.basis_responses import BasisResponses
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.jacobian import Jacobian, linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel, State, refine
from tomr_reality_gap.fit.screening import Screened, screen
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

_COST = 20.0  # log evidence that an addition must bring: about e^20 : 1
_MOST_FINDINGS = 4
_ALIKE = 5.0  # log evidence: no difference
_NOTHING = 1e-3  # prior standard deviations
_SIGMAS = 3.0  # that a size must be away from nothing


@frozen
class Round:
    """One linearisation and what was tried from it."""

    jacobian: Jacobian
    noise: Noise
    tried: tuple[FittedModel, ...]  # refined additions, best first

    def without_derivatives(self) -> "Round":
        """The same without what takes most of the memory."""
        return evolve(self, jacobian=evolve(self.jacobian, matrix=self.jacobian.matrix[:0].copy()))


@frozen
class Selection:
    """Outcome of the selection."""

    best: FittedModel
    without: FittedModel  # nothing but tolerances
    rounds: tuple[Round, ...]
    noise: Noise
    alternatives: tuple[tuple[FittedModel, ...], ...] = field(factory=tuple)  # for each finding
    beside: float = 0.0  # log evidence of what else explains the recordings

    def cost(self, samples: int, best: FittedModel) -> float:
        """Log evidence that a finding must bring beside all others of a model."""
        return cost_beside(samples, best, self.without, self.beside)


def forward_selection(
    dataset: Dataset,
    model: Model,
    candidates: Sequence[Hypothesis],
    basis: BasisResponses,
    *,
    beside: float = 0.0,
    barred: Collection[str] = (),
    tick: Tick = lambda done: None,
) -> Selection:
    """Add hypotheses while they bring evidence; what has no name is not mistaken for noise.

    `beside`: log evidence of a term without a name that the recordings are simulated with;
    `barred`: names of candidates that are not added.
    """
    rounds: list[Round] = []
    without: FittedModel | None = None
    local = basis.local
    while True:
        open_ones = [item for item in candidates if item.name not in model.names]
        jacobian = linearise(
            dataset, model, open_ones, tick, before=rounds[-1].jacobian if rounds else None
        )
        rounds = [item.without_derivatives() for item in rounds]
        noise = _noise(dataset, jacobian, local)
        allowed = [item for item in open_ones if item.name not in barred]
        start, screened = screen(dataset, jacobian, noise, allowed)
        current, tried = _tried(dataset, start, screened, jacobian, noise, tick)
        without = without or current
        cost = cost_beside(len(dataset.value), current, without, beside)
        tried.sort(key=lambda item: item.model.weight * cost - item.evidence)
        rounds.append(Round(jacobian, noise, tuple(tried)))
        added = tried[0].model.weight - model.weight if tried else 0
        if not tried or tried[0].evidence < current.evidence + added * cost:
            break
        model = tried[0].model
        if len(model.hypotheses) > _MOST_FINDINGS:
            break
    return Selection(current, without, tuple(rounds), noise, beside=beside)


def _tried(
    dataset: Dataset,
    start: State,
    screened: Sequence[Screened],
    jacobian: Jacobian,
    noise: Noise,
    tick: Tick,
) -> tuple[FittedModel, list[FittedModel]]:
    """Refine the model, and additions, alone and with the wrong parameters that they would need."""
    trials = [start, *(trial for item in screened for trial in item.starts)]
    current, *fitted = refine(dataset, trials, jacobian, noise, tick=tick)
    first = len(start[0].hypotheses)
    return current, [item for item in fitted if _is_large_enough(item, first)]


def first_names(found: Selection) -> frozenset[str]:
    """What was added first, and what would have done as well: alone or with what came along."""
    tried = found.rounds[0].tried
    alike = [item for item in tried if item.evidence > tried[0].evidence - _ALIKE]
    return frozenset(item.model.hypotheses[0].name for item in alike)


def cost_beside(samples: int, model: FittedModel, without: FittedModel, beside: float) -> float:
    """Log evidence that a finding must bring beside all of a model, and `beside` of learnt terms.

    What these are off by may look like a named effect, so beside them no such gain is enough.
    """
    explained = model.evidence - without.evidence + beside
    return finding_cost(samples, explained, math.inf if beside else -model.evidence)


def finding_cost(samples: int, explained: float = 0.0, left: float = math.inf) -> float:
    """Log evidence that a finding must bring beside others that have explained so much.

    Our simulation errs by a share of what it simulates. Its errors look like nothing in
    particular, so what brings much of what is `left` to be had is no such error.
    """
    beside = min(SIMULATOR.named * explained, SIMULATOR.left * left)
    return max(_COST, SIMULATOR.log_evidence_per_sample * samples, beside)


def _is_large_enough(fitted: FittedModel, first: int) -> bool:
    """Whether every hypothesis from the first added on has a size that is significant."""
    at = sum(len(item.parameters) for item in fitted.model.hypotheses[:first])
    for hypothesis, offsets in zip(
        fitted.model.hypotheses[first:], fitted.model.offsets[first:], strict=True
    ):
        sigma = float(fitted.own_sigma[at])
        at += len(offsets)
        prior_std = hypothesis.parameters[0].prior_std
        if abs(offsets[0]) <= max(hypothesis.least, _NOTHING * prior_std, _SIGMAS * sigma):
            return False
    return True


def _noise(dataset: Dataset, jacobian: Jacobian, local: Sequence[Local]) -> Noise:
    return noise_of(
        dataset.channels,
        dataset.value - jacobian.value,
        jacobian.matrix,
        jacobian.value,
        time_derivative=jacobian.time_derivative,
        local=local,
    )
