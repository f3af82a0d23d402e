"""The report for programs: report.json."""

import json
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tomr_reality_gap.explanation import Estimate, Explanation, Finding, Learnt, Score, Shape
from tomr_reality_gap.fit.laws import words_of
from tomr_reality_gap.report.words import decimals

Value = object  # what json.dumps takes

_DIGITS = 3  # significant digits of an interval's half width


def report_json(explanation: Explanation) -> str:
    """The report as text."""
    return json.dumps(report_fields(explanation), indent=2, allow_nan=False) + "\n"


def report_fields(explanation: Explanation) -> dict[str, Value]:
    """The report as plain dictionaries; numbers that are not finite become None."""
    holdout = _score(explanation.score)
    nrmse = holdout and {key: holdout[key] for key in ("nrmse_before", "nrmse_after")}
    return {
        "verdict": explanation.verdict,
        # The errors on held-out data are those of all findings together.
        "findings": [{**_finding(item), "holdout": nrmse} for item in explanation.findings],
        "unexplained_share": _number(explanation.unexplained_share),
        "sentence": explanation.sentence,
        "holdout": holdout,
        "smallest_detectable": [
            {"effect": effect, "where": where, "size": size}
            for effect, where, size in explanation.detection_limits
        ],
        "whiteness": {
            channel: {"lag1_before": _number(before, 3), "lag1_after": _number(after, 3)}
            for channel, (before, after) in explanation.whiteness.items()
        },
        "alignment": dict(explanation.alignment),
        "notes": list(explanation.notes),
        "recordings": [str(path) for path in explanation.recordings],
    }


def _finding(finding: Finding) -> dict[str, Value]:
    located = finding.located
    fields: dict[str, Value] = {
        "effect": finding.effect,
        "where": list(finding.where),
        "located": {
            "share_of_mismatch": _number(located.share, 3),
            "regime": located.regime,
            "intervals_s": [[_number(a, 2), _number(b, 2)] for a, b in located.intervals],
            "channels": {name: _number(share, 3) for name, share in located.channels.items()},
        },
        "parameters": {name: _estimate(item) for name, item in finding.parameters.items()},
        "rivals": [
            {
                "effect": rival.effect,
                "where": list(rival.where),
                "log_odds": _number(rival.log_odds, 2),
                "experiment": rival.experiment,
            }
            for rival in finding.rivals
        ],
        "confidence": _number(finding.confidence, 3),
        "log_evidence": _number(finding.evidence, 1),
    }
    if finding.shape is not None:
        fields["shape"] = _shape(finding.shape)
    if finding.learnt is not None:
        fields["learnt"] = _learnt(finding.learnt)
    return fields


def _learnt(learnt: Learnt) -> Mapping[str, Value]:
    term = learnt.term
    return {
        "family": term.family.family_id,
        "words": term.family.words,
        "look_at": term.family.look,
        "variables": [axis.title for axis in term.family.axes],
        "repeatable": learnt.is_repeatable,
        "laws": [
            {
                "law": law.name,
                "words": words_of(law),
                "parameters": {name: _estimate(item) for name, item in law.parameters.items()},
                "share_of_table": _number(law.share, 3),
            }
            for law in learnt.laws
        ],
        "share_predicted": _number(learnt.share, 3),
        "unit": term.unit,
        "knots": [[_number(at, 6) for at in points] for points in term.knots],
        "values": [[_number(value, 6) for value in row] for row in term.values],
        "sigma": [[_number(value, 6) for value in row] for row in learnt.sigma],
    }


def _estimate(estimate: Estimate) -> Mapping[str, Value]:
    places = decimals(estimate, _DIGITS)
    ends = [_number(estimate.low, places), _number(estimate.high, places)]
    # An end that is not known leaves no interval to be compared with.
    return {
        "value": _number(estimate.value, places),
        "ci95": [None, None] if None in ends else ends,
        "unit": estimate.unit,
    }


def _score(score: Score | None) -> Mapping[str, Value] | None:
    if score is None:
        return None
    return {
        "nrmse_before": _number(score.nrmse_before),
        "nrmse_after": _number(score.nrmse_after),
        "accuracy_before": _number(score.accuracy_before),
        "accuracy_after": _number(score.accuracy_after),
        "quantity": score.quantity,
    }


def _shape(shape: Shape) -> Mapping[str, Value]:
    def rounded(values: NDArray[np.float64]) -> list[float | None]:
        return [_number(float(f"{value:.5g}"), 12) for value in values]

    return {
        "variable": shape.variable,
        "wheel": shape.wheel,
        "unit": shape.unit,
        "at": rounded(shape.at),
        "value": rounded(shape.value),
        "low": rounded(shape.low),
        "high": rounded(shape.high),
    }


def _number(value: float, places: int = 5) -> float | None:
    return round(float(value), places) if math.isfinite(value) else None
