"""The real Robotino: what its floors add to a description made on the bench.

    .venv/bin/python bench/gap_robotino.py --out gap [--surface gray green]

1. The bench: friction of each motor, gain of the speed loop and delay of the command, from the
   recordings with the wheels in the air.
2. Each floor: `tomr_gap explain` with that description, on twelve headings at 0.1 m/s (5, 35, 65
   ... degrees), held out twelve other headings at 0.1 m/s (20, 50, 80 ...) and at 0.3 m/s.
3. The robot as explained on the first floor, on the held-out drives of the others.
4. The bench's description with drivers that it does not have: a PI loop and no delay.

Currents are compared: the data set holds no voltage. Reports are written into --out.
"""

import argparse
import csv
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from time import monotonic, process_time
from typing import Any

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from tomr_power_model.calibration.fitted import fitted_text
from tomr_power_model.cli import run_main
from tomr_power_model.drive.read import read_drive
from tomr_power_model.files import make_folder, write_text
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.robot import Robot, load_robot, read_description
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.explain import explain
from tomr_reality_gap.explanation import Comparison, Explanation
from tomr_reality_gap.mismatch.compare import comparison
from tomr_reality_gap.progress import progress_bar
from tomr_reality_gap.report.json import report_fields
from tomr_reality_gap.report.write import report_files, write_report
from tomr_reality_gap.request import Request
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.dataset import choose, default_dataset, open_dataset
from tomr_sim_bridge.importers.robotino import Run, read_run

Array = NDArray[np.float64]

SOURCE = "robotino_v2"
_IDENTIFIED = "bench/data_for_identification_without_integral"
_SETTLED = 0.6  # s after a step of the command
_STARTING = 1.0  # s, left out of a drive's mean current: its wheels slip
_FITTED, _HELD = (5.0, 0.1), ((20.0, 0.1), (20.0, 0.3))  # first heading, speed
_EVERY = 30.0  # degrees
_USUAL_INTEGRAL = 10.0  # 1/s, of the integral gain over the proportional one


@frozen
class Bench:
    """What the recordings with wheels in the air show."""

    coulomb: tuple[float, ...]  # N m at each wheel
    viscous: tuple[float, ...]  # N m s/rad
    proportional: float  # V s/rad
    delay: float  # s


def bench_of(run: Run, robot: Robot) -> Bench:
    """Fit friction to steady currents, the loop's gain to its steady error, and the delay."""
    time = 1e-9 * (np.array(run.stamps_ns) - run.stamps_ns[0])
    steps = 1 + np.flatnonzero(np.any(np.diff(run.wheel_command, axis=0) != 0.0, axis=1))
    latest = np.concatenate([[0.0], time[steps]])[
        np.searchsorted(steps, np.arange(len(time)), "right")
    ]
    steady = (time - latest > _SETTLED) & run.wheel_command.any(axis=1)
    friction, volts, errors = [], 0.0, 0.0
    for wheel, motor in enumerate(robot.motors):
        speed, current = np.abs(run.velocity[steady, wheel]), run.current[steady, wheel]
        matrix = np.stack([np.ones_like(speed), speed], axis=1)
        friction.append(np.linalg.lstsq(matrix, motor.wheel_constant * current, rcond=None)[0])
        volts += float((motor.resistance * current + motor.wheel_constant * speed).sum())
        errors += float((np.abs(run.wheel_command[steady, wheel]) - speed).sum())
    late = [_answer(time, run, int(step)) for step in steps if run.wheel_command[step].any()]
    return Bench(
        tuple(float(item[0]) for item in friction),
        tuple(float(item[1]) for item in friction),
        volts / errors,
        float(np.median(late)),
    )


def _answer(time: Array, run: Run, step: int) -> float:
    """From a step of the command to half of the wheels' speed [s], between samples."""
    speed = np.abs(run.velocity[step : step + 40]).mean(axis=1)
    half = 0.5 * float(np.median(speed[20:]))
    after = int(np.argmax(speed > half))
    part = (half - speed[after - 1]) / (speed[after] - speed[after - 1])
    return float(np.interp(after - 1 + part, np.arange(40), time[step : step + 40]) - time[step])


