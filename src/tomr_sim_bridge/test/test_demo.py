"""tomr_demo: its score, its processes, what it shows and leaves behind, a short run over DDS."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rich.console import Console
from sensor_msgs.msg import JointState

from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_fault_diag.residuals.messages import residual_message
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.inputs import DIAGNOSTICS
from tomr_power_model.messages.to_bag import to_bag
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.demo import acts, processes
from tomr_sim_bridge.demo.main import main
from tomr_sim_bridge.demo.output import make_output
from tomr_sim_bridge.demo.processes import Children, DemoFailure
from tomr_sim_bridge.demo.score import Named, Scoreboard
from tomr_sim_bridge.demo.topics import PROCESSES, all_topics
from tomr_sim_bridge.demo.view import PlainView, Scene, act_table, now_panel

START = 1_700_000_000_000_000_000
SLEEP = [sys.executable, "-c", "import time; print('up', flush=True); time.sleep(600)"]
DEAF = [
    sys.executable,
    "-c",
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    "print('up', flush=True); time.sleep(600)",
]


def at(seconds: float) -> int:
    return START + round(seconds * 1e9)


def played(
    truths: Sequence[tuple[float, str | None, int]], named: Sequence[tuple[float, str]], end: float
) -> Scoreboard:
    """A board that was told the truth every 0.05 s and the diagnoses, each when it came."""
    board = Scoreboard()
    news = [(time, 0, state) for time, state in named]
    news += [(0.05 * tick, 1, "") for tick in range(1 + round(end / 0.05))]
    for moment, is_truth, state in sorted(news):
        if is_truth:
            *_, (_, fault, wheel) = [t for t in truths if t[0] <= moment + 1e-9]
            board.truth(at(moment), fault, wheel)
        else:
            board.diagnosis(Named(at(moment), state, 0.9, ("wheel_1 power: 3 W above",)))
    board.close()
    return board


SLIPPING = [(0.0, None, 1), (4.0, "floor_slippery", 1), (8.0, None, 1)]


@pytest.mark.parametrize(
    ("named", "verdicts", "delay"),
    [
        ([(-1, "normal"), (4.4, "slip"), (9.2, "normal")], [True, True, True], 0.45),
        ([(-1, "normal"), (4.95, "slip"), (9.2, "normal")], [True, True, True], 1.0),
        ([(-1, "normal"), (5.0, "slip"), (9.2, "normal")], [True, False, True], 1.05),
        ([(-1, "normal"), (9.2, "normal")], [True, False, True], None),
        # Another fault first, the right one in time after it.
        (
            [(-1, "normal"), (4.2, "control system fault"), (4.6, "slip"), (9.2, "normal")],
            [True, True, True],
            0.65,
        ),
        # Named while there was none, and merely repeated when it came.
        ([(-1, "normal"), (3.0, "slip"), (4.4, "slip"), (9, "normal")], [False, False, True], None),
        ([(4.4, "slip"), (9.2, "normal")], [False, True, True], 0.45),
        ([(-1, "normal"), (4.4, "slip")], [True, True, False], 0.45),
        ([(-1, "normal"), (4.4, "slip"), (10.97, "normal")], [True, True, False], 0.45),
        (
            [(-1, "normal"), (4.4, "slip"), (9, "normal"), (10, "motor system fault 2")],
            [True, True, False],
            0.45,
        ),
    ],
)
def test_a_fault_passes_if_named_within_a_second_and_health_if_nothing_is_invented(
    named: Sequence[tuple[float, str]], verdicts: list[bool], delay: float | None
) -> None:
    board = played(SLIPPING, named, 12.0)
    assert [stretch.passed(board.now_ns) for stretch in board.stretches] == verdicts
    # The last truth before the fault is that of 3.95 s.
    measured = board.stretches[1].delay_ns
    assert measured == (None if delay is None else round(delay * 1e9))
    assert board.passed is all(verdicts)


def test_the_wheel_of_a_lost_encoder_has_to_be_named() -> None:
    truths = [(0.0, None, 1), (2.0, "encoder_lost", 3)]
    right = played(truths, [(-1, "normal"), (2.5, "motor system fault 3")], 6.0)
    wrong = played(truths, [(-1, "normal"), (2.5, "motor system fault 1")], 6.0)
    assert right.stretches[1].title == "wheel 3: encoder lost"
    assert right.passed
    assert not wrong.passed
    assert wrong.stretches[1].strays == ("motor system fault 1",)


def test_share_of_the_time_in_which_the_right_name_stood() -> None:
    named = [(-1, "normal"), (4.45, "slip"), (6.45, "normal"), (6.95, "slip"), (9.0, "normal")]
    board = played(SLIPPING, named, 12.0)
    # Of the 3.5 s from the naming to 7.95 s, 0.5 s are called normal.
    assert board.stretches[1].held(board.now_ns) == pytest.approx(3.0 / 3.5)


def test_a_drive_without_a_fault_does_not_pass() -> None:
    assert not played([(0.0, None, 1)], [(-1, "normal")], 5.0).passed


def rendered(scene: Scene, width: int) -> str:
    console = Console(width=width, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(act_table(scene, width), now_panel(scene))
    return console.export_text()


def test_table_shows_what_was_named_how_late_and_what_is_still_to_come() -> None:
    board = played(SLIPPING[:2], [(-1, "normal"), (4.4, "slip")], 5.0)
    scene = Scene(acts.ACTS, board, board.now_ns, 40.0)
    for width in (80, 130):
        text = rendered(scene, width)
        row = next(line for line in text.splitlines() if "floor slippery" in line)
        assert [part in row for part in ("4.0 s", "slip", "0.90", "0.45 s", "PASS")] == [True] * 5
        assert "wheel 1: encoder lost" in text
        assert "wheel_1 power: 3 W above" in text
        assert max(len(line) for line in text.splitlines()) <= width
    assert text.count("PASS") == 2


def test_plain_lines_tell_each_change_once(capsys: pytest.CaptureFixture[str]) -> None:
    view = PlainView(Console(width=130))
    board = Scoreboard()
    view.starting("no /joint_states from sim_bridge yet")
    view.starting("no /joint_states from sim_bridge yet")
    board.diagnosis(Named(at(-0.5), "normal", 1.0))
    for tick in range(60):
        moment = 0.05 * tick
        board.truth(at(moment), "encoder_lost" if tick >= 20 else None, 2)
        if tick % 20 == 19 or tick == 28:
            state = "motor system fault 2" if tick >= 28 else "normal"
            board.diagnosis(Named(at(moment), state, 0.8, ("total power: 70 W above",)))
        view.show(Scene(acts.ACTS, board, board.now_ns, 40.0))
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        "starting the nodes: no /joint_states from sim_bridge yet",
        "0.00 s  true: healthy",
        "0.00 s  /diagnostics: normal, p 1.00",
        "0.95 s  true: wheel 2: encoder lost",
        "1.40 s  /diagnostics: motor system fault 2, p 0.80, after 0.45 s",
        "total power: 70 W above",
    ]


def is_alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for its parent does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def started(children: Children, *commands: Sequence[str]) -> list[int]:
    """Start commands and wait until each has set itself up; returns their process ids."""
    names = [f"process_{number}" for number in range(len(commands))]
    for name, command in zip(names, commands, strict=True):
        children.start(name, command)
    found = [children.named(name) for name in names]
    while not all("up" in child.last_lines() for child in found):
        children.check()
        time.sleep(0.01)
    return [child.popen.pid for child in found]


def test_processes_end_with_the_block_even_if_deaf_or_if_it_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "TIME_TO_END", 0.5)
    pids: list[int] = []

    def fail() -> None:
        with Children(tmp_path) as children:
            pids.extend(started(children, SLEEP, DEAF))
            assert all(is_alive(pid) and os.getsid(pid) == pid for pid in pids)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert len(pids) == 2
    assert not any(is_alive(pid) for pid in pids)
    with Children(tmp_path) as children:
        started(children, SLEEP, DEAF)
        assert children.stop() == ["process_1"]


def test_processes_end_when_the_demo_is_killed(
    tmp_path: Path, spawn: Callable[..., Any], wait_until: Callable[..., Any]
) -> None:
    script = f"""
