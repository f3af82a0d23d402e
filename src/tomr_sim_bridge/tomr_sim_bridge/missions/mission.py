"""Missions: loaded from YAML, planned for a robot, driven through the simulation."""

import math
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import cast

import numpy as np
from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_power_model.files import load_yaml, read_text
from tomr_power_model.limits import limits, too_large
from tomr_power_model.robot import Robot
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_sim_bridge.missions.schema import (
    CirclePhase,
    MovePhase,
    Phase,
    PlannedFault,
    RandomPhase,
    Twist,
    TwistPhase,
    check,
    longest,
    parse_fault,
    parse_phase,
)
from tomr_sim_bridge.plant.wheels import wheel_angles

_S = ParameterSpec
_SETTINGS = (
    _S("name", "of the mission", kind="str"),
    _S("description", "one line", kind="str", default=""),
    _S("robot", "shipped name or path", kind="str", default="reference"),
    _S("command_rate", "of cmd_vel", unit="Hz", default=20.0, minimum=0.1, maximum=1000.0),
    _S("repeat", "times through the phases", kind="int", default=1, minimum=1, maximum=10_000),
    _S("payload", "on top of the description", unit="kg", default=0.0, minimum=0.0, maximum=1e4),
    _S("floor_friction", "0: that of the robot", default=0.0, minimum=0.0, maximum=10.0),
    _S("stamp_jitter", "of the sampling times", unit="s", default=0.0, minimum=0.0, maximum=1.0),
    _S("seed", "-1: that of the run", kind="int", default=-1, minimum=-1, maximum=2**63 - 1),
)


@frozen
class Mission:
    """A mission as its file describes it."""

    name: str
    phases: tuple[Phase, ...]
    faults: tuple[PlannedFault, ...] = ()
    description: str = ""
    robot: str = "reference"
    command_rate: float = 20.0  # Hz
    repeat: int = 1
    payload: float = 0.0  # kg
    floor_friction: float = 0.0  # 0: that of the robot
    stamp_jitter: float = 0.0  # s
    seed: int = -1  # of random phases, -1: that of the run

    def plan(self, robot: Robot, seed: int = 0) -> "Plan":
        """Turn the phases into pieces with a duration each."""
        random = np.random.default_rng(self.seed if self.seed >= 0 else seed)
        pieces: list[TwistPhase | CirclePhase] = []
        for _ in range(self.repeat):
            for phase in self.phases:
                pieces.extend(_pieces(phase, robot, random))
        return Plan(tuple(pieces), self.command_rate)


@frozen
class Plan:
    """A mission for a certain robot: which twist is commanded when."""

    pieces: tuple[TwistPhase | CirclePhase, ...]
    command_rate: float  # Hz

    @property
    def duration(self) -> float:
        """Length of the mission [s]."""
        return math.fsum(piece.duration for piece in self.pieces)

    def commands(self) -> Iterator[tuple[float, Twist]]:
        """Yield (time [s], twist) at the command rate; each twist is that of its time."""
        period = 1.0 / self.command_rate
        count, begin = 0, 0.0
        for piece in self.pieces:
            # A rounding error must not push a command into the next piece.
            while count * period < begin + piece.duration - 1e-9:
                time = count * period
                yield time, _twist_at(piece, time - begin)
                count += 1
            begin += piece.duration


def _twist_at(piece: TwistPhase | CirclePhase, time: float) -> Twist:
    if isinstance(piece, TwistPhase):
        return piece.twist
    angle = piece.rate * time
    return piece.speed * math.cos(angle), piece.speed * math.sin(angle), 0.0


def _pieces(
    phase: Phase, robot: Robot, random: np.random.Generator
) -> list[TwistPhase | CirclePhase]:
    if isinstance(phase, MovePhase):
        return [_straight(_heading(phase, robot), phase.speed, 0.0, phase.duration)]
    if isinstance(phase, RandomPhase):
        pieces: list[TwistPhase | CirclePhase] = []
        for _ in range(phase.count):
            heading = random.uniform(-math.pi, math.pi)
            speed = random.uniform(*phase.speed)
            yaw_rate = random.uniform(-phase.yaw_rate, phase.yaw_rate)
            pieces.append(_straight(heading, speed, yaw_rate, random.uniform(*phase.duration)))
            if phase.pause > 0:
                pieces.append(TwistPhase((0.0, 0.0, 0.0), phase.pause))
        return pieces
    return [phase]


