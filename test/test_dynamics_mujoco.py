"""The dynamics against MuJoCo, which shares no physics with them.

The reference robot is the simulator's, rollers and all. Vehicles on other wheels are bodies on
balls: a ball that a motor turns about one axis and that is free about the others pushes across
that axis only, as an omni or mecanum wheel does; a wheel without rollers is a ball on a hinge.
"""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pytest
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation, Steps
from tomr_power_model.dynamics.vehicle import (
    Vehicle,
    WheelPlace,
    omni_wheel,
    vehicle_of,
)
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.plant.simulation import Simulation as Plant

Array = NDArray[np.float64]

BALL = 3e-6  # kg m^2
HEIGHT = 0.06  # m, of the mass centre
TIMESTEP = 0.0002  # s
CORNERS = ((0.2, 0.15), (-0.2, 0.15), (-0.2, -0.15), (0.2, -0.15))


@frozen
class Trace:
    """Period by period."""

    twist: Array  # of the body after it [m/s, m/s, rad/s], (k, 3)
    speed: Array  # mean of the wheels [rad/s], (k, n)
    current: Array  # mean of the motors [A], (k, n)
    power: Array  # drawn by the drivers [W], (k, n)


def four_omni() -> Sequence[WheelPlace]:
    angles = [math.pi * (0.25 + 0.5 * wheel) for wheel in range(4)]
    return [omni_wheel(0.2 * math.cos(a), 0.2 * math.sin(a), a + 0.5 * math.pi) for a in angles]


def four_mecanum() -> Sequence[WheelPlace]:
    return [WheelPlace(x, y, 0.0, math.copysign(0.25 * math.pi, x * y)) for x, y in CORNERS]


def two_driven() -> Sequence[WheelPlace]:
    return [WheelPlace(0.0, y, 0.0, None) for y in (0.15, -0.15)]


def on(wheels: Sequence[WheelPlace]) -> Vehicle:
    """The reference robot on other wheels, with viscous friction alone and light axles."""
    vehicle = vehicle_of(shipped_robot("reference"))
    motor = evolve(vehicle.motors[0], rotor_inertia=0.0)
    return evolve(
        vehicle,
        wheels=tuple(wheels),
        wheel_inertia=BALL,
        motors=(motor,) * len(wheels),
        inertia_z=1.5,  # a lighter one on mecanum wheels turns as asked within a step
        mass_center=(0.03, 0.02, HEIGHT),
        physics={"friction.viscous": ({"coefficient": 0.02},) * len(wheels)},
        casters=((0.2, 0.0), (-0.2, 0.0)) if len(wheels) == 2 else (),
    )


def ball(place: WheelPlace, number: int, radius: float) -> tuple[str, str]:
    """A wheel's body and its motor."""
    if place.roller is None:
        held, share = place.drive, 1.0
        joint = f'<joint name="w{number}" axis="{-math.sin(held)} {math.cos(held)} 0"/>'
        transmission, gear = "joint", "1"
    else:
        held = place.roller - 0.5 * math.pi
        share = math.cos(held - place.drive)
        joint = f'<joint name="w{number}" type="ball"/>'
        transmission = "jointinparent"
        gear = f"{-math.sin(held) / share} {math.cos(held) / share} 0"
    body = (
        f'<body pos="{place.x} {place.y} {radius}">{joint}'
        f'<inertial pos="0 0 0" mass="0.01" diaginertia="{BALL} {BALL} {BALL}"/>'
        f'<geom size="{radius}" friction="3 0 0"/></body>'
    )
    return body, f'<motor {transmission}="w{number}" gear="{gear}"/>'


def mjcf(vehicle: Vehicle) -> str:
    """The vehicle on its floor; torques of the motors are the controls."""
    n, radius = vehicle.count, vehicle.wheel_radius
    parts = [ball(place, number, radius) for number, place in enumerate(vehicle.wheels)]
    casters = "".join(
        f'<geom pos="{x} {y} {radius}" size="{radius}" friction="0 0 0" priority="1"/>'
        for x, y in vehicle.casters
    )
    # The wheels' masses are part of the whole: what the body has is the rest.
    whole, (cx, cy, height) = vehicle.mass, vehicle.mass_center
    mass = whole - 0.01 * n
    x = (whole * cx - sum(0.01 * place.x for place in vehicle.wheels)) / mass
    y = (whole * cy - sum(0.01 * place.y for place in vehicle.wheels)) / mass
    z = (whole * height - 0.01 * n * radius) / mass
    around = sum(
        0.01 * ((place.x - cx) ** 2 + (place.y - cy) ** 2) + BALL for place in vehicle.wheels
    )
    inertia = vehicle.inertia_z - around - mass * ((x - cx) ** 2 + (y - cy) ** 2)
    inertial = f'<inertial pos="{x} {y} {z}" mass="{mass}" diaginertia="1 1 {inertia}"/>'
    return f"""
    <mujoco>
      <option timestep="{TIMESTEP}" cone="elliptic" impratio="20"/>
      <default>
        <geom type="sphere" condim="3" solref="0.005 1" solimp="0.99 0.999 0.0001"/>
      </default>
      <worldbody>
        <geom type="plane" size="0 0 1" friction="0 0 0"/>
        <body name="base"><freejoint/>{inertial}
          {casters}{"".join(body for body, _ in parts)}
        </body>
      </worldbody>
      <actuator>{"".join(motor for _, motor in parts)}</actuator>
    </mujoco>"""


