"""A learnt term and the law that is like it, from robot_explained.yaml and the report beside it.

Nothing but numbers is taken from the files: names are those of our own tables, so that what is
written from them holds no text of theirs.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_power_model.files import load_yaml, read_text
from tomr_power_model.robot import Robot, read_description, robot_from_parameters
from tomr_power_model.unmodelled import Family, LearntTerm
from tomr_power_model.unmodelled.described import PREFIX
from tomr_reality_gap.explanation import Estimate
from tomr_reality_gap.fit.law_forms import LAWS, Law
from tomr_reality_gap.fit.laws import unit_of

_REPORT = "report.json"


@frozen
class LearntLaw:
    """A law with the parameters that were found."""

    law: Law
    family: type[Family]
    parameters: Mapping[str, Estimate]
    spacing: float  # of the term's table, along its first variable


def learnt_law(explained: Path, term: str = "", law: str = "") -> LearntLaw:
    """The named law of a term; by default the first of the only one.

    Raises InputError where there is no such term or law, or the report is another robot's.
    """
    values = read_description(explained)
    robot = robot_from_parameters(values, str(explained))
    chosen = _term(robot, values, term, str(explained))
    report = explained.with_name(_REPORT)
    laws = _laws_reported(report, chosen.family)
    family = chosen.family.family_id
    known = [name for name in laws if name in LAWS and family in LAWS[name].families]
    wanted = law or next(iter(known), "")
    if wanted not in known:
        listed = ", ".join(known) or "none"
        raise InputError(f"{report}: no law {wanted!r} of {family}: it has {listed}")
    found = LAWS[wanted]
    parameters = {
        name: _estimate(laws[wanted].get(name), unit_of(unit, chosen), f"{report}: {wanted}.{name}")
        for name, unit in found.units.items()
    }
    points = chosen.knots[0]
    return LearntLaw(found, chosen.family, parameters, float(points[1] - points[0]))


def _term(robot: Robot, values: Mapping[str, object], name: str, place: str) -> LearntTerm:
    """Terms stand in a robot in the order of their names' first keys."""
    keys = [key.removeprefix(PREFIX) for key in values if key.startswith(PREFIX)]
    names = list(dict.fromkeys(key.rpartition(".")[0] for key in keys))
    if not names:
        raise InputError(f"{place}: has no learnt term: explain a recording that shows one")
    if not name and len(names) > 1:
        raise InputError(f"{place}: has several learnt terms: give --term, one of {names}")
    if name and name not in names:
        raise InputError(f"{place}: has no learnt term {name!r}: give one of {names}")
    return robot.unmodelled[names.index(name) if name else 0]


def _laws_reported(report: Path, family: type[Family]) -> dict[str, Mapping[str, Any]]:
    """Parameters by law, of the report's finding that is of this family."""
    found = load_yaml(read_text(report), str(report))  # JSON is YAML
    try:
        learnt = [item["learnt"] for item in found["findings"] if "learnt" in item]
        return {
            str(law["law"]): dict(law["parameters"])
            for item in learnt
            if item["family"] == family.family_id
            for law in item["laws"]
        }
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(f"{report}: is no report of tomr_gap explain: give its folder") from None


def _estimate(given: Any, unit: str, place: str) -> Estimate:
    try:
        value, (low, high) = float(given["value"]), given["ci95"]
        found = Estimate(value, float(low), float(high), unit)
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"{place}: no value with an interval: explain the recordings anew"
        ) from None
    if not all(map(math.isfinite, (found.value, found.low, found.high))):
        raise InputError(f"{place}: its interval is not finite: explain the recordings anew")
    return found
