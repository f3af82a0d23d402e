"""From the result of an analysis to an explanation that can be shown and used."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.effects import EFFECTS
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import autocorrelation
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.analysis import AnalysisResult, detection_limits
from tomr_reality_gap.described import described, for_users
from tomr_reality_gap.explanation import Comparison, Explanation, Finding
from tomr_reality_gap.findings import Findings
from tomr_reality_gap.fit.forward_selection import finding_cost
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.unmodelled import (
    Remainder,
    Unmodelled,
    gains,
    still_needed,
    unmodelled_effects,
)
from tomr_reality_gap.mismatch.compare import comparison, score_of, simulated
from tomr_reality_gap.mismatch.locate import maps_of, variables_at
from tomr_reality_gap.rules import Residuals, is_doubted, is_unmodelled, unexplained
from tomr_reality_gap.suggest import suggested

Array = NDArray[np.float64]


def explanation_of(
    analysis: AnalysisResult, held: Sequence[RecordingSimulation], notes: tuple[str, ...]
) -> Explanation:
    """The whole explanation."""
    dataset, found = analysis.dataset, analysis.found
    jacobian = linearise(dataset, found.best.model, ())
    rest = Remainder.of(dataset, found.best.value, jacobian, found.noise)
    left = unmodelled_effects(rest, analysis.basis)
    effect = left[0] if _is_there(analysis, left) else None
    after = analysis.simulated[1]
    gained = gains(rest, jacobian, [after - item for item in analysis.simulated[2:]], effect)
    needed = [True] * len(gained)
    if effect is not None:
        needed = still_needed(found.best.model, gained, effect)
    model = found.best.model.kept(needed)
    if effect is not None and not all(needed):
        after = dataset.predict([model.described.robot])[0]
        fewer = Remainder.of(dataset, after, jacobian, found.noise, needed)
        (effect,) = unmodelled_effects(fewer, analysis.basis, {effect.family.variable})
    doubted = is_doubted(*unexplained(_residuals(analysis, after)), bool(model.hypotheses))
    if doubted and effect is None and left:
        effect = left[0]  # even if no family of torques explains much of it
    comparisons = _comparisons(analysis, model, effect, after, held)
    variables = _variables(analysis)
    maker = Findings(analysis, gained, variables)
    findings = maker.named(needed, doubted)
    findings += [maker.unmodelled(effect)] if effect is not None else []
    fitted = [item for item in comparisons if not item.held_out]
    explained = np.concatenate([values for item in fitted for values in item.after])
    before, left_over = dataset.value - analysis.simulated[0], dataset.value - explained
    return Explanation(
        verdict="mismatch" if findings else "match",
        sentence=_sentence(findings),
        findings=tuple(findings),
        unexplained_share=unexplained(_residuals(analysis, explained))[0] if findings else 0.0,
        comparisons=comparisons,
        maps=maps_of(dataset.channels, before, left_over, found.noise.sigma, variables=variables),
        alignment=_alignment(analysis),
        detection_limits=detection_limits(analysis) if not findings else (),
        whiteness=_whiteness(analysis),
        score=score_of([item for item in comparisons if item.held_out]),
        explained=described(analysis, for_users(analysis, model)) if model.hypotheses else "",
        suggested=suggested(findings),
        notes=notes,
    )


def _is_there(analysis: AnalysisResult, left: Sequence[Unmodelled]) -> bool:
    """Whether an effect without a name is there, and not in the user's simulation as well."""
    found, cost = analysis.found, finding_cost(len(analysis.dataset.value))
    named = found.best.evidence - found.without.evidence
    if not left or not is_unmodelled(left[0].evidence, named, cost):
        return False
    baseline = analysis.baseline
    return baseline is None or not baseline.shows(left[0], found.best.model, analysis.basis)


def _comparisons(
    analysis: AnalysisResult,
    model: Model,
    effect: Unmodelled | None,
    after: Array,
    held: Sequence[RecordingSimulation],
) -> tuple[Comparison, ...]:
    """All recordings before and after, with what the effect without a name amounts to."""
    described, explained = analysis.base.robot, model.described.robot
    besides = effect.torque if effect is not None else None
    found, at, noise = [], 0, _noise(analysis)
    for item, run in zip(analysis.dataset.simulations, analysis.runs, strict=True):
        part = slice(at, at := at + item.size)
        values: Array = np.stack([analysis.simulated[0][part], after[part]])
        if besides is not None:
            values, run = simulated(item, described, explained, besides)
        found.append(comparison(item, values, run, is_held_out=False, noise=noise))
    for item in held:
        values, run = simulated(item, described, explained, besides)
        found.append(comparison(item, values, run, is_held_out=True, noise=noise))
    return tuple(found)


def _noise(analysis: AnalysisResult) -> dict[str, float]:
    """Usual standard deviation of each channel's noise, as the fit found it, by its name."""
    channels, sigma = analysis.dataset.channels, analysis.found.noise.sigma
    parts: dict[str, list[Array]] = {}
    for channel, part in zip(channels, rows_of(channels), strict=True):
        parts.setdefault(channel.name, []).append(sigma[part])
    return {name: float(np.median(np.concatenate(rows))) for name, rows in parts.items()}


def _residuals(analysis: AnalysisResult, after: Array) -> list[Residuals]:
    """Of what is drawn and of speeds, channel by channel."""
    dataset, before = analysis.dataset, analysis.simulated[0]
    return [
        Residuals(
            channel.value - before[part],
            channel.value - after[part],
            float(np.std(channel.value)),
            channel.quantum,
            channel.kind in DRAWN_KINDS,
        )
        for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True)
        if channel.kind in (*DRAWN_KINDS, "speed")
    ]


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
            variable = item.shape.variable.partition(" [")[0] if item.shape else "?"
            parts.append(f"an effect without a name ({where}, depending on {variable})")
            continue
        sizes = ", ".join(
            f"{name} {value.value:.3g} {value.unit}".rstrip()
            for name, value in item.parameters.items()
        )
        parts.append(f"{_label(item.effect)} ({where}: {sizes})")
    return f"Reality differs: {'; '.join(parts)}."


def _label(effect: str) -> str:
    """What an effect does, or which value is wrong, in the middle of a sentence."""
    if effect not in EFFECTS:
        return f"wrong value of {effect.removeprefix('parameter.')}"
    label = EFFECTS[effect].label
    return label if label.split()[0] in _NAMES else f"{label[0].lower()}{label[1:]}"
