"""From files to what can be compared: recordings read, checked, aligned, and simulated."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.calibration.calibrate import names_of, without
from tomr_power_model.calibration.checks import refuse_little_motion
from tomr_power_model.calibration.recorded import Recorded, read_recorded
from tomr_power_model.effects.scales import Scales
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import ParameterisedRobot, per_wheel
from tomr_power_model.recordings import open_recording, resolve_topic
from tomr_power_model.robot import Robot, read_description, robot_from_parameters
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, channels_of
from tomr_reality_gap.alignment.commands import shift_between
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.alignment.steady import steadied
from tomr_reality_gap.alignment.usable import refuse_dull, refuse_faulty, refuse_unfollowed, usable
from tomr_reality_gap.fit.simulator_discrepancy import DiscrepancyTorques, discrepancy_torques
from tomr_reality_gap.hypotheses.scales import scales_of, traction_ratios_of
from tomr_reality_gap.mismatch.probes import motion_of
from tomr_reality_gap.request import Request

Array = NDArray[np.float64]

_WINDOW = 0.005  # s, over which power sensors average
_SHORTEST = 10.0  # s, of all recordings together
_SINGLE = 2.0  # s, of each


@frozen
class Prepared:
    """A description and recordings of its robot, ready to be compared."""

    base: ParameterisedRobot  # the description, written out for each wheel
    robot: Robot  # as its drivers take it to be
    real: tuple[Forward, ...]
    held: tuple[Forward, ...]
    simulations: tuple[Forward, ...]  # of the user's
    runs: tuple[Mapping[str, Array], ...]  # of `Forward.run` as described, of the real ones
    scales: Scales
    notes: tuple[str, ...]


def prepared(request: Request) -> Prepared:
    """Read and align everything. Raises InputError with one line for bad input."""
    base, robot = _described(request)
    real = _read_all(request.real, request, robot)
    _refuse_short(real)
    held = _read_all(request.holdout, request, robot)
    refuse_little_motion(real, robot)
    refuse_dull(real)
    refuse_faulty((*real, *held), robot)
    sim = _read_all((request.sim,), request, robot) if request.sim else ()
    _check_same_commands(real, sim)
    prompt = _is_prompt(_forward((*sim, *real)[0], robot))
    forwards, held_out, simulations = (
        tuple(evolve(_forward(item, robot), prompt=prompt) for item in group)
        for group in (real, held, sim)
    )
    runs = tuple(item.run(base.robot) for item in forwards)
    refuse_unfollowed(forwards, runs)
    scales = _scales(forwards, runs, robot)
    discrepancy = discrepancy_torques(simulations, base.robot, scales.torque)
    notes = [note for item in (*real, *held) for note in item.notes]
    return Prepared(
        base=base,
        robot=robot,
        real=tuple(_with(discrepancy, item, base.robot) for item in forwards),
        held=tuple(_with(discrepancy, item, base.robot) for item in held_out),
        simulations=tuple(_with(discrepancy, item, base.robot) for item in simulations),
        runs=runs,
        scales=scales,
        notes=(*notes, *_sim_notes(simulations, discrepancy)),
    )


def _described(request: Request) -> tuple[ParameterisedRobot, Robot]:
    values = dict(read_description(request.robot))
    place = str(request.robot)
    robot = robot_from_parameters(values, place)
    if robot.measurement.source == "battery_state" and _has_total_only(request.real, robot):
        values["measurement.source"] = "total_only"
        robot = robot_from_parameters(values, place)
    for key in request.tolerances:
        if key not in values:
            raise InputError(
                f"--tolerance {key}: {place} has no such value: give a key as it stands there"
            )
    return per_wheel(values, robot.wheel_names, place), robot


def _has_total_only(paths: tuple[Path, ...], robot: Robot) -> bool:
    """Whether recordings hold the whole robot's power, and that of no motor."""
    for path in paths:
        with open_recording(path) as recording:
            wheels = [resolve_topic(recording, f"{topic}/power") for topic in robot.wheel_topics]
            if any(wheels) or not resolve_topic(recording, "battery_state"):
                return False
    return True


