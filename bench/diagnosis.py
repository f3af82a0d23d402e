"""The diagnosis against drives in MuJoCo that neither training nor choosing has seen.

    .venv/bin/python bench/diagnosis.py [--drives 420] [--healthy-hours 3.05] [--json report.json]

Robots, 5 % parameter deviations, payloads, floors, bumps, missions, headings, sensor noise, fault
kinds, wheels, severities and onsets are drawn at random from seeds that nothing else uses. What is
scored is the state on /diagnostics at every tick of 50 ms, memory included, of three classifiers on
the same drives: the window network as shipped, and the paper's network on codes with bands
calibrated on healthy drives and with the paper's fixed 5 %.

A fault is observable in a tick if, free of sensor noise, it has changed the power of some motor or
some reported wheel speed by more than 3 sigma of the sensor and the tolerance of a healthy robot in
each of the last 0.2 s, against a twin of the same robot in the same drive without the fault; a
slippery floor must make a wheel slip besides (`tomr_training/labels.py`). Decisions on observable
faults count from 1 s after the fault has begun to show; what comes before is the delay, counted
from the start of the first tick that differs. Shows that are a second or more apart count as onsets
of their own; one that is not named until half a second after it has ceased to show has an infinite
delay.
The 3 s after a fault's end count for nothing.
Standing still, "not observable in this motion" counts as naming no fault.

It takes an hour on two cores; --first-seed 500000 --drives 10 --healthy-hours 0.1 is a quick look.
"""

import argparse
import pickle
import sys
from collections.abc import Callable, Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TypeVar

import numpy as np
from attrs import evolve, frozen
from diagnosis_report import NAMES, Codes, Onset, Outcome, publish, report
from pool import each
from stages import as_arrays

from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import FAULTLESS, NORMAL, SLIP, State
from tomr_fault_diag.residuals.frame import RESIDUALS, Residual, ResidualFrame
from tomr_fault_diag.residuals.settings import PAPER_BANDS, BandSettings
from tomr_fault_diag.residuals.widths import widths
from tomr_power_model.cli import run_main
from tomr_power_model.robot import WHEELS, Robot, shipped_robot
from tomr_training.drives import Drive, random_drive, severity_of, wheel_of
from tomr_training.labels import (
    LASTING,
    LATELY,
    SLIPPING,
    Flags,
    GroundTruth,
    Noise,
    deviates,
    lasting,
)
from tomr_training.planar.faults import class_of
from tomr_training.planar.generate import BEYOND, PAPER_OF
from tomr_training.simulated_drive import LabelledDrive, healthy_twin, simulated_drive

FIRST_SEED = 1_000_000  # of faulty drives; healthy ones follow a million later
_HEALTHY = 1_000_000
_GRACE = 20  # ticks after an onset, scored by its delay instead
_APART = 20  # ticks without a show that make the next one an onset of its own
_AFTER = 10  # ticks after a fault has ceased to show in which naming it still counts
_RECOVERY = 60  # ticks after the end of a fault
_EXCUSE = 10  # ticks in which a wheel that slipped excuses the name of slip
_WIDER = 1.001  # times the usual width: a band that is wider is so for the noise of its encoders
_TURNING = 0.5  # rad/s: a slower wheel is idle
_DRIVE_SECONDS = 18.0  # mean length of a drive, at least

Result = TypeVar("Result")


@frozen
class Kind:
    """A classifier to score: its settings, and the bands of its residuals."""

    settings: ClassifierSettings
    bands: BandSettings


def _weights(name: str) -> str:
    return str(files("tomr_fault_diag").joinpath("weights").joinpath(name))


def kinds() -> dict[str, Kind]:
    """The classifiers to compare."""
    paper = ClassifierSettings(classifier="wang2024", weights=_weights("wang2024_paper_bands.npz"))
    return {
        "window": Kind(ClassifierSettings(), BandSettings()),
        "wang2024, calibrated bands": Kind(
            ClassifierSettings(classifier="wang2024"), BandSettings()
        ),
        "wang2024, paper's bands": Kind(paper, PAPER_BANDS),
    }


def rebanded(frames: Sequence[ResidualFrame], bands: BandSettings) -> list[ResidualFrame]:
    """The same residuals in other bands than the usual; what was wider for its noise stays so, and
    what an IMU shows keeps the usual bands."""
    _, modelled = as_arrays(frames)
    usual, band = (
        widths(modelled, [one.of_residual(place, "W") for place in range(RESIDUALS)], LATELY)
        for one in (BandSettings(), bands)
    )
    volts = np.array([[item.modelled for item in frame.voltages] for frame in frames])
    held = widths(volts, [bands.of_voltage] * WHEELS, LATELY).tolist()

    def width(item: Residual, default: float, wanted: float) -> float:
        return max(wanted, item.band) if item.band > _WIDER * default else wanted

    return [
        evolve(
            frame,
            residuals=tuple(
                evolve(item, band=width(item, float(default), float(wanted)))
                for item, default, wanted in zip(frame.residuals, *pair, strict=True)
            ),
            voltages=_in_bands(frame, voltages),
        )
        for frame, *pair, voltages in zip(frames, usual, band, held, strict=True)
    ]


