"""What was found, as lines for a terminal and as JSON."""

from collections.abc import Iterator, Sequence
from typing import Any

from attrs import asdict

from tomr_fault_diag.classifier.advice import check_first
from tomr_fault_diag.diagnosis.replayed import Failed, Phase, Replayed
from tomr_fault_diag.diagnosis.summary import Episode, Summary
from tomr_power_model.errors import counted, one_line
from tomr_power_model.messages.plain import NANOSECONDS


def seconds(stamp_ns: int, start_ns: int) -> float:
    """Time after the first message [s]."""
    return (stamp_ns - start_ns) / NANOSECONDS


def summary_lines(summary: Summary, start_ns: int) -> Iterator[str]:
    """One phase of a recording, in full."""
    yield f"{summary.ticks} decisions"
    for name, share in summary.shares.items():
        yield f"  {100 * share:5.1f} %  {name}"
    stale = max(summary.stale_shares)
    if stale:
        yield f"  an input of a residual was missing in up to {100 * stale:.1f} % of the decisions"
    for change in summary.conditions:
        yield f"  changed: {change.words}"
    for episode in summary.episodes:
        since, begin, end = (
            seconds(stamp, start_ns)
            for stamp in (episode.since_ns, episode.start_ns, episode.end_ns)
        )
        earlier = f", since {since:.2f} s" if episode.is_fault and since < begin else ""
        yield f"{begin:8.2f} s to {end:8.2f} s  {episode.words}{earlier}"
        if episode.severity is not None:
            yield f"{'':26}{episode.severity.words}"
        for line in episode.evidence:
            yield f"{'':26}{line}"
    for state in dict.fromkeys(episode.state for episode in summary.faults):
        yield f"check first, for {state}: {check_first(state)}"


def phases_line(replayed: Replayed) -> str:
    """What the sampling phases have in common, and what not."""
    phases, start = replayed.phases, replayed.start_ns
    named = [phase.summary.faults for phase in phases]
    firsts = [seconds(faults[0].start_ns, start) for faults in named if faults]
    if not firsts:
        return f"{len(phases)} phases: no fault in any"
    states = sorted({episode.words for faults in named for episode in faults})
    return (
        f"{len(phases)} phases: {', '.join(states)} in {len(firsts)}, "
        f"first named at {min(firsts):.2f} to {max(firsts):.2f} s"
    )


def bag_line(replayed: Replayed) -> str:
    """A recording among many."""
    length = seconds(replayed.end_ns, replayed.start_ns)
    return f"{one_line(replayed.task.bag)}  {length:.1f} s  {verdict(replayed)}"


def verdict(replayed: Replayed) -> str:
    """What is wrong with the robot, in short."""
    if replayed.undecided:
        return f"nothing could be decided: {replayed.undecided}"
    return ", ".join(_named(replayed)) if replayed.has_fault else "nothing wrong"


def _named(replayed: Replayed) -> Iterator[str]:
    """Each state named, when first in any phase, and in how many phases where not in all."""
    count = len(replayed.phases)
    first: dict[str, list[int]] = {}
    for phase in replayed.phases:
        begun: dict[str, int] = {}
        for episode in phase.summary.faults:
            begun.setdefault(episode.words, episode.start_ns)
        for state, start_ns in begun.items():
            first.setdefault(state, []).append(start_ns)
    for state, starts in first.items():
        some = "" if len(starts) == count else f" ({len(starts)} of {count} phases)"
        yield f"{state} at {seconds(min(starts), replayed.start_ns):.2f} s{some}"


def notes(replayed: Replayed) -> Iterator[str]:
    """What is to be said beside the diagnosis."""
    yield from replayed.notes
    for (topic, problem), count in replayed.complaints.items():
        yield f"{topic}: {problem} ({counted(count, 'message')})"


