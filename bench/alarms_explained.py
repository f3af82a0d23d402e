"""False alarms of the diagnosis on real recordings, before and after `tomr_gap explain`.

    .venv/bin/python bench/concealed.py run CASES --out REPORTS
    .venv/bin/python bench/alarms_explained.py CASES REPORTS --out DIR

Each case of CASES is a robot without any fault of a motor, driver or floor: a fault that is named
on its recordings is a false alarm. The diagnosis sees them with robot.yaml as it stands and with
the robot_explained.yaml in REPORTS; settings, bands and classifier stay those of robot.yaml,
nothing is fitted here. A case without robot_explained.yaml (match, or `unknown` alone) keeps its
description. `real_holdout` was used for no fit; `real` is what the explanation was fitted to.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from attrs import frozen
from matplotlib.figure import Figure
from pool import each
from rich.console import Console
from rich.table import Table

from tomr_fault_diag.classifier.states import FAULTLESS
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import STAGE_NODES, DiagnosisSettings
from tomr_fault_diag.diagnosis.summary import Summariser
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot, read_node_sections

RECORDINGS = ("real_holdout", "real")
BEFORE, AFTER = "before", "after"
_EXPLAINED = "robot_explained.yaml"
_DRAWS = 4000  # of the bootstrap


@frozen
class Task:
    """One recording to be diagnosed with one description."""

    case: str
    recording: str  # one of RECORDINGS
    when: str  # BEFORE or AFTER
    bag: Path
    robot: Path
    settings_of: Path  # description whose sections of single nodes count


@frozen
class Played:
    """What the diagnosis said in one recording."""

    ticks: int
    faulty: int  # ticks at which a fault was named
    alarms: int  # onsets: changes to a state that names a fault
    seconds: float
    faults: Counter[str]  # ticks by state, faults only


def play(task: Task) -> Played:
    """Diagnose one recording."""
    settings = DiagnosisSettings.of(
        read_node_sections(task.settings_of, STAGE_NODES), str(task.settings_of)
    )
    pipeline = Pipeline(load_robot(task.robot), settings)
    summariser, alarms = Summariser(pipeline.robot.wheel_names), 0
    with open_recording(task.bag) as recording:
        for _, step in diagnose(recording, pipeline):
            for diagnosis in step.diagnoses:
                summariser.diagnosis(diagnosis, [])
                alarms += diagnosis.changed and diagnosis.state.name not in FAULTLESS
            for frame in step.frames:
                summariser.frame(frame)
    summary = summariser.summary()
    counts = Counter({name: round(share * summary.ticks) for name, share in summary.shares.items()})
    faults = Counter({name: count for name, count in counts.items() if name not in FAULTLESS})
    seconds = summary.ticks * settings.model.ticks.period * 1e-9
    return Played(summary.ticks, sum(faults.values()), alarms, seconds, faults)


def tasks_of(cases: Path, reports: Path) -> list[Task]:
    """Two descriptions for every recording. Raises InputError where something is missing."""
    tasks = []
    found = sorted(path.parent for path in cases.glob("*/robot.yaml"))
    if not found:
        raise InputError(f"{cases}: holds no cases: give the folder of <id>/robot.yaml")
    for case in found:
        details = reports / "details" / case.name
        if not (details / "report.json").exists():
            raise InputError(f"{details}: holds no report.json: run bench/concealed.py run first")
        explained = details / _EXPLAINED
        described = case / "robot.yaml"
        after = explained if explained.exists() else described
        for recording in RECORDINGS:
            tasks += [
                Task(case.name, recording, when, case / recording, robot, described)
                for when, robot in ((BEFORE, described), (AFTER, after))
            ]
    return tasks


def figures(played: Sequence[Played]) -> dict[str, float]:
    """Share of decisions that name a fault [%], and false alarms per hour."""
    ticks, hours = sum(p.ticks for p in played), sum(p.seconds for p in played) / 3600.0
    return {
        "faulty_percent": 100.0 * sum(p.faulty for p in played) / max(ticks, 1),
        "alarms_per_hour": sum(p.alarms for p in played) / max(hours, 1e-9),
        "decisions": ticks,
        "alarms": sum(p.alarms for p in played),
        "hours": hours,
    }


def kept_share(
    before: Sequence[Played], after: Sequence[Played], seed: int = 1
) -> dict[str, list[float]]:
    """Part of the false decisions and alarms that is left, 95 % by bootstrap over cases."""
    rows = np.random.default_rng(seed).integers(0, len(before), (_DRAWS, len(before)))
    found = {}
    for name in ("faulty", "alarms"):
        first, last = (np.array([getattr(p, name) for p in part]) for part in (before, after))
        ratio = last[rows].sum(axis=1) / np.maximum(first[rows].sum(axis=1), 1)
        found[name] = [float(value) for value in np.quantile(ratio, (0.025, 0.975))]
    return found


Results = dict[tuple[str, str, str], Played]  # by case, recording, BEFORE or AFTER


def report_of(results: Results, effects: dict[str, list[str]]) -> dict[str, object]:
    """All numbers: by recording, pooled over cases and case by case."""
    report: dict[str, object] = {}
    names = sorted({case for case, _, _ in results})
    for recording in RECORDINGS:
        pools = {
            when: [results[case, recording, when] for case in names] for when in (BEFORE, AFTER)
        }
        states = {when: sum((p.faults for p in pool), Counter()) for when, pool in pools.items()}
        report[recording] = {
            "pooled": {when: figures(pool) for when, pool in pools.items()},
            "left_ci95": kept_share(pools[BEFORE], pools[AFTER]),
            "decisions_by_fault": {when: dict(count) for when, count in states.items()},
            "cases": {
                case: {
                    "findings": effects[case],
                    **{when: figures([results[case, recording, when]]) for when in pools},
                }
                for case in names
            },
        }
    return report


def print_tables(report: dict[str, object], console: Console) -> None:
    """One table per recording."""
    for recording in RECORDINGS:
        part = report[recording]
        assert isinstance(part, dict)
        table = Table(title=f"{recording}: false alarms before and after", title_justify="left")
        table.add_column("case")
        table.add_column("found")
        for head in ("fault named, % of decisions", "after", "alarms per hour", "after"):
            table.add_column(head, justify="right")
        for case, row in part["cases"].items():
            table.add_row(case, ", ".join(row["findings"]) or "-", *_cells(row))
        table.add_section()
        table.add_row("all", "", *_cells(part["pooled"]), style="bold")
        console.print(table)
        low, high = part["left_ci95"]["faulty"]
        console.print(f"false decisions left: 95 % {low:.2f} to {high:.2f} of those before\n")


def _cells(row: dict[str, dict[str, float]]) -> list[str]:
    return [
        f"{row[when][key]:.{digits}f}"
        for key, digits in (("faulty_percent", 1), ("alarms_per_hour", 0))
        for when in (BEFORE, AFTER)
    ]


def draw(report: dict[str, object], path: Path) -> None:
    """Bars of the share of false decisions on what was held out."""
    part = report[RECORDINGS[0]]
    assert isinstance(part, dict)
    rows = [*part["cases"].items(), ("all", part["pooled"])]
    figure = Figure(figsize=(8.0, 1.2 + 0.5 * len(rows)), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rows))[::-1]
    for offset, when, colour in ((0.2, BEFORE, "#b0533c"), (-0.2, AFTER, "#2f6f8f")):
        shares = [row[when]["faulty_percent"] for _, row in rows]
        label = "robot.yaml" if when == BEFORE else _EXPLAINED
        bars = axes.barh(place + offset, shares, 0.38, color=colour, label=label)
        axes.bar_label(bars, fmt="%.1f", padding=2, fontsize=8)
    names = ["\n".join([case, *(row["findings"] or ["-"])]) for case, row in rows[:-1]]
    axes.set_yticks(place, [*names, "all"], fontsize=7)
    axes.set_xlabel("decisions that name a fault where there is none [%]")
    axes.set_title("recordings held out")
    figure.legend(loc="outside upper right")
    axes.margins(x=0.1)
    figure.savefig(path)


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("cases", type=Path, metavar="CASES", help="folder of <id>/{robot.yaml,real,real_holdout}")
    add("reports", type=Path, metavar="REPORTS", help="that bench/concealed.py run wrote")
    add("--out", type=Path, metavar="DIR", required=True, help="alarms.json and .png go here")
    options = parser.parse_args(arguments)
    tasks = tasks_of(options.cases, options.reports)
    options.out.mkdir(parents=True, exist_ok=True)
    effects = {}
    for case in {task.case for task in tasks}:
        text = (options.reports / "details" / case / "report.json").read_text(encoding="utf-8")
        effects[case] = [item["effect"] for item in json.loads(text)["findings"]]
    played = each(play, tasks, unit="recording")
    results = {
        (task.case, task.recording, task.when): item
        for task, item in zip(tasks, played, strict=True)
    }
    report = report_of(results, effects)
    text = json.dumps(report, indent=1) + "\n"
    (options.out / "alarms.json").write_text(text, encoding="utf-8")
    draw(report, options.out / "alarms.png")
    print_tables(report, Console(width=120, highlight=False))
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
