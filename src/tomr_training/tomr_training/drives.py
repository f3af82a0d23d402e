"""Random drives to learn from and to score on: robots, loads, floors, bumps and faults by chance.

A seed makes a drive, whole: the robot as described, how it really is, what it is to do and what
befalls it.
"""

import math
from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot import Motor, Robot
from tomr_sim_bridge.missions.mission import Mission, Plan
from tomr_sim_bridge.missions.schema import CirclePhase, PlannedFault, TwistPhase

# A drive is healthy, or has one fault: (kind, share of the drives).
KINDS: tuple[tuple[str | None, float], ...] = (
    (None, 0.25),
    ("floor_slippery", 0.25),
    ("control_signal_lost", 0.25),
    ("encoder_lost", 0.25),
)
_SCALES = (0.7, 1.4)  # of the family of robots, against the reference
DEVIATION = 0.05  # of a real robot from its description
PAYLOAD = 0.1  # of its mass, at most, of which the description knows nothing
_PHASES = 9
_SHARES = {
    "straight": 0.25,
    "across": 0.15,
    "turning": 0.2,
    "spin": 0.1,
    "circle": 0.2,
    "stop": 0.1,
}

Array = NDArray[np.float64]
Piece = TwistPhase | CirclePhase


@frozen
class Bump:
    """A push on the body: a sill, a cable, somebody's foot."""

    start: float  # s from the start of the drive
    duration: float  # s
    force: tuple[float, float]  # N in the world
    moment: float  # N m about the vertical
    is_slope: bool = False  # the floor leans: an accelerometer does not feel it as a push


@frozen
class Drive:
    """One drive: what the robot is, what its description believes, and what happens."""

    seed: int
    plant: Robot
    believed: Robot
    mission: Mission
    bumps: tuple[Bump, ...] = ()
    gusts: tuple[Bump, ...] = ()  # pushes too weak to be called so

    @cached_property
    def _plan(self) -> Plan:
        return self.mission.plan(self.believed)

    @property
    def length(self) -> float:
        """Of the drive [s]."""
        return self._plan.duration

    @cached_property
    def commands(self) -> tuple[Array, Array]:
        """Times [s], (k,), and the twists that are commanded then, (k, 3)."""
        times, twists = zip(*self._plan.commands(), strict=True)
        return np.array(times), np.array(twists)

    @property
    def healthy(self) -> "Drive":
        """The same drive without its fault."""
        return evolve(self, mission=evolve(self.mission, faults=()))

    @property
    def undisturbed(self) -> "Drive":
        """The same drive without its bumps."""
        return evolve(self, bumps=())


def random_drive(reference: Robot, seed: int, kind: str | None = "any") -> Drive:
    """A drive that depends on nothing but the seed, and on the fault where one is asked for.

    `kind`: a fault's id, None for a healthy drive, "any" to draw it, "fault" to draw a fault.
    """
    random = np.random.default_rng(seed)
    believed = _another_robot(reference, random)
    mission = _mission(believed, seed, kind, random)
    plant = deviating(believed, random)
    length = mission.plan(believed).duration
    return Drive(
        seed, plant, believed, mission, bumps(believed, random, int(random.integers(0, 4)), length)
    )


def another_drive(robot: Drive, seed: int, kind: str | None = None) -> Drive:
    """A drive of the same robot: another mission, payload, floor, other sensor noise.

    `kind` of fault as in `random_drive`; healthy by default.
    """
    mission = _mission(robot.believed, seed, kind, np.random.default_rng([seed, 4]))
    return evolve(robot, seed=seed, mission=mission, bumps=())


def _mission(believed: Robot, seed: int, kind: str | None, random: np.random.Generator) -> Mission:
    phases = _phases(believed, random)
    length = math.fsum(phase.duration for phase in phases)
    payload = float(random.uniform(0.0, PAYLOAD) * believed.mass) if random.random() < 0.5 else 0.0
    return Mission(
        name=f"drive_{seed}",
        command_rate=float(random.choice([10.0, 20.0, 50.0])),
        payload=payload,
        floor_friction=float(random.uniform(0.6, 1.0)),
        stamp_jitter=float(random.choice([0.0, 0.0005, 0.001])),
        seed=seed,
        phases=tuple(phases),
        faults=_faults(_kind(kind, random), random, length),
    )


def _another_robot(reference: Robot, random: np.random.Generator) -> Robot:
    def scaled(value: float) -> float:
        return float(value * random.uniform(*_SCALES))

    mass = scaled(reference.mass)
    radius = float(reference.robot_radius * random.uniform(0.8, 1.2))
    motor = reference.motors[0]
    motor = evolve(
        motor,
        resistance=scaled(motor.resistance),
        torque_constant=float(motor.torque_constant * random.uniform(0.85, 1.2)),
    )
    physics = {}
    for effect, wheels in reference.physics.items():
        if wheels[0] is not None:
            alike = {key: scaled(value) for key, value in wheels[0].items()}
            physics[effect] = (alike, alike, alike)
    sensors, controller = reference.sensors, reference.controller
    return evolve(
        reference,
        wheel_offset=float(random.uniform(-math.pi, math.pi)),
        robot_radius=radius,
        wheel_radius=float(reference.wheel_radius * random.uniform(0.85, 1.2)),
        mass=mass,
        inertia_z=float(mass * radius**2 * random.uniform(0.45, 0.7)),
        mass_center=(
            float(random.uniform(-0.01, 0.01)),
            float(random.uniform(-0.01, 0.01)),
            float(random.uniform(0.08, 0.15)),
        ),
        motors=(motor, motor, motor),
        controller=evolve(
            controller,
            proportional=scaled(controller.proportional),
            integral=scaled(controller.integral),
            acceleration_limit=float(random.uniform(0.8, 1.8)),
        ),
        sensors=evolve(
            sensors,
            encoder_resolution=float(random.choice([1.5e-4, 4e-4, 8e-4])),
            current_noise=float(sensors.current_noise * random.uniform(0.5, 2.0)),
            voltage_noise=float(sensors.voltage_noise * random.uniform(0.5, 2.0)),
        ),
        physics=physics,
    )