def _in_bands(frame: ResidualFrame, bands: Sequence[float]) -> tuple[Residual, Residual, Residual]:
    """The drivers' voltages in other bands."""
    pairs = zip(frame.voltages, bands, strict=True)
    first, second, third = (evolve(item, band=band) for item, band in pairs)
    return first, second, third


def named_by(kind: Kind, frames: Sequence[ResidualFrame], robot: Robot) -> Codes:
    """State that stands at each tick (n,), as the paper calls it; what names no fault is normal."""
    return codes_of(frames, FaultClassifier.of(kind.settings, robot).classify)


def codes_of(
    frames: Sequence[ResidualFrame], classify: Callable[[ResidualFrame], Diagnosis | None]
) -> Codes:
    """The same of what is said of each tick."""
    state, named = NORMAL, []
    for frame in frames:
        diagnosis = classify(frame)
        if diagnosis is not None:
            state = _in_paper(diagnosis.state)
        named.append(state)
    return np.array(named)


def twin_of(drive: Drive, labelled: LabelledDrive) -> GroundTruth:
    """What is true of the same drive without its fault, at the same ticks."""
    return healthy_twin(drive).of_ticks(labelled.first - 1 + np.arange(len(labelled.frames)))


def _in_paper(state: State) -> int:
    """Which of the six a state belongs to, the one after them if to none."""
    if state.name in FAULTLESS:
        return NORMAL
    return BEYOND if state.paper is None else state.paper


def observable(drive: Drive, labelled: LabelledDrive, twin: GroundTruth) -> Flags:
    """Ticks in which the fault has been measurable for 0.2 s, (n,)."""
    shows = deviates(labelled.truth, twin, Noise.of(drive.plant))
    shows &= labelled.faulty
    if true_state(drive) == SLIP:
        shows &= np.abs(labelled.truth.slip).max(axis=1) > SLIPPING
    return lasting(shows)


def true_state(drive: Drive) -> int:
    """State that the fault of a drive is to be named."""
    return int(PAPER_OF[class_of(drive.mission.faults[0])])


def score_faulty(drive: Drive, labelled: LabelledDrive, twin: GroundTruth, named: Codes) -> Outcome:
    """Hold the states named in a drive with a fault against the truth."""
    state, fault = true_state(drive), drive.mission.faults[0]
    severity = severity_of(fault)
    shows = observable(drive, labelled, twin)
    onsets, late = [], np.zeros(len(named), dtype=bool)
    for start, end in episodes(shows):
        hit = np.flatnonzero(named[start : end + 1 + _AFTER] == state)
        already = start > 0 and named[start - 1] == state
        first = 0.0 if already else (0.05 * (hit[0] + 1) if len(hit) else np.inf)
        onsets.append(Onset(state, severity, float(first)))
        late[start : start + _GRACE] = True
    ticks = np.arange(len(named))
    begin, end = np.flatnonzero(labelled.faulty)[[0, -1]]
    well = (ticks < begin) | (ticks > end + _RECOVERY)
    counted = shows & ~late
    wheel = wheel_of(fault)
    idle = np.zeros(len(named), dtype=bool)
    if wheel is not None:
        idle = np.abs(twin.speed[:, wheel]) < _TURNING
    decisions = counts(NORMAL, named[well]) + counts(state, named[counted])
    rises = np.diff(np.concatenate([[NORMAL], named]) != NORMAL) & (named != NORMAL)
    return Outcome(
        decisions,
        counts(state, named[counted & idle]),
        counts(state, named[labelled.faulty & ~shows & ~late]),
        {bin_of(severity): (int((named[counted] == state).sum()), int(counted.sum()))},
        tuple(onsets),
        tuple(named[rises & (ticks < begin)].tolist()),
        healthy_seconds=0.05 * float(begin),
    )


def score_healthy(labelled: LabelledDrive, named: Codes) -> Outcome:
    """Count what was named in a drive without a fault."""
    rises = np.flatnonzero((np.diff(named, prepend=NORMAL) != 0) & (named != NORMAL))
    slips = np.abs(labelled.truth.slip).max(axis=1) > SLIPPING
    alarms, excused = [], 0
    for tick in rises:
        if named[tick] == SLIP and slips[max(0, tick - _EXCUSE) : tick + 1].any():
            excused += 1
        else:
            alarms.append(int(named[tick]))
    nothing = np.zeros((len(NAMES), len(NAMES)), dtype=np.int64)
    return Outcome(
        counts(NORMAL, named),
        nothing,
        nothing,
        {},
        alarms=tuple(alarms),
        excused=excused,
        healthy_seconds=0.05 * len(named),
    )


