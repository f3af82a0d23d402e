"""The alarm level for a chosen rate of false alarms, by extreme values of the evidence.

A source of false alarms is a kind of event (a shove, ten seconds of driving) that comes so often
an hour and leaves a peak of evidence. Peaks over a threshold u are taken for exponential (Gumbel's
domain; log odds of a likelihood ratio have such a tail, by Ville's inequality one decade per decade
where the classifier is exact), so that

    rate(level) = sum over sources of  events per hour * P(peak > u) * exp(-(level - u) / scale)

What the peaks leave open of P (Jeffreys) and of the scale (gamma, a usual scale counting as a few
peaks) is drawn by chance, and the level is taken at which so many of the draws as `confidence` says
have the chosen rate or less. Where the peaks over u are not exponential (their coefficient of
variation is not 1, at the 5 % level: del Castillo, Daoudi & Lockhart 2014), u is raised to the
highest half of them, and so on: of a heavier tail what is rare may have another cause than what is
frequent, and of a lighter one most peaks lie far above u, which says nothing of how it goes on.
Where most events leave no evidence at all, u is the lowest peak. A source without any peak has no
tail to extrapolate: it counts as nothing, and the report says for how long it was watched. A
generalised Pareto tail is fitted beside, and its shape reported.
"""

import math
from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import genpareto

from tomr_commission.evidence import MOST_CAUTION, SURE
from tomr_commission.request import AlarmChoice

Array = NDArray[np.float64]

_CAP = MOST_CAUTION + SURE  # decades: higher peaks are known to be higher, no more
_USUAL_SCALE, _USUAL_WEIGHT = 4.0, 4  # decades of a tail, and the peaks that this counts as
_DRAWS, _SEED = 4000, 1
_LEAST_RATE = 1e-12
_FIVE_PERCENT = 1.96  # quantile of a standard normal, two-sided


@frozen
class Tail:
    """Peaks of evidence of one source over a threshold."""

    source: str
    events: int
    events_per_hour: float
    threshold: float  # decades
    above: int  # events over the threshold
    scale: float  # decades, of the exponential tail
    certain: int  # peaks that the scale rests on, those that the usual scale counts as included
    shape: float | None  # of a generalised Pareto tail; None: too few to estimate it
    peaks: tuple[float, ...]  # all over the threshold, the highest first

    @classmethod
    def of(
        cls, source: str, peaks: Sequence[float], events_per_hour: float, choice: AlarmChoice
    ) -> "Tail":
        """The tail of the peaks of all events, 0 for those without evidence."""
        values = np.minimum(np.asarray(peaks, dtype=float), _CAP)
        threshold, over = _tail_of(values, choice)
        known = over[over < _CAP]
        certain = _USUAL_WEIGHT + len(known)  # a peak at the cap is longer than is known
        scale = (_USUAL_WEIGHT * _USUAL_SCALE + float((over - threshold).sum())) / certain
        shape = None
        if len(known) >= 2 * choice.least_peaks:
            shape = float(genpareto.fit(known - threshold, floc=0.0)[0])
        return cls(
            source,
            len(values),
            events_per_hour,
            threshold,
            len(over),
            scale,
            certain,
            shape,
            tuple(sorted(map(float, over), reverse=True)),
        )

    def rate(self, level: float) -> float:
        """Events per hour with a peak beyond a level, as estimated."""
        share = self.above / max(self.events, 1)
        return self.events_per_hour * share * math.exp(-self._beyond(level) / self.scale)

    def draws(self, level: float) -> Array:
        """Rates that the peaks are compatible with, always of the same random numbers."""
        if not self.above:
            return np.zeros(_DRAWS)
        random = np.random.default_rng(_SEED)
        share = random.beta(self.above + 0.5, self.events - self.above + 0.5, _DRAWS)
        scale = self.scale * self.certain / random.gamma(self.certain, 1.0, _DRAWS)
        return np.asarray(self.events_per_hour * share * np.exp(-self._beyond(level) / scale))

    def _beyond(self, level: float) -> float:
        return max(level - self.threshold, 0.0)


def _tail_of(values: Array, choice: AlarmChoice) -> tuple[float, Array]:
    """The threshold of a tail that is exponential, or as high as there are peaks for, and these."""
    threshold, over = 0.0, values[values > 0.0]
    share = choice.kept
    # Where most events leave nothing peaks begin at the lowest, not at nothing.
    lowest = float(over.min(initial=_CAP))
    while len(values):
        higher = max(float(np.quantile(values, 1.0 - share)), lowest)
        peaks = values[values > higher]
        if len(peaks) < choice.least_peaks:
            break
        threshold, over = higher, peaks
        # Peaks at the cap count as what they are at least: they are what a rare cause looks like.
        if _is_exponential(over - threshold):
            break
        share /= 2.0
    return threshold, over


def _is_exponential(excesses: Array) -> bool:
    """Whether they vary as much as exponential ones do, at the 5 % level."""
    variation = float(excesses.std(ddof=1) / excesses.mean())
    return math.sqrt(len(excesses)) * abs(variation - 1.0) < _FIVE_PERCENT


@frozen
class AlarmLevel:
    """The caution chosen, and what is expected of it."""

    caution: float  # decades
    wanted: float  # false alarms per hour that were asked for
    needed: float  # decades of caution that these need, before any bound
    expected: float  # false alarms per hour at the caution chosen
    low: float  # 95 % interval of that
    high: float
    tails: tuple[Tail, ...]

    @property
    def is_enough(self) -> bool:
        """Whether the caution that there is reaches what was asked for."""
        return self.needed <= MOST_CAUTION

    @property
    def is_rate_known(self) -> bool:
        """Whether every source was watched: what is expected counts no other."""
        return all(tail.events for tail in self.tails)


def alarm_level(
    tails: Sequence[Tail], wanted: float, shipped: float, choice: AlarmChoice
) -> AlarmLevel:
    """The caution at which false alarms are as rare as wanted, with the confidence chosen.

    Args:
        tails: of all sources.
        wanted: false alarms per hour.
        shipped: caution of the classifier as it comes, the least that is chosen.
        choice: how to choose.
    """

    def drawn(caution: float) -> Array:
        return np.asarray(sum(tail.draws(caution + SURE) for tail in tails))

    def excess(caution: float) -> float:
        rate = float(np.quantile(drawn(caution), choice.confidence))
        return math.log(max(rate, _LEAST_RATE)) - math.log(wanted)

    highest = 10.0 * MOST_CAUTION
    needed = 0.0
    if excess(0.0) > 0.0:
        needed = highest if excess(highest) > 0.0 else float(brentq(excess, 0.0, highest))
    # Simulated robots hardly differ from their description; peaks of real ones are higher.
    caution = min(max(needed, shipped), MOST_CAUTION)
    caution = math.ceil(10.0 * caution) / 10.0
    low, high = np.quantile(drawn(caution), (0.025, 0.975))
    expected = sum(tail.rate(caution + SURE) for tail in tails)
    return AlarmLevel(caution, wanted, needed, expected, float(low), float(high), tuple(tails))


def block_peaks(evidence: Array, seconds: Array, block: float) -> list[float]:
    """The highest evidence of each block of so many seconds, blocks without a tick left out."""
    number = np.floor(seconds / block)
    return [float(evidence[number == one].max()) for one in np.unique(number)]
