"""tomr_simulate: drive a mission with the simulated robot and record it."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import Robot, load_robot, shipped_robots
from tomr_sim_bridge.missions import (
    Mission,
    drive,
    load_mission,
    shipped_missions,
    start_mission,
)
from tomr_sim_bridge.plant.picture import save_picture

START_NS = 1_700_000_000 * NANOSECONDS  # a fixed date, so that equal runs give equal recordings

_EPILOG = """\
examples:
  tomr_simulate square --out square_bag
  tomr_simulate paper_phases_encoder_lost --out bag --seed 3 --robot my_robot.yaml
  tomr_simulate my_mission.yaml --out bag --storage sqlite3
  tomr_simulate --picture robot.png
  tomr_simulate --list

The recording holds cmd_vel, joint_states, <wheel>/power, battery_state, imu/data, odom, and the
truth on ground_truth/odom and ground_truth/faults. The same mission, robot and seed give the same
recording. Exit code 0: done; 2: bad input, reported in one line.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of the command."""
    return run_main(_simulate, arguments)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_simulate",
        description="Drive a mission with the simulated robot and record it as rosbag2.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("mission", nargs="?", help="a shipped mission's name or a mission file")
    parser.add_argument("--out", type=Path, metavar="BAG", help="folder of the recording, new")
    parser.add_argument("--robot", help="shipped name or robot.yaml (default: the mission's)")
    parser.add_argument("--seed", type=int, default=0, help="of noise and random tours (default 0)")
    parser.add_argument(
        "--storage", choices=("mcap", "sqlite3"), default="mcap", help="default: mcap"
    )
    parser.add_argument("--picture", type=Path, metavar="PNG", help="render the robot")
    parser.add_argument("--list", action="store_true", help="list missions and robots, and end")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no summary")
    return parser


def _simulate(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    if options.list:
        _list(Console())
        return EXIT_OK
    if options.mission is None and options.picture is None:
        raise InputError("no mission given: name one (tomr_simulate --list) or ask for --picture")
    if options.mission is not None and options.out is None and options.picture is None:
        raise InputError("--out is missing: say where to put the recording, e.g. --out bag")
    if options.out is not None and options.mission is None:
        raise InputError("--out needs a mission: name one (tomr_simulate --list)")
    if options.seed < 0:
        raise InputError(f"--seed = {options.seed}: give 0 or more")
    mission = None if options.mission is None else load_mission(options.mission)
    source = options.robot or (mission.robot if mission else "reference")
    robot = load_robot(source)
    console = Console(stderr=True, quiet=options.quiet)
    if options.picture is not None:
        save_picture(source, options.picture)
        console.print(f"{options.picture}: picture of the robot", highlight=False)
    if mission is not None and options.out is not None:
        _record(mission, robot, options.seed, options.out, options.storage, console)
    return EXIT_OK


def _record(
    mission: Mission, robot: Robot, seed: int, path: Path, storage: str, console: Console
) -> None:
    duration = mission.plan(robot, seed).duration
    simulation = start_mission(mission, robot, seed, START_NS)
    count = 0
    done = TextColumn("{task.completed:.0f} of {task.total:.0f} s")
    columns = (TextColumn("{task.description}"), BarColumn(), done, TimeRemainingColumn())
    bar = Progress(*columns, console=console, transient=True)
    with RecordingWriter(path, storage=storage) as writer, bar:
        task = bar.add_task(mission.name, total=duration)
        for samples in drive(mission, simulation, seed):
            for sample in samples:
                message = to_bag(sample.message)
                writer.write(sample.topic, sample.message.type_name, message, sample.stamp_ns)
            count += len(samples)
            bar.update(task, completed=(simulation.stamp_ns - START_NS) / NANOSECONDS)
    console.print(f"{path}: {duration:.1f} s of {mission.name}, {count} messages", highlight=False)


def _list(console: Console) -> None:
    console.print("missions:")
    for name in shipped_missions():
        mission = load_mission(name)
        console.print(f"  {name}: {mission.description}", highlight=False, soft_wrap=True)
    console.print("robots:")
    for name in shipped_robots():
        console.print(f"  {name}", highlight=False)
