"""What the diagnosis costs and how soon it answers, played to in real time."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path

from attrs import frozen
from drive import ROBOT, Drive, Raw
from feeder_node import feeder
from processes import command_path, cpu_seconds, resident_mb, running

from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_power_model.errors import InputError
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.predictions import prediction_topics

NODES = ("power_model", "power_residuals", "fault_classifier")
ONE = ("tomr_diagnosis",)
# What is measured: our nodes, and their baseline with callbacks that do nothing.
SUITES = {"three nodes": NODES, "one process": ONE, "empty nodes": NODES}
_BENCH = Path(__file__).resolve().parent
LISTENER = _BENCH / "listener_node.py"
_LEAD_NS = NANOSECONDS // 5  # between "all connected" and the first message

Command = Sequence[str | Path]


def suite_commands(
    robot_file: Path, parameters: Mapping[str, object], nodes: Sequence[str] = NODES
) -> dict[str, Command]:
    """Nodes of the suite."""
    ros: list[str | Path] = ["--ros-args", "--params-file", robot_file, "--log-level", "error"]
    for name, value in parameters.items():
        ros += ["-p", f"{name}:={value}"]
    return {name: [command_path(name), *ros] for name in nodes}


def empty_commands() -> dict[str, Command]:
    """Their baseline."""
    return {name: [sys.executable, _BENCH / "empty_node.py", name] for name in NODES}


def _listeners(extra: Mapping[str, int], nodes: Sequence[str] = NODES) -> dict[str, int]:
    """How many subscribers each topic has once all are connected."""
    robot = shipped_robot(ROBOT)
    supplies = [f"/{wheel}/power" for wheel in robot.wheel_topics]
    twice = ["/joint_states", *supplies, "/battery_state"]
    if nodes == ONE:
        return {**dict.fromkeys([*twice, "/cmd_vel"], 1), **extra}
    single = ["/cmd_vel", *prediction_topics(robot), RESIDUALS]
    return {**dict.fromkeys(twice, 2), **dict.fromkeys(single, 1), **extra}


def _timed(drive: Drive, with_answers: bool) -> list[tuple[int, Raw]]:
    """When to publish what, from the start of the drive [ns]."""
    start = drive.sensors[0].stamp_ns
    timed = []
    for message, answers in zip(drive.sensors, drive.answers, strict=True):
        timed.append((message.stamp_ns - start, message))
        if with_answers:
            heard = (answer for answer in answers if answer.topic != DIAGNOSTICS)
            timed.extend((message.stamp_ns - start, answer) for answer in heard)
    return timed


@frozen
class Cost:
    """Of one node: CPU seconds per second of robot, once warm, and memory [MB]."""

    cpu: float
    memory: float


def measure_cost(drive: Drive, warmup_s: float, suite: str) -> dict[str, Cost]:
    """Cost of each node of one of SUITES.

    To empty nodes the feeder publishes the nodes' recorded predictions and residuals too, each
    right after the message that brought it about.
    """
    names, empty = SUITES[suite], suite == "empty nodes"
    timed = _timed(drive, with_answers=empty)
    warm = next(i for i, (offset, _) in enumerate(timed) if offset >= warmup_s * NANOSECONDS)
    robot_file = files("tomr_power_model").joinpath("robots").joinpath(f"{ROBOT}.yaml")
    with (
        tempfile.TemporaryDirectory(prefix="tomr-bench-") as folder,
        as_file(robot_file) as robot_path,
        feeder([message for _, message in timed]) as source,
    ):
        commands = empty_commands() if empty else suite_commands(robot_path, {}, names)
        with running(commands, Path(folder)) as nodes:
            source.wait_for(_listeners({}, names), lambda: all_run(nodes))
            start = time.monotonic_ns() + _LEAD_NS
            source.play(timed[:warm], start)
            before, since = _cpu(nodes), time.monotonic()
            source.play(timed[warm:], start)
            used, seconds = _cpu(nodes), time.monotonic() - since
            memory = {name: resident_mb(process.pid) for name, process in nodes.items()}
    return {name: Cost((used[name] - before[name]) / seconds, memory[name]) for name in names}


def all_run(processes: Mapping[str, subprocess.Popen[bytes]]) -> bool:
    """Whether none has ended."""
    return all(process.poll() is None for process in processes.values())


def _cpu(nodes: Mapping[str, subprocess.Popen[bytes]]) -> dict[str, float]:
    if not all_run(nodes):
        return dict.fromkeys(nodes, 0.0)  # `running` names which one ended, and why
    return {name: cpu_seconds(process.pid) for name, process in nodes.items()}


@frozen
class Latencies:
    """From handing over the message that completes a tick to the arrival of its diagnosis [s]."""

    ticks: tuple[float, ...]
    changes: tuple[float, ...]  # those of ticks on which the state changed
    unanswered: int


# Each tick is answered, and a change of state shows on the tick that brings it.
PROMPT: dict[str, object] = {
    "report_period": 0.05,
    "filter_time": 0.0,
    "confirm_time": 0.0,
    "recovery_time": 0.0,
    "slip_recovery_time": 0.0,
}


def measure_latency(drive: Drive, warmup_s: float, suite: str) -> Latencies:
    """Play a drive prepared with PROMPT and time the answers of one of SUITES."""
    names = SUITES[suite]
    timed = _timed(drive, with_answers=False)
    robot_file = files("tomr_power_model").joinpath("robots").joinpath(f"{ROBOT}.yaml")
    with (
        tempfile.TemporaryDirectory(prefix="tomr-bench-") as folder,
        as_file(robot_file) as robot_path,
        feeder(drive.sensors) as source,
    ):
        noted = Path(folder, "arrivals")
        listener: dict[str, Command] = {"listener": [sys.executable, LISTENER, noted]}
        with running(
            suite_commands(robot_path, PROMPT, names) | listener, Path(folder)
        ) as processes:
            source.wait_for(_listeners({DIAGNOSTICS: 1}, names), lambda: all_run(processes))
            handed = source.play(timed, time.monotonic_ns() + _LEAD_NS)
            time.sleep(0.5)  # the last answers
        arrived = dict(noted_pairs(noted))
    first = drive.sensors[0].stamp_ns + round(warmup_s * NANOSECONDS)
    wanted = {stamp: index for stamp, index in drive.completing.items() if stamp >= first}
    seconds = {
        stamp: 1e-9 * (arrived[stamp] - handed[index])
        for stamp, index in wanted.items()
        if stamp in arrived
    }
    if not seconds:
        raise InputError("the nodes gave no answer; run them by hand to see why")
    return Latencies(
        tuple(seconds.values()),
        tuple(value for stamp, value in seconds.items() if stamp in drive.changes),
        len(wanted) - len(seconds),
    )


def noted_pairs(noted: Path) -> list[tuple[int, int]]:
    """(stamp, arrival) of what the listener noted, the first arrival of each stamp."""
    lines = [line.split() for line in noted.read_text(encoding="ascii").splitlines()]
    return [(int(stamp), int(arrival)) for arrival, stamp in reversed(lines)]


def load() -> float:
    """Processes that wanted a core in the last minute, on average."""
    return os.getloadavg()[0]
