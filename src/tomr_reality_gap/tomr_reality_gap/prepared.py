"""From files to what can be compared: recordings read, checked, aligned, and simulated."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.drive.astray import not_following, other_radii
from tomr_power_model.drive.clean import check_duration, cleaned
from tomr_power_model.drive.commands import shift_between
from tomr_power_model.drive.cut import names_of, without
from tomr_power_model.drive.excitation import check_excitation
from tomr_power_model.drive.quality import Finding, refuse, sensor_faults
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.effects.scales import Scales
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import ParameterisedRobot, per_wheel
from tomr_power_model.recordings import open_recording, resolve_topic
from tomr_power_model.robot import Robot, read_description, robot_from_parameters
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, channels_of
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.response import answering, controller_alternatives
from tomr_reality_gap.alignment.simulation import RecordingSimulation, Run
from tomr_reality_gap.fit.integrator import INTEGRATOR, WAYS, summed_otherwise
from tomr_reality_gap.fit.learnt import with_terms
from tomr_reality_gap.fit.simulator_discrepancy import DiscrepancyTorques, discrepancy_torques
from tomr_reality_gap.fit.window import WINDOW, window_of
from tomr_reality_gap.hypotheses.scales import scales_of, traction_ratios_of
from tomr_reality_gap.request import Request

Array = NDArray[np.float64]

_COARSE = 0.5  # of what a power varies by
_MOSTLY_INSIDE = 0.02  # of a drive beyond a table


@frozen
class Prepared:
    """A description and recordings of its robot, ready to be compared."""

    base: ParameterisedRobot  # the description, written out for each wheel
    robot: Robot  # as its drivers take it to be
    real: tuple[RecordingSimulation, ...]
    held: tuple[RecordingSimulation, ...]
    simulations: tuple[RecordingSimulation, ...]  # of the user's
    runs: tuple[Run, ...]  # as described, of the real ones
    scales: Scales
    notes: tuple[str, ...]

    def summed_otherwise(self) -> "Prepared":
        """The same, of drivers that sum their error the other way."""
        base = summed_otherwise(self.base)
        return evolve(self, base=base, robot=base.robot)


def prepared(request: Request) -> Prepared:
    """Read and align everything. Raises InputError with one line for bad input."""
    place = str(request.robot)
    values = _described(request)
    robot = robot_from_parameters(values, place)
    real = _read_all(request.real, request, robot)
    check_duration(real)
    held = _read_all(request.holdout, request, robot)
    check_excitation(real, robot)
    refuse(found for item in (*real, *held) for found in sensor_faults(item, robot))
    sim = _read_all((request.sim,), request, robot) if request.sim else ()
    _check_same_commands(real, sim)
    values[INTEGRATOR] = integrator_of(_simulation((*sim, *real)[0], robot))
    described = robot = robot_from_parameters(values, place)
    window = window_of(_simulation(real[0], robot))
    if window is not None:
        values[WINDOW] = window
        robot = robot_from_parameters(values, place)
    base = per_wheel(values, robot.wheel_names, place)
    recordings, held_out = (
        tuple(_simulation(item, robot) for item in group) for group in (real, held)
    )
    simulations = tuple(_simulation(item, described) for item in sim)  # whose sensors are so
    runs = tuple(item.run(base.robot) for item in recordings)
    check_commands(recordings, runs, robot)
    scales = _scales(recordings, runs, robot)
    discrepancy = discrepancy_torques(simulations, base.robot, scales.torque)
    notes = [note for item in (*real, *held) for note in item.notes]
    return Prepared(
        base=base,
        robot=robot,
        real=tuple(_as_described(_with(discrepancy, item, base.robot)) for item in recordings),
        held=tuple(_as_described(_with(discrepancy, item, base.robot)) for item in held_out),
        simulations=tuple(_with(discrepancy, item, base.robot) for item in simulations),
        runs=runs,
        scales=scales,
        notes=(
            *notes,
            *_averaging(window),
            *_sim_notes(simulations, discrepancy),
            *_beyond((*recordings, *held_out)),
            *_coarse((*recordings, *held_out)),
        ),
    )


def _averaging(window: float | None) -> Iterator[str]:
    if window is not None:
        yield (
            f"what power sensors say is averaged over {window:g} s: taken and written as {WINDOW}, "
            "by which nodes and tools go"
        )


def _described(request: Request) -> dict[str, object]:
    """Flat values of the description."""
    values = dict(read_description(request.robot))
    place = str(request.robot)
    robot = robot_from_parameters(values, place)
    if robot.measurement.source == "battery_state" and _has_total_only(request.real, robot):
        values["measurement.source"] = "total_only"
    for key in request.tolerances:
        if key not in values:
            raise InputError(
                f"--tolerance {key}: {place} has no such value: give a key as it stands there"
            )
    return values


def _has_total_only(paths: tuple[Path, ...], robot: Robot) -> bool:
    """Whether recordings hold the whole robot's power, and that of no motor."""
    for path in paths:
        with open_recording(path) as recording:
            wheels = [resolve_topic(recording, f"{topic}/power") for topic in robot.wheel_topics]
            if any(wheels) or not resolve_topic(recording, "battery_state"):
                return False
    return True


def _read_all(paths: tuple[Path, ...], request: Request, robot: Robot) -> tuple[Drive, ...]:
    names = dict(zip(request.recordings, names_of(request.recordings), strict=True))
    return tuple(
        _read(path, robot, names[path], request.skips.get(names[path], ())) for path in paths
    )


