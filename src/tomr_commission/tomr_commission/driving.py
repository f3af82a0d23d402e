"""The drive of a commissioning through cmd_vel: slowly first, watched all the while.

Its logic takes times and values, not clocks or messages; `nodes/drive_node.py` has those.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.geometry.poses import moved
from tomr_power_model.messages.intake import Triple
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.missions.mission import Plan
from tomr_sim_bridge.missions.schema import Twist

Array = NDArray[np.float64]

STILL: Twist = (0.0, 0.0, 0.0)


@frozen
class DriveChoice:
    """How it is driven, and what stops it."""

    slowly: float = 0.3  # share of the planned speeds
    slow_seconds: float = 20.0  # of the plan that are driven slowly first
    pause: float = 1.5  # s of standing before, between and after
    silence: float = 0.5  # s without encoders
    not_following: float = 1.5  # s, of the whole robot or a wheel that runs away
    moves: float = 0.5  # rad/s: slower wheels are not judged
    stands: float = 0.2  # of the commanded speed: slower is standing
    away: float = 1.5  # of the fastest commanded lately: faster is running away
    off: float = 0.4  # by which a wheel's answer may differ from the commanded, slowly
    least: int = 20  # samples that a wheel is judged by


@frozen
class Command:
    """What is to be commanded from a time on [s]; m/s, m/s, rad/s."""

    time: float
    twist: Twist


def schedule(plan: Plan, choice: DriveChoice) -> tuple[tuple[Command, ...], float]:
    """All commands, and when the slow part is over [s]; begins and ends with standing."""
    rate = plan.command_rate
    stand = [STILL] * round(choice.pause * rate)
    planned = [twist for _, twist in plan.commands()]
    slow = [
        (choice.slowly * x, choice.slowly * y, choice.slowly * turn)
        for x, y, turn in planned[: round(choice.slow_seconds * rate)]
    ]
    twists = [*stand, *slow, *stand, *planned, *stand, STILL]
    commands = tuple(Command(number / rate, twist) for number, twist in enumerate(twists))
    return commands, (len(stand) + len(slow)) / rate


def reach(commands: Sequence[Command]) -> float:
    """How far the robot gets from where it starts [m], if it does as commanded."""
    pose, farthest = np.zeros(3), 0.0
    for command, after in pairwise(commands):
        pose = moved(pose, (after.time - command.time) * np.array(command.twist))
        farthest = max(farthest, float(np.hypot(*pose[:2])))
    return farthest


class DriveWatch:
    """Watches a robot that is driven, and says why it must stop."""

    def __init__(self, robot: Robot, choice: DriveChoice) -> None:
        self._names = robot.wheel_names
        self._to_wheels = twist_to_wheels(robot, nominal=True)
        self._choice = choice
        self._late = robot.controller.delay + 0.3  # s until wheels do as commanded
        self._commanded: list[tuple[float, Array]] = [(-math.inf, np.zeros(WHEELS))]
        self._changed = -math.inf  # s, the last change of the command
        self._before: tuple[float, Array] | None = None
        self._away_since: float | None = None
        self._stands_since: float | None = None  # though commanded to move
        self._sums = np.zeros((3, WHEELS))  # of measured * commanded, commanded^2, and samples

    def command(self, time: float, twist: Twist) -> None:
        """A command that is sent [s]."""
        speed = self._to_wheels @ np.array(twist)
        if not np.array_equal(speed, self._commanded[-1][1]):
            self._commanded.append((time, speed))
            self._changed = time
        while len(self._commanded) > 2 and self._commanded[1][0] < time - self._choice.pause:
            del self._commanded[0]

    def encoders(self, time: float, stamp: float, position: Triple, velocity: Triple) -> None:
        """A sample that comes at a time, of its stamp [s, s, rad, rad/s]; where no velocity is
        reported it follows from the positions and stamps: samples may come in bursts."""
        angle, speed = np.array(position), np.array(velocity)
        if self._before is not None and stamp > self._before[0]:
            turned = (angle - self._before[1]) / (stamp - self._before[0])
            speed = np.where(np.isnan(speed), turned, speed)
        self._before = stamp, angle
        wanted = self._commanded[-1][1]
        must = np.abs(wanted) > self._choice.moves
        stands = np.abs(speed) < self._choice.stands * np.abs(wanted)
        is_still = bool(must.any() and stands[must].all())
        self._stands_since = _since(self._stands_since, time, is_still)
        fastest = np.max([np.abs(asked) for _, asked in self._commanded], axis=0)
        runs = np.abs(speed) > self._choice.away * fastest + self._choice.moves
        self._away_since = _since(self._away_since, time, bool(runs.any()))
        steady = must & np.isfinite(speed) & (time - self._changed > self._late)
        self._sums += np.where(steady, [speed * wanted, wanted**2, np.ones(WHEELS)], 0.0)

    def problem(self, time: float, silent: float) -> str:
        """Why the robot must stop now, and what to see to; empty: all is well.

        `silent`: since the last sample, by a clock that goes on whatever the robot's does [s].
        """
        choice = self._choice
        if silent > choice.silence:
            return f"joint_states: nothing for {silent:.1f} s: see to the driver"
        if self._stands_since is not None and time - self._stands_since > choice.not_following:
            return (
                "the robot does not follow cmd_vel: see to e-stop, contactor and brakes, and that "
                "the driver listens to this topic and type"
            )
        if self._away_since is not None and time - self._away_since > choice.silence:
            return (
                "wheels turn faster than commanded: see to robot.wheel_names, wheel_radius, the "
                "gear ratio and who else commands"
            )
        return ""

    def mistakes(self) -> Iterator[str]:
        """What the answers of the wheels so far speak against, wheel by wheel."""
        across, square, count = self._sums
        for wheel, name in enumerate(self._names):
            if count[wheel] < self._choice.least:
                continue
            answer = float(across[wheel] / square[wheel])
            if abs(answer - 1.0) > self._choice.off:
                yield f"{name} turns {answer:.2f} times as fast as commanded"


def _since(before: float | None, time: float, holds: bool) -> float | None:
    """Since when something holds [s], None where it does not."""
    if not holds:
        return None
    return time if before is None else before
