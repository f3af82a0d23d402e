"""From what a search found to an explanation that can be shown and used."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_power_model.calibration.priors import drive_for
from tomr_power_model.estimation.statistics import robust_scale
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.described import described, for_users
from tomr_reality_gap.evidence import Evidence, smallest
from tomr_reality_gap.explanation import (
    Comparison,
    Estimate,
    Explanation,
    Finding,
    Map,
    Rival,
    Score,
)
from tomr_reality_gap.fit.leftover import (
    Leftover,
    leftovers,
    names,
    still_needed,
    without_needless,
)
from tomr_reality_gap.fit.noise import rows_of
from tomr_reality_gap.fit.refine import Fitted
from tomr_reality_gap.fit.search import finding_cost
from tomr_reality_gap.fit.study import Model, columns_at
from tomr_reality_gap.hypotheses.knobs import Hypothesis, bounds_of, neutral_of
from tomr_reality_gap.mismatch.compare import comparison, score_of, simulated
from tomr_reality_gap.mismatch.locate import located, maps_of, variables_at
from tomr_reality_gap.suggest import suggested

Array = NDArray[np.float64]

_RIVAL = 5.0  # log odds within which data do not tell two explanations apart
_UNKNOWN_COST = 60.0  # log evidence that an effect without a name must bring
_UNKNOWN_SHARE = 0.12  # of what all named findings bring: the simulator is not exact either
_WIDE = 1.96
_INEXACT = 0.02  # of a value
_UNSURE = 0.03  # of the spread of power: error of the simulator itself
_MUCH = 0.3  # of the mismatch left: what was named is not the whole story
_GROSS = 10.0  # times the noise: no match, even if nothing is named; slow noise reaches 1
_DOUBTED = 0.45  # confidence of a finding that leaves so much
_TEMPER = 3.0  # odds are trusted to their third root: the noise model is not exact
_SURE = 0.97


def explanation_of(
    evidence: Evidence, held: Sequence[RecordingSimulation], notes: tuple[str, ...]
) -> Explanation:
    """The whole explanation."""
    study, found = evidence.study, evidence.found
    columns = columns_at(study, found.best.model, ())
    left = leftovers(study, found.best, columns, found, evidence.nameless)
    unknown = _unknown(evidence, left)
    needed = [True] * len(found.best.model.hypotheses)
    if unknown is not None:
        needed = still_needed(study, found.best, columns, found, unknown, evidence.simulated[1:])
    model = _kept(found.best.model, needed)
    after = evidence.simulated[1]
    if unknown is not None and not all(needed):
        after = study.predict([model.described.robot])[0]
        unknown = without_needless(study, after, columns, needed, found, evidence.nameless, unknown)
    unexplained, size = _unexplained(evidence, after)
    doubted = unexplained > _MUCH and size > (1.0 if model.hypotheses else _GROSS)
    if doubted and unknown is None and left:
        # Too much is left for what was named, or for a match, even if no family of torques
        # explains it either.
        unknown = left[0]
    comparisons = _comparisons(evidence, model, unknown, after, held)
    score = score_of([item for item in comparisons if item.held_out])
    variables = _variables(evidence)
    findings = _findings(evidence, needed, doubted, score, variables)
    if unknown is not None:
        findings.append(_unnamed(evidence, unknown, score, variables))
    return Explanation(
        verdict="mismatch" if findings else "match",
        sentence=_sentence(findings),
        findings=tuple(findings),
        unexplained_share=_left(evidence, comparisons) if findings else 0.0,
        comparisons=comparisons,
        maps=_maps(evidence, comparisons, variables),
        alignment=_alignment(evidence),
        smallest=smallest(evidence) if not findings else (),
        whiteness=_whiteness(evidence),
        score=score,
        explained=described(evidence, for_users(evidence, model)) if model.hypotheses else "",
        suggested=suggested(findings),
        notes=notes,
    )


def _kept(model: Model, needed: Sequence[bool]) -> Model:
    for number in reversed([place for place, wanted in enumerate(needed) if not wanted]):
        model = model.without(number)
    return model


def _findings(
    evidence: Evidence,
    needed: Sequence[bool],
    doubted: bool,
    score: Score | None,
    variables: Mapping[str, Array],
) -> list[Finding]:
    share = _shares(evidence)
    found = [
        _finding(evidence, number, share, score, variables)
        for number, wanted in enumerate(needed)
        if wanted
    ]
    if doubted:
        return [evolve(item, confidence=min(item.confidence, _DOUBTED)) for item in found]
    return found


def _comparisons(
    evidence: Evidence,
    model: Model,
    unknown: Leftover | None,
    after: Array,
    held: Sequence[RecordingSimulation],
) -> tuple[Comparison, ...]:
    """All recordings before and after, with what the effect without a name amounts to."""
    described, explained = evidence.base.robot, model.described.robot
    besides = unknown.torque if unknown is not None else None
    found, at = [], 0
    for item, run in zip(evidence.study.simulations, evidence.runs, strict=True):
        part = slice(at, at := at + sum(len(channel.time) for channel in item.channels))
        values: Array = np.stack([evidence.simulated[0][part], after[part]])
        if besides is not None:
            values, run = simulated(item, described, explained, besides)
        found.append(comparison(item, values, run, False))
    for item in held:
        found.append(comparison(item, *simulated(item, described, explained, besides), True))
    return tuple(found)


def _unknown(evidence: Evidence, left: Sequence[Leftover]) -> Leftover | None:
    """The family that stands for an effect without a name, if something is left."""
    found, mirror = evidence.found, evidence.mirror
    named = found.best.evidence - found.without.evidence
    if not left or left[0].evidence <= max(
        _UNKNOWN_COST, finding_cost(evidence.study), _UNKNOWN_SHARE * named
    ):
        return None
    if mirror is not None and mirror.shows(left[0], found.best.model, evidence.nameless):
        return None
    return left[0]


def _finding(
    evidence: Evidence,
    number: int,
    share: Sequence[float],
    score: Score | None,
    variables: Mapping[str, Array],
) -> Finding:
    found = evidence.found
    best = found.best
    hypothesis = best.model.hypotheses[number]
    first = sum(len(item.knobs) for item in best.model.hypotheses[:number])
    sigma = best.own_sigma[first : first + len(hypothesis.knobs)]
    study = evidence.study
    change = evidence.simulated[1] - evidence.simulated[2 + number]
    group = found.alternatives[number] if number < len(found.alternatives) else ()
    rivals, confidence = _rivals(number, group)
    return Finding(
        effect=hypothesis.effect,
        where=hypothesis.where,
        parameters=_parameters(evidence, number, sigma),
        located=located(study.channels, change, found.noise.weight, share[number], variables),
        holdout=score,
        rivals=rivals,
        confidence=confidence,
        evidence=best.evidence - found.without.evidence,
    )


def _parameters(evidence: Evidence, number: int, sigma: Array) -> dict[str, Estimate]:
    """Values with their intervals; of a wrong parameter what it is, tolerance included."""
    best = evidence.found.best
    hypothesis, turns = best.model.hypotheses[number], best.model.turns[number]
    shared = evidence.shared[number] if evidence.shared else (0.0,) * len(turns)
    nuisance = {
        knob.keys[0]: turn
        for knob, turn in zip(best.model.nuisances, best.model.nuisance_turns, strict=True)
    }
    found = {}
    for knob, whole, theirs, width in zip(hypothesis.knobs, turns, shared, sigma, strict=True):
        turn = whole - theirs
        starts = []
        for key in knob.keys:
            start = hypothesis.start.get(key, evidence.base.values.get(key))
            starts.append(float(start if start is not None else neutral_of(key)))  # type: ignore[arg-type]
            starts[-1] += nuisance.get(key, 0.0) if key not in hypothesis.start else 0.0
        value = sum(starts) / len(starts) + turn
        # The simulator is not exact either: that part of a value is never known, nor all of what
        # the user's simulation shows of it.
        half = _WIDE * math.hypot(float(width), _INEXACT * turn, 0.5 * theirs)
        if knob.unit == "rad":
            value = math.remainder(value, 2.0 * math.pi)
        lowest, highest = bounds_of(knob.keys[0])
        found[knob.name] = Estimate(
            value, max(value - half, lowest), min(value + half, highest), knob.unit
        )
    return found


def _rivals(number: int, group: Sequence[Fitted]) -> tuple[tuple[Rival, ...], float]:
    """Who explains it as well, and how much of the belief they and the finding hold together."""
    odds = {}
    for item in group[1:]:  # the first is the finding itself, judged by the same noise
        other = item.model.hypotheses[number]
        if other.name != group[0].model.hypotheses[number].name:
            odds[other.name] = (item.evidence - group[0].evidence, other)
    close = [pair for pair in odds.values() if pair[0] > -_RIVAL]
    rest = sum(
        math.exp(max(pair[0], -600.0) / _TEMPER) for pair in odds.values() if pair[0] <= -_RIVAL
    )
    near = 1.0 + sum(math.exp(min(pair[0], 0.0) / _TEMPER) for pair in close)
    rivals = tuple(
        Rival(
            other.effect,
            other.where,
            min(odd, 0.0),
            drive_for(_key_of(other)),
        )
        for odd, other in sorted(close, key=lambda pair: -pair[0])
    )
    return rivals, _SURE * near / (near + rest)


def _key_of(hypothesis: Hypothesis) -> str:
    """Key under which the drive that would tell it is known."""
    if hypothesis.effect.startswith("parameter."):
        return hypothesis.effect.removeprefix("parameter.")
    return f"physics.{hypothesis.effect}"


def _unnamed(
    evidence: Evidence, unknown: Leftover, score: Score | None, variables: Mapping[str, Array]
) -> Finding:
    study = evidence.study
    change = unknown.columns @ (np.concatenate(unknown.turns) / evidence.nameless.size)
    weight = evidence.found.noise.weight
    found = located(
        study.channels, change / weight, weight, _share_of(evidence, unknown), variables
    )
    return Finding(
        effect="unknown",
        where=names(unknown.wheels, evidence.robot),
        parameters={},
        located=found,
        holdout=score,
        rivals=(),
        confidence=0.9,
        evidence=unknown.evidence,
        shape=unknown.shapes[0],
    )


def _variables(evidence: Evidence) -> Mapping[str, Array]:
    """Variables at all samples of all recordings."""
    parts = [
        variables_at(item, run, item.channels)
        for item, run in zip(evidence.study.simulations, evidence.runs, strict=True)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _shares(evidence: Evidence) -> list[float]:
    """Part of the mismatch's energy that each finding explains, by leaving it out."""
    study, found = evidence.study, evidence.found
    best = found.best
    weight = found.noise.weight
    before = float((((study.value - found.without.value) * weight) ** 2).sum())
    floor = min(best.chi2, float(len(study.value)))
    energies = []
    for number in range(len(best.model.hypotheses)):
        value = evidence.simulated[2 + number]
        energies.append(float((((study.value - value) * weight) ** 2).sum()) - best.chi2)
    total = max(sum(energies), 1e-9)
    explained = max(0.0, min(1.0, (before - best.chi2) / max(before - floor, 1e-9)))
    return [explained * energy / total for energy in energies]


