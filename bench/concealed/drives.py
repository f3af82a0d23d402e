"""Missions at random: headings, speeds, turns, spins, reversals, creeping, stops."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from attrs import frozen

from concealed.robots import Nested
from tomr_sim_bridge.missions.mission import Plan
from tomr_sim_bridge.missions.schema import CirclePhase, TwistPhase

Piece = TwistPhase | CirclePhase
COMMAND_RATE = 20.0  # Hz
_HEADROOM = 0.8  # of the wheel speed at which the supply is exhausted
_WAVE_STEP = 1.0 / COMMAND_RATE  # s
_GENTLE = 0.35  # of the acceleration limit, for motions that turn at every command


@frozen
class Limits:
    """What a robot and a style allow."""

    slow: float  # m/s
    fast: float  # m/s
    yaw: float  # rad/s
    acceleration: float  # m/s^2
    yaw_acceleration: float  # rad/s^2


Draw = Callable[[Limits, np.random.Generator], list[Piece]]


@frozen
class Style:
    """Kinds of pieces with their chances, and the range of speeds."""

    chances: Mapping[str, float]
    speed: tuple[float, float] = (0.1, 0.7)  # m/s
    opening: tuple[str, ...] = ()


def _straight(limits: Limits, random: np.random.Generator) -> list[Piece]:
    return [_moving(limits, random, random.uniform(1.5, 5.0), 0.0)]


def _turning(limits: Limits, random: np.random.Generator) -> list[Piece]:
    yaw = random.uniform(-limits.yaw, limits.yaw)
    return [_moving(limits, random, random.uniform(1.5, 4.0), yaw)]


def _spin(limits: Limits, random: np.random.Generator) -> list[Piece]:
    yaw = random.uniform(0.3, 1.0) * limits.yaw * random.choice([-1.0, 1.0])
    return [TwistPhase((0.0, 0.0, float(yaw)), float(random.uniform(1.5, 3.0)))]


def _pause(limits: Limits, random: np.random.Generator) -> list[Piece]:
    return [_standing(float(random.uniform(0.8, 3.0)))]


def _reversals(limits: Limits, random: np.random.Generator) -> list[Piece]:
    there = _moving(limits, random, random.uniform(0.5, 1.0), 0.0)
    x, y, yaw = there.twist
    back = TwistPhase((-x, -y, yaw), there.duration)
    return [there, back] * int(random.integers(1, 4))


def _creep(limits: Limits, random: np.random.Generator) -> list[Piece]:
    speed = random.uniform(0.02, 0.08)
    return [_along(random, speed, random.uniform(2.0, 4.0), 0.0)]


def _circle(limits: Limits, random: np.random.Generator) -> list[Piece]:
    speed = float(random.uniform(limits.slow, 0.7 * limits.fast))
    rate = random.uniform(0.5, 1.0) * _GENTLE * limits.acceleration / speed
    rate = min(rate, 1.5) * random.choice([-1.0, 1.0])
    return [CirclePhase(speed, float(rate), float(random.uniform(3.0, 6.0)))]


def _yaw_wave(limits: Limits, random: np.random.Generator) -> list[Piece]:
    base = _moving(limits, random, random.uniform(3.0, 6.0), 0.0)
    rate = random.uniform(1.0, 2.5)
    height = random.uniform(0.5, 1.0) * min(limits.yaw, _GENTLE * limits.yaw_acceleration / rate)
    steps = round(base.duration / _WAVE_STEP)
    return [
        TwistPhase(
            (base.twist[0], base.twist[1], float(height * math.sin(rate * _WAVE_STEP * step))),
            _WAVE_STEP,
        )
        for step in range(steps)
    ]


def _long_straight(limits: Limits, random: np.random.Generator) -> list[Piece]:
    return [_moving(limits, random, random.uniform(9.0, 14.0), 0.0)]


def _burst(limits: Limits, random: np.random.Generator) -> list[Piece]:
    return [_along(random, 0.7, 2.5, 0.0)]


_PIECES: Mapping[str, Draw] = {
    "straight": _straight,
    "turning": _turning,
    "spin": _spin,
    "pause": _pause,
    "reversals": _reversals,
    "creep": _creep,
    "circle": _circle,
    "yaw_wave": _yaw_wave,
    "long_straight": _long_straight,
    "burst": _burst,
}
STYLES: Mapping[str, Style] = {
    "varied": Style(
        {
            "straight": 0.32,
            "turning": 0.2,
            "spin": 0.1,
            "pause": 0.12,
            "reversals": 0.1,
            "creep": 0.08,
            "circle": 0.04,
            "yaw_wave": 0.04,
        }
    ),
    "lively": Style(
        {"straight": 0.3, "turning": 0.15, "spin": 0.05, "pause": 0.1, "reversals": 0.4},
        (0.35, 0.8),
    ),
    "one_burst": Style(
        {"straight": 0.45, "turning": 0.25, "pause": 0.2, "spin": 0.1}, (0.05, 0.15), ("burst",)
    ),
    "few_starts": Style({"long_straight": 0.8, "circle": 0.2}, (0.15, 0.4)),
}


def random_plan(style: str, nominal: Nested, seconds: float, random: np.random.Generator) -> Plan:
    """A mission of about `seconds`, standing still at both ends, within what the robot can do."""
    chosen = STYLES[style]
    top, yaw = _reach(nominal)
    most = nominal["controller"]["acceleration_limit"]
    limits = Limits(
        slow=min(chosen.speed[0], 0.5 * top),
        fast=min(chosen.speed[1], top),
        yaw=yaw,
        acceleration=most,
        yaw_acceleration=most / nominal["robot"]["robot_radius"],
    )
    names, chances = list(chosen.chances), list(chosen.chances.values())
    pieces: list[Piece] = [_standing(float(random.uniform(1.5, 3.0)))]
    for name in chosen.opening:
        pieces += _PIECES[name](limits, random)
    while math.fsum(piece.duration for piece in pieces) < seconds - 2.0:
        name = names[int(random.choice(len(names), p=chances))]
        pieces += _PIECES[name](limits, random)
    pieces.append(_standing(1.5))
    return Plan(tuple(pieces), COMMAND_RATE)


def _reach(nominal: Nested) -> tuple[float, float]:
    """Largest speed [m/s] and yaw rate [rad/s], together within the headroom of the supply."""
    robot, motor = nominal["robot"], nominal["motor"]
    constant = motor["torque_constant"] * motor["gear_ratio"]
    rim = _HEADROOM * nominal["supply"]["nominal_voltage"] / constant * robot["wheel_radius"]
    yaw = min(1.3, 0.3 * rim / robot["robot_radius"])
    return rim - yaw * robot["robot_radius"], yaw


def _standing(seconds: float) -> TwistPhase:
    return TwistPhase((0.0, 0.0, 0.0), seconds)


def _moving(limits: Limits, random: np.random.Generator, seconds: float, yaw: float) -> TwistPhase:
    return _along(random, random.uniform(limits.slow, limits.fast), seconds, yaw)


def _along(random: np.random.Generator, speed: float, seconds: float, yaw: float) -> TwistPhase:
    heading = random.uniform(-math.pi, math.pi)
    twist = (float(speed * math.cos(heading)), float(speed * math.sin(heading)), float(yaw))
    return TwistPhase(twist, float(seconds))
