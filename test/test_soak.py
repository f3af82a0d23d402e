"""A short soak over DDS, and that its judge sees what it should: see bench/soak.py."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

BENCH = Path(__file__).parents[1] / "bench"
SECOND = 1_000_000_000
sys.path.insert(0, str(BENCH))

from soak.acts import FAULTS, Flood, Jump, Kill, Pause, Rest, acts  # noqa: E402
from soak.crew import Crew  # noqa: E402
from soak.judge import Delays, Process, memory_items, table  # noqa: E402
from soak.stage import Soak  # noqa: E402


@pytest.mark.serial
def test_a_minute_passes(tmp_path: Path, ros_environment: Mapping[str, str]) -> None:
    run = subprocess.run(
        [
            *(sys.executable, BENCH / "soak.py", "--out", tmp_path),
            *("--minutes", "0.7", "--flood", "1"),
        ],
        env=dict(ros_environment),
        capture_output=True,
        text=True,
        timeout=170,
    )
    assert run.returncode == 0, run.stdout + run.stderr + (tmp_path / "course.txt").read_text()
    for what in ("flood of encoders", "killed", "clock jumps", "silent", "lost comes", "lost goes"):
        assert what in run.stdout
    assert "FAIL" not in run.stdout


def test_a_course_holds_every_fault_and_every_interruption() -> None:
    course = [act for act, _ in zip(acts(1, 20.0), range(60), strict=False)]
    assert {act.condition.fault for act in course} == {"", *(fault.fault for fault in FAULTS)}
    kinds = {type(one) for act in course for one in act.interruptions}
    assert kinds == {Flood, Jump, Kill, Pause, Rest}
    jumps = {one.by for act in course for one in act.interruptions if isinstance(one, Jump)}
    assert min(jumps) < 0.0 < max(jumps)


def test_a_late_verdict_is_a_miss() -> None:
    delays = Delays()
    delays.add("gap", 1.9)
    delays.add("fault goes", 1.9)
    assert all(item.passed for item in delays.items())
    delays.add("gap", 2.1)
    gone, gap = sorted(delays.items(), key=lambda item: item.passed, reverse=True)
    assert gone.passed
    assert not gap.passed
    assert "1 late" in gap.found
    assert "FAIL" in table(delays.items())
    hearing = Delays("messages after", 6.0)
    hearing.add("a kill", 5.9)
    assert hearing.items()[0].what == "messages after: a kill"
    assert hearing.items()[0].passed
    hearing.add("a kill", 6.1)
    assert not hearing.items()[0].passed


@pytest.mark.parametrize(("growth", "passed"), [(0.04, True), (0.06, False), (-0.06, False)])
def test_memory_that_changes_after_warm_up_is_a_miss(growth: float, passed: bool) -> None:
    ages = range(0, 1000, 10)
    samples = [(age, 50.0 if age < 100 else 100.0 * (1.0 + growth * age / 990)) for age in ages]
    steady = [(float(age), 80.0) for age in ages]
    short = [(200.0 + age, 10.0 * age) for age in range(1, 10)]  # killed before it was warm
    lives = [Process("a", samples), Process("a", steady), Process("a", short)]
    (item,) = memory_items(lives, 100.0)
    assert item.passed == passed
    assert "in 2 lives" in item.found


NODE = """
import signal, subprocess, sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit(CODE))
MORE
print("publishes something", flush=True)
signal.pause()
"""


@pytest.mark.parametrize(
    ("code", "more", "found"),
    [
        ("0", "", {}),
        ("1", "", {"nodes end when asked to, and only then": "node: code 1"}),
        (
            "0",
            "print('Traceback'); sys.exit(0)",
            {
                "nodes end when asked to, and only then": "node ended by itself",
                "tracebacks in logs": "node",
            },
        ),
        (
            "0",
            "subprocess.Popen(['tail', '-f', '/dev/null'], start_new_session=True)",
            {"processes left behind": "1"},
        ),
    ],
)
def test_nodes_that_end_badly_or_leave_something_are_misses(
    code: str, more: str, found: dict[str, str], tmp_path: Path, wait_until: Callable[..., Any]
) -> None:
    text = NODE.replace("CODE", code).replace("MORE", more)
    crew = Crew(lambda name: [sys.executable, "-c", text], tmp_path)
    crew.start("node")
    wait_until(lambda: crew.is_up("node") or crew.ended(), "the node")
    assert {item.what: item.found for item in crew.end() if not item.passed} == found


def test_clocks_that_jump_stay_where_stamps_can_follow() -> None:
    shift, farthest = 0.0, 0.0
    for _, act in zip(range(2000), acts(6, 20.0), strict=False):
        for one in act.interruptions:
            shift += one.by if isinstance(one, Jump) else 0.0
            farthest = max(farthest, abs(shift))
    assert 3e7 <= farthest < 6e7


def test_a_killed_node_s_time_begins_when_it_is_up_again() -> None:
    """It was up at 5 s, heard its peers at 6.5 s and was right at 7 s: 2 s."""
    now = SimpleNamespace(now_ns=5 * SECOND)
    delays, hearing = Delays(), Delays("messages after", 2.0)

    def until(condition: Callable[[], object], what: str) -> None:
        assert condition()
        if what.endswith("hears again"):
            now.now_ns = 13 * SECOND // 2

    stage = SimpleNamespace(
        _relay=now, _crew=Mock(), _half=60 * SECOND, _kills=0, _note=Mock(), _until=until,
        _hearing=hearing, _delays=delays, _allowed=set(), _drive=Mock(),
        _condition=SimpleNamespace(states=("normal",), fault=""),
        _verdicts={"three": ("normal", 7 * SECOND)},
    )  # fmt: skip

    def await_verdict(*arguments: Any, **more: Any) -> None:
        now.now_ns = 7 * SECOND
        Soak._await_verdict(stage, *arguments, **more)  # type: ignore[arg-type]

    stage._await_verdict = await_verdict
    Soak._kill(stage)  # type: ignore[arg-type]
    assert ["most 2.00 s" in item.found for item in delays.items()] == [True]
    assert ["most 1.50 s" in item.found for item in hearing.items()] == [True]
