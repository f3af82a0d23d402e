"""From the result of an analysis to an explanation that can be shown and used."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.effects import EFFECTS
from tomr_power_model.estimation.linear_gaussian import Gram, solve, transposed_product
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import autocorrelation
from tomr_power_model.robot.description import why_not_held
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.analysis import AnalysisResult, detection_limits, residuals_of
from tomr_reality_gap.described import described, for_users
from tomr_reality_gap.explanation import Comparison, Explanation, Finding, Learnt
from tomr_reality_gap.findings import Findings
from tomr_reality_gap.fit.laws import words_of
from tomr_reality_gap.fit.learnt import with_terms
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.mismatch.compare import comparison, score_of
from tomr_reality_gap.mismatch.locate import maps_of, variables_at
from tomr_reality_gap.rules import is_doubted, unexplained
from tomr_reality_gap.suggest import suggested

Array = NDArray[np.float64]

_AT_EDGE = 0.98  # of the way to the edge of a tolerance
_MOST_KEYS = 6  # in a line


def explanation_of(
    analysis: AnalysisResult, held: Sequence[RecordingSimulation], notes: tuple[str, ...]
) -> Explanation:
    """The whole explanation."""
    dataset, found = analysis.dataset, analysis.found
    before, after = analysis.simulated[0], analysis.simulated[1]
    left, size = unexplained(residuals_of(dataset, before, after))
    model = found.best.model
    doubted = is_doubted(left, size, bool(model.hypotheses))
    comparisons = _comparisons(analysis, held)
    variables = _variables(analysis)
    maker = Findings(analysis, gains(analysis), variables)
    findings = maker.all(left, doubted)
    return Explanation(
        verdict="mismatch" if findings else "match",
        sentence=_sentence(findings),
        findings=tuple(findings),
        unexplained_share=left if findings else 0.0,
        comparisons=comparisons,
        maps=maps_of(
            dataset.channels,
            dataset.value - before,
            dataset.value - after,
            found.noise.sigma,
            variables=variables,
        ),
        alignment=_alignment(analysis),
        detection_limits=detection_limits(analysis) if not findings else (),
        whiteness=_whiteness(analysis),
        score=score_of([item for item in comparisons if item.held_out]),
        explained=described(analysis, for_users(analysis, model)) if findings else "",
        suggested=suggested(findings),
        notes=(*notes, *_notes(analysis)),
    )


def _notes(analysis: AnalysisResult) -> tuple[str, ...]:
    """What is to be heeded of a term without a name, and of values at their edge."""
    return (*_term_notes(analysis), *edge_notes(analysis.found.best.model))


def _term_notes(analysis: AnalysisResult) -> tuple[str, ...]:
    """What no other drive repeats is named, not predicted; what no driver holds, not written."""
    effect, robot = analysis.unmodelled, analysis.found.best.model.described.robot
    if effect is None:
        return ()
    if analysis.spoils:
        return (
            f"{effect.family.words} is not in the explained description: held-out drives are "
            "predicted worse with it. Record drives through what these do, places and speeds",
        )
    if effect.is_repeatable:
        why = why_not_held(robot, effect.term)
        return (f"{effect.family.words} is not in the explained description: {why}",) if why else ()
    return (
        f"{effect.family.words} comes and goes: other drives are predicted without it; its course "
        "is an estimate for this one",
    )


def edge_notes(model: Model) -> tuple[str, ...]:
    """Which described values the recordings ask to be farther off than they may be."""
    listed = []
    for parameter, offset in zip(model.nuisances, model.nuisance_offsets, strict=True):
        value = model.base.values[parameter.keys[0]]
        if isinstance(value, float) and abs(offset) > _AT_EDGE * parameter.upper:
            listed.append(f"{parameter.keys[0]} {offset / value:+.1%}")
    if not listed:
        return ()
    more = len(listed) - _MOST_KEYS
    text = ", ".join(listed[:_MOST_KEYS]) + (f" and {more} more" if more > 0 else "")
    return (
        f"as far off as the tolerance lets them be: {text}: measure them, or give them more with "
        "--tolerance KEY=REL",
    )


def gains(analysis: AnalysisResult) -> list[float]:
    """Log evidence that each named finding brings, all else fitted anew without it."""
    dataset, found = analysis.dataset, analysis.found
    jacobian = analysis.jacobian
    weight = found.noise.weight
    matrix, residual = jacobian.matrix, dataset.value - found.best.value
    everything = list(range(matrix.shape[1]))
    gram = Gram.of(matrix, residual, weight)
    whole, gained = _likelihood(gram, everything), []
    for part, value in zip(jacobian.own, analysis.simulated[2:], strict=True):
        others = [row for row in everything if not part.start <= row < part.stop]
        lacking = (residual + analysis.simulated[1] - value) * weight
        vector = transposed_product(matrix, lacking * weight)
        other = Gram(gram.matrix, vector, float(lacking @ lacking))
        gained.append(whole - _likelihood(other, others))
    return gained


def _likelihood(gram: Gram, chosen: Sequence[int]) -> float:
    """Log evidence of some columns, up to what all residuals of one weighting share."""
    return solve(gram, chosen).evidence - 0.5 * gram.square


def _comparisons(
    analysis: AnalysisResult, held: Sequence[RecordingSimulation]
) -> tuple[Comparison, ...]:
    """All recordings before and after; held-out ones with what they repeat of an unnamed term."""
    described, explained = analysis.base.robot, analysis.found.best.model.described.robot
    found, at, noise = [], 0, _noise(analysis)
    for item, run in zip(analysis.dataset.simulations, analysis.runs, strict=True):
        part = slice(at, at := at + item.size)
        values: Array = np.stack([analysis.simulated[0][part], analysis.simulated[1][part]])
        found.append(comparison(item, values, run, is_held_out=False, noise=noise))
    terms = () if analysis.term is None else (analysis.term,)
    for item in held:
        termed = with_terms(item, explained, terms)
        values = np.concatenate([item.predict([described]), termed.predict([explained])])
        run = termed.run(explained)
        found.append(comparison(item, values, run, is_held_out=True, noise=noise))
    return tuple(found)


def _noise(analysis: AnalysisResult) -> dict[str, float]:
    """Usual standard deviation of each channel's noise, as the fit found it, by its name."""
    channels, sigma = analysis.dataset.channels, analysis.found.noise.sigma
    parts: dict[str, list[Array]] = {}
    for channel, part in zip(channels, rows_of(channels), strict=True):
        parts.setdefault(channel.name, []).append(sigma[part])
    return {name: float(np.median(np.concatenate(rows))) for name, rows in parts.items()}