def every_value(robot: Robot, off: Callable[[float], float]) -> Robot:
    """A robot with every value of its body, motors and effects passed through `off`.

    Of a ratio only what it differs from its neutral value by: an encoder that shows 1.002 of the
    angle is not off by a share of all its counts.
    """

    def motor(nominal: Motor) -> Motor:
        return evolve(
            nominal,
            resistance=off(nominal.resistance),
            torque_constant=off(nominal.torque_constant),
            rotor_inertia=off(nominal.rotor_inertia),
        )

    def effect(name: str, values: Mapping[str, float]) -> dict[str, float]:
        found = {}
        for key, value in values.items():
            parameter = EFFECTS[name].parameters[key]
            about = parameter.neutral if parameter.is_ratio else 0.0
            found[key] = about + off(value - about)
        return found

    first, second, third = (motor(nominal) for nominal in robot.motors)
    physics = {}
    for name, wheels in robot.physics.items():
        one, two, three = (None if wheel is None else effect(name, wheel) for wheel in wheels)
        physics[name] = (one, two, three)
    return evolve(
        robot,
        mass=off(robot.mass),
        inertia_z=off(robot.inertia_z),
        wheel_inertia=off(robot.wheel_inertia),
        motors=(first, second, third),
        physics=physics,
    )


def deviating(robot: Robot, random: np.random.Generator) -> Robot:
    """A real robot: every value a little off its description, wheel by wheel."""
    return every_value(
        robot, lambda value: float(value * random.uniform(1.0 - DEVIATION, 1.0 + DEVIATION))
    )


def _phases(robot: Robot, random: np.random.Generator) -> list[Piece]:
    phases: list[Piece] = [TwistPhase((0.0, 0.0, 0.0), 1.0)]
    for _ in range(_PHASES):
        speed = float(random.uniform(0.1, 0.6))
        heading = float(random.uniform(-math.pi, math.pi))
        duration = float(random.uniform(1.0, 3.0))
        kind = random.choice(list(_SHARES), p=list(_SHARES.values()))
        yaw_rate = float(random.uniform(-1.5, 1.5))
        if kind == "across":  # along an axle: that wheel need not turn
            heading = robot.wheel_offset + math.pi / 3.0 * int(random.integers(6))
        vx, vy = speed * math.cos(heading), speed * math.sin(heading)
        if kind == "circle":
            phases.append(CirclePhase(speed, 2.0 * yaw_rate, duration))
        elif kind == "spin":
            phases.append(TwistPhase((0.0, 0.0, yaw_rate), duration))
        elif kind == "turning":
            phases.append(TwistPhase((vx, vy, 0.7 * yaw_rate), duration))
        elif kind == "stop":
            phases.append(TwistPhase((0.0, 0.0, 0.0), 0.5 * duration))
        else:
            phases.append(TwistPhase((vx, vy, 0.0), duration))
    return phases


def _kind(asked: str | None, random: np.random.Generator) -> str | None:
    names = [name for name, _ in KINDS]
    share = np.array([share for _, share in KINDS])
    if asked == "fault":
        share[names.index(None)] = 0.0
    drawn = names[int(random.choice(len(names), p=share / share.sum()))]
    return drawn if asked in ("any", "fault") else asked


def _faults(
    kind: str | None, random: np.random.Generator, length: float
) -> tuple[PlannedFault, ...]:
    start = float(random.uniform(0.2, 0.5) * length)
    end = float(random.uniform(0.7, 1.0) * length)
    slipperiness = float(random.uniform(0.6, 1.0))
    severity = 1.0 if random.random() < 0.6 else float(random.uniform(0.5, 1.0))
    wheel = int(random.integers(1, 4))
    if kind is None:
        return ()
    settings: dict[str, float | int] = {"severity": severity, "wheel": wheel}
    if kind == "floor_slippery":
        settings = {"severity": slipperiness}
    return (PlannedFault(kind, start, end, settings),)


def wheel_of(fault: PlannedFault) -> int | None:
    """The wheel 0..2 that a fault of a random drive is at; None where it is at none."""
    wheel = fault.settings.get("wheel")
    return None if wheel is None else int(str(wheel)) - 1


def severity_of(fault: PlannedFault) -> float:
    """How severe a fault of a random drive is, 0 to 1."""
    return float(str(fault.settings["severity"]))


def bumps(robot: Robot, random: np.random.Generator, count: int, until: float) -> tuple[Bump, ...]:
    """So many bumps that start before a time [s]."""
    found = []
    for _ in range(count):
        force = robot.mass * float(random.uniform(0.5, 2.5))
        direction = float(random.uniform(-math.pi, math.pi))
        found.append(
            Bump(
                start=float(random.uniform(0.0, until)),
                duration=float(random.uniform(0.03, 0.12)),
                force=(force * math.cos(direction), force * math.sin(direction)),
                moment=float(random.uniform(-0.5, 0.5) * force * robot.robot_radius),
            )
        )
    return tuple(sorted(found, key=lambda bump: bump.start))
