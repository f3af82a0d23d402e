"""Hours of healthy driving of the explained robot, simulated: shoved about, loaded, on any floor.

An evening of real driving holds a few shoves at most, a year holds thousands. The robot is a little
off its description in every value, as an explained one is, resistances and torque constants by no
more than its drivers' voltages allow; floor and payload vary from drive to drive. Simulated in the
power model's own dynamics, which also train the classifier.
"""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_commission.evidence import evidence_in
from tomr_commission.observed import Observed, frames_of
from tomr_commission.parallel import on_all_cores
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import RESIDUALS, SPEEDS
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.robot import WHEELS, Robot, load_robot
from tomr_power_model.robot.description import Motor
from tomr_sim_bridge.missions.mission import Mission
from tomr_sim_bridge.missions.schema import RandomPhase, TwistPhase
from tomr_training.drives import Bump, Drive, every_value
from tomr_training.planar.generate import simulate

Array = NDArray[np.float64]

TICK_NS = 50_000_000
_SEED = 80_000_000  # of the first drive: no training or scoring drive has it
_SETTLING = 3.0  # s after a shove that are its own
_APART = 6.0  # s between shoves
_PER_DRIVE = 3  # shoves
_FIRST = 4.0  # s
_CHUNK = 8


@frozen
class Usage:
    """How a robot is driven: what its recorded commands ask for."""

    speed: tuple[float, float]  # m/s, usual least and most
    yaw_rate: float  # rad/s, usual most

    @classmethod
    def of(cls, commands: Array) -> "Usage":
        """Of commanded twists, (k, 3)."""
        speed = np.hypot(commands[:, 0], commands[:, 1])
        moving = speed[speed > 0.02]
        if not len(moving):
            return cls((0.1, 0.3), 0.5)
        low, high = np.quantile(moving, (0.05, 0.98))
        return cls(
            (float(low), float(max(high, 1.2 * low))),
            float(np.quantile(np.abs(commands[:, 2]), 0.98)),
        )


@frozen
class Rehearsal:
    """How the simulated hours are made."""

    shoves: int = 390
    first: int = 90  # of them, that show whether the others are worth while
    force: tuple[float, float] = (0.5, 3.0)  # N per kg of the robot
    duration: tuple[float, float] = (0.03, 0.2)  # s
    off: float = 0.02  # share by which every value of the robot may be off its explained one, ...
    electrical: float = 0.02  # ... and resistance and torque constant of each motor
    payload: float = 0.05  # of its mass, at most
    friction: tuple[float, float] = (0.6, 1.0)  # traction of the floor
    standing: int = 4  # one drive of so many stands still when it is shoved
    shoves_per_hour: float = 30.0  # that a robot meets, for the rate of alarms
    silent: tuple[int, ...] = ()  # residuals that the robot does not report
    done: int = 0  # shoves that came before: these follow

    @property
    def parts(self) -> tuple["Rehearsal", "Rehearsal"]:
        """The first shoves, and all others."""
        others = evolve(self, shoves=self.shoves - self.first, done=self.first)
        return evolve(self, shoves=self.first), others


@frozen
class Shoved:
    """Peaks of evidence after simulated shoves [decades]."""

    peaks: tuple[float, ...] = ()  # one for each shove
    hours: float = 0.0  # judged

    def followed_by(self, more: "Shoved") -> "Shoved":
        """With those of other drives as well."""
        return Shoved(self.peaks + more.peaks, self.hours + more.hours)


def electrical_off(drives: Sequence[Observed], most: float) -> float:
    """Share by which resistances and torque constants can be off, at most so much: their drivers'
    voltages in healthy drives would show more."""
    volts = np.abs(np.concatenate([drive.volts for drive in drives]))
    beyond, expected = volts[:, :WHEELS], volts[:, WHEELS:]
    known = np.isfinite(beyond) & np.isfinite(expected)
    if not known.any():
        return most
    usual = float(np.quantile(expected[known], 0.98))
    return min(most, float(np.quantile(beyond[known], 0.999)) / usual) if usual > 0.0 else most


def rehearse(
    robot: str, bands: BandSettings, settings: ClassifierSettings, usage: Usage, plan: Rehearsal
) -> Shoved:
    """Drive a described robot and shove it, on all cores; the result depends on arguments alone."""
    first, last = plan.done // _PER_DRIVE, math.ceil((plan.done + plan.shoves) / _PER_DRIVE)
    jobs = [(robot, bands, settings, usage, plan, _SEED + index) for index in range(first, last)]
    _one(jobs[0])  # compiled before processes start
    parts = on_all_cores(_one, jobs, _CHUNK)
    return Shoved(
        tuple(peak for peaks, _ in parts for peak in peaks),
        sum(ticks for _, ticks in parts) * TICK_NS * 1e-9 / 3600.0,
    )


