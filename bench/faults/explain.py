"""`tomr_gap explain` on healthy drives: what it costs, what it finds, how well that predicts."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from attrs import frozen
from rich.console import Console
from rich.table import Table

from faults.closed_loop import closed_loop
from faults.recordings import Recordings
from faults.regimes import rms
from faults.truth import missed, true_value
from tomr_power_model.errors import InputError

EXPLAINED = "robot_explained.yaml"
_REPORT = "report.json"


@frozen
class Cost:
    """Of one process."""

    wall: float  # s
    cpu: float  # s, of all its threads
    memory: float  # MB, at most


def explain(
    recordings: Recordings, out: Path, count: int, options: Sequence[str], console: Console
) -> None:
    """Run the tool, `count` drives to fit and the next one held out, and print all that."""
    healthy = recordings.drives("healthy")
    if not 0 < count < len(healthy):
        raise InputError(f"--fit {count}: give 1 to {len(healthy) - 1}, one is held out")
    fitted, held = healthy[:count], healthy[count]
    out.mkdir(parents=True, exist_ok=True)
    command = [
        str(Path(sys.executable).with_name("tomr_gap")),
        "explain",
        *("--robot", str(recordings.description)),
        *("--real", *(str(drive.bag) for drive in fitted)),
        *("--holdout", str(held.bag)),
        *("--out", str(out)),
        *options,
    ]
    cost = measured(command, out / "explain.log")
    report = json.loads((out / _REPORT).read_text(encoding="utf-8"))
    names = ", ".join(drive.identity for drive in fitted)
    console.print(f"fitted {names}; held out {held.identity}")
    console.print(f"{cost.wall:.1f} s, CPU {cost.cpu:.1f} s, at most {cost.memory:.0f} MB")
    print_findings(report, recordings.real(), console)
    explained = out / EXPLAINED
    for name, robot in (("robot.yaml", recordings.description), (EXPLAINED, explained)):
        if robot.exists():
            motors = closed_loop(held.bag, robot).motors
            errors = ", ".join(f"{rms(motor.residual):.3f}" for motor in motors)
            console.print(f"held out, closed loop of {name}: RMS of motors 1 to 3 {errors} W")


def measured(command: Sequence[str], log: Path) -> Cost:
    """Run a command and say what it cost. Raises InputError with its last line if it fails."""
    begin = time.perf_counter()
    with log.open("wb") as stream:
        process = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        lines = log.read_text(errors="replace").strip().splitlines() or ["it said nothing"]
        raise InputError(f"{Path(command[0]).name} ended with {process.returncode}: {lines[-1]}")
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0)


def print_findings(report: Mapping[str, Any], real: Mapping[str, Any], console: Console) -> None:
    """What was found beside the truth, and what was not."""
    table = Table(title=f"verdict: {report['verdict']}", title_justify="left")
    for name in ("effect", "where", "parameter", "confidence", "found", "95 %", "truth"):
        table.add_column(name)
    for finding in report["findings"]:
        for name, item in finding["parameters"].items() or [("-", None)]:
            truth = true_value(real, finding["effect"], finding["where"], name)
            low_high, value = "", "-"
            if item is not None:
                value = f"{item['value']:.4g} {item['unit']}"
                low_high = " to ".join("?" if v is None else f"{v:.4g}" for v in item["ci95"])
            table.add_row(
                finding["effect"],
                ", ".join(finding["where"]),
                name,
                f"{finding['confidence']:.2f}",
                value,
                low_high,
                "none" if truth is None else f"{truth:.4g}",
            )
    console.print(table)
    absent = missed(real, [finding["effect"] for finding in report["findings"]])
    console.print(f"not named: {', '.join(absent) or 'nothing'}")
    console.print(f"unexplained share: {report['unexplained_share']}")
    console.print(f"held out: {report['holdout']}")
