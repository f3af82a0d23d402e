"""All cases on one page, and as JSON."""

import json
from collections import Counter
from collections.abc import Sequence

from tomr_reality_gap.fleet.outcome import BAD_INPUT, FAILED, Outcome
from tomr_reality_gap.report.html import rendered

HTML, JSON = "overview.html", "overview.json"
_VERDICTS = (FAILED, BAD_INPUT, "mismatch", "match")  # in the order of their need to be seen


def overview_page(outcomes: Sequence[Outcome]) -> str:
    """The page as HTML; it links to <case>/report.html."""
    return rendered(
        "fleet/overview.html.j2",
        sentence=counted(outcomes),
        outcomes=in_order(outcomes),
        effects=_by_effect(in_order(outcomes)),
    )


def overview_json(outcomes: Sequence[Outcome]) -> str:
    """The same for programs, by case."""
    return json.dumps({item.name: _fields(item) for item in in_order(outcomes)}, indent=2) + "\n"


def in_order(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """What could not be explained first, then the worst mismatches."""
    return sorted(
        outcomes,
        key=lambda item: (
            _VERDICTS.index(item.verdict),
            -item.score.nrmse_before if item.score is not None else 0.0,
            item.name,
        ),
    )


def counted(outcomes: Sequence[Outcome]) -> str:
    """E.g. `12 cases: 8 mismatch, 4 match`."""
    count = Counter(item.verdict for item in outcomes)
    parts = [f"{count[verdict]} {verdict}" for verdict in _VERDICTS if count[verdict]]
    return f"{len(outcomes)} case{'s' * (len(outcomes) != 1)}: {', '.join(parts)}"


def _by_effect(outcomes: Sequence[Outcome]) -> list[tuple[str, list[str]]]:
    """Names of the cases in which each effect was found, the most frequent first."""
    cases: dict[str, list[str]] = {}
    for item in outcomes:
        for effect in dict.fromkeys(found.effect for found in item.findings):
            cases.setdefault(effect, []).append(item.name)
    return sorted(cases.items(), key=lambda one: (-len(one[1]), one[0]))


def _fields(item: Outcome) -> dict[str, object]:
    score = item.score
    return {
        "verdict": item.verdict,
        "sentence": item.sentence,
        "findings": [
            {"effect": found.effect, "where": list(found.where), "confidence": found.confidence}
            for found in item.findings
        ],
        "holdout": None
        if score is None
        else {"nrmse_before": score.nrmse_before, "nrmse_after": score.nrmse_after},
        "unexplained_share": item.unexplained,
        "seconds": round(item.seconds, 1),
    }
