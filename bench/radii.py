"""Whether a description's radii that the drivers do not share are found, and right ones left alone.

    .venv/bin/python bench/radii.py BAG... --robot robot.yaml [--live | --wrong]

Counts the recordings in which `other_radii` finds something as described; with --live those in
which `inputs: robot.yaml` ever warns. --wrong diagnoses the first with one value off at a time, and
says what is named and noted then.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
from pool import each

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.replayed import Replayed, Task, replay_one
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.calibration.following import expected_speed
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.quality import other_radii
from tomr_power_model.drive.read import read_drive
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import NANOSECONDS, Level
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot
from tomr_power_model.robot.files import robot_file

# By how much each value is off: factors, but of the offset radians.
WRONG: Sequence[Mapping[str, float]] = (
    {},
    {"wheel_radius": 1.03},
    {"wheel_radius": 1.08},
    {"robot_radius": 1.08},
    {"wheel_offset": 0.0349},
    {"wheel_radius": 1.08, "robot_radius": 0.967},
)


def found(bag: Path, robot: str) -> str | None:
    """What is found in a recording, "" where nothing; None where it cannot be read."""
    described = load_robot(robot)
    try:
        drive = cleaned(read_drive(bag, described, None), described)
    except InputError:
        return None
    time, expected = expected_speed(drive, described)
    return "; ".join(map(str, other_radii(drive, described, time, expected)))


def warned(bag: Path, robot: str) -> str | None:
    """What `inputs: robot.yaml` warns of first in a recording, and when; as `found`."""
    try:
        with open_recording(bag) as recording:
            pipeline = Pipeline(load_robot(robot), DiagnosisSettings.of({}, "bench"))
            for receive_ns, step in diagnose(recording, pipeline):
                for report in step.reports:
                    for status in report.statuses:
                        if status.name == "inputs: robot.yaml" and status.level is not Level.OK:
                            seconds = (receive_ns - recording.start_ns) / NANOSECONDS
                            return f"{seconds:.1f} s: {status.message}"
    except InputError:
        return None
    return ""


def changed(robot: str, wrong: Mapping[str, float], path: Path) -> str:
    """A file with a robot some of whose values are off."""
    tree: dict[str, Any] = yaml.safe_load(robot_file(robot).read_text(encoding="utf-8"))
    values = tree["/**"]["ros__parameters"]["robot"]
    for key, off in wrong.items():
        values[key] = values[key] + off if key == "wheel_offset" else values[key] * off
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return str(path)


def _line(wrong: Mapping[str, float], played: Replayed) -> str:
    shares = sorted(played.phases[0].summary.shares.items(), key=lambda item: -item[1])
    named = ", ".join(f"{name} {share:.1%}" for name, share in shares if share > 0.001)
    return f"| {dict(wrong) or 'as described'} | {named} | {'; '.join(played.notes) or '-'} |"


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG")
    parser.add_argument("--robot", required=True)
    parser.add_argument(
        "--live", action="store_true", help="as nodes say it while the robot drives"
    )
    parser.add_argument("--wrong", action="store_true", help="put values wrong, one at a time")
    options = parser.parse_args(arguments)
    if options.wrong:
        with TemporaryDirectory() as folder:
            robots = [
                changed(options.robot, wrong, Path(folder) / f"{number}.yaml")
                for number, wrong in enumerate(WRONG)
            ]
            settings = DiagnosisSettings.of({}, "bench")
            tasks = [Task(options.bags[0], robot, settings) for robot in robots]
            played = each(replay_one, tasks)
        print("| off | named | noted |\n|---|---|---|")
        print("\n".join(_line(*pair) for pair in zip(WRONG, played, strict=True)))
        return EXIT_OK
    look = warned if options.live else found
    seen = each(partial(look, robot=options.robot), options.bags)
    for bag, words in zip(options.bags, seen, strict=True):
        if words:
            print(f"{bag}: {words}")
    read = [words for words in seen if words is not None]
    print(f"found in {sum(map(bool, read))} of {len(read)}; {len(seen) - len(read)} not read")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
