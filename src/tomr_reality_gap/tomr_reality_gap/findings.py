"""Findings as a report shows them, from the result of an analysis."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.priors import drive_for
from tomr_power_model.estimation.parameter import bounds_of, neutral_of
from tomr_reality_gap.analysis import AnalysisResult
from tomr_reality_gap.explanation import Estimate, Finding, Rival
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.fit.unmodelled import Unmodelled, names
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.mismatch.locate import located
from tomr_reality_gap.rules import (
    DOUBTED,
    confidence_of,
    energy_shares,
    estimate_of,
    is_rival,
    unmodelled_share,
)

Array = NDArray[np.float64]


@frozen
class Findings:
    """Makes the findings of one analysis."""

    analysis: AnalysisResult
    gained: Sequence[float]  # log evidence that each of the model's hypotheses brings
    variables: Mapping[str, Array]  # at all samples, by name

    def named(self, needed: Sequence[bool], doubted: bool) -> list[Finding]:
        """Those hypotheses that are needed."""
        analysis, best = self.analysis, self.analysis.found.best
        without = [self._energy(value) for value in analysis.simulated[2:]]
        before = self._energy(analysis.found.without.value)
        samples = len(analysis.dataset.value)
        shares = energy_shares(before, best.chi2, without, samples)
        return [
            self._named(number, shares[number], DOUBTED if doubted else 1.0)
            for number, wanted in enumerate(needed)
            if wanted
        ]

    def unmodelled(self, effect: Unmodelled) -> Finding:
        """An effect without a name."""
        analysis, found = self.analysis, self.analysis.found
        change = effect.columns @ (np.concatenate(effect.weights) / analysis.basis.size)
        before, samples = self._energy(found.without.value), len(analysis.dataset.value)
        share = unmodelled_share(effect.evidence, before, found.best.chi2, samples)
        weight, channels = found.noise.weight, analysis.dataset.channels
        return Finding(
            effect="unknown",
            where=names(effect.wheels, analysis.robot),
            parameters={},
            located=located(channels, change / weight, weight, share, variables=self.variables),
            rivals=(),
            confidence=0.9,
            evidence=effect.evidence,
            shape=effect.shape,
        )

    def _energy(self, value: Array) -> float:
        """Sum of the squared whitened residuals."""
        found = self.analysis.found
        return float((((self.analysis.dataset.value - value) * found.noise.weight) ** 2).sum())

    def _named(self, number: int, share: float, most: float) -> Finding:
        analysis, found = self.analysis, self.analysis.found
        hypothesis = found.best.model.hypotheses[number]
        change = analysis.simulated[1] - analysis.simulated[2 + number]
        group = found.alternatives[number] if number < len(found.alternatives) else ()
        odds = log_odds_of(hypothesis, group)
        channels, weight = analysis.dataset.channels, found.noise.weight
        return Finding(
            effect=hypothesis.effect,
            where=hypothesis.where,
            parameters=self._parameters(number),
            located=located(channels, change, weight, share, variables=self.variables),
            rivals=tuple(
                Rival(other.effect, other.where, min(odd, 0.0), drive_for(_key_of(other)))
                for odd, other in sorted(odds, key=lambda pair: -pair[0])
                if is_rival(odd)
            ),
            confidence=min(most, confidence_of([odd for odd, _ in odds])),
            evidence=self.gained[number],
        )

    def _parameters(self, number: int) -> dict[str, Estimate]:
        """Values with their intervals; of a wrong parameter what it is, tolerance included."""
        best, model = self.analysis.found.best, self.analysis.found.best.model
        hypothesis, offsets = model.hypotheses[number], model.offsets[number]
        first = sum(len(item.parameters) for item in model.hypotheses[:number])
        sigma = best.own_sigma[first : first + len(offsets)].tolist()
        shared = self.analysis.shared[number] if self.analysis.shared else (0.0,) * len(offsets)
        nuisances = zip(model.nuisances, model.nuisance_offsets, strict=True)
        nuisance = {parameter.keys[0]: offset for parameter, offset in nuisances}
        found = {}
        for item, whole, theirs, width in zip(
            hypothesis.parameters, offsets, shared, sigma, strict=True
        ):
            starts = []
            for key in item.keys:
                start = hypothesis.start.get(key, self.analysis.base.values.get(key))
                starts.append(float(start if start is not None else neutral_of(key)))  # type: ignore[arg-type]
                starts[-1] += nuisance.get(key, 0.0) if key not in hypothesis.start else 0.0
            found[item.name] = estimate_of(
                sum(starts) / len(starts) + whole - theirs,
                width,
                offset=whole - theirs,
                baseline=theirs,
                unit=item.unit,
                bounds=bounds_of(item.keys[0]),
            )
        return found


def log_odds_of(found: Hypothesis, group: Sequence[FittedModel]) -> list[tuple[float, Hypothesis]]:
    """Others in the place of a finding with their log odds; the first has the finding itself.

    The group may be of more findings than were kept in the end.
    """
    odds = {}
    for item in group[1:]:
        place = [known.name for known in group[0].model.hypotheses].index(found.name)
        other = item.model.hypotheses[place]
        if other.name != found.name:
            odds[other.name] = (item.evidence - group[0].evidence, other)
    return list(odds.values())


def _key_of(hypothesis: Hypothesis) -> str:
    """Key under which the drive that would show it is known."""
    if hypothesis.effect.startswith("parameter."):
        return hypothesis.effect.removeprefix("parameter.")
    return f"physics.{hypothesis.effect}"