def _variables(analysis: AnalysisResult) -> Mapping[str, Array]:
    """Variables at all samples of all recordings."""
    parts = [
        variables_at(item, run, item.channels)
        for item, run in zip(analysis.dataset.simulations, analysis.runs, strict=True)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _alignment(analysis: AnalysisResult) -> dict[str, str]:
    """What the fit found about the timing of each recording."""
    found = {}
    for item in analysis.dataset.simulations:
        line = item.timeline
        found[item.recorded.name] = (
            f"drivers' periods of {1e3 * line.period:g} ms begin {1e3 * line.phase:.2f} ms before "
            "the first encoder sample"
        )
    return found


def _whiteness(analysis: AnalysisResult) -> dict[str, tuple[float, float]]:
    """Autocorrelation of the residuals at lag one, before and after, by channel."""
    dataset, found = analysis.dataset, analysis.found
    before = (dataset.value - found.without.value) * found.noise.weight
    after = (dataset.value - found.best.value) * found.noise.weight
    return {
        channel.name: (
            float(autocorrelation([before[part]], 2)[-1]),
            float(autocorrelation([after[part]], 2)[-1]),
        )
        for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True)
    }


_NAMES = frozenset({"Coulomb", "Stribeck"})


def _sentence(findings: Sequence[Finding]) -> str:
    if not findings:
        return "The simulation matches: nothing differs beyond noise and the stated tolerances."
    parts = []
    for item in findings:
        where = ", ".join(item.where).replace("_", " ")
        if item.effect == "unknown":
            parts.append(f"an effect without a name ({where}: {_unnamed(item.learnt)})")
            continue
        sizes = ", ".join(
            f"{name} {value.value:.3g} {value.unit}".rstrip()
            + ("" if value.described is None else f", described as {value.described:.3g}")
            for name, value in item.parameters.items()
        )
        parts.append(f"{_label(item.effect)} ({where}: {sizes})")
    return f"Reality differs: {'; '.join(parts)}."


def _unnamed(learnt: Learnt | None) -> str:
    """What it depends on, and what law it is like."""
    if learnt is None:
        return "nothing shows on what it depends"
    words = learnt.term.family.words
    if learnt.laws:
        return f"{words}; {words_of(learnt.laws[0])}"
    return words if learnt.is_repeatable else f"{words}, which no other drive repeats"


def _label(effect: str) -> str:
    """What an effect does, or which value is wrong, in the middle of a sentence."""
    if effect not in EFFECTS:
        return f"wrong value of {effect.removeprefix('parameter.')}"
    label = EFFECTS[effect].label
    return label if label.split()[0] in _NAMES else f"{label[0].lower()}{label[1:]}"
