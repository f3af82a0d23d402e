"""What fits, explains and commissions, on healthy drives: cost, findings beside the truth."""

import json
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
from faults.truth import missed, ratios, true_value
from tomr_power_model.errors import InputError
from tomr_power_model.robot import read_description

EXPLAINED = "robot_explained.yaml"


@frozen
class Run:
    """What a process came to and what it cost."""

    code: int
    last: str  # line that it printed
    wall: float  # s
    cpu: float  # s, of all its threads
    memory: float  # MB, at most

    @property
    def cost(self) -> str:
        """In words."""
        return f"{self.wall:.1f} s, CPU {self.cpu:.1f} s, at most {self.memory:.0f} MB"


def explain(
    recordings: Recordings, out: Path, count: int, options: Sequence[str], console: Console
) -> None:
    """Run `tomr_gap explain`, `count` drives to fit and the next one held out; print all that."""
    fitted, held = _split(recordings, count)
    out.mkdir(parents=True, exist_ok=True)
    console.print(f"fitted {', '.join(bag.name for bag in fitted)}; held out {held.name}")
    bags: list[str | Path] = ["--real", *fitted, "--holdout", held]
    command = [tool("tomr_gap"), "explain", "--robot", recordings.description, *bags]
    command += ["--out", out, *options]
    run = measured(command, out / "explain.log")
    console.print(run.cost)
    if run.code:
        raise InputError(f"tomr_gap ended with {run.code}: {run.last}")
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    real = recordings.real()
    print_findings(report, real, console)
    explained = out / EXPLAINED
    if explained.exists():
        print_ratios(explained, real, console)
    for name, robot in (("robot.yaml", recordings.description), (EXPLAINED, explained)):
        if robot.exists():
            motors = closed_loop(held, robot).motors
            errors = ", ".join(f"{rms(motor.residual):.3f}" for motor in motors)
            console.print(f"held out, closed loop of {name}: RMS of motors 1 to 3 {errors} W")


def calibrate(recordings: Recordings, out: Path, count: int, console: Console) -> None:
    """Run `tomr_calibrate` on the same drives; print its cost, and its values over the truth."""
    fitted, held = _split(recordings, count)
    out.mkdir(parents=True, exist_ok=True)
    written = out / "calibrated.yaml"
    inputs: list[str | Path] = [*fitted, "--robot", recordings.description, "--holdout", held]
    command = [tool("tomr_calibrate"), *inputs, "--out", written]
    run = measured(command, out / "calibrate.log")
    console.print(run.cost)
    if run.code:
        console.print(f"refused: {run.last}")
        return
    console.print((out / "calibrate.log").read_text(encoding="utf-8"))
    print_ratios(written, recordings.real(), console)


def commission(recordings: Recordings, out: Path, console: Console) -> None:
    """Run `tomr_commission` on all healthy drives; print its cost and what it says."""
    out.mkdir(parents=True, exist_ok=True)
    healthy = [drive.bag for drive in recordings.drives("healthy")]
    command: list[str | Path] = [tool("tomr_commission"), *healthy]
    command += ["--robot", recordings.description, "--out", out]
    run = measured(command, out / "commission.log")
    console.print(run.cost)
    console.print((out / "commission.log").read_text(encoding="utf-8"))


def _split(recordings: Recordings, count: int) -> tuple[list[Path], Path]:
    """Bags to fit and the one held out."""
    healthy = [drive.bag for drive in recordings.drives("healthy")]
    if not 0 < count < len(healthy):
        raise InputError(f"--fit {count}: give 1 to {len(healthy) - 1}, one is held out")
    return healthy[:count], healthy[count]


def tool(name: str) -> Path:
    """Where a command of the suite lies."""
    return Path(sys.executable).with_name(name)


# A process counts the memory of the one that it was forked from: a small one starts the command.
_LAUNCHER = """
import json, os, subprocess, sys
process = subprocess.Popen(sys.argv[2:])
_, status, usage = os.wait4(process.pid, 0)
cost = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0
json.dump([os.waitstatus_to_exitcode(status), *cost], open(sys.argv[1], "w"))
"""


def measured(command: Sequence[str | Path], log: Path) -> Run:
    """Run a command, its output into a file, and say what it cost."""
    begin, cost = time.perf_counter(), log.with_suffix(".cost")
    launched = [sys.executable, "-c", _LAUNCHER, cost, *command]
    with log.open("wb") as stream:
        subprocess.run(list(map(str, launched)), stdout=stream, stderr=stream, check=True)
    wall = time.perf_counter() - begin
    lines = log.read_text(errors="replace").strip().splitlines() or ["it said nothing"]
    code, cpu, memory = json.loads(cost.read_text())
    return Run(code, lines[-1], wall, cpu, memory)


def print_ratios(description: Path, real: Mapping[str, Any], console: Console) -> None:
    """How far off the values of a description are."""
    console.print(f"{description.name} over the truth, wheel by wheel where they differ:")
    for key, values in ratios(real, read_description(description)).items():
        console.print(f"  {key:44} {' '.join(f'{value:.3f}' for value in values)}")


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
