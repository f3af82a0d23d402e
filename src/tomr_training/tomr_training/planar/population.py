"""The robots that a classifier learns from, and what befalls them.

Four drives in a row are of one robot. Of three robots two are commissioned: their descriptions are
nearly right, lack some physics, and their bands come of a healthy drive of their own. The third is
up to 5 % off its description and has the bands of any robot. Every other robot is of another kind
than the reference, under which wheels stick and drivers wind up.
"""

import math

import numpy as np
from attrs import evolve, frozen

from tomr_fault_diag.residuals.calibrated import fit_bands, widened
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.widths import moved
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_power_model.robot.description import PerWheel
from tomr_sim_bridge.missions.schema import Phase, TwistPhase
from tomr_training.drives import DEVIATION, Bump, Drive, another_drive, bumps, random_drive
from tomr_training.labels import LATELY
from tomr_training.planar.faults import DRY, loaded, random_faults
from tomr_training.planar.hidden import tuned, with_hidden_physics
from tomr_training.planar.plant import run_plant
from tomr_training.planar.residuals import compare
from tomr_training.planar.sensors import Signals

PER_ROBOT = 4  # drives
COMMISSIONING = 110.0  # s of healthy driving
_VISCOUS, _STRIBECK, _DRAG = "friction.viscous", "friction.stribeck", "contact.roller_drag"
_CREEP = 0.25  # rad/s of yaw: with it a wheel that need not turn creeps, or sticks
_SLOPE = 0.04  # rad, of a floor that is nothing special
_GUST = 0.15  # N/kg, of disturbances that nobody would call a push
_GUST_TIME = 0.3  # s


@frozen
class TrainingRobot:
    """A robot, in a drive without faults or bumps, and how well it is known."""

    drive: Drive
    is_commissioned: bool
    is_of_another_kind: bool


def training_robot(reference: Robot, number: int) -> TrainingRobot:
    """A robot that depends on its number alone."""
    base = random_drive(reference, number, None)
    random = np.random.default_rng([number, 3])
    another, commissioned = number % 2 == 0, number % 3 != 0
    believed, plant = base.believed, base.plant
    if another:
        believed, plant = _of_another_kind((believed, plant), random)
    if commissioned:
        plant = with_hidden_physics(believed, random)
    elif number // 2 % 2 == 0:
        plant = evolve(plant, controller=tuned(plant.controller, DEVIATION, random))
    drive = evolve(base, believed=believed, plant=plant, bumps=())
    return TrainingRobot(drive, commissioned, another)


