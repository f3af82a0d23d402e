"""Mission files: what to drive, which faults to meet. See `mission.py` for what becomes of them.

name: square
description: one line
robot: reference              # default robot, a shipped name or a path
base: other                   # optional: a shipped mission whose keys are taken over
command_rate: 20.0            # Hz
repeat: 1                     # times through the phases
payload: 0.0                  # kg on top of the description
floor_friction: 0.8           # traction coefficient; absent: that of the robot
stamp_jitter: 0.0             # s, standard deviation of the sampling times
seed: 1                       # of random phases; absent: that of the run
phases:
  - {pause: 1.0}                                            # s
  - {twist: [0.4, 0.0, 0.0], duration: 3.0}                 # m/s, m/s, rad/s; s
  - {move: {heading_deg: 30.0, speed: 0.4, duration: 3.0}}  # from +x of base_link
  - {move: {along_wheel: 2, speed: 0.4, duration: 3.0}}     # parallel to the wheel's plane
  - {move: {across_wheel: 1, speed: 0.4, duration: 3.0}}    # that wheel need not turn
  - {circle: {speed: 0.4, rate: 1.0, duration: 10.0}}       # heading turns, the robot does not
  - {random: {count: 10, speed: [0.1, 0.5], yaw_rate: 0.5, duration: [1.0, 3.0], pause: 0.5}}
faults:                       # settings as the fault describes itself; severity 1 if absent
  - {fault: encoder_lost, start: 5.0, end: 8.0, wheel: 1}
"""

import math
from collections.abc import Callable, Mapping
from typing import Literal, cast

from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_power_model.robot.parameters import ParameterSpec, Value, check_all
from tomr_sim_bridge.faults import check_settings

Twist = tuple[float, float, float]
Direction = Literal["heading", "along_wheel", "across_wheel"]
_S = ParameterSpec
_DURATION = _S("duration", "how long", unit="s", above=0.0, maximum=1e5)
_SPEED = _S("speed", "of the body", unit="m/s", minimum=0.0, maximum=10.0)


@frozen
class TwistPhase:
    """A body twist held for a while; zero for a pause."""

    twist: Twist  # m/s, m/s, rad/s
    duration: float  # s


@frozen
class MovePhase:
    """Straight driving in a direction that may depend on the robot's wheels."""

    direction: Direction
    value: float  # rad from +x of base_link, or the wheel's number 1..3
    speed: float  # m/s
    duration: float  # s


@frozen
class CirclePhase:
    """The velocity turns at a constant rate while the robot keeps its heading."""

    speed: float  # m/s
    rate: float  # rad/s
    duration: float  # s


@frozen
class RandomPhase:
    """A number of random twists, each followed by a pause."""

    count: int
    speed: tuple[float, float]  # m/s
    yaw_rate: float  # rad/s, largest magnitude
    duration: tuple[float, float]  # s
    pause: float  # s


Phase = TwistPhase | MovePhase | CirclePhase | RandomPhase


def longest(phase: Phase) -> float:
    """The longest time that a phase may take [s]."""
    if isinstance(phase, RandomPhase):
        return phase.count * (phase.duration[1] + phase.pause)
    return phase.duration


@frozen
class PlannedFault:
    """A fault with the time it is in force [s from the start], `end` None: to the end."""

    fault_id: str
    start: float
    end: float | None
    settings: Mapping[str, Value]


def _mapping(value: object, place: str) -> Mapping[str, object]:
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise InputError(f"{place}: {value!r} is no mapping: write it as {{key: value}}")
    return cast(Mapping[str, object], value)


def check(specs: tuple[ParameterSpec, ...], value: object, place: str) -> dict[str, Value]:
    """Check a mapping against a table; unknown keys are errors. Raises InputError."""
    values = _mapping(value, place)
    known = [spec.name for spec in specs]
    for key in values:
        if key not in known:
            raise InputError(f"{place}: {key} is unknown: give {', '.join(known)}")
    return check_all(specs, values, place)


def parse_phase(value: object, place: str) -> Phase:
    """Read one phase. Raises InputError."""
    given = _mapping(value, place)
    kinds = [kind for kind in given if kind in _PHASES]
    if len(kinds) != 1:
        raise InputError(
            f"{place}: {dict(given)!r} names {len(kinds)} kinds of phase: "
            f"give exactly one of {', '.join(_PHASES)}"
        )
    kind = kinds[0]
    if kind != "twist" and len(given) > 1:
        extra = next(key for key in given if key != kind)
        raise InputError(f"{place}: {extra} is unknown beside {kind}: remove it")
    return _PHASES[kind](given, place)