import time
from pathlib import Path
from tomr_sim_bridge.demo.processes import Children
with Children(Path({str(tmp_path)!r})) as children:
    for name in "ab":
        children.start(name, {SLEEP!r})
    while not all("up" in children.named(name).last_lines() for name in "ab"):
        time.sleep(0.01)
    print("pids", *(children.named(name).popen.pid for name in "ab"), flush=True)
    time.sleep(600)
"""
    parent = spawn([sys.executable, "-c", script])
    output = parent.wait_for_output("pids")
    pids = [int(word) for word in output.partition("pids")[2].split()]
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


def test_only_a_folder_of_an_earlier_demo_is_replaced(tmp_path: Path) -> None:
    first = make_output(tmp_path / "demo_output")
    first.recording.mkdir()
    (first.recording / "old.mcap").write_text("old")
    (first.folder / "notes.txt").write_text("mine")
    again = make_output(tmp_path / "demo_output")
    assert again.folder == first.folder
    assert not again.recording.exists()
    assert (again.folder / "notes.txt").read_text() == "mine"
    other = tmp_path / "thesis"
    other.mkdir()
    (other / "README.txt").write_text("not to be lost")
    assert make_output(other).folder == tmp_path / "thesis_2"
    assert make_output(other).folder == tmp_path / "thesis_2"
    assert [entry.name for entry in other.iterdir()] == ["README.txt"]
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        make_output(tmp_path / "file" / "below")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Ten seconds of a robot that slips from 4 s to 8 s, named after 0.45 s."""
    path = tmp_path / "recording"
    with RecordingWriter(path) as writer:

        def write(topic: str, type_name: str, moment: float, **fields: object) -> None:
            message = bag_message(type_name, header=bag_header(at(moment)), **fields)
            writer.write(topic, type_name, message, at(moment))

        for tick in range(200):
            moment = 0.05 * tick
            slips = 4.0 <= moment < 8.0
            for number in (1, 2, 3):
                power = 4.0 + 2.0 * math.sin(2.5 * moment + number)
                measured = 4.0 if slips else power
                for name, value in (("power", measured), ("power/predicted", power)):
                    write(
                        f"wheel_{number}/{name}",
                        "sensor_msgs/msg/BatteryState",
                        moment,
                        voltage=24.0,
                        current=-value / 24.0,
                    )
            frame = ResidualFrame(at(moment), (Residual(4.0 if slips else 0.2, 1.0, 4.0),) * 10)
            message = residual_message(shipped_robot("reference"), frame)
            writer.write("residuals", DIAGNOSTICS, to_bag(message), at(moment))
            truth = [("floor_slippery", {"active": float(slips), "severity": 0.8})]
            write_diagnostics(write, "ground_truth/faults", moment, truth)
            if tick % 20 == 0 or tick == 88:
                state = "slip" if 4.4 <= moment <= 9.0 else "normal"
                since = at({"slip": 4.3, "normal": 0.0}[state] if moment < 9.5 else 9.4)
                values = {
                    "state": state,
                    "since": f"{since // 10**9}.{since % 10**9:09d}",
                    f"p {state}": 0.9,
                }
                named = [("fault_classifier: drive", values)]
                write_diagnostics(write, "/diagnostics", moment, named)
    return path


