"""What `diagnosis.py` prints: confusion, recall, precision, delays and false alarms."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.diagnosis.score import per_hour, poisson_interval

Codes = NDArray[np.int64]

# What a tick may be called: one of the paper's six, or a fault that is none of these.
NAMES = (*(state.name for state in STATES), "beyond these")


@frozen
class Onset:
    """A fault began to show."""

    state: int
    severity: float
    delay: float  # s, infinite if it was not named while it showed or half a second later


@frozen
class Outcome:
    """One drive as one classifier saw it; counts of ticks, rows true, columns named."""

    decisions: Codes  # (7, 7): healthy ticks and observable faults
    idle: Codes  # (7, 7): the observable ones of them with the faulty wheel idle
    unseen: Codes  # (7, 7): faults in force that are not observable
    by_severity: dict[str, tuple[int, int]]  # right, all
    onsets: tuple[Onset, ...] = ()
    alarms: tuple[int, ...] = ()  # faults named that were not there, while healthy
    excused: int = 0  # slip named where a healthy robot's wheel did slip
    healthy_seconds: float = 0.0


def report(sick: Sequence[Outcome], well: Sequence[Outcome]) -> dict[str, object]:
    """All figures of one classifier."""
    tables = np.array([outcome.decisions for outcome in (*sick, *well)])
    confusion = tables.sum(axis=0)
    faults = tables[:, 1:].copy()
    onsets = [onset for outcome in sick for onset in outcome.onsets]
    idle = _sum([outcome.idle for outcome in sick])
    severities: Counter[str] = Counter()
    right: Counter[str] = Counter()
    for outcome in sick:
        for name, (good, count) in outcome.by_severity.items():
            right[name] += good
            severities[name] += count
    return {
        "drives": {
            "faulty": len(sick),
            "fault_showed": sum(bool(outcome.onsets) for outcome in sick),
            "healthy": len(well),
        },
        "states": list(NAMES),
        "confusion_rows_true": confusion.tolist(),
        "recall": _shares(np.diag(confusion), confusion.sum(axis=1)),
        "precision": _shares(np.diag(confusion), confusion.sum(axis=0)),
        "observable_faults": _accuracy(faults, 1),
        "all_decisions": _accuracy(tables, 0),
        "observable_faults_by_use_of_the_wheel": {
            "in use": _share(confusion[1:] - idle[1:], 1),
            "idle": _share(idle[1:], 1),
        },
        "observable_faults_by_severity": {
            name: [round(right[name] / max(severities[name], 1), 5), severities[name]]
            for name in sorted(severities)
        },
        "faults_not_observable": _named(_sum([outcome.unseen for outcome in sick])),
        "delay_s": {"all": _delays(onsets), **_by_state(onsets)},
        "false_alarms": _alarms(well),
        "false_alarms_before_the_fault_of_faulty_drives": _alarms(sick),
    }


def _sum(tables: Sequence[Codes]) -> Codes:
    empty = np.zeros((len(NAMES), len(NAMES)), dtype=np.int64)
    return np.asarray(np.sum(tables, axis=0)) if tables else empty


def _shares(part: Codes, whole: Codes) -> list[float | None]:
    return [round(p / w, 5) if w else None for p, w in zip(part, whole, strict=True)]


def _share(rows: Codes, first: int) -> dict[str, float | int | None]:
    """Right share of confusion rows that start with that of a state."""
    right, total = int(np.trace(rows, offset=first)), int(rows.sum())
    return {"right": round(right / total, 5) if total else None, "decisions": total}


def _accuracy(tables: Codes, first: int) -> dict[str, object]:
    """Share of right decisions, and its 95 % interval from resampling whole drives."""
    right = np.trace(tables, offset=first, axis1=1, axis2=2)
    total = tables.sum(axis=(1, 2))
    random = np.random.default_rng(0)
    draws = random.integers(0, len(tables), (2000, len(tables)))
    sums = np.stack([right[draws].sum(axis=1), total[draws].sum(axis=1)])
    low, high = np.percentile(sums[0] / np.maximum(sums[1], 1), [2.5, 97.5])
    return {
        "right": round(int(right.sum()) / max(int(total.sum()), 1), 5),
        "ci95_by_drive": [round(float(low), 5), round(float(high), 5)],
        "decisions": int(total.sum()),
    }


def _named(table: Codes) -> dict[str, int]:
    """What was named while a fault was in force that could not be seen."""
    right = int(np.trace(table))
    nothing = int(table[:, 0].sum())
    return {
        "ticks": int(table.sum()),
        "no_fault_named": nothing,
        "still_or_already_named": right,
        "another_fault_named": int(table.sum()) - right - nothing,
    }


def _delays(onsets: Sequence[Onset]) -> dict[str, float | int | None]:
    if not onsets:
        return {"onsets": 0}
    delays = np.array([onset.delay for onset in onsets])
    median, late = (float(np.quantile(delays, q, method="higher")) for q in (0.5, 0.95))
    return {
        "onsets": len(delays),
        "never_named": int(np.isinf(delays).sum()),
        "median": round(median, 3) if np.isfinite(median) else None,
        "p95": round(late, 3) if np.isfinite(late) else None,
    }


def _by_state(onsets: Sequence[Onset]) -> dict[str, dict[str, float | int | None]]:
    return {
        state.name: _delays([onset for onset in onsets if STATES[onset.state] is state])
        for state in STATES[1:]
    }


def _alarms(outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Faults named in healthy driving, per hour with the exact interval of a Poisson count."""
    hours = sum(outcome.healthy_seconds for outcome in outcomes) / 3600.0
    kinds = Counter(NAMES[state] for outcome in outcomes for state in outcome.alarms)
    count = sum(kinds.values())
    low, high = poisson_interval(count)
    return {
        "count": count,
        "kinds": dict(kinds),
        "hours": round(hours, 3),
        "per_hour": per_hour(count, hours),
        "ci95_per_hour": [per_hour(low, hours), per_hour(high, hours)],
        "slip_named_where_a_wheel_slipped": sum(outcome.excused for outcome in outcomes),
    }


def publish(found: object, file: Path | None) -> None:
    """Print a report as JSON, and write it to a file as well if one is given."""
    text = json.dumps(found, indent=2)
    print(text)
    if file is not None:
        file.write_text(text + "\n", encoding="utf-8")