def training_drive(reference: Robot, seed: int) -> Drive:
    """A drive that depends on its seed alone: bumped, at an angle, maybe with a fault."""
    robot = training_robot(reference, seed // PER_ROBOT)
    random = np.random.default_rng([seed, 2])
    drive = another_drive(robot.drive, seed)
    phases = drive.mission.phases
    if robot.is_of_another_kind:
        phases = tuple(_skewed(phase, random) for phase in phases)
    faults = random_faults(drive.believed, drive.length, random)
    own = np.random.default_rng([seed, 6])
    faults = loaded(faults, drive.believed, drive.mission.floor_friction, own)
    drive = evolve(
        drive,
        mission=evolve(drive.mission, phases=phases, faults=faults),
        bumps=_pushes(drive, random),
    )
    if robot.is_commissioned:
        drive = evolve(drive, plant=_elsewhere(drive.plant, random), gusts=_gusts(drive, random))
    return drive


def bands_of(reference: Robot, number: int) -> BandSettings:
    """Bands that a robot's classifier has: its own where it is commissioned."""
    robot = training_robot(reference, number)
    if not robot.is_commissioned:
        return BandSettings()
    drive = another_drive(robot.drive, PER_ROBOT * number)
    random = np.random.default_rng([number, 5])
    drive = evolve(drive, mission=evolve(drive.mission, payload=0.0))
    while drive.length < COMMISSIONING:
        more = another_drive(robot.drive, int(random.integers(2**31))).mission.phases
        phases = (*drive.mission.phases, *more)
        drive = evolve(drive, mission=evolve(drive.mission, phases=phases))
    compared = compare(drive, Signals.of(drive, run_plant(drive)))
    residual, _ = compared.residuals(BandSettings())
    try:
        fitted = fit_bands(residual, compared.modelled, moved(compared.modelled, LATELY))
    except InputError:  # it stood nearly all the time
        return BandSettings()
    return widened(fitted)


def _pushes(drive: Drive, random: np.random.Generator) -> tuple[Bump, ...]:
    """Bumps, shoves before the start, and sometimes somebody who leans on the robot."""
    robot, length = drive.believed, drive.length
    found = list(bumps(robot, random, int(random.integers(0, 3)), length))
    found += bumps(robot, random, int(random.integers(0, 2)), 1.0)
    found += [
        evolve(push, duration=2.0 * push.duration, force=_larger(push.force))
        for push in bumps(robot, random, int(random.integers(0, 3)), length)
    ]
    if random.random() < 0.15:
        (lean,) = bumps(robot, random, 1, length)
        share = float(random.uniform(0.2, 0.5))
        found.append(
            evolve(
                lean,
                duration=float(random.uniform(0.5, 4.0)),
                force=(share * lean.force[0], share * lean.force[1]),
                moment=share * lean.moment,
            )
        )
    return tuple(sorted(found, key=lambda bump: bump.start))


def _larger(force: tuple[float, float]) -> tuple[float, float]:
    return 1.3 * force[0], 1.3 * force[1]


def _gusts(drive: Drive, random: np.random.Generator) -> tuple[Bump, ...]:
    """A force that wanders, a third of a second at a time."""
    size = drive.believed.mass * _GUST * float(random.uniform(0.0, 1.0)) ** 2
    count = math.ceil(drive.length / _GUST_TIME)
    force = np.zeros(2)
    found = []
    for k in range(count):
        force = 0.7 * force + 0.7 * size * random.standard_normal(2)
        found.append(Bump(k * _GUST_TIME, _GUST_TIME, (float(force[0]), float(force[1])), 0.0))
    return tuple(found)


def _elsewhere(plant: Robot, random: np.random.Generator) -> Robot:
    """The robot on another day: a floor at an angle, a computer with more or less to do."""
    angle = _SLOPE * float(random.uniform(0.0, 1.0)) ** 2
    azimuth = float(random.uniform(-math.pi, math.pi))
    slope = {"angle": angle, "azimuth": azimuth}
    share = float(random.uniform(0.9, 1.15)) if random.random() < 0.5 else 1.0
    supply = evolve(plant.supply, auxiliary_power=share * plant.supply.auxiliary_power)
    physics = {**plant.physics, "body.slope": (slope, slope, slope)}
    return evolve(plant, supply=supply, physics=physics)


def _of_another_kind(
    robots: tuple[Robot, Robot], random: np.random.Generator
) -> tuple[Robot, Robot]:
    """The same change of motor, friction and rollers to a description and the robot it is of."""

    def factor(low: float, high: float) -> float:
        return float(np.exp(random.uniform(math.log(low), math.log(high))))

    winding, dry, viscous = factor(0.7, 6.0), factor(0.7, 8.0), factor(0.5, 6.0)
    above, speed = float(random.uniform(0.0, 0.3)), float(random.uniform(0.4, 1.5))
    drag = float(random.uniform(0.005, 0.03)) if random.random() < 0.5 else 0.0

    def changed(robot: Robot) -> Robot:
        first, second, third = (
            evolve(motor, resistance=winding * motor.resistance) for motor in robot.motors
        )
        coulomb = _scaled(robot.physics[DRY], dry)
        one, two, three = (
            None if wheel is None else {"torque": above * wheel["torque"], "speed": speed}
            for wheel in coulomb
        )
        physics = {
            **robot.physics,
            DRY: coulomb,
            _VISCOUS: _scaled(robot.physics[_VISCOUS], viscous),
            _STRIBECK: (one, two, three),
        }
        if drag:
            physics[_DRAG] = ({"coefficient": drag, "slip": 0.0},) * 3
        return evolve(robot, motors=(first, second, third), physics=physics)

    one, two = robots
    return changed(one), changed(two)


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
