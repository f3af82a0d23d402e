"""Reports against truths.

exact: the effect is named with its place, confidence 0.5 or more. class: the effect or one that
data cannot distinguish from it is named, or listed as a rival, at an overlapping place, whatever
the confidence. false discovery: a confident finding that is neither, nor a wrong parameter stated
right.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from concealed.catalogue import SIZES
from concealed.claims import PARAMETER, UNKNOWN, Finding, Report, TrueEffect, Truth, read_report
from concealed.likeness import (
    Comparison,
    compared,
    explains,
    family,
    is_true,
    overlap,
    states_value,
)

NOTHING = "(nothing)"
NULL = "(null)"
MATCH, MISMATCH = "match", "mismatch"
ORACLE_AIM = 1.2
_SURE = 0.8
_PLAIN = 25.0  # signal to noise, of all samples together, from which an effect has to be found


@frozen
class Hit:
    """How one concealed effect was met."""

    effect: str
    size: str
    snr: float | None
    exact: bool
    named: bool  # by its name, wherever
    alike: bool  # class
    called: str  # the name that it was given
    comparisons: tuple[Comparison, ...]
    is_plain: bool = False  # named effects whose whole signal to noise is `_PLAIN`


@frozen
class Outcome:
    """One case, scored."""

    truth: Truth
    report: Report | None
    hits: tuple[Hit, ...]
    false: tuple[str, ...]
    overconfident: tuple[str, ...]
    verdict_right: bool
    place: float | None  # Jaccard index of the places named and true; None for nulls
    after: float | None  # NRMSE on the holdout as reported
    seconds: float | None


def score_case(truth: Truth, report: Report | None, seconds: float | None = None) -> Outcome:
    """Score one report; None where there is none."""
    sure = report.confident if report else ()
    findings = report.findings if report else ()
    false = [finding for finding in sure if not is_true(finding, truth)]
    after = [finding.nrmse_after for finding in findings if finding.nrmse_after is not None]
    return Outcome(
        truth=truth,
        report=report,
        hits=tuple(_hit(true, truth, findings) for true in truth.effects),
        false=tuple(finding.effect for finding in false),
        overconfident=tuple(_overconfident(truth, sure)),
        verdict_right=_verdict_right(truth, report),
        place=None if truth.null else _place(truth, sure),
        after=min(after, default=None),
        seconds=seconds,
    )


def _hit(true: TrueEffect, truth: Truth, findings: Sequence[Finding]) -> Hit:
    named = [item for item in findings if item.confident and item.effect == true.effect]
    hits = [item for item in named if item.places == true.places or true.effect == UNKNOWN]
    alike = any(
        ({item.effect} | item.rivals) & family(true.effect) and overlap(item.places, true.places)
        for item in findings
    )
    comparisons: tuple[Comparison, ...] = ()
    if hits and true.effect != UNKNOWN:
        comparisons = tuple(compared(true, max(hits, key=lambda item: item.confidence)))
    return Hit(
        effect=true.effect,
        size=true.size,
        snr=true.snr,
        exact=bool(hits),
        named=bool(named),
        alike=alike,
        called=_called(true, truth, findings),
        comparisons=comparisons,
        is_plain=true.effect != UNKNOWN and (true.strength or 0.0) >= _PLAIN,
    )


def _called(true: TrueEffect, truth: Truth, findings: Sequence[Finding]) -> str:
    """The name an effect was given: its own, one of its family, or what stands in its stead."""
    sure = sorted((f for f in findings if f.confident), key=lambda f: -f.confidence)
    for wanted in (
        lambda item: item.effect == true.effect,
        lambda item: explains(item, true),
        lambda item: not is_true(item, truth),
    ):
        named = next((item.effect for item in sure if wanted(item)), None)
        if named is not None:
            return named
    return NOTHING


def _overconfident(truth: Truth, sure: Iterable[Finding]) -> Iterable[str]:
    """Findings of high confidence where next to nothing shows, that are wrong or do not cover."""
    if not truth.barely_excited:
        return
    for finding in sure:
        if finding.confidence < _SURE:
            continue
        same = [true for true in truth.effects if true.effect == finding.effect]
        missed = any(item.covered is False for true in same for item in compared(true, finding))
        if missed or not is_true(finding, truth):
            yield finding.effect


def _verdict_right(truth: Truth, report: Report | None) -> bool:
    """A null may also be recognised by naming its deviations, and them rightly."""
    if report is None:
        return False
    if not truth.null:
        return report.verdict == MISMATCH
    deviations_only = all(
        finding.effect.startswith(PARAMETER) and states_value(finding, truth)
        for finding in report.confident
    )
    return report.verdict == MATCH or deviations_only


def _place(truth: Truth, sure: Sequence[Finding]) -> float:
    true = frozenset[str]().union(*(effect.places for effect in truth.effects))
    named = frozenset[str]().union(*(finding.places for finding in sure))
    return len(true & named) / len(true | named)


def score_all(
    truths: Sequence[Truth], reports: Path, seconds: Mapping[str, float]
) -> list[Outcome]:
    """Score a folder of reports; a missing one is a miss."""
    outcomes = []
    for truth in truths:
        path = reports / f"{truth.identity}.json"
        report = read_report(path) if path.exists() else None
        outcomes.append(score_case(truth, report, seconds.get(truth.identity)))
    return outcomes


def totals(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """All counts and medians; shares are pairs (of, out of)."""
    real = [item for item in outcomes if not item.truth.null]
    nulls = [item for item in outcomes if item.truth.null]
    hits = [hit for item in outcomes for hit in item.hits]
    plain = [hit for hit in hits if hit.is_plain]
    unknown = [item for item in real if any(hit.effect == UNKNOWN for hit in item.hits)]
    compared = [comparison for hit in hits for comparison in hit.comparisons]
    covered = [item.covered for item in compared if item.covered is not None]
    gaps = [_gap_closed(item) for item in real]
    ratios = [item.after / item.truth.oracle for item in real if item.after is not None]
    return {
        "cases": len(outcomes),
        "reports": sum(item.report is not None for item in outcomes),
        "exact": _share(hits, lambda hit: hit.exact),
        "named_anywhere": _share(hits, lambda hit: hit.named),
        "class": _share(hits, lambda hit: hit.alike),
        "exact_from_snr_25": _share(plain, lambda hit: hit.exact),
        "class_from_snr_25": _share(plain, lambda hit: hit.alike),
        "all_exact": _share(real, lambda item: all(hit.exact for hit in item.hits)),
        "verdict_right": _share(outcomes, lambda item: item.verdict_right),
        "null_right": _share(nulls, lambda item: item.verdict_right and not item.false),
        "false_on_nulls": sum(len(item.false) for item in nulls),
        "false_on_others": sum(len(item.false) for item in real),
        "unknown_recognised": _share(unknown, lambda item: any(h.exact for h in item.hits)),
        "unknown_misnamed": _share(unknown, lambda item: bool(item.false)),
        "confident_findings": sum(len(o.report.confident) for o in outcomes if o.report),
        "overconfident": sum(len(item.overconfident) for item in outcomes),
        "place": _mean([item.place for item in real if item.place is not None]),
        "parameter_error_median": _median([item.error for item in compared]),
        "intervals_covering": (sum(covered), len(covered)),
        "gap_closed_median": _median([gap for gap in gaps if gap is not None]),
        "oracle_ratio_median": _median(ratios),
        "within_oracle_aim": (sum(ratio <= ORACLE_AIM for ratio in ratios), len(ratios)),
        "seconds_median": _median([i.seconds for i in outcomes if i.seconds is not None]),
    }


def _share(items: Sequence[Any], true: Callable[[Any], bool]) -> tuple[int, int]:
    return sum(bool(true(item)) for item in items), len(items)


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _gap_closed(item: Outcome) -> float | None:
    """Share of the way from the simulation to the oracle, on the holdout."""
    gap = item.truth.before - item.truth.oracle
    return None if item.after is None or gap <= 0.0 else (item.truth.before - item.after) / gap


def by_group(outcomes: Sequence[Outcome]) -> dict[str, dict[str, Any]]:
    """Totals of each group."""
    groups = sorted({item.truth.group for item in outcomes})
    return {name: totals([o for o in outcomes if o.truth.group == name]) for name in groups}


@frozen
class Sighting:
    """One effect at its three sizes: how each was met."""

    effect: str
    met: Mapping[str, Hit]  # by name of size

    @property
    def limit(self) -> str | None:
        """The smallest size that was named exactly, with all larger ones."""
        found = None
        for size in SIZES:
            if size in self.met:
                if not self.met[size].exact:
                    break
                found = size
        return found


def sightings(outcomes: Sequence[Outcome]) -> list[Sighting]:
    """Detection limits: cases of one effect at a named size, by effect."""
    met: dict[str, dict[str, Hit]] = {}
    for outcome in outcomes:
        if outcome.truth.group == "sizes":
            for hit in outcome.hits:
                met.setdefault(hit.effect, {})[hit.size] = hit
    return [Sighting(effect, sizes) for effect, sizes in sorted(met.items())]


def confusion(outcomes: Sequence[Outcome]) -> dict[tuple[str, str], int]:
    """How often a true effect was called what; a null by its first false finding."""
    counts: dict[tuple[str, str], int] = {}
    for outcome in outcomes:
        pairs = [(hit.effect, hit.called) for hit in outcome.hits]
        if outcome.truth.null:
            pairs = [(NULL, outcome.false[0] if outcome.false else NOTHING)]
        for pair in pairs:
            counts[pair] = counts.get(pair, 0) + 1
    return counts
