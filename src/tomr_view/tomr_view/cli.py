"""`tomr_view`: the diagnosis in a browser."""

import argparse
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.robot import shipped_robots
from tomr_view.recording import introduction, pictures_of
from tomr_view.server import Server

LOOPBACK = "127.0.0.1"
PORT = 8737

_EPILOG = """\
examples:
  tomr_view --robot robot.yaml                   what runs on this robot now
  tomr_view --robot robot.yaml --ros-args -r __ns:=/robot_2
  tomr_view drive.mcap --robot robot.yaml        a recording, diagnosed anew, to scrub through

The page is for this computer alone unless --host says otherwise: whoever reaches it sees the robot,
and beside the simulator can switch its faults.

exit codes: 0 after SIGINT or SIGTERM; 2 bad input"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_view",
        description="Show a robot and its diagnosis in a browser: live, or of a recording.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, nargs="?", help="rosbag2 folder, .mcap or .db3 file")
    parser.add_argument(
        "--robot",
        default="reference",
        help=f"robot.yaml, or one of {', '.join(shipped_robots())} (default: %(default)s)",
    )
    parser.add_argument("--namespace", help="of the robot's topics, if the bag holds several")
    parser.add_argument(
        "--host", default=LOOPBACK, help="address to serve on (default: this computer)"
    )
    parser.add_argument("--port", type=_port, default=PORT, help="default: %(default)s; 0: any")
    return parser


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r}: give a port from 0 to 65535")
    return int(text)


def _view(arguments: Sequence[str] | None) -> int:
    given = list(sys.argv[1:] if arguments is None else arguments)
    place = given.index("--ros-args") if "--ros-args" in given else len(given)
    options, ros = _parser().parse_args(given[:place]), given[place:]
    if options.bag is None:
        from tomr_view.nodes.view_node import view_live  # knows ROS, which a recording needs not

        return view_live(options.robot, options.host, options.port, ros)
    if ros:
        raise InputError("--ros-args: a recording needs none: leave them out, or leave out the bag")
    return _view_recording(options)


def _view_recording(options: argparse.Namespace) -> int:
    print(f"diagnosing {options.bag}", file=sys.stderr)
    robot, pictures = pictures_of(options.bag, options.robot, options.namespace)
    if not pictures:
        raise InputError(f"{options.bag}: too short for a decision: give a longer recording")
    hello = introduction(robot, pictures, options.bag.name)
    server = Server(hello, pictures)
    server.start(options.host, options.port)
    announce(server)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    stop.wait()
    server.close()
    return EXIT_OK


def announce(server: Server) -> None:
    """Say where to look."""
    print(f"watch at {server.address}", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_view`."""
    return run_main(_view, arguments)