def _pause(given: Mapping[str, object], place: str) -> Phase:
    spec = _S("pause", "how long", unit="s", above=0.0, maximum=1e5)
    return TwistPhase((0.0, 0.0, 0.0), cast(float, check((spec,), given, place)["pause"]))


def _twist(given: Mapping[str, object], place: str) -> Phase:
    spec = _S("twist", "v_x, v_y, omega_z", kind="floats", length=3, minimum=-20.0, maximum=20.0)
    checked = check((spec, _DURATION), given, place)
    return TwistPhase(cast(Twist, checked["twist"]), cast(float, checked["duration"]))


def _move(given: Mapping[str, object], place: str) -> Phase:
    values = _mapping(given["move"], place)
    directions = {
        "heading_deg": _S("heading_deg", "from +x", unit="deg", minimum=-360.0, maximum=360.0),
        "along_wheel": _S("along_wheel", "wheel", kind="int", minimum=1, maximum=3),
        "across_wheel": _S("across_wheel", "wheel", kind="int", minimum=1, maximum=3),
    }
    chosen = [name for name in directions if name in values]
    if len(chosen) != 1:
        raise InputError(f"{place}: move needs exactly one of {', '.join(directions)}")
    name = chosen[0]
    checked = check((directions[name], _SPEED, _DURATION), values, f"{place}.move")
    number = float(cast(float, checked[name]))
    return MovePhase(
        direction="heading" if name == "heading_deg" else cast(Direction, name),
        value=math.radians(number) if name == "heading_deg" else number,
        speed=cast(float, checked["speed"]),
        duration=cast(float, checked["duration"]),
    )


def _circle(given: Mapping[str, object], place: str) -> Phase:
    rate = _S("rate", "turning of the velocity", unit="rad/s", minimum=-20.0, maximum=20.0)
    checked = check((_SPEED, rate, _DURATION), given["circle"], f"{place}.circle")
    return CirclePhase(**cast(dict[str, float], checked))


def _random(given: Mapping[str, object], place: str) -> Phase:
    pair = {"kind": "floats", "length": 2, "minimum": 0.0}
    specs = (
        _S("count", "number of twists", kind="int", minimum=1, maximum=10_000),
        _S("speed", "from, to", unit="m/s", maximum=10.0, **pair),  # type: ignore[arg-type]
        _S("yaw_rate", "largest", unit="rad/s", default=0.0, minimum=0.0, maximum=20.0),
        _S("duration", "from, to", unit="s", maximum=1e4, **pair),  # type: ignore[arg-type]
        _S("pause", "after each", unit="s", default=0.0, minimum=0.0, maximum=1e4),
    )
    checked = check(specs, given["random"], f"{place}.random")
    for key in ("speed", "duration"):
        low, high = cast(tuple[float, float], checked[key])
        if low > high or high == 0.0:
            raise InputError(f"{place}.random: {key} = [{low:g}, {high:g}]: give [least, most]")
    return RandomPhase(**checked)  # type: ignore[arg-type]


_PHASES: dict[str, Callable[[Mapping[str, object], str], Phase]] = {
    "pause": _pause,
    "twist": _twist,
    "move": _move,
    "circle": _circle,
    "random": _random,
}


def parse_fault(value: object, place: str) -> PlannedFault:
    """Read one fault of a mission. Raises InputError."""
    given = dict(_mapping(value, place))
    fault_id = given.pop("fault", None)
    if not isinstance(fault_id, str):
        raise InputError(f"{place}: fault is missing: name one, e.g. fault: encoder_lost")
    specs = (
        _S("start", "from the start of the mission", unit="s", minimum=0.0),
        _S("end", "from the start of the mission", unit="s", default=math.inf, above=0.0),
    )
    times: dict[str, object] = {key: given.pop(key) for key in ("start", "end") if key in given}
    checked = check_all(specs, times, place)
    start, end = cast(float, checked["start"]), cast(float, checked["end"])
    if end <= start:
        raise InputError(f"{place}: end = {end:g} s is not after start = {start:g} s")
    given.setdefault("severity", 1.0)
    settings = check_settings(fault_id, given, place)
    return PlannedFault(fault_id, start, None if math.isinf(end) else end, settings)
