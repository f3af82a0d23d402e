"""The folder that a demo leaves behind."""

import json
import shutil
from pathlib import Path

from tomr_demo.score import Scoreboard
from tomr_power_model.errors import InputError
from tomr_power_model.files.write import write_text
from tomr_power_model.messages.plain import NANOSECONDS

_MARK = "Left behind by tomr_demo, whose next run replaces it."
_README = f"""\
{_MARK}

recording/     rosbag2 (mcap) of all topics of the robot and of the suite; look into it with
               `ros2 bag info`, PlotJuggler or Foxglove; play it with bag_replay
timeline.png   power measured and predicted, residuals, what was true and what was named;
               drawn from the recording: tomr_demo --figure recording
result.json    delays and verdicts
robot.yaml     the robot; diagnose its recording again without ROS:
               tomr_diagnose recording --robot robot.yaml
logs/          what each process printed
"""
RECORDING, FIGURE, RESULT = "recording", "timeline.png", "result.json"
ROBOT, LOGS, README = "robot.yaml", "logs", "README.txt"


def make_output(wanted: Path) -> Path:
    """Make the folder, or clear it of an earlier demo; anything else there is left alone.

    A folder in use for something else is not touched: the next free of `<wanted>_2`, `<wanted>_3`
    is taken. Raises InputError if it cannot be made.
    """
    try:
        folder = _free(wanted)
        folder.mkdir(parents=True, exist_ok=True)
        for name in (RECORDING, FIGURE, RESULT, ROBOT, LOGS, README):
            _remove(folder / name)
        write_text(folder / README, _README)
        (folder / LOGS).mkdir()
    except OSError as error:
        raise InputError(
            f"--out {wanted}: cannot be written ({error.strerror}): name another folder"
        ) from None
    return folder


def _free(wanted: Path) -> Path:
    number, folder = 1, wanted
    while not _is_free(folder):
        number += 1
        folder = wanted.with_name(f"{wanted.name}_{number}")
    return folder


def _is_free(folder: Path) -> bool:
    """Whether it is absent, an empty folder or one of an earlier demo."""
    if not folder.is_dir():
        return not folder.exists() and not folder.is_symlink()
    readme = folder / README
    if readme.is_file():
        return readme.read_text(errors="replace").startswith(_MARK)
    return not any(folder.iterdir())


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_result(path: Path, board: Scoreboard) -> None:
    """Write delays [s] and verdicts of all stretches as JSON."""
    stretches = [
        {
            "true": stretch.title,
            "expected": stretch.expected,
            "onset_ns": stretch.start_ns,
            "named_ns": None if stretch.right is None else stretch.right.stamp_ns,
            "delay_s": None if stretch.delay_ns is None else stretch.delay_ns / NANOSECONDS,
            "probability": None if stretch.right is None else stretch.right.probability,
            "evidence": [] if stretch.right is None else list(stretch.right.evidence),
            "held": round(stretch.held(board.now_ns), 4),
            "also_named": list(stretch.strays),
            "passed": stretch.passed(board.now_ns),
        }
        for stretch in board.stretches
    ]
    document = {"passed": board.passed, "stretches": stretches}
    write_text(path, json.dumps(document, indent=2) + "\n")
