"""How effects that no vocabulary holds were met: what they depend on, where, how they predict."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from attrs import frozen

from concealed.claims import UNKNOWN, Finding, Report, TrueEffect, Truth, read_report


@frozen
class Kind:
    """What is right to say of an effect without a name."""

    families: tuple[str, ...]  # of learnt terms that depend on what it depends on
    laws: tuple[str, ...] = ()  # that are its own; none: no short law is
    repeats: bool = True  # on another drive


_BY_SPEED = ("torque.speed", "torque.signed_speed")
KINDS: Mapping[str, Kind] = {
    "x.two_harmonics": Kind(("torque.angle",)),
    "x.chipped_tooth": Kind(("torque.angle", "torque.tight_angle"), ("bump",)),
    "x.running_in": Kind(("torque.time",), ("exponential",), False),
    "x.striped_floor": Kind(("torque.place",), ("stripes",)),
    "x.cubic": Kind(_BY_SPEED, ("power law",)),
    "x.intermittent": Kind(("torque.time",), (), False),
    "x.sticky_start": Kind(
        ("torque.from_rest", "torque.turned", "torque.since_stand"), ("exponential",)
    ),
    "x.overload": Kind(("driver.current",), ("square of the excess",)),
    "x.tether": Kind(("force.place",), ("spring",)),
    "x.wind": Kind(("force.velocity",), ("wind",)),
    "x.gust": Kind(("force.time",), (), False),
    "x.sticky_place": Kind(("torque.place",), ("patch",)),
    "x.consumer": Kind(("supply.time",), (), False),
    "x.fast_driver": Kind(("driver.speed",), ("square beyond a threshold",)),
    "x.after_stand": Kind(("torque.since_stand", "torque.turned"), ("exponential",)),
    "x.detent": Kind(_BY_SPEED),
}


@frozen
class Met:
    """How one of them was met; None where the question does not arise."""

    truth: Truth
    recognised: bool
    named: str  # family and place, or what it was called
    placed: bool  # the right variable at the right place
    share: float | None  # of the possible improvement on the held-out drive
    repeats: bool | None  # said to come and go where it does
    law: bool | None  # a right law among those that are reported


def met_all(truths: Sequence[Truth], reports: Path) -> list[Met]:
    """Of all cases with one effect of a known kind and a report."""
    found = []
    for truth in truths:
        natures = [item for item in truth.effects if item.nature in KINDS]
        path = reports / f"{truth.identity}.json"
        if len(natures) == 1 and path.exists():
            found.append(met(truth, natures[0], read_report(path)))
    return found


def met(truth: Truth, true: TrueEffect, report: Report) -> Met:
    """How one case's effect was met."""
    kind = KINDS[true.nature]
    unknown = next((item for item in report.confident if item.effect == UNKNOWN), None)
    learnt: Mapping[str, Any] = (unknown and unknown.learnt) or {}
    family, places = learnt.get("family"), unknown.places if unknown else frozenset()
    return Met(
        truth=truth,
        recognised=unknown is not None,
        named=f"{family} at {', '.join(sorted(places))}" if unknown else _called(report.confident),
        placed=family in kind.families and places == true.places,
        share=_share(truth, report) if kind.repeats else None,
        repeats=None if kind.repeats else learnt.get("repeatable") is False,
        law=any(item["law"] in kind.laws for item in learnt.get("laws", ())) if kind.laws else None,
    )


def _called(findings: Sequence[Finding]) -> str:
    return ", ".join(item.effect for item in findings) or "match"


def _share(truth: Truth, report: Report) -> float | None:
    """Nothing where a drive is predicted worse; None where there is nothing to gain."""
    possible = truth.before - truth.oracle
    after = next((item.nrmse_after for item in report.findings if item.nrmse_after), truth.before)
    return (truth.before - after) / possible if possible > 0.0 else None


def figures(found: Sequence[Met]) -> dict[str, tuple[int, int] | float | None]:
    """The figures of all, counts as (of them, all)."""

    def counted(values: Sequence[bool | None]) -> tuple[int, int]:
        known = [value for value in values if value is not None]
        return sum(known), len(known)

    shares = [item.share for item in found if item.share is not None]
    return {
        "recognised": counted([item.recognised for item in found]),
        "variable and place right": counted([item.placed for item in found]),
        "share of the possible improvement, median": median(shares) if shares else None,
        "not repeatable, said so": counted([item.repeats for item in found]),
        "a right law among those reported": counted([item.law for item in found]),
    }
