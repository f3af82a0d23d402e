"""Diagnoses held against labels: delays, false alarms, isolability, detection floor.

Every sampling phase of a recording counts as a recording of its own in shares and delays; they are
not independent, so intervals are those of as many cases as there are recordings.
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.stats import beta, binom, chi2

from tomr_fault_diag.classifier.states import FAULTLESS, UNKNOWN
from tomr_fault_diag.diagnosis.labels import Label, split_state
from tomr_fault_diag.diagnosis.summary import UNDECIDED
from tomr_fault_diag.diagnosis.track import Said, Track
from tomr_power_model.messages.plain import NANOSECONDS

SETTLING = 1.0  # s after an onset that count as delay, not as decisions
LATE = 0.5  # s after an end in which naming still counts
RECOVERY = 3.0  # s after an end that count for nothing
MERGED = 1.0  # s: alarms that are closer to one another are one
NOTHING = "nothing decided"
RIGHT, UNKNOWN_NAMED, MISSED, WRONG = "right", "unknown", "normal_or_nothing", "another_named"
_FLOOR = 0.9  # share of faults that must be named
_OTHER_WHEEL = " (other wheel)"

Flags = NDArray[np.bool_]


@frozen
class Case:
    """One fault as one phase saw it."""

    kind: str
    severity: float | None
    delay: float  # s from its onset to a right state, infinite where there is none
    delay_any: float  # s to any state in which something is wrong
    named: Counter[str]  # ticks in which it could be seen, by what was named
    verdicts: Counter[str]  # the same ticks by RIGHT, UNKNOWN_NAMED, MISSED, WRONG

    @property
    def majority(self) -> str:
        """What was named most."""
        return self.named.most_common(1)[0][0] if self.named else NOTHING

    @property
    def is_found(self) -> bool:
        return math.isfinite(self.delay)


@frozen
class Seen:
    """One recording in one phase."""

    cases: tuple[Case, ...]
    alarms: tuple[str, ...]  # states named wrongly while nothing was wrong
    healthy_seconds: float
    phase: int
    phases: int


def seen(track: Track, start_ns: int, labels: Sequence[Label], phase: tuple[int, int]) -> Seen:
    """Hold a track against what is true of its recording; `phase`: its number, and of how many."""
    time = (track.stamp_ns - start_ns) / NANOSECONDS
    period = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    faults = [label.times(start_ns) for label in labels if label.is_fault]
    healthy = np.ones(len(time), dtype=bool)
    for label in faults:
        end = math.inf if label.end is None else label.end + RECOVERY
        healthy &= ~((time >= label.onset) & (time < end))
        if label.begun is not None:
            named = np.array([label.is_right(*said) for said in track.said], dtype=bool)
            healthy &= ~(named & (time >= label.begun) & (time < label.onset))
    alarm = np.array([said.state not in FAULTLESS for said in track.said], dtype=bool)
    starts = _runs(alarm & healthy, time)
    return Seen(
        tuple(_case(label, track.said, time, alarm) for label in faults),
        tuple(track.said[tick].state for tick in starts),
        float(healthy.sum()) * period,
        *phase,
    )


def _runs(flags: Flags, time: NDArray[np.float64]) -> list[int]:
    """First ticks of runs of flags, short gaps closed."""
    ticks = np.flatnonzero(flags)
    starts = [
        n for n in range(len(ticks)) if n == 0 or time[ticks[n]] - time[ticks[n - 1]] > MERGED
    ]
    return [int(ticks[n]) for n in starts]


def _case(label: Label, said: Sequence[Said], time: NDArray[np.float64], alarm: Flags) -> Case:
    end = math.inf if label.end is None else label.end
    right = np.array([label.is_right(*item) for item in said], dtype=bool)
    inside = (time >= label.onset) & (time <= end + LATE)
    counted = (time >= label.onset + SETTLING) & (time <= end)
    if label.observable:
        counted &= np.any([(time >= low) & (time < high) for low, high in label.observable], axis=0)
    ticks = [int(tick) for tick in np.flatnonzero(counted)]
    return Case(
        label.title,
        label.severity,
        _first(time, inside & right, label.onset),
        _first(time, inside & alarm, label.onset),
        Counter(column(label, said[tick]) for tick in ticks),
        Counter(_verdict(label, said[tick]) for tick in ticks),
    )


def _verdict(label: Label, said: Said) -> str:
    if label.is_right(*said):
        return RIGHT
    if said.state == UNKNOWN.name:
        return UNKNOWN_NAMED
    return MISSED if said.state in FAULTLESS or said.state in UNDECIDED else WRONG


def column(label: Label, said: Said) -> str:
    """What a tick counts as in the isolability matrix."""
    if said.state in UNDECIDED:
        return NOTHING
    name, own = split_state(said.state)
    number = own or said.wheel
    other = bool(label.wheel and number and number != label.wheel)
    return name + _OTHER_WHEEL if other else name


def _first(time: NDArray[np.float64], flags: Flags, onset: float) -> float:
    ticks = np.flatnonzero(flags)
    return float(time[ticks[0]] - onset) if len(ticks) else math.inf


@frozen
class Scores:
    """Everything of all recordings, ready to be printed."""

    seen: tuple[Seen, ...]

    def as_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        cases = [case for item in self.seen for case in item.cases]
        kinds = sorted({case.kind for case in cases})
        return {
            "false_alarms": self._alarms(),
            "faults": {
                "all": self._figures(cases),
                **{kind: self._figures([c for c in cases if c.kind == kind]) for kind in kinds},
            },
            "isolability": {
                kind: dict(_total(c.named for c in cases if c.kind == kind).most_common())
                for kind in kinds
            },
            "isolability_by_fault": {
                kind: dict(Counter(c.majority for c in cases if c.kind == kind).most_common())
                for kind in kinds
            },
            "detection_floor": {
                kind: floor for kind in kinds if (floor := _floor(cases, kind)) is not None
            },
        }

    @property
    def _phases(self) -> int:
        return max((item.phases for item in self.seen), default=1)

    def _alarms(self) -> dict[str, Any]:
        by_phase: Counter[int] = Counter()
        for item in self.seen:
            by_phase[item.phase] += len(item.alarms)
        hours = sum(item.healthy_seconds for item in self.seen) / 3600.0 / self._phases
        counts = [by_phase[number] for number in range(self._phases)]
        low, high = poisson_interval(min(counts))[0], poisson_interval(max(counts))[1]
        states = Counter(state for item in self.seen for state in item.alarms)
        mean = sum(counts) / len(counts)
        return {
            "count_by_phase": counts,
            "states": dict(states.most_common()),
            "hours": round(hours, 4),
            "per_hour": per_hour(mean, hours),
            "ci95_per_hour": [per_hour(low, hours), per_hour(high, hours)],
        }

    def _figures(self, cases: Sequence[Case]) -> dict[str, Any]:
        count, found = len(cases), sum(case.is_found for case in cases)
        verdicts = _total(case.verdicts for case in cases)
        return {
            "count": count // self._phases,
            "found": with_interval(found, count, self._phases),
            "any_alarm": with_interval(
                sum(math.isfinite(case.delay_any) for case in cases), count, self._phases
            ),
            "delay_s": delays([case.delay for case in cases], self._phases),
            "delay_any_s": delays([case.delay_any for case in cases], self._phases),
            "time": {
                name: _part(verdicts[name], verdicts.total())
                for name in (RIGHT, UNKNOWN_NAMED, MISSED, WRONG)
            },
        }


def _total(counters: Iterable[Counter[str]]) -> Counter[str]:
    total: Counter[str] = Counter()
    for counter in counters:
        total.update(counter)
    return total


def _part(part: int, whole: int) -> float | None:
    return round(part / whole, 4) if whole else None


def per_hour(count: float, hours: float) -> float | None:
    """A rate; None of no time at all."""
    return round(count / hours, 3) if hours else None


def with_interval(part: int, whole: int, phases: int = 1) -> dict[str, Any]:
    """A share with its exact 95 % interval, for as many cases as there are recordings."""
    if not whole:
        return {"share": None, "ci95": None}
    low, high = binomial_interval(part / phases, whole / phases)
    return {"share": round(part / whole, 4), "ci95": [round(low, 4), round(high, 4)]}


def delays(values: Sequence[float], phases: int = 1) -> dict[str, Any]:
    """Median and 95th percentile with 95 % intervals from order statistics; null: never named."""
    if not values:
        return {}
    ordered = np.sort(values)

    def quantile(share: float) -> list[float | None]:
        count = len(ordered) / phases
        low, high = (binom.ppf(p, round(count), share) / count for p in (0.025, 0.975))
        return [
            _finite(np.quantile(ordered, min(1.0, q), method="higher")) for q in (share, low, high)
        ]

    median, late = quantile(0.5), quantile(0.95)
    return {
        "median": _finite(np.median(ordered)),
        "median_ci95": median[1:],
        "p95": late[0],
        "p95_ci95": late[1:],
        "never": int(np.isinf(ordered).sum()),
    }


def _finite(value: float) -> float | None:
    return round(float(value), 3) if math.isfinite(value) else None


def _floor(cases: Sequence[Case], kind: str) -> dict[str, Any] | None:
    """The least severity from which on nine of ten faults are named right."""
    graded = sorted(
        (case.severity, case.is_found)
        for case in cases
        if case.kind == kind and case.severity is not None
    )
    if len({severity for severity, _ in graded}) < 2:
        return None
    floor = None
    for place in range(len(graded)):
        found = [is_found for _, is_found in graded[place:]]
        if sum(found) / len(found) >= _FLOOR and found[0]:
            floor = graded[place][0]
            break
    return {"severity": floor, "least_tried": graded[0][0], "tried": len(graded)}


def poisson_interval(count: float) -> tuple[float, float]:
    """Exact 95 % interval of the mean of which a count is one sample."""
    low = float(chi2.ppf(0.025, 2 * count)) / 2.0 if count else 0.0
    return low, float(chi2.ppf(0.975, 2 * count + 2)) / 2.0


def binomial_interval(part: float, whole: float) -> tuple[float, float]:
    """Exact 95 % interval (Clopper-Pearson) of a share."""
    low = float(beta.ppf(0.025, part, whole - part + 1)) if part > 0 else 0.0
    high = float(beta.ppf(0.975, part + 1, whole - part)) if part < whole else 1.0
    return low, high
