"""`make bench`: what the suite costs, as ratios measured side by side in one run."""

import argparse
import json
import os
import platform
import signal
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen
from drive import ROOT, SOURCE, prepare, rates, repeated, write_bag
from online import PROMPT, SUITES, Cost, load, measure_cost, measure_latency
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError

COST_AIMS = {"three nodes": (0.20, 300.0), "one process": (0.10, 110.0)}  # of a core; MB
LATENCY_AIM_S = 0.010
OFFLINE_AIM = 1.5
_OFFLINE = Path(__file__).resolve().parent / "offline.py"
_OFFLINE_MODES = ("all", "diagnose", "read")

_BAR = "{desc} {n}/{total} [{elapsed}]"

_EPILOG = """\
It plays bags/circle_encoder_lost, over and over, to the nodes in real time: run it on a quiet
machine, on a ROS_DOMAIN_ID of its own. About four minutes; --quick takes less than one."""


@frozen
class Plan:
    """How long to measure [s] and how often."""

    cpu_s: float = 20.0
    cpu_rounds: int = 3
    warmup_s: float = 3.0
    latency_s: float = 30.0
    offline_s: float = 600.0
    offline_rounds: int = 2


QUICK = Plan(4.0, 1, 1.0, 5.0, 60.0, 1)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="make bench",
        description=__doc__,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers there too")
    parser.add_argument("--quick", action="store_true", help="short: does it run, not how fast")
    return parser


def _cost(plan: Plan, folder: Path, bar: Any) -> dict[str, Any]:
    """Three nodes, one process and three empty nodes, by turns."""
    bag = write_bag(repeated(plan.warmup_s + plan.cpu_s), folder / "cpu")
    drive = prepare(bag, {})
    rounds: dict[str, list[dict[str, Cost]]] = {name: [] for name in SUITES}
    for number in range(plan.cpu_rounds):
        for suite in list(SUITES)[:: 1 if number % 2 == 0 else -1]:
            bar.set_description(suite)
            rounds[suite].append(measure_cost(drive, plan.warmup_s, suite))
            bar.update()
    return {
        "rates_hz": rates(drive.sensors),
        "suites": {
            suite: {
                "nodes": {
                    name: {
                        "cpu_s_per_s": statistics.mean(each[name].cpu for each in found),
                        "memory_mb": max(each[name].memory for each in found),
                    }
                    for name in found[0]
                },
                "cpu_by_round": [sum(cost.cpu for cost in each.values()) for each in found],
            }
            for suite, found in rounds.items()
        },
        "aims": COST_AIMS,
    }


def _latency(plan: Plan, folder: Path, bar: Any) -> dict[str, Any]:
    """Message in to diagnosis out."""
    bag = write_bag(repeated(plan.warmup_s + plan.latency_s), folder / "latency")
    drive = prepare(bag, PROMPT)
    bar.set_description("latency")
    found = {}
    for suite in COST_AIMS:
        measured = measure_latency(drive, plan.warmup_s, suite)
        bar.update()
        found[suite] = {
            "ticks": _spread(measured.ticks),
            "changes": _spread(measured.changes),
            "unanswered_ticks": measured.unanswered,
        }
    return {"suites": found, "aim_p99_s": LATENCY_AIM_S}


def _spread(seconds: Sequence[float]) -> dict[str, float]:
    if not seconds:
        return {"count": 0}
    p50, p99 = np.percentile(seconds, (50, 99))
    return {
        "count": len(seconds),
        "p50_s": float(p50),
        "p99_s": float(p99),
        "max_s": max(seconds),
    }


