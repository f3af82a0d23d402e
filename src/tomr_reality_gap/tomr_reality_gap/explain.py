"""From recordings to an explanation: align, compare, name, model, show."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.checks import refuse_little_motion
from tomr_power_model.calibration.recorded import Recorded, read_recorded
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording, resolve_topic
from tomr_power_model.robot import Robot, read_description, robot_from_parameters
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.alignment.steady import steadied
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.fit.noise import rows_of
from tomr_reality_gap.fit.prune import second_thoughts
from tomr_reality_gap.fit.search import search
from tomr_reality_gap.fit.study import Model, Study
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances
from tomr_reality_gap.hypotheses.knobs import Turned, turned
from tomr_reality_gap.hypotheses.scales import Scales, scales_of
from tomr_reality_gap.mismatch.orders import ripple_orders
from tomr_reality_gap.request import Request
from tomr_reality_gap.verdict import Evidence, explanation_of

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

_WINDOW = 0.005  # s, over which power sensors average
_SHORTEST = 10.0  # s


@frozen
class _Described:
    """The description, written out for each wheel."""

    base: Turned
    robot: Robot
    source: str


def explain(request: Request, progress: Progress = lambda stage, part: None) -> Explanation:
    """Explain where reality differs. Raises InputError with one line for bad input."""
    progress("reading", 0.0)
    described = _described(request)
    robot = described.robot
    real = _read_all(request.real, robot)
    held = _read_all(request.holdout, robot)
    refuse_little_motion(real, robot)
    sim = _read_all((request.sim,), robot) if request.sim else ()
    _check_alike(real, sim, robot)
    prompt = _is_prompt(_forward((*sim, *real)[0], robot))
    forwards = tuple(evolve(_forward(item, robot), prompt=prompt) for item in real)
    study = Study(forwards)
    progress("simulating", 0.05)
    runs = [item.run(described.base.robot) for item in forwards]
    scales = _scales(forwards, runs, robot)
    knobs = nuisances(described.base, robot.wheel_names, request.tolerance, request.tolerances)
    start = Model(described.base, knobs, (0.0,) * len(knobs))
    orders = _orders(study, runs)
    candidates = catalogue(described.base, robot.wheel_names, scales, request.tolerance, orders)
    tick = _Counter(progress, 3 * len(candidates) * len(forwards))
    found = search(study, start, candidates, tick)
    found = second_thoughts(study, found, tick)
    progress("what is left", 0.85)
    evidence = Evidence(study, found, described.base, robot, described.source, scales, candidates)
    held_forwards = tuple(evolve(_forward(item, robot), prompt=prompt) for item in held)
    notes = tuple(note for item in (*real, *held) for note in item.notes)
    explanation = explanation_of(evidence, held_forwards, (*notes, *_sim_notes(sim, robot, prompt)))
    progress("done", 1.0)
    return evolve(explanation, recordings=(*request.real, *request.holdout))


class _Counter:
    """Turns counts of simulated robots into progress."""

    def __init__(self, progress: Progress, expected: int) -> None:
        self._progress = progress
        self._expected = expected
        self._done = 0

    def __call__(self, count: int) -> None:
        self._done += count
        part = 1.0 - 0.5 ** (2.0 * self._done / self._expected)
        self._progress("naming", 0.1 + 0.75 * part)


def _described(request: Request) -> _Described:
    values = dict(read_description(request.robot))
    place = str(request.robot)
    robot = robot_from_parameters(values, place)
    if robot.measurement.source == "battery_state" and _has_total_only(request.real, robot):
        values["measurement.source"] = "total_only"
        robot = robot_from_parameters(values, place)
    if robot.measurement.quantity == "motor_current":
        raise InputError(
            f"{place}: measurement.quantity = motor_current: power is compared, and currents alone "
            "do not tell it: record the supply's voltage and current of each driver"
        )
    for key in request.tolerances:
        if key not in values:
            raise InputError(
                f"--tolerance {key}: {place} has no such value: give a key as it stands there"
            )
    return _Described(turned(values, robot.wheel_names, place), robot, place)


def _has_total_only(paths: tuple[Path, ...], robot: Robot) -> bool:
    """Whether recordings hold the whole robot's power, and that of no motor."""
    for path in paths:
        with open_recording(path) as recording:
            wheels = [resolve_topic(recording, f"{topic}/power") for topic in robot.wheel_topics]
            if any(wheels) or not resolve_topic(recording, "battery_state"):
                return False
    return True


def _read_all(paths: tuple[Path, ...], robot: Robot) -> tuple[Recorded, ...]:
    return tuple(_read(path, robot) for path in paths)


