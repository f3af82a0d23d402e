"""A commissioning in lines for a terminal, and as JSON."""

import json
import math
from typing import Any

from attrs import asdict

from tomr_commission.alarm import AlarmLevel
from tomr_commission.bands import outside
from tomr_commission.commission import Commissioned
from tomr_commission.evidence import Decided


def lines(found: Commissioned) -> list[str]:
    """What a terminal shows."""
    level, outcome = found.outcome.level, found.outcome
    said = [f"{found.verdict}: {headline(found)}"]
    for reason in found.reasons:
        said += [f"  {reason.what}", f"    -> {reason.remedy}"]
    said += [
        f"robot: {outcome.explained['report']['sentence']}",
        f"alarm level: {level.caution:g} decades; {_expected(level)}",
        f"held out ({outcome.held_name}, {60 * outcome.held_hours:.1f} min): "
        f"{len(outcome.held_together.alarms)} false alarms, "
        f"{100 * decided_share(outcome.held_together):.0f} % of the time decided",
    ]
    said.append("smallest size found:")
    for floor in found.floors:
        delay = "" if floor.delay is None else f", after {floor.delay:.2f} s"
        name = f"; called {floor.called}" if floor.called else ""
        said.append(f"  {floor.kind}: {floor.words}{delay}{name}")
    return said


def headline(found: Commissioned) -> str:
    """The verdict in one sentence."""
    if found.is_go and not found.outcome.level.is_rate_known:
        return "commissioned; nothing speaks against it, but how often shoves alarm is not known"
    if found.is_go:
        return (
            f"commissioned for {found.request.false_alarms_per_hour:g} false alarms per hour; "
            "nothing speaks against it"
        )
    count = len(found.reasons)
    return f"{count} thing{'s' if count > 1 else ''} to mend first"


def _expected(level: AlarmLevel) -> str:
    if not level.is_rate_known:
        return "how many false alarms are to be expected is not known"
    return (
        f"expected {level.expected:.2g} false alarms per hour "
        f"(95 %: {level.low:.2g} to {level.high:.2g})"
    )


def decided_share(said: Decided) -> float:
    """Share of the ticks in which anything could be decided."""
    return 1.0 - said.undecided / max(said.ticks, 1)


def fields(found: Commissioned) -> dict[str, Any]:
    """All as plain values; numbers that are not finite become None."""
    outcome = found.outcome
    level = outcome.level
    value = {
        "verdict": found.verdict,
        "date": found.date,
        "robot": str(found.request.robot),
        "reasons": [asdict(reason) for reason in found.reasons],
        "sentence": outcome.explained["report"]["sentence"],
        "findings": outcome.explained["report"]["findings"],
        "unexplained_share": outcome.explained["report"]["unexplained_share"],
        "levels": outcome.explained["levels"],
        "bands": asdict(outcome.bands),
        "margin": found.margin,
        "regimes": [asdict(line) for line in found.regimes],
        "alarm": {
            "caution": level.caution,
            "wanted_per_hour": level.wanted,
            "needed": level.needed,
            "expected_per_hour": level.expected if level.is_rate_known else None,
            "ci95_per_hour": [level.low, level.high] if level.is_rate_known else None,
            "tails": [asdict(tail) for tail in level.tails],
            "simulated_hours": found.shoved.hours,
        },
        "small_faults": {
            "looked_for": found.driven.settings.small_faults,
            "gathered_in_healthy_driving": found.driven.gathered,
        },
        "held_out": {
            "name": outcome.held_name,
            "hours": outcome.held_hours,
            "false_alarms": [
                {"drive": drive.name, **asdict(alarm)}
                for drive, said in zip(outcome.held, outcome.held_said, strict=True)
                for alarm in said.alarms
            ],
            "decided": decided_share(outcome.held_together),
            "outside_bands": outside(outcome.held, outcome.bands),
        },
        "fitted": [
            {
                "name": drive.name,
                "hours": drive.hours,
                "false_alarms": [asdict(alarm) for alarm in said.alarms],
            }
            for drive, said in zip(outcome.fitted, outcome.fitted_said, strict=True)
        ],
        "floors": [asdict(floor) for floor in found.floors],
        "notes": list(found.notes),
        "trials": [asdict(trial) for trial in found.trials],
    }
    cleaned: dict[str, Any] = _finite(value)
    return cleaned


def as_json(found: Commissioned) -> str:
    """commission.json."""
    return json.dumps(fields(found), indent=2, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value