def _read_all(paths: tuple[Path, ...], request: Request, robot: Robot) -> tuple[Recorded, ...]:
    names = dict(zip(request.recordings, names_of(request.recordings), strict=True))
    return tuple(
        without(evolve(_read(path, robot), name=names[path]), request.skips.get(names[path], ()))
        for path in paths
    )


def _read(path: Path, robot: Robot) -> Recorded:
    recorded = read_recorded(path, robot)
    if not len(recorded.command_time):
        raise InputError(f"{path}: no cmd_vel: record it too, the simulation is driven with it")
    if recorded.duration < _SINGLE:
        raise InputError(
            f"{path}: {recorded.duration:.1f} s are too short for a recording: leave it out"
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
    return usable(recorded, robot)


def _refuse_short(real: tuple[Recorded, ...]) -> None:
    duration = sum(item.duration for item in real)
    if duration < _SHORTEST:
        names = ", ".join(item.name for item in real)
        raise InputError(
            f"{names}: {duration:.1f} s are too short to decide anything: record at least "
            f"{_SHORTEST:g} s, better three minutes"
        )


def _forward(recorded: Recorded, robot: Robot) -> Forward:
    even, jitters = steadied(recorded)
    return Forward.of(even, robot, channels_of(even, robot, _WINDOW, jitters))


def _with(discrepancy: DiscrepancyTorques | None, forward: Forward, robot: Robot) -> Forward:
    """The recording, simulated with what the user's simulation resists beyond ours."""
    if discrepancy is None:
        return forward
    motion = motion_of(forward, robot, forward.run(robot))
    return evolve(forward, resisting=discrepancy.torque(motion))


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


def _check_same_commands(real: tuple[Recorded, ...], sim: tuple[Recorded, ...]) -> None:
    """A simulation must have been driven with the commands of a real recording."""
    for item in sim:
        moved = np.nanmax(np.abs(item.position - item.position[:1]), initial=0.0)
        speed = np.nanmax(np.abs(item.velocity), initial=0.0)
        if max(moved, speed) < 0.1:
            raise InputError(f"{item.name}: no wheel turns in it: record a simulation that drives")
        if all(shift_between(item, other) is None for other in real):
            raise InputError(
                f"{item.name}: its commands are not those of {real[0].name}: simulate with the "
                "cmd_vel of the real recording"
            )


def _sim_notes(
    simulations: Sequence[Forward], discrepancy: DiscrepancyTorques | None
) -> tuple[str, ...]:
    """How far the given simulation and the one used here agree."""
    notes = []
    for forward in simulations:
        value = forward.predict([forward.robot])[0]
        rows = rows_of(forward.channels)
        errors = [
            float(np.std(channel.value - value[part]) / max(np.std(channel.value), 1e-9))
            for channel, part in zip(forward.channels, rows, strict=True)
            if channel.kind in DRAWN_KINDS
        ]
        more = "" if discrepancy is None else "; what it resists more is taken off"
        notes.append(
            f"{forward.recorded.name}: the simulation that the findings rest on differs from it by "
            f"an NRMSE of {max(errors):.3f} in what it draws{more}"
        )
    return tuple(notes)


def _scales(
    forwards: Sequence[Forward], runs: Sequence[Mapping[str, Array]], robot: Robot
) -> Scales:
    joined = {
        name: np.concatenate([run[name] for run in runs]) for name in ("speed", "power", "copper")
    }
    duration = max(item.timeline.count * item.timeline.period for item in forwards)
    channels = [channel for item in forwards for channel in item.channels]
    currents = [channel.value for channel in channels if channel.kind == "current"]
    scales = scales_of(
        robot, joined["speed"], joined["power"], joined["copper"], duration, currents
    )
    ratios = [
        traction_ratios_of(robot, run["speed"], item.timeline.period)
        for item, run in zip(forwards, runs, strict=True)
    ]
    return evolve(
        scales, traction_ratios=tuple(max(levels) for levels in zip(*ratios, strict=True))
    )