def episodes(flags: Flags) -> list[tuple[int, int]]:
    """First and last tick of each time that a fault shows; its first deviating tick is first."""
    ticks = np.flatnonzero(flags)
    if not len(ticks):
        return []
    cuts = np.flatnonzero(np.diff(ticks) > _APART)
    starts = np.concatenate([[ticks[0]], ticks[cuts + 1]]) - (LASTING - 1)
    return list(zip(starts.tolist(), [*ticks[cuts].tolist(), int(ticks[-1])], strict=True))


def counts(true: int, named: Codes) -> Codes:
    """(7, 7) with the row of one true state filled."""
    table = np.zeros((len(NAMES), len(NAMES)), dtype=np.int64)
    table[true] = np.bincount(named, minlength=len(NAMES))
    return table


def bin_of(severity: float) -> str:
    """Name of a range of severities."""
    return next(name for name, most in _BINS if severity <= most)


_BINS = (("0.50 to 0.70", 0.7), ("0.70 to 0.85", 0.85), ("0.85 to 1", 0.999999), ("1", 1.0))


def seen(
    seed: int, kind: str | None, folder: Path | None, resolution: float | None = None
) -> tuple[Drive, LabelledDrive, GroundTruth | None]:
    """A drive, what the first two stages made of it, and its healthy twin if it has a fault."""
    drive = random_drive(shipped_robot("reference"), seed, kind)
    if resolution is not None:
        sensors = evolve(drive.plant.sensors, encoder_resolution=resolution)
        drive = evolve(drive, plant=evolve(drive.plant, sensors=sensors))
    kept = None if folder is None else folder / f"{seed}.pickle"
    if kept is not None and kept.exists():
        labelled, twin = pickle.loads(kept.read_bytes())
        return drive, labelled, twin
    labelled = simulated_drive(drive)
    twin = None
    if drive.mission.faults:
        twin = twin_of(drive, labelled)
    if kept is not None:
        kept.write_bytes(pickle.dumps((labelled, twin)))
    return drive, labelled, twin


def simulated(
    seed: int, kind: str | None, folder: Path | None, resolution: float | None = None
) -> None:
    """Only simulate, for a later run to score."""
    seen(seed, kind, folder, resolution)


def scored(
    seed: int, kind: str | None, folder: Path | None, resolution: float | None = None
) -> dict[str, Outcome]:
    """A drive scored by every classifier."""
    drive, labelled, twin = seen(seed, kind, folder, resolution)
    outcomes = {}
    for name, classifier in kinds().items():
        named = named_by(classifier, rebanded(labelled.frames, classifier.bands), drive.believed)
        outcomes[name] = (
            score_healthy(labelled, named)
            if twin is None
            else score_faulty(drive, labelled, twin, named)
        )
    return outcomes


def _run(
    work: Callable[[int, str | None, Path | None], Result],
    seeds: range,
    kind: str | None,
    folder: Path | None,
) -> list[Result]:
    of_all = [kind] * len(seeds), [folder] * len(seeds)
    return each(work, seeds, *of_all, title=kind or "healthy")


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drives", type=int, default=420, help="with a fault (default 420)")
    parser.add_argument("--healthy-hours", type=float, default=3.05, help="(default 3.05)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the test set")
    parser.add_argument("--json", type=Path, help="write the report to this file as well")
    parser.add_argument("--folder", type=Path, help="keep the simulated drives here, or take them")
    parser.add_argument("--simulate", action="store_true", help="only fill the folder")
    parser.add_argument(
        "--encoder-resolution",
        type=float,
        metavar="RAD",
        help="of the wheels' angles (default: the reference's, 40,960 counts a turn)",
    )
    options = parser.parse_args(arguments)
    first = options.first_seed
    count = max(1, round(options.healthy_hours * 3600.0 / _DRIVE_SECONDS))
    folder = options.folder
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    seeds = range(first, first + options.drives)
    more = range(first + _HEALTHY, first + _HEALTHY + count)
    if options.simulate:
        simulating = partial(simulated, resolution=options.encoder_resolution)
        _run(simulating, seeds, "fault", folder)
        _run(simulating, more, None, folder)
        return 0
    scoring = partial(scored, resolution=options.encoder_resolution)
    sick, well = _run(scoring, seeds, "fault", folder), _run(scoring, more, None, folder)
    found = {
        name: report([item[name] for item in sick], [item[name] for item in well])
        for name in kinds()
    }
    publish(found, options.json)
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
