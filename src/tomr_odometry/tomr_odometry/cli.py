"""`tomr_odometry`: where the robot of a recording really was, and how much its wheels slipped."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.picture import draw
from tomr_odometry.reference import Path2D, reference_of, wheel_path
from tomr_odometry.settings import PARAMETERS, OdometrySettings
from tomr_odometry.summary import lines, summary
from tomr_odometry.topics import estimate_messages
from tomr_power_model.cli import EXIT_OK, PrintAndLeave, run_main
from tomr_power_model.errors import InputError, counted
from tomr_power_model.files import make_folder, write_together
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.recordings import Recording, RecordingWriter, open_recording
from tomr_power_model.robot import Robot, load_robot, read_node_sections, shipped_robots
from tomr_power_model.robot.parameters import parse_assignments
from tomr_power_model.topics.inputs import Complaints

NODE = "slip_odometry"
_EPILOG = """\
examples:
  tomr_odometry drive --robot my_robot.yaml --out corrected
  tomr_odometry drive --robot my_robot.yaml --out corrected --reference ground_truth/odom
  tomr_odometry learn lab1 lab2 --robot my_robot.yaml --reference map_pose --out learnt

OUT/bag holds odom_slip (nav_msgs/Odometry), slip (JointState: slip ratios as positions, sliding
[m/s] as velocities, traction [N] as efforts) and /diagnostics; OUT/odometry.json and
OUT/odometry.png the summary and the path by wheels and as estimated.
Exit codes: 0 done, 2 bad input."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_odometry",
        description="Odometry that knows of slip, from commands, encoders, motor power and an IMU.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, help="rosbag2 folder, .mcap or .db3 file")
    parser.add_argument(
        "--robot",
        default="reference",
        help=f"robot.yaml, or one of {', '.join(shipped_robots())} (default: %(default)s)",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder")
    parser.add_argument("--reference", metavar="TOPIC", help="a known pose, to compare with")
    parser.add_argument("--namespace", help="of the robot's topics, if the bag holds several")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="one parameter, before what robot.yaml says; may be repeated (see --parameters)",
    )
    parser.add_argument(
        "--parameters",
        action=PrintAndLeave,
        nargs=0,
        const=lambda: (spec.summary for spec in PARAMETERS),
        help="list all parameters",
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    return parser


def _play(
    recording: Recording, core: SlipOdometry, robot: Robot, options: argparse.Namespace
) -> list[Estimate]:
    complaints = Complaints()
    items = estimates(recording, robot, core, complaints, options.namespace)
    kept = list(tqdm(items, unit=" estimates", disable=None, delay=1.0))
    for (topic, problem), count in complaints.counts.items():
        print(f"note: {topic}: {problem} ({counted(count, 'message')})", file=sys.stderr)
    if not kept:
        raise InputError(
            f"{options.bag}: no estimate: it takes encoder samples of all wheels with positions"
        )
    return kept


def _write_bag(
    folder: Path, robot: Robot, settings: OdometrySettings, kept: Sequence[Estimate]
) -> None:
    with RecordingWriter(folder) as writer:
        for item in kept:
            for message in estimate_messages(robot, item, settings):
                writer.write(
                    message.topic,
                    message.message.type_name,
                    to_bag(message.message),
                    message.stamp_ns,
                )


def _odometry(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    given = read_node_sections(options.robot, [NODE])
    settings = OdometrySettings.given(
        {**given, **parse_assignments(options.set)}, f"--set or {options.robot}"
    )
    robot = load_robot(options.robot)
    if options.out.exists():
        raise InputError(f"{options.out} exists already: remove it or choose another folder")
    with open_recording(options.bag) as recording:
        if recording.warning:
            print(f"note: {recording.warning}", file=sys.stderr)
        reference: Path2D | None = None
        if options.reference is not None:
            reference = reference_of(recording, options.reference, options.namespace)
        wheels = wheel_path(recording, robot, options.namespace)
        core = SlipOdometry(robot, settings)
        kept = _play(recording, core, robot, options)
    found = summary(robot, kept, wheels, reference)
    text = json.dumps(found, indent=2, allow_nan=False)
    picture = draw(robot, kept, wheels, reference, core.floor.grid())
    make_folder(options.out)
    write_together(
        {options.out / "odometry.json": f"{text}\n", options.out / "odometry.png": picture}
    )
    _write_bag(options.out / "bag", robot, settings, kept)
    print(text if options.json else "\n".join(lines(found)))
    return EXIT_OK


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_odometry`; its first word may be `learn`."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words[:1] == ["learn"]:
        from tomr_odometry.learn.cli import learn

        return run_main(learn, words[1:])
    return run_main(_odometry, words)


if __name__ == "__main__":
    sys.exit(main())
