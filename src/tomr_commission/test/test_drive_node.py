"""`tomr_commission drive` with sim_bridge over DDS."""

import signal
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock, PropertyMock

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from tomr_commission.cli import main
from tomr_commission.driving import STILL, Command
from tomr_commission.nodes.drive_node import DriveNode, DriveRequest, _follow
from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_INTERRUPTED
from tomr_power_model.drive.read import read_drive
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
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
def bridge(spawn: Callable, request: pytest.FixtureRequest) -> Callable:
    more = getattr(request, "param", [])
    parameters = ("publish_clock:=true", "real_time_factor:=2.0", "start_time:=100.0", *more)
    pairs = [part for parameter in parameters for part in ("-p", parameter)]
    return spawn(["sim_bridge", "--ros-args", "--params-file", str(ROBOT), *pairs])


@pytest.mark.parametrize("bridge", [["measurement.motor_voltage:=true"]], indirect=True)
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
    assert not seen.command[-5:].any()  # commanded to stand
    # Twice within command_timeout, however slow the machine.
    assert np.median(np.diff(seen.command_time)) < 0.25
    with open_recording(Path(command[5])) as recording:
        assert {"/imu/data", "/odom", "/motor_voltage"} <= {*recording.topics}


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
def operator(request: pytest.FixtureRequest) -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context)
    node = Node(getattr(request, "param", "operator"), context=context)
    yield node
    node.destroy_node()
    context.shutdown()


def test_two_do_not_drive(
    bridge: object, operator: Node, spawn: Callable, command: list[str]
) -> None:
    operator.create_publisher(TwistStamped, "cmd_vel", 10)
    drive = spawn(command)
    assert drive.popen.wait(20.0) == EXIT_BAD_INPUT
    assert drive.output == (
        "error: cmd_vel is published by /operator: stop that, two cannot drive\n"
    )
    assert not Path(command[5]).exists()  # it never began


@pytest.mark.parametrize("operator", ["tomr_commission_drive"], indirect=True)
def test_who_begins_to_command_in_mid_drive_stops_it(
    bridge: object, operator: Node, spawn: Callable, command: list[str], wait_until: Callable
) -> None:
    """Also a second one of the same command."""
    drive = spawn(command)
    tour = Path(command[5])
    wait_until(lambda: list(tour.parent.glob(f".{tour.name}.*.part")), "a recording under way")
    operator.create_publisher(TwistStamped, "cmd_vel", 10)
    assert drive.popen.wait(20.0) == EXIT_BAD_INPUT
    assert drive.output.startswith("error: stopped after ")
    assert drive.output.endswith(
        "cmd_vel is published by /tomr_commission_drive: stop that, two cannot drive\n"
    )
    assert tour.exists()


@pytest.mark.parametrize("bridge", [["cmd_vel_type:=twist"]], indirect=True)
def test_wheels_in_another_order_stop_it_after_the_slow_part(
    bridge: object, spawn: Callable, command: list[str], tmp_path: Path
) -> None:
    """The robot takes plain twists; wheels 2 and 3 answer to each other's name."""
    text = ROBOT.read_text(encoding="utf-8")
    names = "[wheel_1_joint, wheel_2_joint, wheel_3_joint]"
    swapped = text.replace(names, "[wheel_1_joint, wheel_3_joint, wheel_2_joint]")
    assert swapped != text
    description = tmp_path / "swapped.yaml"
    description.write_text(swapped, encoding="utf-8")
    command[3] = str(description)
    drive = spawn(command)
    assert drive.popen.wait(20.0) == EXIT_BAD_INPUT
    assert "times as fast as commanded" in drive.output
    assert "see to robot.wheel_names" in drive.output
    seen = read_drive(Path(command[5]), shipped_robot("reference"))
    assert 0.0 < np.abs(seen.command[:, 0]).max() < 0.1  # never more than slowly


def leaping(leap: float) -> Mock:
    """A node whose clock leaps once."""

    class Leaping(Mock):
        seconds = PropertyMock(side_effect=[0.1, 0.2, 0.2 + leap, 9.0])

    node = Leaping(silent=0.0, rivals="")
    node.watch.problem.return_value = ""
    node.watch.mistakes.return_value = []
    return node


@pytest.mark.parametrize("leap", [-0.3, 2.5])
def test_a_clock_that_leaps_stops_it(leap: float) -> None:
    request = DriveRequest(shipped_robot("reference"), (Command(8.0, STILL),), 4.0)
    with pytest.raises(InputError, match=f"stopped: the clock leaps by {leap:.1f} s: see to it"):
        _follow(leaping(leap), request, Mock(), Mock())


@pytest.mark.parametrize("leap", [-0.1, 1.9])
def test_a_clock_that_is_set_a_little_does_not(leap: float) -> None:
    request = DriveRequest(shipped_robot("reference"), (Command(0.2 + leap, STILL),), 4.0)
    node = leaping(leap)
    _follow(node, request, Mock(), Mock())
    node.command.assert_called_once_with(STILL)


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


def test_it_stands_before_it_names_a_rival() -> None:
    """A publisher is known a moment before the name of its node."""
    node = leaping(0.1)
    node.rivals = "published by a node without a name"
    node.halt.side_effect = lambda: setattr(node, "rivals", "published by /teleop")
    request = DriveRequest(shipped_robot("reference"), (Command(8.0, STILL),), 4.0)
    with pytest.raises(InputError, match=r"stopped after 0.1 s: published by /teleop"):
        _follow(node, request, Mock(), Mock())


def test_a_rival_whose_name_has_not_come_yet_is_one() -> None:
    info = SimpleNamespace(
        node_namespace="_NODE_NAMESPACE_UNKNOWN_", node_name="_NODE_NAME_UNKNOWN_"
    )
    node = SimpleNamespace(
        get_publishers_info_by_topic=lambda topic: [info],
        get_fully_qualified_name=lambda: "/tomr_commission_drive",
        _outlet=object(),
    )
    rivals = DriveNode.rivals.fget(node)  # type: ignore[attr-defined]
    assert rivals == "cmd_vel is published by a node without a name: stop that, two cannot drive"
