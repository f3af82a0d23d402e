"""tomr_demo: its processes, which end with it whatever happens, and a short run over DDS."""

import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import JointState

from tomr_demo import processes
from tomr_demo.processes import Children, DemoFailure
from tomr_demo.topics import PROCESSES, all_topics
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot

SLEEP = [sys.executable, "-c", "import signal; print('up', flush=True); signal.pause()"]
DEAF = [
    sys.executable,
    "-c",
    "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    "print('up', flush=True); signal.pause()",
]


def status_of(pid: int) -> tuple[str, int]:
    """State letter and parent of a process; "Z" also if it is gone for good."""
    try:
        state, parent, *_ = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "Z", 0
    return state, int(parent)


def is_alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for its parent does not."""
    return status_of(pid)[0] != "Z"


def children_of(pid: int) -> list[int]:
    """Processes that a process has started."""
    everyone = (int(folder.name) for folder in Path("/proc").glob("[0-9]*"))
    return [other for other in everyone if status_of(other)[1] == pid]


def started(
    wait_until: Callable[..., Any], children: Children, *commands: Sequence[str]
) -> list[int]:
    """Start commands and wait until each has set itself up; returns their process ids."""
    names = [f"process_{number}" for number in range(len(commands))]
    for name, command in zip(names, commands, strict=True):
        children.start(name, command)
    found = [children.named(name) for name in names]
    wait_until(lambda: all("up" in child.last_lines() for child in found), "all set up")
    return [child.popen.pid for child in found]


def test_processes_end_with_the_block_even_if_deaf_or_if_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wait_until: Callable[..., Any]
) -> None:
    monkeypatch.setattr(processes, "TIME_TO_END", 0.5)
    pids: list[int] = []

    def fail() -> None:
        with Children(tmp_path) as children:
            pids.extend(started(wait_until, children, SLEEP, DEAF))
            assert all(is_alive(pid) and os.getsid(pid) == pid for pid in pids)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert len(pids) == 2
    assert not any(is_alive(pid) for pid in pids)
    with Children(tmp_path) as children:
        started(wait_until, children, SLEEP, DEAF)
        assert children.stop() == ["process_1"]


def test_processes_end_when_the_demo_is_killed(
    tmp_path: Path, spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    script = f"""
import signal
from pathlib import Path
from tomr_demo.processes import Children
with Children(Path({str(tmp_path)!r})) as children:
    for name in "ab":
        children.start(name, {SLEEP!r})
    print("pids", *(children.named(name).popen.pid for name in "ab"), flush=True)
    signal.pause()
"""
    parent = spawn([sys.executable, "-c", script])
    output = parent.wait_for_output("pids")
    pids = [int(word) for word in output.partition("pids")[2].split()]
    logs = [tmp_path / f"{name}.log" for name in "ab"]
    wait_until(lambda: all("up" in log.read_text() for log in logs), "both processes to run")
    parent.signal(signal.SIGKILL)
    wait_until(lambda: not any(is_alive(pid) for pid in pids), "the end of the processes")
    assert len(pids) == 2


def test_a_process_that_ends_early_is_named_with_its_last_lines(tmp_path: Path) -> None:
    def ended(program: str) -> Children:
        children = Children(tmp_path)
        children.start("power_model", [sys.executable, "-c", program])
        children.named("power_model").popen.wait()
        return children

    crash = "import sys; print('deep trouble'); sys.exit(3)"
    with ended(crash) as children, pytest.raises(DemoFailure, match="exit code 3") as failed:
        children.check()
    assert "power_model" in str(failed.value)
    assert "deep trouble" in str(failed.value)
    complaint = "import sys; print('error: mass is -1'); sys.exit(2)"
    with (
        ended(complaint) as children,
        pytest.raises(InputError, match=r"^power_model: mass is -1$"),
    ):
        children.check()
    killed = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    with ended(killed) as children, pytest.raises(DemoFailure, match="SIGKILL"):
        children.check()


def demo(*arguments: str | Path, drive: float = 1.5) -> list[str]:
    """A command that runs the demo with short acts and one fault."""
    program = f"""
import sys
from tomr_demo import acts, main
fault = next(act for act in acts.ACTS if act.fault_id == "encoder_lost")
fault = acts.evolve(fault, duration=1.5)
main.ACTS = (acts.Act("healthy", {drive}), fault, acts.Act("healthy", 1.5))
sys.exit(main.main())
"""
    return [sys.executable, "-c", program, *(str(argument) for argument in arguments)]


@pytest.mark.serial
def test_demo_names_a_fault_over_dds_and_leaves_a_bag_and_a_figure(
    tmp_path: Path, spawn: Callable[..., Any]
) -> None:
    out = tmp_path / "demo_output"
    process = spawn(demo("--out", out))
    assert process.wait(120.0) == 0, process.output
    assert "wheel 1: encoder lost" in process.output
    result = json.loads((out / "result.json").read_text())
    assert [stretch["passed"] for stretch in result["stretches"]] == [True] * 3
    assert 0.0 < result["stretches"][1]["delay_s"] <= 1.0
    assert result["stretches"][1]["evidence"]
    with open_recording(out / "recording") as opened:
        topics = all_topics(shipped_robot("reference"))
        assert {name: topic.type_name for name, topic in topics.items()} == opened.topics
        assert opened.warning is None
    assert (out / "timeline.png").stat().st_size > 50_000
    assert {log.stem for log in (out / "logs").iterdir()} == set(PROCESSES)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_demo_ends_all_its_processes_on_a_signal_even_if_it_comes_twice(
    tmp_path: Path, spawn: Callable[..., Any], number: signal.Signals
) -> None:
    out = tmp_path / "demo_output"
    process = spawn(demo("--out", out, drive=600.0))
    process.wait_for_output("true: healthy", 90.0)
    children = children_of(process.pid)
    assert len(children) == len(PROCESSES)
    for _ in range(2):
        process.signal(number, group=True)
    assert process.wait(20.0) == 130
    assert not any(is_alive(pid) for pid in children)
    assert "Traceback" not in process.output
    with open_recording(out / "recording") as opened:
        assert "/joint_states" in opened.topics


def test_demo_keeps_away_from_a_robot_that_is_there_already(
    tmp_path: Path, spawn: Callable[..., Any]
) -> None:
    context = Context()
    rclpy.init(context=context)
    try:
        node = Node("another_robot", context=context)
        node.create_publisher(JointState, "joint_states", 10)
        process = spawn(demo("--out", tmp_path / "out"))
        assert process.wait(60.0) == 2, process.output
        assert "another process publishes /joint_states" in process.output
    finally:
        rclpy.shutdown(context=context)


def test_demo_names_which_process_refused_its_input(
    tmp_path: Path, spawn: Callable[..., Any]
) -> None:
    weights = tmp_path / "weights.npz"
    weights.write_bytes(b"no weights")
    process = spawn(demo("--out", tmp_path / "out", "--weights", weights))
    assert process.wait(60.0) == 2, process.output
    assert "error: fault_classifier: " in process.output
    assert str(weights) in process.output
