"""The command: what it writes, and one clear line for bad input."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tomr_odometry.cli import main
from tomr_odometry.creep import Creep
from tomr_odometry.learn.cli import learnt_text
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.robot import load_robot, read_node_sections
from tomr_power_model.robot.files import robot_file

BAG = Path(__file__).parents[3] / "bags" / "square"


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("odometry") / "out"
    assert main([str(BAG), "--out", str(out), "--reference", "ground_truth/odom"]) == 0
    return out


def test_it_writes_a_bag_a_summary_and_a_picture(written: Path) -> None:
    assert {item.name for item in written.iterdir()} == {"bag", "odometry.json", "odometry.png"}
    found = json.loads((written / "odometry.json").read_text())
    assert found["end_error_m"] < found["end_error_of_wheels_m"] + 0.01
    assert found["slipping_share"] == 0.0
    assert found["sensors"]["imu/data"] == "used"


# It ends, by a signal, in the write that makes a file longer than this, as a kill would.
_CUT_SHORT = """
import resource, signal, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), int(sys.argv[1])))
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
from tomr_odometry.cli import main
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize(
    ("share", "left"), [(0.9, []), (1.1, ["odometry.json", "odometry.png"])], ids=["png", "bag"]
)
def test_a_run_that_is_killed_while_it_writes_leaves_whole_files_or_none(
    share: float, left: list[str], written: Path, tmp_path: Path
) -> None:
    # The picture is the longest file but for the bag, which is written last.
    most, out = int(share * (written / "odometry.png").stat().st_size), tmp_path / "out"
    arguments = [str(most), str(BAG), "--out", str(out), "--reference", "ground_truth/odom"]
    run = subprocess.run([sys.executable, "-c", _CUT_SHORT, *arguments], capture_output=True)
    assert run.returncode == -signal.SIGXFSZ
    assert run.stdout == b""
    assert sorted(name for name in os.listdir(out) if not name.startswith(".")) == left
    for name in left:
        assert (out / name).read_bytes() == (written / name).read_bytes()


@pytest.mark.parametrize(
    ("redirection", "codes"), [("> /dev/full", {74}), (">&-", {0}), ("| true", {0, 141})]
)
def test_output_that_cannot_be_written(
    redirection: str, codes: set[int], capfd: pytest.CaptureFixture[str]
) -> None:
    words = f"{sys.executable} -c 'import sys; from tomr_odometry import entry;"
    command = f"{words} sys.exit(entry.tomr_odometry())' --parameters {redirection}"
    run = subprocess.run(["bash", "-c", f"{command}; exit ${{PIPESTATUS[0]}}"], check=False)
    assert run.returncode in codes
    printed = capfd.readouterr().err
    assert "Traceback" not in printed
    assert printed.count("\n") <= 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "use_imus=true"], "use_imus is unknown"),
        (["--set", "decision_rate=1000"], "decision_rate = 1000"),
        (["--set", "decision_rate"], "write name=value"),
        (["--reference", "map_pose"], "no topic /map_pose"),
        (["--reference", "cmd_vel"], "give a nav_msgs/Odometry"),
        (["--robot", "nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(BAG), "--out", str(tmp_path / "out"), *arguments]) == 2
    printed = capsys.readouterr().err.strip()
    assert words in printed
    assert printed.count("\n") == 0


def test_learnt_creep_is_read_again_and_the_rest_stays(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(learnt_text("reference", Creep((0.1, 0.2, 0.3), 0.4, 0.05), ["a"]))
    again = learnt_text(str(file), Creep((0.5, 0.5, 0.5), 0.0, 0.1), ["b"])
    file.write_text(again)
    assert load_robot(file) == load_robot("reference")
    given = read_node_sections(file, ["slip_odometry"])
    assert OdometrySettings.given(given, "test").creep == Creep((0.5, 0.5, 0.5), 0.0, 0.1)
    assert again.count("slip_odometry:") == 1


@pytest.mark.parametrize("name", ["slip_odometry:  # mine", '"slip_odometry":', "/slip_odometry:"])
def test_learnt_creep_takes_the_place_of_a_section_however_it_is_written(
    name: str, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    reference = robot_file("reference").read_text()
    own = f"{name}\n  ros__parameters:\n    use_imu: false\n    creep: {{growth: 9.0}}\n"
    file.write_text(f"{reference}\n{own}")
    file.write_text(learnt_text(str(file), Creep((0.1, 0.2, 0.3), 0.4, 0.05), ["a"]))
    settings = OdometrySettings.given(read_node_sections(file, ["slip_odometry"]), "test")
    assert settings.creep == Creep((0.1, 0.2, 0.3), 0.4, 0.05)
    assert not settings.use_imu


def test_learning_needs_a_floor_for_each_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(BAG), "--reference", "ground_truth/odom", "--out", str(tmp_path / "out")]
    assert main(["learn", *arguments, "--floor", "lab=other"]) == 2
    assert "belongs to 0 floors" in capsys.readouterr().err
