"""`tomr_commission drive`: the drive of a commissioning through cmd_vel, recorded."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tomr_commission.driving import DriveChoice, reach, schedule
from tomr_commission.plan import mission_text
from tomr_power_model.cli import EXIT_OK
from tomr_power_model.errors import InputError
from tomr_power_model.messages.types import TWIST_TYPES
from tomr_power_model.robot import Robot, load_robot
from tomr_reality_gap.progress import progress_bar
from tomr_sim_bridge.missions import load_mission
from tomr_sim_bridge.missions.mission import Plan, parse_mission

_DESCRIPTION = """\
Drive the robot through cmd_vel, its first part slowly, and record what a commissioning needs. Keep
a hand at the e-stop: it knows nothing of walls. It stops, and commands standing, on Ctrl-C, when
the encoders fall silent, when the robot does not follow or runs away, and when the slow part shows
that wheels turn otherwise than robot.yaml says."""
_EPILOG = """\
examples:
  tomr_commission drive --robot my_robot.yaml --out tour1
  tomr_commission drive --robot my_robot.yaml --out tour2 --speed 0.3 --yes    # in a script
  tomr_commission drive --robot reference --out tour1 --sim-time --yes         # sim_bridge

exit codes: 0 driven and recorded; 2 bad input, or stopped, the line says why; 130 interrupted"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_commission drive",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--robot", required=True, help="robot.yaml, or a shipped one's name")
    add("--out", type=Path, required=True, metavar="BAG", help="the recording, a new folder")
    add("--speed", type=float, default=0.4, metavar="M/S", help="the highest (default %(default)s)")
    add("--mission", help="drive this instead of the plan: a file, or a shipped one's name")
    add(
        "--cmd-vel-type", choices=sorted(TWIST_TYPES), default="auto", help="(default: %(default)s)"
    )
    add("--namespace", default="", help="of the robot's topics")
    add("--sim-time", action="store_true", help="time is that of /clock")
    add("--yes", action="store_true", help="do not ask before it moves")
    add("--quiet", action="store_true", help="no progress bar, no summary")
    return parser


def drive_main(arguments: Sequence[str]) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    if not 0.05 <= options.speed <= 5.0:
        raise InputError(f"--speed {options.speed:g}: give 0.05 to 5 m/s")
    if options.out.exists():
        raise InputError(f"--out {options.out}: is there already: give another")
    robot = load_robot(options.robot)
    plan = _plan(robot, options.mission, options.speed)
    choice = DriveChoice()
    commands, slow_end = schedule(plan, choice)
    said = (
        f"{commands[-1].time:.0f} s, the first {slow_end:.0f} s slowly, up to "
        f"{reach(commands):.1f} m from where it stands now"
    )
    _ask(said, options.yes)
    from tomr_commission.nodes.drive_node import DriveRequest, drive

    request = DriveRequest(
        robot,
        commands,
        slow_end,
        options.cmd_vel_type,
        options.namespace,
        options.sim_time,
        choice,
    )
    with progress_bar(options.quiet) as progress:
        progress("waiting for joint_states", 0.0)
        drive(request, options.out, progress)
    if not options.quiet:
        print(f"written: {options.out} ({said})")
        print(
            "next: drive once more on each floor that counts, warm and cold, then\n"
            f"  tomr_commission {options.out} ... --robot {options.robot} --out commissioned"
        )
    return EXIT_OK


def _plan(robot: Robot, mission: str | None, speed: float) -> Plan:
    if mission is not None:
        return load_mission(mission).plan(robot)
    return parse_mission(mission_text(robot, speed), "plan").plan(robot)


def _ask(what: str, is_agreed: bool) -> None:
    if is_agreed:
        return
    if not sys.stdin.isatty():
        raise InputError("the robot will move: give --yes where nobody can be asked")
    answer = input(f"The robot will drive by itself: {what}. Is the floor free? [y/N] ")
    if answer.strip().lower() not in ("y", "yes"):
        raise InputError("not driven: nobody said yes")