def _share_of(evidence: Evidence, unknown: Leftover) -> float:
    before = float(
        (
            ((evidence.study.value - evidence.found.without.value) * evidence.found.noise.weight)
            ** 2
        ).sum()
    )
    floor = min(evidence.found.best.chi2, float(len(evidence.study.value)))
    return max(0.0, min(1.0, 2.0 * unknown.evidence / max(before - floor, 1e-9)))


def _unexplained(evidence: Evidence, after: Array) -> tuple[float, float]:
    """Part of the mismatch of power and speed that is left, beyond noise and what the simulator is
    unsure of; and how much that is in power, noise being 1.

    Noise is what differs from one sample to the next: unlike the noise of the fit it knows nothing
    of slow mismatches that no hypothesis explains.
    """
    study = evidence.study
    before = evidence.simulated[0]
    first, left, drawn = 0.0, 0.0, 0.0
    for channel, part in zip(study.channels, rows_of(study.channels), strict=True):
        if channel.kind not in (*DRAWN_KINDS, "speed"):
            continue
        value = channel.value
        residuals = value - before[part], value - after[part]
        steps = np.abs(np.diff(residuals[1]))
        noise = robust_scale(steps) ** 2 / 2.0
        noise = max(noise, 0.5 * float(np.mean(np.minimum(steps, 5.0 * np.median(steps)) ** 2)))
        noise = max(noise, channel.quantum**2 / 12.0)
        known = noise + (_UNSURE * float(np.std(value))) ** 2
        first += max(float(np.mean(residuals[0] ** 2)) - known, 0.0) / known
        rest = max(float(np.mean(residuals[1] ** 2)) - known, 0.0) / known
        left += rest
        drawn += rest if channel.kind in DRAWN_KINDS else 0.0
    count = sum(channel.kind in DRAWN_KINDS for channel in study.channels)
    share = min(1.0, left / first) if first > 0.0 else 0.0
    return share, drawn / max(count, 1)


