"""The robots that a classifier learns from: of all kinds, for nobody's is the reference's."""

import math

import numpy as np
from attrs import evolve

from tomr_power_model.robot import Robot
from tomr_power_model.robot.description import PerWheel
from tomr_sim_bridge.missions.schema import Phase, TwistPhase
from tomr_training.drives import DEVIATION, Drive, bumps, random_drive

_DRY, _VISCOUS, _STRIBECK = "friction.coulomb", "friction.viscous", "friction.stribeck"
_CREEP = 0.25  # rad/s of yaw: with it a wheel that need not turn creeps, or sticks


def training_drive(reference: Robot, seed: int) -> Drive:
    """A random drive, every other one bumped before it starts: shoved, not faulty.

    Two of four robots have drivers that are tuned a little off, two of four another motor and
    another friction, under which wheels stick and drivers wind up.
    """
    drive = random_drive(reference, seed)
    random = np.random.default_rng([seed, 2])
    early = bumps(drive.believed, random, int(random.integers(0, 2)), 1.0)
    drive = evolve(drive, bumps=(*drive.bumps, *early))
    if seed % 2 == 0:
        drive = _tuned(drive, random)
    if seed // 2 % 2 == 0:
        drive = _of_another_kind(drive, np.random.default_rng([seed, 3]))
    return drive


def _tuned(drive: Drive, random: np.random.Generator) -> Drive:
    """Drivers a little off: a real loop is never known as well as a simulated one."""
    given = drive.plant.controller

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - DEVIATION, 1.0 + DEVIATION))

    tuned = evolve(
        given,
        proportional=off(given.proportional),
        integral=off(given.integral),
        acceleration_limit=off(given.acceleration_limit),
    )
    return evolve(drive, plant=evolve(drive.plant, controller=tuned))


def _of_another_kind(drive: Drive, random: np.random.Generator) -> Drive:
    """The same drive of a robot with another motor and friction, pushed about more and longer."""

    def factor(low: float, high: float) -> float:
        return float(np.exp(random.uniform(math.log(low), math.log(high))))

    winding, dry, viscous = factor(0.7, 6.0), factor(0.7, 8.0), factor(0.5, 6.0)
    above, speed = float(random.uniform(0.0, 0.3)), float(random.uniform(0.4, 1.5))

    def changed(robot: Robot) -> Robot:
        first, second, third = (
            evolve(motor, resistance=winding * motor.resistance) for motor in robot.motors
        )
        coulomb = _scaled(robot.physics[_DRY], dry)
        one, two, three = (
            None if wheel is None else {"torque": above * wheel["torque"], "speed": speed}
            for wheel in coulomb
        )
        physics = {
            **robot.physics,
            _DRY: coulomb,
            _VISCOUS: _scaled(robot.physics[_VISCOUS], viscous),
            _STRIBECK: (one, two, three),
        }
        return evolve(robot, motors=(first, second, third), physics=physics)

    phases = tuple(_skewed(phase, random) for phase in drive.mission.phases)
    pushes = bumps(drive.believed, random, int(random.integers(0, 3)), drive.length)
    longer = (evolve(push, duration=2.0 * push.duration) for push in pushes)
    return evolve(
        drive,
        mission=evolve(drive.mission, phases=phases),
        plant=changed(drive.plant),
        believed=changed(drive.believed),
        bumps=tuple(sorted((*drive.bumps, *longer), key=lambda bump: bump.start)),
    )


def _skewed(phase: Phase, random: np.random.Generator) -> Phase:
    """Half of the phases with a little yaw: some wheel then creeps where it would stand."""
    yaw_rate, chosen = float(random.uniform(-_CREEP, _CREEP)), random.random() < 0.5
    if not isinstance(phase, TwistPhase) or not any(phase.twist) or not chosen:
        return phase
    along, across, turning = phase.twist
    return evolve(phase, twist=(along, across, turning + yaw_rate))


def _scaled(wheels: PerWheel, factor: float) -> PerWheel:
    one, two, three = (
        None if wheel is None else {key: factor * value for key, value in wheel.items()}
        for wheel in wheels
    )
    return one, two, three
