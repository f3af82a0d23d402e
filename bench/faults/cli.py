"""The command line of the benchmark on robots with and without faults."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from tomr_power_model.cli import EXIT_OK

_DESCRIPTION = """\
Judge the suite on the recordings `faults_practice`: one robot of an independent plant, healthy and
with faults, and its truth. They lie under $TOMR_RECORDINGS (default ../shared/recordings)."""

_EPILOG = """\
examples:
  faults_practice.py explain
  faults_practice.py diagnose --robot build/faults_practice/explained/robot_explained.yaml
  faults_practice.py commission
  faults_practice.py diagnose --robot build/faults_practice/commissioned/commissioned.yaml
  faults_practice.py power --robot build/faults_practice/explained/robot_explained.yaml
  faults_practice.py sensors slow --out slow && TOMR_RECORDINGS=slow faults_practice.py commission

exit codes: 0 done, 2 bad input, or the recordings are absent"""

_FITTING = {
    "explain": "run tomr_gap explain on the healthy drives: cost, findings beside the truth, error",
    "commission": "run tomr_commission on the healthy drives: cost, verdict, floors",
    "spoilt": "run tomr_commission on three healthy drives and a faulty one: is it noticed?",
    "calibrate": "run tomr_calibrate on the same: cost, values over the truth, or why it refused",
}
_SENSORS = (
    "slow",
    "encoders-20-hz",
    "encoders-10-hz",
    "averaging",
    "coarse-currents",
    "coarse-everywhere",
    "motor-encoders",
    "coarse-encoders",
    "currents-alone",
    "magnitudes",
    "lost",
)
_SCORING = {
    "diagnose": "diagnose all drives with a description and score that",
    "power": "compare power residuals of the nodes with those of tomr_gap's simulation, by regime",
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="faults_practice.py",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    for name, summary in {**_FITTING, **_SCORING}.items():
        command = commands.add_parser(name, help=summary, description=summary)
        if name != "power":
            command.add_argument(
                "--out",
                type=Path,
                default=Path("build/faults_practice"),
                metavar="DIR",
                help="results go here (default %(default)s)",
            )
        if name in _FITTING:
            if name == "spoilt":
                command.add_argument(
                    "--only", nargs="+", default=(), metavar="ID", help="of faulty drives"
                )
            if name in ("commission", "spoilt"):
                continue  # tomr_commission holds out a drive by itself
            command.add_argument(
                "--fit", type=int, default=3, metavar="N", help="drives to fit (default 3)"
            )
        else:
            command.add_argument(
                "--robot", type=Path, metavar="FILE", help="description (default: the owner's)"
            )
        if name == "explain":
            command.add_argument(
                "--tolerance", metavar="REL", help="how far stated values may be off, for tomr_gap"
            )
    summary = "write the set as other sensors would have recorded it"
    sensors = commands.add_parser("sensors", help=summary, description=summary)
    sensors.add_argument("kind", choices=_SENSORS, metavar="KIND", help=", ".join(_SENSORS))
    sensors.add_argument("--out", type=Path, required=True, metavar="DIR", help="it goes here")
    return parser


def main(arguments: Sequence[str] | None) -> int:
    """Run one of the commands. Raises InputError, also where the recordings are absent."""
    options = _parser().parse_args(arguments)
    # What follows takes seconds to import: --help does without.
    from faults.diagnose import diagnose
    from faults.explain import calibrate, commission, explain
    from faults.power import power
    from faults.recordings import Recordings
    from faults.sensors import record
    from faults.spoilt import spoilt

    recordings = Recordings.find()
    console = Console(width=160, highlight=False)
    if options.command == "explain":
        more = [] if options.tolerance is None else ["--tolerance", options.tolerance]
        explain(recordings, options.out / "explained", options.fit, more, console)
    elif options.command == "commission":
        commission(recordings, options.out / "commissioned", console)
    elif options.command == "spoilt":
        spoilt(recordings, options.out / "spoilt", options.only, console)
    elif options.command == "sensors":
        console.print(f"written: TOMR_RECORDINGS={record(recordings, options.kind, options.out)}")
    elif options.command == "calibrate":
        calibrate(recordings, options.out / "calibrated", options.fit, console)
    else:
        robot = options.robot or recordings.description
        if options.command == "power":
            power(recordings, robot, console)
        else:
            print(diagnose(recordings, robot, options.out / "diagnosed" / robot.stem), end="")
    return EXIT_OK