def _left(evidence: Evidence, comparisons: Sequence[Comparison]) -> float:
    """Part of the mismatch that is left after everything, the curve of an unnamed effect too."""
    return _unexplained(evidence, _after(comparisons))[0]


def _after(comparisons: Sequence[Comparison]) -> Array:
    """Values of the fitted recordings' channels, as explained."""
    fitted = [item for item in comparisons if not item.held_out]
    return np.concatenate([values for item in fitted for values in item.after])


def _maps(
    evidence: Evidence, comparisons: Sequence[Comparison], variables: Mapping[str, Array]
) -> tuple[Map, ...]:
    study, found = evidence.study, evidence.found
    before = study.value - evidence.simulated[0]
    after = study.value - _after(comparisons)
    return maps_of(study.channels, before, after, found.noise.sigma, variables)


def _alignment(evidence: Evidence) -> dict[str, str]:
    """What the fit found about the timing of each recording."""
    told = {}
    for item in evidence.study.simulations:
        line = item.timeline
        told[item.recorded.name] = (
            f"drivers' periods of {1e3 * line.period:g} ms begin {1e3 * line.phase:.2f} ms before "
            "the first encoder sample"
        )
    return told


def _whiteness(evidence: Evidence) -> dict[str, tuple[float, float]]:
    study, found = evidence.study, evidence.found
    before = (study.value - found.without.value) * found.noise.weight
    after = (study.value - found.best.value) * found.noise.weight
    return {
        channel.name: (_next(before[part]), _next(after[part]))
        for channel, part in zip(study.channels, rows_of(study.channels), strict=True)
    }


def _next(series: Array) -> float:
    """Autocorrelation at lag one."""
    return float(np.mean(series[:-1] * series[1:]) / max(float(np.mean(series**2)), 1e-300))


def _sentence(findings: Sequence[Finding]) -> str:
    if not findings:
        return "The simulation matches: nothing differs beyond noise and the stated tolerances."
    parts = []
    for item in findings:
        where = ", ".join(item.where).replace("_", " ")
        if item.effect == "unknown":
            variable = item.shape.variable if item.shape else "?"
            parts.append(f"an effect without a name at {where}, depending on {variable}")
            continue
        sizes = ", ".join(
            f"{name} {value.value:.3g} {value.unit}".rstrip()
            for name, value in item.parameters.items()
        )
        parts.append(f"{item.effect} at {where} ({sizes})")
    return f"Reality differs by {' and '.join(parts)}."