def _offline(plan: Plan, folder: Path, bar: Any) -> dict[str, Any]:
    """`tomr_diagnose` against merely deserialising the same recording; the best of each."""
    bar.set_description("a long recording")
    bag = write_bag(repeated(plan.offline_s), folder / "long")
    best: dict[str, dict[str, float]] = {}
    for _ in range(plan.offline_rounds):
        for mode in _OFFLINE_MODES:
            bar.set_description(f"offline: {mode}")
            done = subprocess.run(
                [sys.executable, str(_OFFLINE), mode, str(bag)],
                check=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
            times = json.loads(done.stdout)
            if mode not in best or times["cpu_s"] < best[mode]["cpu_s"]:
                best[mode] = times
            bar.update()
    cost = {mode: times["cpu_s"] for mode, times in best.items()}
    return {
        "seconds_of_robot": plan.offline_s,
        "best": best,
        "ratio_to_all_topics": cost["diagnose"] / cost["all"],
        "ratio_to_read_topics": cost["diagnose"] / cost["read"],
        "times_real_time": plan.offline_s / best["diagnose"]["wall_s"],
        "aim": OFFLINE_AIM,
    }


def _aim(value: float, aim: float) -> str:
    return "[green]met[/]" if value <= aim else "[red]missed[/]"


def _print_cost(console: Console, found: dict[str, Any]) -> None:
    table = Table(title="Cost: CPU in s per s of robot, memory in MB", title_justify="left")
    for heading in ("", "node", "CPU", "memory"):
        table.add_column(heading, justify="right" if heading in ("CPU", "memory") else "left")
    lines = []
    for suite, cost in found["suites"].items():
        for name, node in cost["nodes"].items():
            table.add_row(suite, name, f"{node['cpu_s_per_s']:.4f}", f"{node['memory_mb']:.0f}")
        cpu = statistics.mean(cost["cpu_by_round"])
        memory = sum(node["memory_mb"] for node in cost["nodes"].values())
        table.add_row(suite, "all", f"{cpu:.4f}", f"{memory:.0f}", end_section=True)
        if suite in found["aims"]:
            most_cpu, most_memory = found["aims"][suite]
            lines.append(
                f"{suite}: aim {most_cpu:g} of a core {_aim(cpu, most_cpu)} at {cpu:.3f}, aim "
                f"{most_memory:g} MB {_aim(memory, most_memory)} at {memory:.0f}; by round "
                + ", ".join(f"{value:.3f}" for value in cost["cpu_by_round"])
            )
    console.print(table)
    console.print("\n".join(lines))
    played = ", ".join(f"{topic} {rate:.0f}" for topic, rate in found["rates_hz"].items())
    console.print(
        f"Played, in Hz: {played}. The empty nodes subscribe to the same topics as the three nodes "
        "with the same QoS and executor and publish nothing: what the suite publishes to itself "
        "(eight predictions and the residuals at 20 Hz) comes from the feeder, as recorded, at the "
        "same moments. Memory is resident, what processes share counted in each.\n"
    )


def _print_latency(console: Console, found: dict[str, Any]) -> None:
    table = Table(title="Message in to diagnosis out, milliseconds", title_justify="left")
    for heading in ("", "count", "p50", "p99", "max"):
        table.add_column(heading, justify="right" if heading else "left")
    lines = []
    for suite, times in found["suites"].items():
        for name, spread in (("all decisions", times["ticks"]), ("changes", times["changes"])):
            if spread["count"]:
                each = (f"{1e3 * spread[key]:.2f}" for key in ("p50_s", "p99_s", "max_s"))
                table.add_row(f"{suite}: {name}", str(spread["count"]), *each)
        p99, aim = times["ticks"]["p99_s"], found["aim_p99_s"]
        lines.append(
            f"{suite}: aim p99 {1e3 * aim:g}: {_aim(p99, aim)} at {1e3 * p99:.2f}; "
            f"{times['unanswered_ticks']} decisions without an answer\n"
        )
    console.print(table)
    console.print(
        "".join(lines)
        + "From publishing the message that completes a decision to its /diagnostics arriving "
        "in another process. The decision window before it is policy, not delay: a decision at t "
        "takes the 50 ms up to t (decision_rate 20 Hz) and is made when every live stream has "
        "passed t and one of them t + 20 ms (settle_time). Here every decision is published "
        "(report_period 0.05) and no filter holds a change back (filter_time, confirm_time, "
        "recovery_time, slip_recovery_time 0).\n"
    )


def _print_offline(console: Console, found: dict[str, Any]) -> None:
    minutes = found["seconds_of_robot"] / 60.0
    table = Table(
        title=f"A recording of {minutes:g} minutes, offline, seconds", title_justify="left"
    )
    for heading in ("", "CPU", "wall", "start-up CPU, not counted"):
        table.add_column(heading, justify="right" if heading else "left")
    labels = {
        "diagnose": "tomr_diagnose",
        "all": "rosbags, all topics deserialised",
        "read": "rosbags, the topics tomr_diagnose reads",
    }
    for mode, label in labels.items():
        times = found["best"][mode]
        table.add_row(label, *(f"{times[k]:.2f}" for k in ("cpu_s", "wall_s", "startup_cpu_s")))
    console.print(table)
    ratio, aim = found["ratio_to_all_topics"], found["aim"]
    console.print(
        f"aim {aim:g} times deserialising the recording: {_aim(ratio, aim)} at {ratio:.2f}; "
        f"{found['ratio_to_read_topics']:.2f} times deserialising only what "
        f"it reads; {found['times_real_time']:.0f} times real time\n"
    )


def _bench(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    plan = QUICK if options.quick else Plan()
    if options.json and not options.json.parent.is_dir():
        raise InputError(f"--json {options.json}: no folder {options.json.parent}: make it first")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    profile = ROOT / "config" / "fastdds.xml"
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(profile))
    console = Console(width=120)
    found: dict[str, Any] = {"source": SOURCE.name, "quick": options.quick, "machine": _machine()}
    console.print(_describe(found["machine"]))
    steps = (
        len(SUITES) * plan.cpu_rounds + len(COST_AIMS) + len(_OFFLINE_MODES) * plan.offline_rounds
    )
    with (
        tempfile.TemporaryDirectory(prefix="tomr-bench-") as name,
        tqdm(total=steps, leave=False, disable=None, bar_format=_BAR) as bar,
    ):
        for key, measure in (("cost", _cost), ("latency", _latency), ("offline", _offline)):
            found[key] = measure(plan, Path(name), bar)
    _print_cost(console, found["cost"])
    _print_latency(console, found["latency"])
    _print_offline(console, found["offline"])
    if options.json:
        options.json.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return EXIT_OK


def _machine() -> dict[str, Any]:
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "load_before": load(),
    }


def _describe(machine: dict[str, Any]) -> str:
    busy = machine["load_before"] > 0.5
    return (
        f"Python {machine['python']}, {machine['machine']}, {machine['cores']} cores, "
        f"load before {machine['load_before']:.2f}"
        + (": [yellow]not a quiet machine, times will be long[/]" if busy else "")
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `make bench`."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    return run_main(_bench, arguments)


if __name__ == "__main__":
    sys.exit(main())