def described(bench: Bench, integral: float, delay: float) -> str:
    """Text of the robot's description with what the bench showed."""
    values = dict(read_description(SOURCE))
    names = load_robot(SOURCE).wheel_names
    for effect, name, numbers in (
        ("friction.coulomb", "torque", bench.coulomb),
        ("friction.viscous", "coefficient", bench.viscous),
    ):
        del values[f"physics.{effect}.{name}"]
        for wheel, number in zip(names, numbers, strict=True):
            values[f"physics.{effect}.{wheel}.{name}"] = float(f"{number:.5g}")
    values["controller.proportional"] = float(f"{bench.proportional:.5g}")
    values["controller.integral"] = integral
    values["controller.delay"] = float(f"{delay:.3g}")
    header = [f"{SOURCE}, friction, gain and delay fitted to {_IDENTIFIED}"]
    return fitted_text(
        SOURCE, values, (), (), half_widths=(), header=header, provenance={"bags": [_IDENTIFIED]}
    )


def drives(folder: Path, surface: str, first: float, speed: float) -> tuple[Path, ...]:
    """Drives at every `_EVERY` degrees from a first heading on."""
    with (folder / "index.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["surface"] == surface]
    return tuple(
        folder / row["bag"]
        for row in rows
        if abs(float(row["speed_m_s"]) - speed) < 0.01
        and abs((float(row["heading_deg"]) - first + 1.0) % _EVERY - 1.0) < 0.5
    )


def figures_of(comparisons: Sequence[Comparison]) -> dict[str, dict[str, float]]:
    """Errors of the currents, before and after; R2 is that of each drive's and motor's mean."""
    found = {}
    for title in ("before", "after"):
        measured, simulated, means = [], [], []
        for item in comparisons:
            for channel, value in zip(item.channels, getattr(item, title), strict=True):
                if channel.kind == "current":
                    steady = channel.time > _STARTING
                    measured.append(channel.value)
                    simulated.append(value)
                    means.append((channel.value[steady].mean(), value[steady].mean()))
        real, model, mean = np.concatenate(measured), np.concatenate(simulated), np.array(means)
        left = float(np.square(mean[:, 0] - mean[:, 1]).sum())
        found[title] = {
            "nrmse": nrmse(real, model),
            "accuracy": accuracy(real, model),
            "r2_mean": 1.0 - left / float(np.square(mean[:, 0] - mean[:, 0].mean()).sum()),
        }
    return found


@frozen
class Bags:
    """The imported recordings, and which are used for what."""

    folder: Path

    def fitted(self, surface: str) -> tuple[Path, ...]:
        return drives(self.folder, surface, *_FITTED)

    def held(self, surface: str) -> dict[str, tuple[Path, ...]]:
        return {
            f"{surface}, other headings, {speed:g} m/s": drives(self.folder, surface, first, speed)
            for first, speed in _HELD
        }


def explained(
    bags: Bags, surface: str, robot: Path, out: Path
) -> tuple[Explanation, dict[str, Any]]:
    """Explain one floor, write the report, and score each set of held-out drives."""
    sets = bags.held(surface)
    held = tuple(path for paths in sets.values() for path in paths)
    begun = monotonic(), process_time()
    with progress_bar(False) as progress:
        found = explain(Request(robot, bags.fitted(surface), holdout=held), progress)
    seconds, busy = monotonic() - begun[0], process_time() - begun[1]
    make_folder(out)
    write_report(out, report_files(found, robot.name))
    rest = iter(item for item in found.comparisons if item.held_out)
    scores = {
        f"{surface}, fitted": figures_of([one for one in found.comparisons if not one.held_out]),
        **{title: figures_of([next(rest) for _ in paths]) for title, paths in sets.items()},
    }
    fields = report_fields(found)
    kept = {name: fields[name] for name in ("sentence", "findings", "unexplained_share", "holdout")}
    return found, {**kept, "seconds": seconds, "cpu_seconds": busy, "scores": scores}


def transferred(bags: Bags, surface: str, before: Path, after: Path) -> dict[str, Any]:
    """A robot explained elsewhere on the held-out drives of a floor."""
    robots = load_robot(before), load_robot(after)
    return {
        title: figures_of([_compared(path, *robots) for path in tqdm(paths, desc=surface)])
        for title, paths in bags.held(surface).items()
    }


def _compared(path: Path, before: Robot, after: Robot) -> Comparison:
    instant = evolve(before, sensors=evolve(before.sensors, power_window=0.0))
    drive = read_drive(path, before)
    simulation = RecordingSimulation.of(drive, before, channels_of(drive, instant))
    values = simulation.predict([before, after])
    return comparison(simulation, values, simulation.run(after), is_held_out=True)


def measure(dataset: Path, surfaces: Sequence[str], out: Path) -> dict[str, Any]:
    """All four steps."""
    make_folder(out)
    bags = Bags(out / "bags")
    if not (bags.folder / "index.csv").exists():
        with redirect_stdout(sys.stderr):
            import_robotino([str(dataset), "--out", str(bags.folder), "--surface", *surfaces])
    with open_dataset(dataset) as files:
        (file,) = (item for item in choose(files, ("bench",)) if item.bag == _IDENTIFIED)
        bench = bench_of(read_run(file.path, file.place), load_robot(SOURCE))
    known, wrong = out / "robot_bench.yaml", out / "robot_bench_wrong_loop.yaml"
    write_text(known, described(bench, 0.0, bench.delay))
    write_text(wrong, described(bench, _USUAL_INTEGRAL * round(bench.proportional), 0.0))
    report: dict[str, Any] = {
        "bench": {name: getattr(bench, name) for name in Bench.__annotations__},
        "explained": {},
        "elsewhere": {},
    }
    for surface in surfaces:
        report["explained"][surface] = explained(bags, surface, known, out / surface)[1]
    first = surfaces[0]
    after = out / first / "robot_explained.yaml"
    for surface in surfaces[1:]:
        report["elsewhere"][surface] = transferred(bags, surface, known, after)
    report["wrong_loop"] = explained(bags, first, wrong, out / "wrong_loop")[1]
    return report


def _lines(scores: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for title, item in scores.items():
        yield (
            title,
            *(
                f"{item['before'][name]:.3f} -> {item['after'][name]:.3f}"
                for name in ("nrmse", "accuracy", "r2_mean")
            ),
        )


def print_report(console: Console, report: Mapping[str, Any]) -> None:
    """What was said, and the figures."""
    console.print(f"bench: {report['bench']}")
    said = {**report["explained"], "wrong loop": report["wrong_loop"]}
    table = Table(box=None, title="motor current, as described -> as explained")
    for heading in ("description", "drives", "NRMSE", "accuracy", "R2 of the mean"):
        table.add_column(heading, no_wrap=True)
    for name, item in said.items():
        console.print(
            f"{name} ({item['seconds']:.0f} s, {item['cpu_seconds']:.0f} s of CPU): "
            f"{item['sentence']}"
        )
        for finding in item["findings"]:
            values = "; ".join(
                f"{key} {value['value']:g} [{value['ci95'][0]:g}, {value['ci95'][1]:g}] "
                f"{value['unit']}"
                for key, value in finding["parameters"].items()
            )
            rivals = ", ".join(f"{r['effect']} {r['where'][0]}" for r in finding["rivals"])
            console.print(
                f"    {finding['effect']} at {', '.join(finding['where'])}: {values}; "
                f"{100 * finding['located']['share_of_mismatch']:.1f} % of the mismatch, "
                f"confidence {finding['confidence']:g}" + (f"; or {rivals}" if rivals else "")
            )
        console.print(f"    {100 * item['unexplained_share']:.1f} % unexplained")
        for line in _lines(item["scores"]):
            table.add_row(name, *line)
    for scores in report["elsewhere"].values():
        for line in _lines(scores):
            table.add_row("explained on the first floor", *line)
    console.print(table)


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="write here")
    parser.add_argument("--surface", nargs="+", default=["gray", "green"])
    parser.add_argument("--dataset", type=Path, default=default_dataset())
    options = parser.parse_args(arguments)
    if not options.dataset.exists():
        print(f"skipped: {options.dataset} is absent; set TOMR_RECORDINGS", file=sys.stderr)
        return 0
    report = measure(options.dataset, options.surface, options.out)
    write_text(options.out / "robotino.json", json.dumps(report, indent=2) + "\n")
    print_report(Console(width=200, highlight=False, soft_wrap=True), report)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
