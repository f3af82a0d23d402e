"""Random drives to learn from: robots, loads, floors, headings and faults drawn at random."""

import math

import numpy as np
from attrs import evolve, frozen

from tomr_power_model.robot import Motor, Robot
from tomr_sim_bridge.missions.mission import Mission
from tomr_sim_bridge.missions.schema import (
    CirclePhase,
    PlannedFault,
    TwistPhase,
)

# A drive is healthy, or has one fault: (kind, share of the drives).
_KINDS: tuple[tuple[str | None, float], ...] = (
    (None, 0.25),
    ("floor_slippery", 0.3),
    ("control_signal_lost", 0.2),
    ("encoder_lost", 0.25),
)
_SCALES = (0.7, 1.4)  # of the family of robots, against the reference
_DEVIATION = 0.03  # of a real robot from its description


@frozen
class Drive:
    """One drive: what the robot is, what its description believes, and what happens."""

    seed: int
    plant: Robot
    believed: Robot
    mission: Mission


def random_drive(reference: Robot, seed: int) -> Drive:
    """A drive that depends on nothing but the seed."""
    random = np.random.default_rng(seed)
    believed = _another_robot(reference, random)
    phases = _phases(random)
    length = math.fsum(phase.duration for phase in phases)
    mission = Mission(
        name=f"drive_{seed}",
        description="",
        robot="reference",
        command_rate=float(random.choice([10.0, 20.0, 50.0])),
        repeat=1,
        payload=0.0,
        floor_friction=float(random.uniform(0.5, 1.0)),
        stamp_jitter=float(random.choice([0.0, 0.0005, 0.001])),
        seed=seed,
        phases=tuple(phases),
        faults=_faults(random, length),
    )
    return Drive(seed, _deviating(believed, random), believed, mission)


def _another_robot(reference: Robot, random: np.random.Generator) -> Robot:
    def scaled(value: float) -> float:
        return float(value * random.uniform(*_SCALES))

    size = random.uniform(0.8, 1.2)
    mass = scaled(reference.mass)
    radius = reference.robot_radius * size
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
    return evolve(
        reference,
        wheel_offset=float(random.uniform(-math.pi, math.pi)),
        robot_radius=float(radius),
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
            reference.controller,
            proportional=scaled(reference.controller.proportional),
            integral=scaled(reference.controller.integral),
            acceleration_limit=float(random.uniform(1.0, 2.5)),
        ),
        sensors=evolve(
            reference.sensors, encoder_resolution=float(random.choice([1.5e-4, 4e-4, 8e-4]))
        ),
        physics=physics,
    )


def _deviating(robot: Robot, random: np.random.Generator) -> Robot:
    """The real robot: every value a little off its description, wheel by wheel."""

    def off(value: float) -> float:
        return float(value * random.uniform(1.0 - _DEVIATION, 1.0 + _DEVIATION))

    def motor(nominal: Motor) -> Motor:
        return evolve(
            nominal,
            resistance=off(nominal.resistance),
            torque_constant=off(nominal.torque_constant),
        )

    first, second, third = (motor(nominal) for nominal in robot.motors)
    physics = {}
    for effect, wheels in robot.physics.items():
        one, two, three = (
            None if wheel is None else {key: off(value) for key, value in wheel.items()}
            for wheel in wheels
        )
        physics[effect] = (one, two, three)
    return evolve(
        robot,
        mass=off(robot.mass),
        inertia_z=off(robot.inertia_z),
        motors=(first, second, third),
        physics=physics,
    )


def _phases(random: np.random.Generator) -> list[TwistPhase | CirclePhase]:
    phases: list[TwistPhase | CirclePhase] = [TwistPhase((0.0, 0.0, 0.0), 1.0)]
    for _ in range(9):
        speed = float(random.uniform(0.1, 0.6))
        heading = float(random.uniform(-math.pi, math.pi))
        duration = float(random.uniform(1.0, 3.0))
        kind = random.choice(["straight", "turning", "spin", "circle", "pause"], p=_SHARES)
        vx, vy = speed * math.cos(heading), speed * math.sin(heading)
        if kind == "circle":
            phases.append(CirclePhase(speed, float(random.uniform(-3.0, 3.0)), duration))
        elif kind == "spin":
            phases.append(TwistPhase((0.0, 0.0, float(random.uniform(-1.5, 1.5))), duration))
        elif kind == "turning":
            phases.append(TwistPhase((vx, vy, float(random.uniform(-1.0, 1.0))), duration))
        elif kind == "pause":
            phases.append(TwistPhase((0.0, 0.0, 0.0), 0.5 * duration))
        else:
            phases.append(TwistPhase((vx, vy, 0.0), duration))
    return phases


_SHARES = (0.35, 0.2, 0.1, 0.2, 0.15)


def _faults(random: np.random.Generator, length: float) -> tuple[PlannedFault, ...]:
    names = [name for name, _ in _KINDS]
    kind = names[int(random.choice(len(_KINDS), p=[share for _, share in _KINDS]))]
    if kind is None:
        return ()
    start = float(random.uniform(0.2, 0.5) * length)
    end = float(random.uniform(0.7, 1.0) * length)
    if kind == "floor_slippery":
        settings: dict[str, float | int] = {"severity": float(random.uniform(0.75, 1.0))}
    else:
        severity = 1.0 if random.random() < 0.8 else float(random.uniform(0.7, 1.0))
        settings = {"severity": severity, "wheel": int(random.integers(1, 4))}
    return (PlannedFault(kind, start, end, settings),)
