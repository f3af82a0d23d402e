"""Which hypotheses explain the recordings: forward, with swaps and removals, by evidence.

Each round linearises everything at the model so far, ranks all additions by the evidence of the
linear Gaussian model, refines the best few with the simulator, and takes the one whose evidence,
now of the nonlinear model (Laplace), is highest:

    log p = -1/2 |r|^2 - 1/2 |u|^2 - 1/2 log|I + G| + log prior

with r the whitened residual, u all turns in units of their beliefs, G their normal matrix.
"""

from collections.abc import Sequence

from attrs import evolve, field, frozen

from tomr_reality_gap.fit.noise import Local, Noise, noise_of
from tomr_reality_gap.fit.probed import Probed
from tomr_reality_gap.fit.refine import Fitted, State, Tick, refine
from tomr_reality_gap.fit.screen import Screened, screen
from tomr_reality_gap.fit.study import Columns, Model, Study, columns_at
from tomr_reality_gap.hypotheses.knobs import Hypothesis

_COST = 20.0  # log evidence that an addition must bring: about e^20 : 1
_COST_SHARE = 0.003  # of the samples: the simulator is not exact, and many samples show it
_NAMED_SHARE = 0.01  # of the log evidence so far: nor is it exact about what has been found
_MOST_FINDINGS = 4
_NOTHING = 1e-3  # spreads
_SIGMAS = 3.0  # that a size must be away from nothing


@frozen
class Round:
    """One linearisation and what was tried from it."""

    columns: Columns
    noise: Noise
    tried: tuple[Fitted, ...]  # refined additions, best first
    screened: tuple[Screened, ...]  # by their linear gains, best first

    def without_derivatives(self) -> "Round":
        """The same without what takes most of the memory."""
        return evolve(self, columns=evolve(self.columns, matrix=self.columns.matrix[:0].copy()))


@frozen
class Found:
    """Outcome of a search."""

    best: Fitted
    without: Fitted  # nothing but tolerances
    rounds: tuple[Round, ...]
    noise: Noise
    alternatives: tuple[tuple[Fitted, ...], ...] = field(factory=tuple)  # for each finding


def search(
    study: Study,
    model: Model,
    candidates: Sequence[Hypothesis],
    nameless: Probed,
    tick: Tick = lambda done: None,
) -> Found:
    """Add hypotheses while they bring evidence; what has no name is not mistaken for noise."""
    rounds: list[Round] = []
    without: Fitted | None = None
    local = nameless.local
    while True:
        open_ones = [item for item in candidates if item.name not in model.names]
        columns = columns_at(study, model, open_ones, tick, rounds[-1].columns if rounds else None)
        rounds = [item.without_derivatives() for item in rounds]
        noise = _noise(study, columns, local)
        start, screened = screen(study, columns, noise, open_ones)
        current, tried = _tried(study, start, screened, columns, noise, tick)
        without = without or current
        cost = finding_cost(study, current.evidence - without.evidence)
        tried.sort(key=lambda item: len(item.model.hypotheses) * cost - item.evidence)
        rounds.append(Round(columns, noise, tuple(tried), tuple(screened)))
        added = len(tried[0].model.hypotheses) - len(model.hypotheses) if tried else 0
        if not tried or tried[0].evidence < current.evidence + added * cost:
            break
        model = tried[0].model
        if len(model.hypotheses) > _MOST_FINDINGS:
            break
    return Found(current, without, tuple(rounds), noise)


def _tried(
    study: Study,
    start: State,
    screened: Sequence[Screened],
    columns: Columns,
    noise: Noise,
    tick: Tick,
) -> tuple[Fitted, list[Fitted]]:
    """Refine the model, and additions, alone and with the wrong parameters that they would need."""
    trials = [start, *(trial for item in screened for trial in item.starts)]
    current, *fitted = refine(study, trials, columns, noise, tick)
    first = len(start[0].hypotheses)
    return current, [item for item in fitted if _is_large_enough(item, first)]


def finding_cost(study: Study, explained: float = 0.0) -> float:
    """Log evidence that a finding must bring beside others that have explained so much."""
    return max(_COST, _COST_SHARE * len(study.value), _NAMED_SHARE * explained)


def _is_large_enough(fitted: Fitted, first: int) -> bool:
    """Whether every hypothesis from the first added on has a size that can be told from none."""
    at = sum(len(item.knobs) for item in fitted.model.hypotheses[:first])
    for hypothesis, turns in zip(
        fitted.model.hypotheses[first:], fitted.model.turns[first:], strict=True
    ):
        sigma = float(fitted.own_sigma[at])
        at += len(turns)
        spread = hypothesis.knobs[0].spread
        if abs(turns[0]) <= max(hypothesis.least, _NOTHING * spread, _SIGMAS * sigma):
            return False
    return True


def _noise(study: Study, columns: Columns, local: Sequence[Local]) -> Noise:
    return noise_of(
        study.channels,
        study.value - columns.value,
        columns.matrix,
        columns.value,
        columns.slope,
        local,
    )