class Rig:
    """A vehicle in MuJoCo."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(vehicle))
        self.data = mujoco.MjData(self.model)
        motor, viscous = vehicle.motors[0], vehicle.physics["friction.viscous"][0]
        assert viscous is not None
        self.k, self.resistance = motor.wheel_constant, motor.resistance
        self.viscous = viscous["coefficient"]
        mujoco.mj_step(self.model, self.data, 200)  # settles

    def twist(self) -> Array:
        w, x, y, z = self.data.qpos[3:7]
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        vx, vy, _ = self.data.qvel[:3]
        cos, sin = math.cos(yaw), math.sin(yaw)
        return np.array([cos * vx + sin * vy, cos * vy - sin * vx, self.data.qvel[5]])

    def period(self, volts: Array) -> tuple[Array, Array]:
        """Mean speeds [rad/s] and currents [A] of 5 ms."""
        speeds = []
        for _ in range(round(0.005 / TIMESTEP)):
            speed = self.data.actuator_velocity.copy()
            current = (volts - self.k * speed) / self.resistance
            self.data.ctrl[:] = self.k * current - self.viscous * speed
            mujoco.mj_step(self.model, self.data)
            mujoco.mj_forward(self.model, self.data)
            speeds.append(0.5 * (speed + self.data.actuator_velocity))
        mean = np.mean(speeds, axis=0)
        return mean, (volts - self.k * mean) / self.resistance


def simulated(vehicle: Vehicle, commands: Array) -> tuple[Trace, Array]:
    """The dynamics, and the voltages that their drivers gave, (k, n)."""
    simulation = Simulation(vehicle)
    state, asked = simulation.start(), simulation.inputs()
    twists, volts, out = [], [], []
    for command in commands.tolist():
        asked[at.COMMAND : at.COMMAND + 3] = command
        out.append(simulation.advance(state, asked))
        twists.append(state[at.TWIST : at.TWIST + 3])
        volts.append(state[at.STATE_HEADER + at.VOLTS :: at.STATE_WHEEL])
    steps = Steps.of(np.array(out), vehicle.count)
    return Trace(np.array(twists), steps.speed, steps.current, steps.power), np.array(volts)


def plant(vehicle: Vehicle, volts: Array) -> Trace:
    """MuJoCo under the same voltages."""
    rig = Rig(vehicle)
    twists, speeds, currents = [], [], []
    for row in volts:
        speed, current = rig.period(row)
        twists.append(rig.twist())
        speeds.append(speed)
        currents.append(current)
    return Trace(np.array(twists), np.array(speeds), np.array(currents), volts * np.array(currents))


def relative(found: Array, expected: Array) -> float:
    return float(np.sqrt(np.mean((found - expected) ** 2) / np.mean(expected**2)))


@pytest.mark.parametrize("wheels", [four_omni, four_mecanum, two_driven])
def test_vehicles_on_other_wheels(wheels: object) -> None:
    """Starts, a curve, a spin and a stop: motion within 0.3 %, currents within 2.5 %."""
    assert callable(wheels)
    vehicle = on(wheels())
    side = 0.0 if vehicle.casters else 0.3
    legs = [(0.6, 0.0, 0.0), (0.3, side, 1.5), (0.0, 0.0, -1.5), (0.0, 0.0, 0.0)]
    commands = np.repeat(np.array(legs), 120, axis=0)
    ours, volts = simulated(vehicle, commands)
    theirs = plant(vehicle, volts)
    assert np.abs(ours.current).max() > 1.0
    np.testing.assert_allclose(ours.twist[115], legs[0], atol=0.02)
    assert relative(ours.twist, theirs.twist) < 0.003
    assert relative(ours.speed, theirs.speed) < 0.003
    assert relative(ours.current, theirs.current) < 0.025


def test_the_reference_robot_with_rollers_in_closed_loop() -> None:
    """A short mission under commands alone: speeds within 0.3 %, power within 1.5 %."""
    robot = shipped_robot("reference")
    robot = evolve(robot, sensors=evolve(robot.sensors, encoder_resolution=0.0))
    rig = Plant(robot, seed=3)
    legs = [(0.4, 0.0, 0.0), (0.2, 0.3, 1.0), (0.0, 0.0, -2.0), (-0.3, 0.1, 0.0), (0.0, 0.0, 0.0)]
    commands = np.repeat(np.array(legs), 160, axis=0)
    speeds, energy = [], [0.0]
    for command in commands.tolist():
        rig.command(*command)
        before = rig.engine.angle
        rig.step_to(rig.stamp_ns + 5_000_000)
        speeds.append((rig.engine.angle - before) / 0.005)
        energy.append(rig.ledger.drivers)
    ours, _ = simulated(vehicle_of(robot), commands)
    theirs = np.diff(energy) / 0.005
    window = np.ones(10) / 10.0  # of a power monitor, 50 ms
    smooth = [np.convolve(item, window, "valid") for item in (ours.power.sum(axis=1), theirs)]
    assert relative(ours.speed, np.array(speeds)) < 0.003
    assert relative(smooth[0], smooth[1]) < 0.015