def total_line(done: Sequence[Replayed], failed: Sequence[Failed]) -> str:
    """All recordings together."""
    hours = sum(seconds(item.end_ns, item.start_ns) for item in done) / 3600.0
    faulty = sum(item.has_fault for item in done)
    undecided = sum(bool(item.undecided) for item in done)
    parts = [f"{len(done)} recordings, {hours:.2f} h", f"{faulty} with a fault named"]
    if undecided:
        parts.append(f"{undecided} undecided")
    if failed:
        parts.append(f"{len(failed)} failed")
    return ": ".join((parts[0], ", ".join(parts[1:])))


def score_lines(scores: dict[str, Any]) -> Iterator[str]:
    """The figures of the labelled mode."""
    alarms = scores["false_alarms"]
    if alarms["hours"]:
        low, high = alarms["ci95_per_hour"]
        yield (
            f"false alarms: {alarms['per_hour']:g} per hour (95 %: {low:g} to {high:g}), "
            f"{' and '.join(map(str, alarms['count_by_phase']))} in {alarms['hours']:.3f} h"
        )
        for state, count in alarms["states"].items():
            yield f"{count:6d}  {state}"
    kinds = {kind: item for kind, item in scores["faults"].items() if item["count"]}
    if not kinds:
        return
    yield f"{'fault':24}{'n':>5}{'found':>8}{'95 %':>14}{'delay s, median, 95th':>24}  of the time"
    for kind, item in kinds.items():
        yield _figures(kind, item)
    yield "named for most of the time in which each fault could be seen, by phase:"
    for kind, named in scores["isolability_by_fault"].items():
        yield f"{kind:24}{', '.join(f'{count} {name}' for name, count in named.items())}"
    for kind, floor in scores["detection_floor"].items():
        least = "none" if floor["severity"] is None else f"{floor['severity']:.3g}"
        tried = floor["least_tried"]
        yield f"{kind}: 9 of 10 found from severity {least} on (tried from {tried:.3g})"


def _figures(kind: str, item: dict[str, Any]) -> str:
    found, delay, time = item["found"], item["delay_s"], item["time"]
    low, high = found["ci95"]
    late = ["never" if delay[key] is None else f"{delay[key]:.2f}" for key in ("median", "p95")]
    shares = ", ".join(
        f"{100 * share:.1f} % {name.replace('_', ' ')}" for name, share in time.items() if share
    )
    return (
        f"{kind:24}{item['count']:>5}{100 * found['share']:>6.1f} %"
        f"{100 * low:>8.1f} to {100 * high:.0f} %{' / '.join(late):>18}      {shares}"
    )


def as_json(replayed: Replayed) -> dict[str, Any]:
    """A recording; the first phase in full, the others by what they name."""
    first = replayed.phases[0].summary
    found: dict[str, Any] = {
        "bag": str(replayed.task.bag),
        "start_ns": replayed.start_ns,
        "end_ns": replayed.end_ns,
        "ticks": first.ticks,
        "shares": first.shares,
        "stale_shares": first.stale_shares,
        "episodes": [_episode(episode) for episode in first.episodes],
        "conditions": [asdict(change) for change in first.conditions],
    }
    if len(replayed.phases) > 1:
        found["phases"] = [_phase(phase) for phase in replayed.phases]
    if replayed.undecided:
        found["undecided"] = replayed.undecided
    if list(notes(replayed)):
        found["notes"] = list(notes(replayed))
    return found


def _phase(phase: Phase) -> dict[str, Any]:
    return {
        "shift": phase.share,
        "ticks": phase.summary.ticks,
        "shares": phase.summary.shares,
        "faults": [_episode(episode) for episode in phase.summary.faults],
    }


def _episode(episode: Episode) -> dict[str, Any]:
    return {
        "state": episode.state,
        "wheel": episode.wheel,
        "joint": episode.joint,
        "start_ns": episode.start_ns,
        "end_ns": episode.end_ns,
        "since_ns": episode.since_ns,
        "evidence": episode.evidence,
        "severity": None if episode.severity is None else asdict(episode.severity),
    }
