"""tomr_simulate: recordings, pictures and complaints."""

import struct
from pathlib import Path

import pytest
from matplotlib.image import imread

from tomr_power_model.errors import InputError
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.recordings import open_recording
from tomr_sim_bridge.cli.simulate import START_NS, main
from tomr_sim_bridge.plant.picture import save_picture

SHORT = """\
name: short
phases:
  - {twist: [0.3, 0.0, 0.0], duration: 0.5}
faults:
  - {fault: floor_slippery, start: 0.2, severity: 0.5}
"""


@pytest.fixture
def mission(tmp_path: Path) -> str:
    file = tmp_path / "short.yaml"
    file.write_text(SHORT)
    return str(file)


def contents(path: Path) -> list[tuple[str, int, bytes]]:
    with open_recording(path) as recording:
        return [(topic, stamp, bytes(raw)) for topic, _, raw, stamp in recording.raw_messages()]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_recording_holds_the_topics_of_the_contract(
    storage: str, mission: str, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    assert main([mission, "--out", str(bag), "--quiet", "--storage", storage]) == 0
    with open_recording(bag) as recording:
        assert recording.topics == {
            "/battery_state": "sensor_msgs/msg/BatteryState",
            "/cmd_vel": "geometry_msgs/msg/TwistStamped",
            "/ground_truth/faults": "diagnostic_msgs/msg/DiagnosticArray",
            "/ground_truth/odom": "nav_msgs/msg/Odometry",
            "/imu/data": "sensor_msgs/msg/Imu",
            "/joint_states": "sensor_msgs/msg/JointState",
            "/odom": "nav_msgs/msg/Odometry",
            "/wheel_1/power": "sensor_msgs/msg/BatteryState",
            "/wheel_2/power": "sensor_msgs/msg/BatteryState",
            "/wheel_3/power": "sensor_msgs/msg/BatteryState",
        }
        counts: dict[str, int] = {}
        for topic, _, message, stamp in recording.messages():
            counts[topic] = counts.get(topic, 0) + 1
            assert header_stamp_ns(message) == stamp
        assert recording.start_ns == START_NS
        assert counts["/cmd_vel"] == 10
        assert counts["/joint_states"] == 51


def test_recorded_values_survive(mission: str, tmp_path: Path) -> None:
    main([mission, "--out", str(tmp_path / "bag"), "--quiet"])
    with open_recording(tmp_path / "bag") as recording:
        last = {topic: message for topic, _, message, _ in recording.messages()}
    assert last["/cmd_vel"].twist.linear.x == 0.3
    assert last["/joint_states"].name == ["wheel_1_joint", "wheel_2_joint", "wheel_3_joint"]
    assert last["/joint_states"].velocity[1] > 4.0
    assert last["/wheel_2/power"].current < -0.05
    assert last["/imu/data"].orientation_covariance[0] == -1.0
    slippery = next(s for s in last["/ground_truth/faults"].status if s.name == "floor_slippery")
    assert {pair.key: pair.value for pair in slippery.values}["active"] == "1"


def test_same_seed_gives_the_same_recording(mission: str, tmp_path: Path) -> None:
    for name, seed in (("one", "4"), ("two", "4"), ("other", "5")):
        assert main([mission, "--out", str(tmp_path / name), "--seed", seed, "--quiet"]) == 0
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    assert contents(tmp_path / "one") != contents(tmp_path / "other")


def test_robot_of_the_command_line_wins(mission: str, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    assert main([mission, "--out", str(bag), "--robot", "robotino_v2", "--quiet"]) == 0
    with open_recording(bag) as recording:
        assert "/battery_state" not in recording.topics  # that robot does not measure it


def test_existing_recording_is_kept(
    mission: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "precious").touch()
    assert main([mission, "--out", str(tmp_path / "bag"), "--quiet"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert [entry.name for entry in (tmp_path / "bag").iterdir()] == ["precious"]


def test_list_names_missions_and_robots(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    listed = capsys.readouterr().out
    for name in ("paper_phases:", "square_encoder_lost:", "circle:", "random_tour:", "reference"):
        assert f"  {name}" in listed


def test_picture_shows_a_robot(tmp_path: Path) -> None:
    path = tmp_path / "robot.png"
    try:
        save_picture("reference", path)
    except InputError as error:
        pytest.skip(f"no GL library on this machine: {error}")
    width, height = struct.unpack(">II", path.read_bytes()[16:24])
    assert (width, height) == (1280, 960)
    pixels = imread(path)[..., :3]
    orange = (pixels[..., 0] > 0.6) & (pixels[..., 2] < 0.2)
    black = pixels.max(axis=-1) < 0.2
    assert orange.mean() > 0.002  # the band around the body
    assert black.mean() > 0.02  # rollers and lidar


def test_picture_without_gl_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    assert main(["--picture", str(tmp_path / "robot.png")]) == 2
    assert "none of nonsense can render here: install libegl1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "no mission given"),
        (["square"], "--out is missing"),
        (["--out", "bag", "--picture", "r.png"], "--out needs a mission"),
        (["nowhere", "--out", "bag"], "nowhere: cannot be read"),
        (["square", "--out", "bag", "--robot", "nobody.yaml"], "nobody.yaml: cannot be read"),
        (["square", "--out", "bag", "--seed", "-1"], "--seed = -1: give 0 or more"),
        (["--picture", "robot.jpg"], "robot.jpg: the picture is a PNG"),
        (["--picture", "no/such/robot.png"], "there is no folder no/such: create it first"),
    ],
)
def test_bad_input_is_reported_in_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