def _one(
    job: tuple[str, BandSettings, ClassifierSettings, Usage, Rehearsal, int],
) -> tuple[list[float], int]:
    """Peaks of a drive's shoves, and the ticks up to the last one's end, which are judged."""
    described, bands, settings, usage, plan, seed = job
    robot = robot_of(described)
    drive = shoved_drive(robot, usage, plan, seed)
    spans = [_ticks_of(bump) for bump in drive.bumps]
    seen = observed_of(drive).silenced(plan.silent).part(slice(0, spans[-1].stop), str(seed))
    evidence = evidence_in(frames_of(seen, bands), settings, robot)
    return [float(evidence[span].max(initial=0.0)) for span in spans], len(evidence)


def _ticks_of(shove: Bump) -> slice:
    """Of a shove and what follows from it."""
    end = shove.start + shove.duration + _SETTLING
    return slice(math.floor(shove.start * 1e9 / TICK_NS), math.ceil(end * 1e9 / TICK_NS))


@cache
def robot_of(described: str) -> Robot:
    """A described robot, read once: its record does not pass between processes."""
    return load_robot(described)


def shoved_drive(robot: Robot, usage: Usage, plan: Rehearsal, seed: int) -> Drive:
    """One drive; it depends on nothing but the arguments."""
    random = np.random.default_rng(seed)
    length = _FIRST + _PER_DRIVE * _APART
    stands = seed % plan.standing == 0
    phase = RandomPhase(
        count=1 if stands else math.ceil(length / 1.5),
        speed=usage.speed,
        yaw_rate=usage.yaw_rate,
        duration=(1.0, 3.0),
        pause=float(random.choice([0.0, 0.5])),
    )
    mission = Mission(
        name=f"rehearsal_{seed}",
        payload=float(random.uniform(0.0, plan.payload) * robot.mass),
        floor_friction=float(random.uniform(*plan.friction)),
        stamp_jitter=0.0005,
        seed=seed,
        phases=(_stop(1.0), phase, _stop(length)) if stands else (_stop(1.0), phase),
    )
    plant = every_value(
        robot, lambda value: float(value * random.uniform(1.0 - plan.off, 1.0 + plan.off))
    )
    closer = min(plan.electrical / plan.off, 1.0) if plan.off else 1.0
    motors = (_closer(*pair, closer) for pair in zip(plant.motors, robot.motors, strict=True))
    first, second, third = motors
    plant = evolve(plant, motors=(first, second, third))
    starts = _FIRST + _APART * np.arange(_PER_DRIVE) + random.uniform(0.0, 1.0, _PER_DRIVE)
    shoves = tuple(_shove(robot, plan, float(start), random) for start in starts)
    return Drive(seed, plant, robot, mission, shoves)


def _closer(drawn: Motor, described: Motor, share: float) -> Motor:
    """A motor whose resistance and constant are off by a share of what was drawn."""
    r, k = described.resistance, described.torque_constant
    return evolve(
        drawn,
        resistance=r + share * (drawn.resistance - r),
        torque_constant=k + share * (drawn.torque_constant - k),
    )


def _stop(seconds: float) -> TwistPhase:
    return TwistPhase((0.0, 0.0, 0.0), seconds)


def _shove(robot: Robot, plan: Rehearsal, start: float, random: np.random.Generator) -> Bump:
    force = robot.mass * float(random.uniform(*plan.force))
    heading = float(random.uniform(-math.pi, math.pi))
    return Bump(
        start=start,
        duration=float(random.uniform(*plan.duration)),
        force=(force * math.cos(heading), force * math.sin(heading)),
        moment=float(random.uniform(-0.5, 0.5) * force * robot.robot_radius),
    )


def observed_of(drive: Drive) -> Observed:
    """A simulated drive as the residual stage would see it."""
    compared = simulate(drive).compared
    residual, _ = compared.residuals(BandSettings())
    units = np.full(RESIDUALS, "W", dtype="<U5")
    units[list(SPEEDS)] = "rad/s"
    missing = np.full(residual.shape, "", dtype=np.str_)
    stamps = (1 + np.arange(len(residual), dtype=np.int64)) * TICK_NS
    return Observed(
        drive.mission.name,
        stamps,
        residual,
        np.asarray(compared.modelled),
        missing,
        units,
        np.full((len(residual), 2), np.nan),  # an IMU is not simulated
        np.full((len(residual), 4), np.nan),
        np.hstack([compared.held - compared.voltage, compared.voltage]),
    )