def _heading(phase: MovePhase, robot: Robot) -> float:
    if phase.direction == "heading":
        return phase.value
    axle = float(wheel_angles(robot)[int(phase.value) - 1])
    return axle - math.pi / 2 if phase.direction == "along_wheel" else axle


def _straight(heading: float, speed: float, yaw_rate: float, duration: float) -> TwistPhase:
    return TwistPhase((speed * math.cos(heading), speed * math.sin(heading), yaw_rate), duration)


def shipped_missions() -> list[str]:
    """Names of the missions that come with the package."""
    folder = files("tomr_sim_bridge").joinpath("missions")
    names = (entry.name for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    return sorted(name.removesuffix(".yaml") for name in names)


def load_mission(source: Path | str) -> Mission:
    """Read a mission from a file, or a shipped one by name.

    Raises InputError with one line that names the file, the key and the remedy.
    """
    place = str(source)
    if place in shipped_missions():
        resource = files("tomr_sim_bridge").joinpath("missions").joinpath(f"{place}.yaml")
        return parse_mission(resource.read_text(encoding="utf-8"), f"{place}.yaml")
    try:
        text = read_text(Path(source))
    except InputError as error:
        raise InputError(
            f"{error}: give a mission file or one of {', '.join(shipped_missions())}"
        ) from None
    return parse_mission(text, place)


def parse_mission(text: str, place: str) -> Mission:
    """Read a mission from the text of its file. Raises InputError."""
    given = dict(_document(text, place))
    base = given.pop("base", None)
    if base is not None:
        if base not in shipped_missions():
            raise InputError(
                f"{place}: base = {base!r} is no shipped mission: give one of "
                f"{', '.join(shipped_missions())}"
            )
        resource = files("tomr_sim_bridge").joinpath("missions").joinpath(f"{base}.yaml")
        inherited = dict(_document(resource.read_text(encoding="utf-8"), f"{base}.yaml"))
        if "base" in inherited:
            raise InputError(f"{place}: base = {base!r} has a base itself: use that one")
        given = {**inherited, **given}
    phases = _list(given.pop("phases", None), f"{place}: phases")
    faults = given.pop("faults", [])
    if not phases:
        raise InputError(f"{place}: phases is missing or empty: list at least one phase")
    settings = check(_SETTINGS, given, place)
    planned = tuple(
        parse_fault(fault, f"{place}: faults[{index}]")
        for index, fault in enumerate(_list(faults, f"{place}: faults"))
    )
    _reject_overlap(planned, place)
    parsed = tuple(
        parse_phase(phase, f"{place}: phases[{index}]") for index, phase in enumerate(phases)
    )
    mission = Mission(phases=parsed, faults=planned, **settings)  # type: ignore[arg-type]
    _reject_endless(mission, place)
    return mission


def _reject_endless(mission: Mission, place: str) -> None:
    pieces = mission.repeat * sum(
        phase.count if isinstance(phase, RandomPhase) else 1 for phase in mission.phases
    )
    seconds = mission.repeat * sum(longest(phase) for phase in mission.phases)
    if pieces > limits().mission_phases:
        too_large(place, f"{pieces:,} phases", "mission_phases")
    if seconds > limits().mission_seconds:
        too_large(place, f"it may last {seconds:,.0f} s", "mission_seconds")


def _document(text: str, place: str) -> Mapping[str, object]:
    document = load_yaml(text, place)
    if not isinstance(document, Mapping):
        raise InputError(f"{place}: is no mapping: start with name: and phases:")
    return cast(Mapping[str, object], document)


def _list(value: object, place: str) -> list[object]:
    if value is None:
        return []
    if not isinstance(value, list):
        raise InputError(f"{place}: {value!r} is no list: write one entry per line, each after -")
    return value


def _reject_overlap(faults: tuple[PlannedFault, ...], place: str) -> None:
    """One fault has one set of settings at a time."""
    for index, fault in enumerate(faults):
        for other in faults[:index]:
            end = math.inf if fault.end is None else fault.end
            other_end = math.inf if other.end is None else other.end
            same = fault.fault_id == other.fault_id
            if same and fault.start < other_end and other.start < end:
                raise InputError(
                    f"{place}: faults[{index}]: {fault.fault_id} overlaps an earlier entry: "
                    "end that one first"
                )
