"""Command `tomr_import_robotino`: the public Robotino data set as rosbag2 recordings."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from tomr_power_model.cli import EXIT_BAD_INPUT, EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_sim_bridge.importers.dataset import choose, default_dataset, import_files, open_dataset

DESCRIPTION = """\
Turn the public data set of a real Festo Robotino v2 into rosbag2 recordings.

One recording per csv file, named by surface and experiment, with these topics:
  joint_states       wheel encoders, at the wheels [rad, rad/s]
  wheel_<i>/power    motor current as BatteryState: voltage NaN, current negative [A]
  cmd_vel            the robot's set speeds (drives on the floor)
  ground_truth/odom  pose seen by the overhead camera (drives on the floor)
  wheel_command      set wheel speeds (bench runs, wheels in the air)
and an index.csv of surface, heading, speed, duration and gaps.
"""
EPILOG = """\
examples:
  tomr_import_robotino datasets.tar.gz --out robotino_bags
  tomr_import_robotino datasets --out gray_bags --surface gray
  tomr_diagnose robotino_bags/gray/exp05 --robot robotino_v2_gray

The data set is BrOleg5/research-wheel-slippage on GitHub (Apache-2.0), folder `datasets`.

exit codes: 0 all done; 2 bad input, or some files could not be read (each is named, the others
are done); 130 interrupted.
"""


def build_parser() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(
        prog="tomr_import_robotino",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "dataset",
        type=Path,
        nargs="?",
        metavar="DATASET_DIR",
        help="folder `datasets` of the data set, or its .tar.gz "
        "(default: robotino under $TOMR_RECORDINGS, else ../shared/recordings)",
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="new or empty folder to write to"
    )
    parser.add_argument(
        "--surface",
        nargs="+",
        default=[],
        metavar="NAME",
        help="only these: gray, green, bench, ... (default: all)",
    )
    parser.add_argument(
        "--storage", choices=("mcap", "sqlite3"), default="mcap", help="default: mcap"
    )
    return parser


def import_robotino(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = build_parser().parse_args(arguments)
    out: Path = options.out
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"--out {out} is not an empty folder; remove it or choose another")
    with open_dataset(options.dataset or default_dataset()) as files:
        chosen = choose(files, options.surface)
        with tqdm(chosen, unit="file", desc="import", file=sys.stderr) as progress:
            done, failed = import_files(
                progress,
                out,
                options.storage,
                lambda line: progress.write(f"error: {line}", file=sys.stderr),
            )
    print(f"{done} recordings and index.csv in {out}" + (f", {failed} failed" if failed else ""))
    return EXIT_BAD_INPUT if failed else EXIT_OK


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of the command line."""
    return run_main(import_robotino, arguments)
