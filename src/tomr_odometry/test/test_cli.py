"""The command: what it writes, and one clear line for bad input."""

import json
from pathlib import Path

import pytest

from tomr_odometry.cli import main
from tomr_odometry.creep import Creep
from tomr_odometry.learn.cli import learnt_text
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.robot import load_robot, read_node_sections

BAG = Path(__file__).parents[3] / "bags" / "square"


def test_it_writes_a_bag_a_summary_and_a_picture(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main([str(BAG), "--out", str(out), "--reference", "ground_truth/odom"]) == 0
    assert {item.name for item in out.iterdir()} == {"bag", "odometry.json", "odometry.png"}
    found = json.loads((out / "odometry.json").read_text())
    assert found["end_error_m"] < found["end_error_of_wheels_m"] + 0.01
    assert found["slipping_share"] == 0.0
    assert found["sensors"]["imu/data"] == "used"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "use_imus=true"], "use_imus is unknown"),
        (["--set", "decision_rate=1000"], "decision_rate = 1000"),
        (["--set", "decision_rate"], "NAME=VALUE"),
        (["--reference", "map_pose"], "no topic /map_pose"),
        (["--reference", "cmd_vel"], "give a nav_msgs/Odometry"),
        (["--robot", "nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(BAG), "--out", str(tmp_path / "out"), *arguments]) == 2
    told = capsys.readouterr().err.strip()
    assert words in told
    assert told.count("\n") == 0


def test_learnt_creep_is_read_again_and_the_rest_stays(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(learnt_text("reference", Creep((0.1, 0.2, 0.3), 0.4, 0.05), ["a"]))
    again = learnt_text(str(file), Creep((0.5, 0.5, 0.5), 0.0, 0.1), ["b"])
    file.write_text(again)
    assert load_robot(file) == load_robot("reference")
    given = read_node_sections(file, ["slip_odometry"])
    assert OdometrySettings.given(given, "test").creep == Creep((0.5, 0.5, 0.5), 0.0, 0.1)
    assert again.count("slip_odometry:") == 1


def test_learning_needs_a_floor_for_each_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(BAG), "--reference", "ground_truth/odom", "--out", str(tmp_path / "out")]
    assert main(["learn", *arguments, "--floor", "lab=other"]) == 2
    assert "belongs to 0 floors" in capsys.readouterr().err
