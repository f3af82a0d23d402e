"""`tomr_commission drive` with sim_bridge over DDS."""

import signal
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

import pytest
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from tomr_commission.cli import main
from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_INTERRUPTED
from tomr_power_model.drive.read import read_drive
from tomr_power_model.robot import shipped_robot

ROBOT = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
MISSION = """\
name: short
description: A move and a spin.
phases:
- {twist: [0.3, 0.0, 0.0], duration: 1.0}
- {twist: [0.0, 0.0, 0.5], duration: 1.0}
"""


@pytest.fixture
def command(tmp_path: Path) -> list[str]:
    mission = tmp_path / "mission.yaml"
    mission.write_text(MISSION, encoding="utf-8")
    return [
        *("tomr_commission", "drive", "--robot", "reference", "--out", str(tmp_path / "tour")),
        *("--mission", str(mission), "--sim-time", "--yes", "--quiet"),
    ]


@pytest.fixture
def bridge(spawn: Callable) -> Callable:
    parameters = ("publish_clock:=true", "real_time_factor:=2.0", "start_time:=100.0")
    pairs = [part for parameter in parameters for part in ("-p", parameter)]
    return spawn(["sim_bridge", "--ros-args", "--params-file", str(ROBOT), *pairs])


def test_it_drives_and_records(bridge: object, spawn: Callable, command: list[str]) -> None:
    drive = spawn(command)
    assert drive.popen.wait(40.0) == 0, drive.output
    assert drive.output == ""
    seen = read_drive(Path(command[5]), shipped_robot("reference"))
    assert seen.notes == ()
    assert 7.0 < seen.duration < 10.0
    speeds = seen.command[:, 0]
    assert speeds.max() == pytest.approx(0.3)
    first = speeds[speeds > 0.0][0]
    assert first == pytest.approx(0.09)  # slowly
    assert not seen.command[-5:].any()  # told to stand
    assert len(seen.command_time) > 100


def test_it_stops_when_the_driver_dies(
    bridge: "Callable", spawn: Callable, command: list[str], wait_until: Callable
) -> None:
    drive = spawn(command)
    tour = Path(command[5])
    wait_until(lambda: list(tour.parent.glob(f".{tour.name}.*.part")), "a recording under way")
    bridge.popen.kill()  # type: ignore[attr-defined]
    assert drive.popen.wait(20.0) == EXIT_BAD_INPUT
    assert "joint_states: nothing for 0.5 s: see to the driver" in drive.output
    assert drive.output.count("\n") == 1
    assert tour.exists()  # what was recorded is kept


def test_ctrl_c_leaves_it_standing(
    bridge: object, operator: Node, spawn: Callable, command: list[str], wait_until: Callable
) -> None:
    sent: list[float] = []
    operator.create_subscription(
        TwistStamped, "cmd_vel", lambda message: sent.append(message.twist.linear.x), 100
    )
    executor = SingleThreadedExecutor(context=operator.context)
    executor.add_node(operator)
    drive = spawn(command)
    wait_until(lambda: executor.spin_once(0.1) or (sent and sent[-1] > 0.0), "a robot that drives")
    drive.popen.send_signal(signal.SIGINT)
    wait_until(
        lambda: executor.spin_once(0.1) or drive.popen.poll() is not None, "the end of the drive"
    )
    executor.shutdown()
    assert drive.popen.returncode == EXIT_INTERRUPTED
    assert drive.output == "interrupted\n"
    assert not any(sent[-5:])
    assert Path(command[5]).exists()  # what was recorded is kept


@pytest.fixture
def operator() -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context)
    node = Node("operator", context=context)
    yield node
    node.destroy_node()
    context.shutdown()


def test_two_do_not_drive(
    bridge: object, operator: Node, spawn: Callable, command: list[str]
) -> None:
    operator.create_publisher(TwistStamped, "cmd_vel", 10)
    drive = spawn(command)
    assert drive.popen.wait(20.0) == EXIT_BAD_INPUT
    assert "cmd_vel is published by /operator: stop that, two cannot drive" in drive.output


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        (["--speed", "9"], "give 0.05 to 5 m/s"),
        (["--mission", "nowhere.yaml"], "nowhere.yaml"),
        ([], "the robot will move: give --yes where nobody can be asked"),
    ],
)
def test_bad_input(
    more: list[str],
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    code = main(["drive", "--robot", "reference", "--out", str(tmp_path / "tour"), *more])
    assert code == EXIT_BAD_INPUT
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert not (tmp_path / "tour").exists()