def write_diagnostics(
    write: Callable[..., None],
    topic: str,
    moment: float,
    statuses: Sequence[tuple[str, dict[str, Any]]],
) -> None:
    made = [
        bag_message(
            "diagnostic_msgs/msg/DiagnosticStatus",
            name=name,
            values=[
                bag_message("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
                for key, value in values.items()
            ],
        )
        for name, values in statuses
    ]
    write(topic, DIAGNOSTICS, moment, status=made)


def share_of(image: Any, colour: str) -> float:
    """Share of an image's pixels that have a colour such as #8cb8e8."""
    wanted = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return float((np.abs(image[:, :, :3] - wanted).max(axis=2) < 0.01).mean())


def test_figure_is_drawn_from_a_recording(recording: Path) -> None:
    assert main(["--figure", str(recording)]) == 0
    image = matplotlib.image.imread(recording.parent / "timeline.png")
    height, width, _ = image.shape
    assert width > 1500
    assert height > 1000
    # Slip is true for 4 s and named for 4.6 s of 10 s on strips 0.035 of the height; then a heat
    # map that is beyond three bands for 4 s on a third of the height.
    assert share_of(image, "#8cb8e8") == pytest.approx(0.86 * 0.8 * 0.033, rel=0.2)
    assert share_of(image, "#a82a22") == pytest.approx(0.4 * 0.8 * 0.27, rel=0.25)
    assert share_of(image, "#e07b00") > 0.002


def test_figure_of_a_recording_without_predictions_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bag"
    with RecordingWriter(path) as writer:
        message = bag_message("sensor_msgs/msg/BatteryState", header=bag_header(START))
        writer.write("wheel_1/power", "sensor_msgs/msg/BatteryState", message, START)
    assert main(["--figure", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "wheel_1/power" in error
    assert main(["--figure", str(tmp_path / "nothing")]) == 2


def demo(*arguments: str | Path, drive: float = 1.5) -> list[str]:
    """A command that runs the demo with short acts and one fault."""
    program = f"""
import sys
from tomr_sim_bridge.demo import acts, main
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


def children_of(pid: int) -> list[int]:
    listing = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True
    )
    return [int(word) for word in listing.stdout.split()]


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


def test_demo_tells_which_process_refused_its_input(
    tmp_path: Path, spawn: Callable[..., Any]
) -> None:
    weights = tmp_path / "weights.npz"
    weights.write_bytes(b"no weights")
    process = spawn(demo("--out", tmp_path / "out", "--weights", weights))
    assert process.wait(60.0) == 2, process.output
    assert "error: fault_classifier: " in process.output
    assert str(weights) in process.output