def _read(path: Path, robot: Robot) -> Recorded:
    recorded = read_recorded(path, robot)
    if not len(recorded.command_time):
        raise InputError(f"{path}: no cmd_vel: record it too, the simulation is driven with it")
    if recorded.duration < _SHORTEST:
        raise InputError(
            f"{path}: {recorded.duration:.1f} s are too short to decide anything: record at least "
            f"{_SHORTEST:g} s, better three minutes"
        )
    first, last = recorded.command_time[0], recorded.command_time[-1]
    if first > recorded.duration or last < 0.0:
        raise InputError(
            f"{path}: commands ({first:.1f} to {last:.1f} s) and encoders (0 to "
            f"{recorded.duration:.1f} s) do not overlap: are both stamped by the same clock?"
        )
    power = np.concatenate([recorded.power.ravel(), recorded.total])
    if len(power) and not np.isfinite(power).any():
        raise InputError(f"{path}: every power sample is NaN: check the power sensors' driver")
    return recorded


def _forward(recorded: Recorded, robot: Robot) -> Forward:
    even, jitters = steadied(recorded)
    return Forward.of(even, robot, channels_of(even, robot, _WINDOW, jitters))


def _is_prompt(forward: Forward) -> bool:
    """Whether the drivers add the present error before they use the sum: which fits better.

    The contract leaves it open; it counts as much as a few percent of the proportional gain.
    """
    errors = []
    for prompt in (False, True):
        value = evolve(forward, prompt=prompt).predict([forward.robot])[0]
        parts = zip(forward.channels, rows_of(forward.channels), strict=True)
        errors.append(
            sum(
                float(np.mean(np.abs(channel.value - value[part])))
                for channel, part in parts
                if channel.kind == "speed"
            )
        )
    return errors[1] < errors[0]


def _check_alike(real: tuple[Recorded, ...], sim: tuple[Recorded, ...], robot: Robot) -> None:
    """A simulation must have been driven with the commands of a real recording."""
    for item in sim:
        moved = np.nanmax(np.abs(item.position - item.position[:1]), initial=0.0)
        speed = np.nanmax(np.abs(item.velocity), initial=0.0)
        if max(moved, speed) < 0.1:
            raise InputError(f"{item.name}: no wheel turns in it: record a simulation that drives")
        if not any(_same_commands(item, other) for other in real):
            raise InputError(
                f"{item.name}: its commands are not those of {real[0].name}: simulate with the "
                "cmd_vel of the real recording"
            )


def _same_commands(one: Recorded, other: Recorded) -> bool:
    """Whether two recordings were driven alike, up to a shift of their clocks."""
    step = 0.05
    ends = [item.command_time[-1] - item.command_time[0] for item in (one, other)]
    if min(ends) < 0.5 * max(ends):
        return False
    grid = np.arange(0.0, min(ends), step)
    series = [
        item.command[
            np.searchsorted(item.command_time - item.command_time[0], grid + 1e-9, side="right") - 1
        ]
        for item in (one, other)
    ]
    scale = np.sqrt(np.mean(series[1] ** 2)) + 1e-9
    return bool(np.sqrt(np.mean((series[0] - series[1]) ** 2)) < 0.3 * scale)


def _sim_notes(sim: tuple[Recorded, ...], robot: Robot, prompt: bool) -> tuple[str, ...]:
    """How far the given simulation and the one used here agree."""
    notes = []
    for item in sim:
        forward = evolve(_forward(item, robot), prompt=prompt)
        value = forward.predict([robot])[0]
        rows = rows_of(forward.channels)
        errors = [
            float(np.std(channel.value - value[part]) / max(np.std(channel.value), 1e-9))
            for channel, part in zip(forward.channels, rows, strict=True)
            if channel.kind in ("power", "total")
        ]
        notes.append(
            f"{item.name}: the simulation that the findings rest on agrees with it to an NRMSE of "
            f"{max(errors):.3f} in power"
        )
    return tuple(notes)


def _scales(forwards: tuple[Forward, ...], runs: list[dict[str, Array]], robot: Robot) -> Scales:
    joined = {
        name: np.concatenate([run[name] for run in runs]) for name in ("speed", "power", "copper")
    }
    duration = max(item.timeline.count * item.timeline.period for item in forwards)
    return scales_of(robot, joined["speed"], joined["power"], joined["copper"], duration)


def _orders(study: Study, runs: list[dict[str, Array]]) -> tuple[float, ...]:
    """Orders of ripples that any recording shows."""
    found: list[float] = []
    for item, run in zip(study.forwards, runs, strict=True):
        value = item.predict([item.robot])[0]
        line = item.timeline
        middle = line.start + line.period * (np.arange(line.count) + 0.5)
        residuals, speeds = [], []
        for channel, part in zip(item.channels, rows_of(item.channels), strict=True):
            residuals.append(channel.value - value[part])
            own = run["speed"][:, channel.wheel or 0]
            speeds.append(np.interp(channel.time - 0.5 * channel.span, middle, own))
        found += ripple_orders(item.recorded, item.channels, residuals, speeds)
    return tuple(dict.fromkeys(found))
