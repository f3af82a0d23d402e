"""Each method's answer to a case, held against the truth with the scorer of tomr_gap."""

import json
import math
from pathlib import Path
from typing import Any

from attrs import frozen
from concealed.claims import ALL_WHEELS, PARAMETER, WHEELS, Finding, Places, Truth, Value, places_of
from concealed.likeness import actual_value, is_true
from concealed.score import score_all

from others.library import allowed, shape_of
from others.refit import Fit, Refit
from others.sparse import Equation, Sparse

_JOINTS = sorted(WHEELS)
_TOLERANCE = 0.02  # by which any value may be off its description
_LISTED = 3  # parameters in a line


@frozen
class Verdict:
    """What a method claims of one case, and how much of that is so."""

    after: float | None  # NRMSE on the holdout
    claims: int  # parameters said to be off by more than the tolerance; terms; findings
    false: tuple[str, ...]  # claims that are not so
    named: int | None  # concealed effects that it names, or has a term for, where they are
    says: str


def finding_of(fit: Fit) -> Finding:
    """A refitted parameter as a finding of a report."""
    own = next((wheel for wheel in _JOINTS if f".{wheel}." in fit.key), None)
    general = fit.key if own is None else fit.key.replace(f".{own}.", ".")
    places = places_of(own or (ALL_WHEELS if general.startswith("motor.") else "body"))
    interval = fit.value - fit.half_width, fit.value + fit.half_width
    value = {"value": Value(fit.value, interval)}
    return Finding(PARAMETER + general, places, 1.0, frozenset(), value, None)


def excluded(truth: Truth, found: Refit) -> dict[str, float]:
    """Parameters whose interval leaves out what the part really is, and by how many half-widths.

    A payload is mass that is truly there.
    """
    payload = sum(e.values["mass"] for e in truth.effects if e.effect == "body.payload_mass")
    missed = {}
    for fit in found.fits:
        actual = actual_value(finding_of(fit), truth)
        if actual is not None:
            off = abs(fit.value - actual - (payload if fit.key == "robot.mass" else 0.0))
            if off > fit.half_width:
                missed[fit.key] = off / fit.half_width
    return missed


def score_refit(truth: Truth, found: Refit) -> Verdict:
    """Hold refitted parameters against what the parts really are."""
    claimed = [fit for fit in found.fits if _surely_moved(fit) > _TOLERANCE]
    claimed.sort(key=_surely_moved, reverse=True)
    bounded = sum(fit.at_bound for fit in found.fits)
    listed = [f"{fit.key} {_percent(fit)}" for fit in claimed[:_LISTED]]
    return Verdict(
        after=found.after,
        claims=len(claimed),
        false=tuple(fit.key for fit in claimed if not is_true(finding_of(fit), truth)),
        named=None,
        says="; ".join([f"{bounded} at a bound" if bounded else "no issues detected", *listed]),
    )


def _surely_moved(fit: Fit) -> float:
    """By which share of the described value at least, with 95 %."""
    return (abs(fit.value - fit.nominal) - fit.half_width) / abs(fit.nominal)


def _percent(fit: Fit) -> str:
    share, width = (100.0 * x / fit.nominal for x in (fit.value - fit.nominal, fit.half_width))
    return f"{share:+.0f} % +- {width:.1f}" if math.isfinite(width) else f"{share:+.0f} %"


def score_sparse(truth: Truth, found: Sparse) -> Verdict:
    """Hold the terms of equations against those that concealed effects or deviations bring."""
    deviations = allowed(PARAMETER + key for key in truth.deviations)
    false: list[str] = []
    for equation in found.equations:
        here = [item.effect for item in truth.effects if _shows(item.places, equation)]
        fine = deviations | allowed(here)
        false += [f"{term} at {equation.channel}" for term in equation.terms if term not in fine]
    named = sum(
        any(
            _shows(item.places, equation) and shape_of(item.effect)[0] & set(equation.terms)
            for equation in found.equations
        )
        for item in truth.effects
    )
    said = [f"{e.channel}: {_signed(e)}" for e in found.equations]
    claims = sum(len(equation.terms) for equation in found.equations)
    return Verdict(found.after, claims, tuple(false), named, "; ".join(said))


def _shows(places: Places, equation: Equation) -> bool:
    """Whether an effect shows in an equation; body and supply show in all."""
    return equation.wheel is None or not places <= WHEELS or _JOINTS[equation.wheel] in places


def _signed(equation: Equation) -> str:
    return " ".join(f"{x:+.2g} {term}" for term, x in equation.terms.items()) or "nothing"


def score_reported(truth: Truth, reports: Path) -> Verdict:
    """What tomr_gap says of a case, scored as in bench/concealed.py."""
    (outcome,) = score_all([truth], reports, {})
    path = reports / f"{truth.identity}.json"
    document: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.exists() else {}
    return Verdict(
        after=(document.get("holdout") or {}).get("nrmse_after", outcome.after),
        claims=len(outcome.report.confident) if outcome.report else 0,
        false=outcome.false,
        named=sum(hit.exact for hit in outcome.hits),
        says=document.get("sentence", "(no report)"),
    )


@frozen
class Row:
    """One case, as all methods see it."""

    identity: str
    name: str
    null: bool
    effects: int
    before: float  # NRMSE of the simulation as described on the holdout
    oracle: float  # of the plant with the true values
    parameters: int  # refitted
    excluded: dict[str, float]  # refitted parameters whose interval misses the truth, half-widths
    verdicts: dict[str, Verdict]  # by method


def row_of(truth: Truth, refitted: Refit, regressed: Sparse, reports: Path) -> Row:
    """Score all answers to a case."""
    return Row(
        identity=truth.identity,
        name=truth.name,
        null=truth.null,
        effects=len(truth.effects),
        before=refitted.before,
        oracle=truth.oracle,
        parameters=len(refitted.fits),
        excluded=excluded(truth, refitted),
        verdicts={
            "refit": score_refit(truth, refitted),
            "PySINDy": score_sparse(truth, regressed),
            "tomr_gap": score_reported(truth, reports),
        },
    )
