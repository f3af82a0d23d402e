"""From what a search found to an explanation that can be shown and used."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.beliefs import drive_for
from tomr_power_model.calibration.fitted import fitted_text
from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.explanation import (
    Estimate,
    Explanation,
    Finding,
    Map,
    Rival,
    Score,
)
from tomr_reality_gap.fit.leftover import Leftover, leftovers, names, still_needed
from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.noise import rows_of
from tomr_reality_gap.fit.search import Fitted, Found, finding_cost
from tomr_reality_gap.fit.study import Columns, Model, Study, columns_at
from tomr_reality_gap.hypotheses.knobs import NEUTRAL, Hypothesis, Knob, Turned
from tomr_reality_gap.hypotheses.scales import Scales
from tomr_reality_gap.mismatch.compare import comparison, score_of
from tomr_reality_gap.mismatch.locate import located, maps_of, variables_at
from tomr_reality_gap.suggest import suggested

Array = NDArray[np.float64]

_RIVAL = 5.0  # log odds within which data do not tell two explanations apart
_UNKNOWN_COST = 60.0  # log evidence that an effect without a name must bring
_UNKNOWN_SHARE = 0.12  # of what all named findings bring: the simulator is not exact either
_WIDE = 1.96
_INEXACT = 0.01  # of a value
_UNSURE = 0.03  # of the spread of power: error of the simulator itself
_MUCH = 0.3  # of the mismatch left: what was named is not the whole story
_DOUBTED = 0.45  # confidence of a finding that leaves so much
_TEMPER = 3.0  # odds are trusted to their third root: the noise model is not exact
_SURE = 0.97
_LISTED = 12  # smallest sizes that are told


@frozen
class Evidence:
    """All that a verdict rests on."""

    study: Study
    found: Found
    base: Turned
    robot: Robot  # as described
    source: str  # robot.yaml
    scales: Scales
    candidates: tuple[Hypothesis, ...]


def explanation_of(
    evidence: Evidence, held: Sequence[Forward], notes: tuple[str, ...]
) -> Explanation:
    """The whole explanation."""
    study, found = evidence.study, evidence.found
    best = found.best
    columns = columns_at(study, best.model, ())
    explained = best.model.described.robot
    left = leftovers(study, best, columns, found, explained, evidence.scales.torque)
    unknown = _unknown(best, found, left)
    needed = [True] * len(best.model.hypotheses)
    if unknown is not None:
        needed = still_needed(study, best, columns, found, unknown)
    model = best.model
    for number in reversed([place for place, wanted in enumerate(needed) if not wanted]):
        model = model.without(number)
    explained = model.described.robot
    comparisons = [
        comparison(item, evidence.base.robot, explained, False) for item in study.forwards
    ] + [comparison(item, evidence.base.robot, explained, True) for item in held]
    score = score_of([item for item in comparisons if item.held_out])
    share = _shares(evidence)
    variables = _variables(evidence)
    findings = [
        _finding(evidence, number, share, score, variables)
        for number, wanted in enumerate(needed)
        if wanted
    ]
    unexplained, size = 0.0, 0.0
    if findings:
        unexplained, size = _unexplained(evidence, study.predict([explained])[0])
    if unexplained > _MUCH and size > 1.0 and unknown is None and left:
        # Too much is left for what was named, even if no family of torques explains it either.
        unknown = left[0]
        findings = [evolve(item, confidence=min(item.confidence, _DOUBTED)) for item in findings]
    if unknown is not None:
        findings.append(_unnamed(evidence, unknown, score, variables))
    verdict = "mismatch" if findings else "match"
    return Explanation(
        verdict=verdict,
        sentence=_sentence(findings),
        findings=tuple(findings),
        unexplained_share=max(unexplained, float(bool(unknown) and not model.hypotheses)),
        comparisons=tuple(comparisons),
        maps=_maps(evidence, variables),
        alignment=_alignment(evidence),
        smallest=_smallest(evidence) if not findings else (),
        whiteness=_whiteness(evidence),
        score=score,
        explained=_described(evidence, model) if model.hypotheses else "",
        suggested=suggested(findings),
        notes=notes,
    )


def _unknown(best: Fitted, found: Found, left: Sequence[Leftover]) -> Leftover | None:
    """The family that stands for an effect without a name, if something is left."""
    if not left:
        return None
    named = best.evidence - found.without.evidence
    if left[0].evidence > max(_UNKNOWN_COST, _UNKNOWN_SHARE * named):
        return left[0]
    return None


def _finding(
    evidence: Evidence,
    number: int,
    share: Sequence[float],
    score: Score | None,
    variables: Mapping[str, Array],
) -> Finding:
    found = evidence.found
    best = found.best
    hypothesis, turns = best.model.hypotheses[number], best.model.turns[number]
    first = sum(len(item.knobs) for item in best.model.hypotheses[:number])
    sigma = best.own_sigma[first : first + len(hypothesis.knobs)]
    study = evidence.study
    without = study.predict([best.model.without(number).described.robot])[0]
    change = study.predict([best.model.described.robot])[0] - without
    group = found.alternatives[number] if number < len(found.alternatives) else ()
    rivals, confidence = _rivals(hypothesis, group)
    return Finding(
        effect=hypothesis.effect,
        where=hypothesis.where,
        parameters=_parameters(evidence, hypothesis, turns, sigma),
        located=located(study.channels, change, found.noise.weight, share[number], variables),
        holdout=score,
        rivals=rivals,
        confidence=confidence,
        evidence=best.evidence - found.without.evidence,
    )


def _parameters(
    evidence: Evidence, hypothesis: Hypothesis, turns: Sequence[float], sigma: Array
) -> dict[str, Estimate]:
    """Values with their intervals; of a wrong parameter what it is, tolerance included."""
    best = evidence.found.best
    nuisance = {
        knob.keys[0]: turn
        for knob, turn in zip(best.model.nuisances, best.model.nuisance_turns, strict=True)
    }
    found = {}
    for knob, turn, width in zip(hypothesis.knobs, turns, sigma, strict=True):
        starts = []
        for key in knob.keys:
            leaf = key.rpartition(".")[2]
            start = hypothesis.start.get(key, evidence.base.values.get(key))
            starts.append(float(start if start is not None else NEUTRAL.get(leaf, 0.0)))  # type: ignore[arg-type]
            starts[-1] += nuisance.get(key, 0.0) if key not in hypothesis.start else 0.0
        value = sum(starts) / len(starts) + turn
        # The simulator is not exact either: that part of a value is never known.
        half = _WIDE * math.hypot(float(width), _INEXACT * abs(turn))
        if knob.unit == "rad":
            value = math.remainder(value, 2.0 * math.pi)
        found[knob.name] = Estimate(value, value - half, value + half, knob.unit)
    return found


def _rivals(hypothesis: Hypothesis, group: Sequence[Fitted]) -> tuple[tuple[Rival, ...], float]:
    """Who explains it as well, and how much of the belief they and the finding hold together."""
    odds = {}
    for item in group[1:]:  # the first is the finding itself, judged by the same noise
        other = item.model.hypotheses[-1]
        if other.name != hypothesis.name:
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
    change = unknown.columns @ np.ones(unknown.columns.shape[1])
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
    robot = evidence.found.best.model.described.robot
    parts = [variables_at(item, item.run(robot), item.channels) for item in evidence.study.forwards]
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
        value = study.predict([best.model.without(number).described.robot])[0]
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
    """Part of the power's mismatch that is left, beyond noise and what the simulator is unsure of;
    and how much that is, noise being 1.

    Noise is what differs from one sample to the next: unlike the noise of the fit it knows nothing
    of slow mismatches that no hypothesis explains.
    """
    study = evidence.study
    before = study.predict([evidence.base.robot])[0]
    first, left = 0.0, 0.0
    for channel, part in zip(study.channels, rows_of(study.channels), strict=True):
        if channel.kind not in ("power", "total"):
            continue
        value = channel.value
        residuals = value - before[part], value - after[part]
        steps = np.abs(np.diff(residuals[1]))
        noise = (1.4826 * float(np.median(steps))) ** 2 / 2.0
        noise = max(noise, 0.5 * float(np.mean(np.minimum(steps, 5.0 * np.median(steps)) ** 2)))
        known = noise + (_UNSURE * float(np.std(value))) ** 2
        first += max(float(np.mean(residuals[0] ** 2)) - known, 0.0) / known
        left += max(float(np.mean(residuals[1] ** 2)) - known, 0.0) / known
    count = sum(channel.kind in ("power", "total") for channel in study.channels)
    share = min(1.0, left / first) if first > 0.0 else 0.0
    return share, left / max(count, 1)


def _maps(evidence: Evidence, variables: Mapping[str, Array]) -> tuple[Map, ...]:
    study, found = evidence.study, evidence.found
    before = study.value - study.predict([evidence.base.robot])[0]
    after = study.value - found.best.value
    return maps_of(study.channels, before, after, found.noise.sigma, variables)


def _alignment(evidence: Evidence) -> dict[str, str]:
    """What the fit found about the timing of each recording."""
    told = {}
    for item in evidence.study.forwards:
        line = item.timeline
        told[item.recorded.name] = (
            f"drivers' periods of {1e3 * line.period:g} ms begin {-1e3 * line.start:.2f} ms before "
            f"the first encoder sample; {len(line.first)} stretches simulated side by side"
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


def _smallest(evidence: Evidence) -> tuple[tuple[str, str, str], ...]:
    """The smallest size of each effect that would have been found."""
    step = evidence.found.rounds[-1]
    columns: Columns = step.columns
    weight = step.noise.weight
    gram = Gram.of(columns.matrix * weight[:, None], np.zeros(len(weight)))
    base = list(range(columns.instruments.stop))
    inverse = solve(gram, base).covariance
    found: dict[str, tuple[float, Hypothesis, Knob]] = {}
    open_ones = [h for h in evidence.candidates if h.name not in columns.model.names]
    for hypothesis in open_ones:
        row = columns.candidates[hypothesis.key].start
        cross = gram.matrix[row, base]
        information = gram.matrix[row, row] - float(cross @ inverse @ cross)
        if information <= 0.0 or hypothesis.effect.startswith("parameter."):
            continue
        knob = hypothesis.knobs[0]
        size = knob.spread * math.sqrt(
            2.0 * (finding_cost(evidence.study) + math.log1p(information)) / information
        )
        size = max(size, hypothesis.least)
        best = found.get(hypothesis.name)
        if best is None or size < best[0]:
            found[hypothesis.name] = (size, hypothesis, knob)
    rows = [
        (item.effect, ", ".join(item.where), f"{knob.name} {size:.2g} {knob.unit}".rstrip())
        for size, item, knob in found.values()
        if item.where[0] in ("all_wheels", "body", "supply")
    ]
    return tuple(rows[: 2 * _LISTED])


def _described(evidence: Evidence, model: Model) -> str:
    """Text of robot_explained.yaml: what is alike for all wheels is written once."""
    values = dict(model.described.values)
    wheels = evidence.robot.wheel_names
    for key in [key for key in values if f".{wheels[0]}." in key]:
        keys = [key.replace(wheels[0], wheel) for wheel in wheels]
        numbers = {values.get(item) for item in keys}
        general = key.replace(f".{wheels[0]}.", ".")
        if len(numbers) == 1:
            values[general] = values[key]
            for item in keys:
                del values[item]
    findings = ", ".join(item.name for item in model.hypotheses)
    header = [f"{evidence.source}, with what reality showed besides:", findings]
    recordings = ", ".join(item.recorded.name for item in evidence.study.forwards)
    return fitted_text(evidence.source, values, (), (), (), header, {"recordings": recordings})


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
