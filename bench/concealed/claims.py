"""Reports and truths as the scorer reads them: findings, places, values."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from attrs import frozen

from tomr_power_model.errors import InputError

WHEELS = frozenset({"wheel_1_joint", "wheel_2_joint", "wheel_3_joint"})
ALL_WHEELS = "all_wheels"
PARAMETER = "parameter."
UNKNOWN = "unknown"
CONFIDENT = 0.5
Places = frozenset[str]


@frozen
class Value:
    """A reported number with its 95 % interval, where there is one."""

    value: float
    interval: tuple[float, float] | None = None


@frozen
class Finding:
    """One finding of a report."""

    effect: str
    places: Places
    confidence: float
    rivals: frozenset[str]
    values: Mapping[str, Value]
    nrmse_after: float | None
    learnt: Mapping[str, Any] | None = None  # of an effect without a name

    @property
    def confident(self) -> bool:
        return self.confidence >= CONFIDENT


@frozen
class Report:
    """What the tool said of a case."""

    verdict: str
    findings: tuple[Finding, ...]

    @property
    def confident(self) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.confident)


def places_of(where: str | Sequence[str] | None) -> Places:
    """Places as a set, `all_wheels` spelt out."""
    named = frozenset([where] if isinstance(where, str) else where or ())
    return (named - {ALL_WHEELS}) | WHEELS if ALL_WHEELS in named else named


def read_report(path: Path) -> Report:
    """Read a report. Raises InputError where it is none."""
    try:
        return report_of(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path}: is no report of a reality gap ({type(error).__name__}: {error}): "
            "see interfaces.md"
        ) from None


def report_of(document: Mapping[str, Any]) -> Report:
    """A report from its JSON."""
    findings = tuple(_finding(item) for item in document.get("findings") or ())
    return Report(str(document.get("verdict", "-")), findings)


def _finding(item: Mapping[str, Any]) -> Finding:
    effect, places = str(item["effect"]), places_of(item.get("where"))
    for wheel in WHEELS:
        # parameter.motor.wheel_2_joint.resistance is parameter.motor.resistance at wheel 2.
        if f".{wheel}." in effect:
            effect, places = effect.replace(f".{wheel}.", "."), frozenset({wheel})
    confidence = item.get("confidence")
    after = (item.get("holdout") or {}).get("nrmse_after")
    return Finding(
        effect=effect,
        places=places,
        confidence=1.0 if confidence is None else float(confidence),
        rivals=frozenset(
            rival if isinstance(rival, str) else str(rival.get("effect", ""))
            for rival in item.get("rivals") or ()
        ),
        values=_values(item.get("parameters") or {}),
        nrmse_after=None if after is None else float(after),
        learnt=item.get("learnt"),
    )


def _values(parameters: Mapping[str, Any]) -> dict[str, Value]:
    found = {}
    for key, given in parameters.items():
        if isinstance(given, int | float):
            found[key] = Value(float(given))
        elif given.get("value") is not None:
            low, high = given.get("ci95") or (None, None)
            interval = None if low is None or high is None else (float(low), float(high))
            found[key] = Value(float(given["value"]), interval)
    return found


@frozen
class TrueEffect:
    """One concealed effect."""

    effect: str
    places: Places
    values: Mapping[str, float]
    size: str  # of its recipe, or empty
    snr: float | None  # per power sample
    nature: str = ""  # of one without a name
    strength: float | None = None  # signal to noise of all its samples together


@frozen
class Truth:
    """What was concealed in a case."""

    identity: str
    name: str
    group: str
    null: bool
    barely_excited: bool
    effects: tuple[TrueEffect, ...]
    nominal: Mapping[str, Any]
    deviations: Mapping[str, float | list[float]]
    before: float  # NRMSE on the holdout, without the truth
    oracle: float  # with it


def read_truths(folder: Path) -> list[Truth]:
    """All truths of a folder, by identity. Raises InputError if there are none."""
    truths = [
        truth_of(json.loads(path.read_text(encoding="utf-8")))
        for path in sorted(folder.glob("*.json"))
    ]
    if not truths:
        raise InputError(f"{folder}: holds no truths: give the folder truth/ of a set of cases")
    return truths


def truth_of(document: Mapping[str, Any]) -> Truth:
    """A truth from its JSON; the practice set's or ours."""
    oracle = document["oracle"]
    holdout = oracle["real_holdout"].get("wheels") or oracle["real_holdout"]["total"]
    real = oracle.get("real", {})
    per_sample, whole = real.get("snr_per_sample", {}), real.get("snr_by_effect", {})
    effects = tuple(
        TrueEffect(
            effect=item["effect"],
            places=places_of(item["where"]),
            values={key: float(value["value"]) for key, value in item["parameters"].items()},
            size=str(item.get("size", "")),
            snr=per_sample.get(item.get("id")),
            nature=str(item.get("nature", "")),
            strength=whole.get(item.get("id")),
        )
        for item in document["effects"]
    )
    return Truth(
        identity=document["id"],
        name=document.get("name") or _summary(document["effects"]),
        group=document.get("group", document["kind"]),
        null=bool(document["null"]),
        barely_excited=bool(document["barely_excited"]),
        effects=effects,
        nominal=document["nominal"],
        deviations=document["deviations"],
        before=float(holdout["nrmse_before"]),
        oracle=float(holdout["nrmse_after"]),
    )


def _summary(effects: Sequence[Mapping[str, Any]]) -> str:
    """Effects in few words, for cases that have no name."""
    return " + ".join(item.get("nature", item["effect"]) for item in effects) or "(null)"
