"""Findings as a report shows them, from the result of an analysis."""

from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.priors import drive_for
from tomr_power_model.estimation.parameter import bounds_of, neutral_of
from tomr_reality_gap.analysis import AnalysisResult
from tomr_reality_gap.explanation import Estimate, Finding, Learnt, Rival
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.fit.unmodelled import Unmodelled, shape_of, wheels_of
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis
from tomr_reality_gap.mismatch.locate import located
from tomr_reality_gap.rules import (
    DOUBTED,
    NAMELESS,
    confidence_of,
    energy_shares,
    estimate_of,
    is_rival,
)

Array = NDArray[np.float64]


@frozen
class Findings:
    """Makes the findings of one analysis."""

    analysis: AnalysisResult
    gained: Sequence[float]  # log evidence that each of the model's hypotheses brings
    variables: Mapping[str, Array]  # at all samples, by name

    def all(self, left: float, doubted: bool) -> list[Finding]:
        """The findings; their shares and what is left of the mismatch (`left`) add up to one."""
        analysis, best, effect = self.analysis, self.analysis.found.best, self.analysis.unmodelled
        after = self._energy(analysis.simulated[1])
        lost = [self._energy(value) - after for value in analysis.simulated[2:]]
        if effect is not None:
            weight = analysis.found.noise.weight
            residual = analysis.dataset.value - analysis.simulated[1]
            lacking = (residual + effect.change) * weight
            lost.append(float(lacking @ lacking) - after)
        shares = energy_shares(lost, left)
        found = [
            self._named(number, shares[number], DOUBTED if doubted else 1.0)
            for number in range(len(best.model.hypotheses))
        ]
        return [*found, self._unmodelled(effect, shares[-1])] if effect is not None else found

    def _unmodelled(self, effect: Unmodelled, share: float) -> Finding:
        """An effect without a name."""
        analysis, weight = self.analysis, self.analysis.found.noise.weight
        channels = analysis.dataset.channels
        return Finding(
            effect="unknown",
            where=wheels_of(effect.term, analysis.robot),
            parameters={},
            located=located(channels, effect.change, weight, share, variables=self.variables),
            rivals=(),
            confidence=NAMELESS,
            evidence=effect.evidence,
            shape=shape_of(effect, analysis.robot),
            learnt=Learnt(
                effect.learnt, effect.sigma, effect.share, effect.is_repeatable, effect.laws
            ),
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
        model = self.analysis.found.best.model
        hypothesis, offsets = model.hypotheses[number], model.offsets[number]
        first = sum(len(item.parameters) for item in model.hypotheses[:number])
        own = slice(first, first + len(offsets))
        sigma = self.analysis.own_sigma[own].tolist()
        shifts = self.analysis.structural_shifts[own].tolist()
        shared = self.analysis.shared[number] if self.analysis.shared else (0.0,) * len(offsets)
        nuisances = zip(model.nuisances, model.nuisance_offsets, strict=True)
        nuisance = {parameter.keys[0]: offset for parameter, offset in nuisances}
        found = {}
        for item, whole, theirs, width, shift in zip(
            hypothesis.parameters, offsets, shared, sigma, shifts, strict=True
        ):
            starts = []
            for key in item.keys:
                start = hypothesis.start.get(key, self.analysis.base.values.get(key))
                starts.append(float(start if start is not None else neutral_of(key)))  # type: ignore[arg-type]
                starts[-1] += nuisance.get(key, 0.0) if key not in hypothesis.start else 0.0
            estimate = estimate_of(
                sum(starts) / len(starts) + whole - theirs,
                width,
                offset=whole - theirs,
                baseline=theirs,
                shift=shift,
                unit=item.unit,
                bounds=bounds_of(item.keys[0]),
            )
            is_wrong = hypothesis.effect.startswith("parameter.")
            before = self._described(item.keys) if is_wrong else None
            found[item.name] = evolve(estimate, described=before)
        return found

    def _described(self, keys: Sequence[str]) -> float:
        """What the description has for a value, the mean of all wheels."""
        values = [self.analysis.base.values[key] for key in keys]
        return sum(value for value in values if isinstance(value, float)) / len(values)


def log_odds_of(found: Hypothesis, group: Sequence[FittedModel]) -> list[tuple[float, Hypothesis]]:
    """Others in the place of a finding with their log odds; the first has the finding itself.

    The group may be of more findings than were kept in the end. Of several tries of one rival the
    best counts.
    """
    odds: dict[str, tuple[float, Hypothesis]] = {}
    for item in group[1:]:
        if found.name in item.model.names:
            continue
        names = group[0].model.names
        other = next((known for known in item.model.hypotheses if known.name not in names), None)
        odd = item.evidence - group[0].evidence
        if other is not None and (other.name not in odds or odd > odds[other.name][0]):
            odds[other.name] = (odd, other)
    return list(odds.values())


def _key_of(hypothesis: Hypothesis) -> str:
    """Key under which the drive that would show it is known."""
    if hypothesis.effect.startswith("parameter."):
        return hypothesis.effect.removeprefix("parameter.")
    return f"physics.{hypothesis.effect}"
