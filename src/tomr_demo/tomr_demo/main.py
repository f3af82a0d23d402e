"""`tomr_demo`: watch a simulated robot drive, fail and be diagnosed."""

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

import yaml
from rich.console import Console

from tomr_demo.acts import ACTS, shortened
from tomr_demo.figure import save_figure
from tomr_demo.output import (
    FIGURE,
    LOGS,
    RECORDING,
    RESULT,
    ROBOT,
    make_output,
    write_result,
)
from tomr_demo.processes import Children, DemoFailure, command_of, signals_noted
from tomr_demo.series import load_drive
from tomr_demo.topics import PROCESSES, all_topics
from tomr_demo.view import Scene, act_table, make_console, view_on
from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.files import real_path
from tomr_power_model.files.write import write_text
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import load_robot
from tomr_view.cli import LOOPBACK, PORT

# A command acts this long [s] after its stamp, as in the real Robotino, so that the time it takes
# on its way between busy processes plays no part.
COMMAND_DELAY = 0.15
PAGE = f"http://{LOOPBACK}:{PORT}/"

_EPILOG = """\
Four processes talk over DDS on this machine only: sim_bridge (the robot, in MuJoCo, in real time),
power_model, power_residuals and fault_classifier. The demo drives the robot in a circle, makes the
floor slippery, takes the control signal from wheel 3 and cuts off the encoder of wheel 1, with
healthy driving in between, and holds /diagnostics against the truth. A fault passes if it is named
within 1 s of data time after its onset; a healthy stretch if normal is named within 3 s of its
start, and no fault after that.

examples:
  tomr_demo                                  the whole demo, about 50 s
  tomr_demo --quick --out try                shorter acts
  tomr_demo --view                           in a browser too, with buttons for faults
  tomr_demo --figure demo_output/recording   draw the time line again

To watch with other tools, give them the same ROS_DOMAIN_ID (here {domain}) and
ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.

exit codes: 0 all faults named in time and nothing else; 1 not so, or a process failed;
2 bad input; 130 interrupted
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_demo`."""
    try:
        return run_main(_demo, arguments)
    except DemoFailure as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_MISMATCH


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_demo",
        description="Watch a simulated three-wheeled robot drive, fail and be diagnosed.",
        epilog=_EPILOG.format(domain=os.environ.get("ROS_DOMAIN_ID", "0")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="shorter acts")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder to leave recording, figure and result in (default: demo_output); one of an "
        "earlier demo is replaced, any other gets a number",
    )
    parser.add_argument(
        "--view",
        action="store_true",
        help=f"show it in a browser too, at {PAGE}, and drive on until Ctrl-C",
    )
    parser.add_argument("--weights", type=Path, metavar="NPZ", help="of the classifier")
    parser.add_argument(
        "--figure",
        type=Path,
        metavar="BAG",
        help="only draw the time line of a recording, to timeline.png beside it or in --out",
    )
    return parser


def _demo(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    console = make_console()
    if options.figure is not None:
        _draw_again(options.figure, options.out, console)
        return EXIT_OK
    if options.weights is not None and not options.weights.is_file():
        raise InputError(f"--weights {options.weights}: no such file")
    # A simulated robot must not meet a real one on the network.
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    output = make_output(options.out or Path("demo_output"))
    write_robot(output / ROBOT)
    scene = _perform(output, options, console)
    write_result(output / RESULT, scene.board)
    console.print(act_table(scene, console.width))
    passed = scene.board.passed
    verdict = (
        "each fault was named within 1 s of its onset, and healthy driving was called normal"
        if passed
        else "a fault was not named within 1 s of its onset, or healthy driving was called faulty"
    )
    console.print(verdict, style="bold green" if passed else "bold red")
    with console.status("drawing the time line"):
        _draw(output / RECORDING, output / FIGURE)
    for name in (RECORDING, FIGURE, RESULT):
        console.print(f"  {output / name}", highlight=False)
    return EXIT_OK if passed else EXIT_MISMATCH


def _perform(output: Path, options: argparse.Namespace, console: Console) -> Scene:
    """Run the processes and the play; returns its last scene."""
    # Takes a second to import, which neither --help nor --figure needs.
    from tomr_demo.play import Play

    acts = shortened(ACTS) if options.quick else ACTS
    topics = all_topics(load_robot(output / ROBOT))
    with signals_noted() as signals, Children(output / LOGS) as children:
        start_nodes(children, output / ROBOT, options.weights)
        if options.view:
            start_page(children, output / ROBOT)
            console.print(f"watch at {PAGE}")
        with _ros(), view_on(console) as view:
            play = Play(topics, children, view, signals)
            try:
                play.wait_until_ready()
                with RecordingWriter(output / RECORDING) as recording:
                    play.perform(acts, recording)
                if options.view:
                    console.print(f"driving on for {PAGE}; Ctrl-C ends")
                    play.drive_on()
            finally:
                play.close()
    return play.scene()


@contextmanager
def _ros() -> Iterator[None]:
    from tomr_demo.director_node import begin_ros, end_ros

    begin_ros()
    try:
        yield
    finally:
        end_ros()


def write_robot(path: Path) -> None:
    """Write the robot.yaml of the demo: the reference robot, which answers a little late."""
    text = files("tomr_power_model").joinpath("robots", "reference.yaml").read_text()
    document = yaml.safe_load(text)
    document["/**"]["ros__parameters"]["controller"]["delay"] = COMMAND_DELAY
    write_text(path, yaml.safe_dump(document, sort_keys=False))


def start_nodes(children: Children, robot: Path, weights: Path | None = None) -> None:
    """Start the robot and the three nodes of the diagnosis."""
    more = {"fault_classifier": ["-p", f"weights:={real_path(weights)}"]} if weights else {}
    for name in PROCESSES:
        # sim_bridge makes the time that the others follow.
        time = ["-p", f"{'publish_clock' if name == 'sim_bridge' else 'use_sim_time'}:=true"]
        given: list[str | Path] = ["--ros-args", "--params-file", robot, *time, *more.get(name, [])]
        children.start(name, [*command_of(name, PROCESSES), *given])


def start_page(children: Children, robot: Path) -> None:
    """Start the web server of the page."""
    program = command_of("tomr_view", {"tomr_view": "tomr_view.cli"})
    children.start("tomr_view", [*program, "--robot", robot])


def _draw(recording: Path, figure: Path) -> None:
    with open_recording(recording) as opened:
        save_figure(load_drive(opened), figure)


def _draw_again(recording: Path, out: Path | None, console: Console) -> None:
    folder = recording.parent if out is None else out
    if not folder.is_dir():
        raise InputError(f"--out {folder}: no such folder")
    figure = folder / FIGURE
    with console.status("drawing the time line"):
        _draw(recording, figure)
    console.print(f"{figure}", highlight=False)