def _read(path: Path, robot: Robot, name: str, skipped: Sequence[tuple[float, float]]) -> Drive:
    drive = evolve(read_drive(path, robot), name=name)
    if not len(drive.command_time):
        raise InputError(f"{path}: no cmd_vel: record it too, the simulation is driven with it")
    return without(cleaned(drive, robot), skipped)


def _simulation(drive: Drive, robot: Robot) -> RecordingSimulation:
    return RecordingSimulation.of(drive, robot, channels_of(drive, robot))


def _with(
    discrepancy: DiscrepancyTorques | None, simulation: RecordingSimulation, robot: Robot
) -> RecordingSimulation:
    """The recording, simulated with what the user's simulation resists beyond ours."""
    if discrepancy is None:
        return simulation
    return evolve(simulation, resisting=discrepancy.torque(motion_in(simulation, robot)))


def _as_described(simulation: RecordingSimulation) -> RecordingSimulation:
    """The recording, simulated with the learnt terms of the description."""
    robot = simulation.robot
    return with_terms(simulation, robot, robot.unmodelled)


def _beyond(simulations: Sequence[RecordingSimulation]) -> Iterator[str]:
    """Drives that go beyond what the description's learnt terms know."""
    for item in simulations:
        for number, term in enumerate(item.robot.unmodelled, start=1):
            share = term.outside(motion_in(item, item.robot))
            if share > _MOSTLY_INSIDE:
                yield (
                    f"{item.recorded.name}: {share:.0%} of it lies beyond the table of learnt term "
                    f"{number} ({term.family.words}), which fades there"
                )


def _coarse(simulations: Sequence[RecordingSimulation]) -> Iterator[str]:
    """Drives of which a power sensor shows little more than its own steps."""
    for item in simulations:
        drawn = [channel for channel in item.channels if channel.kind in DRAWN_KINDS]
        steps = [channel.quantum / max(float(np.std(channel.value)), 1e-12) for channel in drawn]
        if steps and max(steps) > _COARSE:
            worst = drawn[int(np.argmax(steps))]
            yield (
                f"{item.recorded.name}: {worst.name} is read in steps of {worst.quantum:.2g} "
                f"{worst.unit}, {max(steps):.1f} times what it varies by (standard deviation): "
                "much of its error, as explained too, is these"
            )


def integrator_of(simulation: RecordingSimulation) -> str:
    """Whether the drivers add the present error before they use the sum: which fits better.

    It counts as much as a few percent of the proportional gain.
    """
    given = simulation.robot
    robots = [evolve(given, controller=evolve(given.controller, integrator=way)) for way in WAYS]
    errors = dict.fromkeys(WAYS, 0.0)
    for way, value in zip(WAYS, simulation.predict(robots), strict=True):
        for channel, part in zip(simulation.channels, rows_of(simulation.channels), strict=True):
            if channel.kind == "speed":
                errors[way] += float(np.mean(np.abs(channel.value - value[part])))
    return min(WAYS, key=errors.__getitem__)


def check_commands(
    recordings: Sequence[RecordingSimulation], runs: Sequence[Run], robot: Robot
) -> None:
    """Raise InputError where wheels do not turn as the commands make them, neither by drivers as
    described nor as `controller_alternatives` has them, which is for an explanation to say."""
    found = _astray(recordings, runs)
    if not found:
        return
    shown = controller_alternatives(recordings, robot)
    if shown:
        other = answering(robot, shown)
        found = _astray(recordings, [item.run(other) for item in recordings])
    refuse(found)


def _astray(recordings: Sequence[RecordingSimulation], runs: Sequence[Run]) -> list[Finding]:
    return [
        found
        for item, run in zip(recordings, runs, strict=True)
        for check in (not_following, other_radii)
        for found in check(item.recorded, item.robot, item.timeline.middle, run.speed)
    ]


def _check_same_commands(real: tuple[Drive, ...], sim: tuple[Drive, ...]) -> None:
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
    simulations: Sequence[RecordingSimulation], discrepancy: DiscrepancyTorques | None
) -> tuple[str, ...]:
    """How far the given simulation and the one used here agree."""
    notes = []
    for simulation in simulations:
        value = simulation.predict([simulation.robot])[0]
        rows = rows_of(simulation.channels)
        errors = [
            float(np.std(channel.value - value[part]) / max(np.std(channel.value), 1e-9))
            for channel, part in zip(simulation.channels, rows, strict=True)
            if channel.kind in DRAWN_KINDS
        ]
        more = "" if discrepancy is None else "; what it resists more is taken off"
        notes.append(
            f"{simulation.recorded.name}: the simulation that the findings rest on differs from "
            f"it by an NRMSE of {max(errors):.3f} in what it draws{more}"
        )
    return tuple(notes)


def _scales(
    simulations: Sequence[RecordingSimulation], runs: Sequence[Run], robot: Robot
) -> Scales:
    joined = {
        name: np.concatenate([getattr(run, name) for run in runs])
        for name in ("speed", "power", "copper")
    }
    duration = max(item.timeline.count * item.timeline.period for item in simulations)
    channels = [channel for item in simulations for channel in item.channels]
    currents = [channel.value for channel in channels if channel.kind == "current"]
    scales = scales_of(
        robot,
        joined["speed"],
        joined["power"],
        joined["copper"],
        duration=duration,
        currents=currents,
    )
    ratios = [
        traction_ratios_of(robot, run.speed, item.timeline.period)
        for item, run in zip(simulations, runs, strict=True)
    ]
    return evolve(
        scales, traction_ratios=tuple(max(levels) for levels in zip(*ratios, strict=True))
    )
