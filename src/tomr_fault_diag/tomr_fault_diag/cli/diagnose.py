"""`tomr_diagnose`: what was wrong with a robot in a recording."""

import argparse
import json
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from tqdm import tqdm

from tomr_fault_diag.classifier.messages import evidence_of
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import (
    PARAMETERS,
    STAGE_NODES,
    DiagnosisSettings,
    parse_assignments,
)
from tomr_fault_diag.diagnosis.summary import Summariser, Summary
from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.outgoing import TYPES
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.recordings import Recording, RecordingWriter, open_recording
from tomr_power_model.robot import load_robot, read_node_sections, shipped_robots

_EPILOG = """\
examples:
  tomr_diagnose drive.mcap --robot my_robot.yaml
  tomr_diagnose bag_folder --out diagnosed --set band.power=2.0
  tomr_diagnose bag_folder --json | jq .shares

exit codes: 0 nothing wrong, 1 a fault was named, 2 bad input
The numbers are those that the three nodes publish on the same data."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_diagnose",
        description="Diagnose a three-wheeled omni robot from a recording of its commands, wheel "
        "encoders and motor power.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", type=Path, help="rosbag2 folder, .mcap or .db3 file")
    parser.add_argument(
        "--robot",
        default="reference",
        help=f"robot.yaml, or one of {', '.join(shipped_robots())} (default: %(default)s)",
    )
    parser.add_argument("--out", type=Path, help="write the suite's messages to this new bag")
    parser.add_argument("--namespace", help="of the robot's topics, if the bag holds several")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter; --parameters lists them",
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    parser.add_argument("--parameters", action=_ListParameters, help="list all parameters")
    return parser


class _ListParameters(argparse.Action):
    """Prints the table of parameters and leaves."""

    def __init__(self, option_strings: Sequence[str], dest: str, help: str | None = None) -> None:
        super().__init__(option_strings, dest, nargs=0, help=help)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        for spec in PARAMETERS.values():
            print(spec.summary)
        parser.exit()


def _run(recording: Recording, pipeline: Pipeline, arguments: argparse.Namespace) -> Summary:
    summariser = Summariser()
    seconds = (recording.end_ns - recording.start_ns) / NANOSECONDS
    with ExitStack() as stack:
        writer = stack.enter_context(RecordingWriter(arguments.out)) if arguments.out else None
        bar = stack.enter_context(
            tqdm(total=round(seconds), unit="s", desc="diagnosing", disable=None, delay=1.0)
        )
        for receive_ns, step in diagnose(recording, pipeline, arguments.namespace):
            if not step.frames and not step.predictions:
                continue
            done = (receive_ns - recording.start_ns) // NANOSECONDS
            if done > bar.n:
                bar.update(done - bar.n)
            for diagnosis in step.diagnoses:
                summariser.diagnosis(diagnosis, evidence_of(pipeline.robot, diagnosis))
            for frame in step.frames:
                summariser.frame(frame)
            if writer is not None:
                for message in pipeline.messages(step):
                    writer.write(
                        message.topic, TYPES[type(message)], to_bag(message.plain), message.stamp_ns
                    )
    return summariser.summary()


def _print(summary: Summary, pipeline: Pipeline, start_ns: int) -> None:
    print(f"{summary.ticks} decisions")
    for name, share in summary.shares.items():
        print(f"  {100 * share:5.1f} %  {name}")
    stale = max(summary.stale_shares)
    if stale:
        print(f"  up to {100 * stale:.1f} % of a residual without an input")
    for spell in summary.spells:
        since, until = ((t - start_ns) / NANOSECONDS for t in (spell.start_ns, spell.end_ns))
        print(f"{since:8.2f} s to {until:8.2f} s  {spell.state}")
        for line in spell.evidence:
            print(f"{'':26}{line}")
    for (topic, problem), count in pipeline.complaints.counts.items():
        print(f"note: {topic}: {problem} ({count} messages)", file=sys.stderr)


def _as_json(summary: Summary) -> str:
    return json.dumps(
        {
            "ticks": summary.ticks,
            "shares": summary.shares,
            "stale_shares": summary.stale_shares,
            "spells": [
                {
                    "state": spell.state,
                    "start_ns": spell.start_ns,
                    "end_ns": spell.end_ns,
                    "evidence": spell.evidence,
                }
                for spell in summary.spells
            ],
        },
        indent=2,
    )


def _diagnose(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    given = read_node_sections(options.robot, STAGE_NODES)
    settings = DiagnosisSettings.of(
        {**given, **parse_assignments(options.set)}, f"--set or {options.robot}"
    )
    pipeline = Pipeline(load_robot(options.robot), settings)
    with open_recording(options.bag) as recording:
        if recording.warning:
            print(f"note: {recording.warning}", file=sys.stderr)
        summary = _run(recording, pipeline, options)
        if options.json:
            print(_as_json(summary))
        else:
            _print(summary, pipeline, recording.start_ns)
    return EXIT_MISMATCH if summary.has_fault else EXIT_OK


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_diagnose`."""
    return run_main(_diagnose, arguments)
