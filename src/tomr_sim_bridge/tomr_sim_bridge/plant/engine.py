"""MuJoCo behind a small door: voltages in, motion out."""

import logging
import math

import mujoco
import numpy as np

from tomr_power_model.errors import InputError
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects import WheelLoads
from tomr_sim_bridge.plant.mjcf import ROLLERS, build_model, roller_rolling_radius
from tomr_sim_bridge.plant.wheels import Vector, wheel_angles

OPEN_CIRCUIT = 1e9  # ohm: a bridge that is off
_SETTLING = 0.3  # s for the rollers to find the floor
_HOLDING = 5.0  # N m: so much dry friction is a brake
_RIGID = 0.9999  # impedance of a friction constraint that hardly yields
_NORMAL_SMOOTHING = 0.05  # s: contact forces chatter where one roller hands over to the next


def _log_warning(text: str) -> None:
    """MuJoCo would write its warnings into a file in the working directory."""
    logging.getLogger(__name__).debug(text)


class Engine:
    """The robot on its floor. World and base_link coincide at the start."""

    def __init__(self, robot: Robot, design: PlantDesign, timestep: float, phase: Vector) -> None:
        """Build and settle the robot.

        Args:
            robot: its description.
            design: what the effects made of it.
            timestep: integration step [s].
            phase: wheel angles at the start [rad], shape (3,): which roller is on the floor.
        """
        mujoco.set_mju_user_warning(_log_warning)
        self.model = build_model(robot, design, timestep)
        self.data = mujoco.MjData(self.model)
        self.timestep = timestep
        self._healthy_constant = np.array([motor.wheel_constant for motor in robot.motors])
        self._shaft_constant = np.array([motor.torque_constant for motor in robot.motors])
        self.set_motors(np.array([motor.resistance for motor in robot.motors]), np.ones(WHEELS))
        self._radius = design.wheel_radius
        angles = wheel_angles(robot)
        self._arms = robot.robot_radius * np.column_stack([np.cos(angles), np.sin(angles)])
        names = [f"wheel_{wheel}" for wheel in range(WHEELS)]
        self._angles = np.array([self.model.joint(name).qposadr[0] for name in names])
        self._speeds = np.array([self.model.joint(name).dofadr[0] for name in names])
        rollers = [
            [f"roller_{wheel}_{number}" for number in range(ROLLERS)] for wheel in range(WHEELS)
        ]
        self._impedance = self.model.dof_solimp[self._speeds, :2].copy()
        self._roller_speeds = np.array(
            [[self.model.joint(name).dofadr[0] for name in row] for row in rollers]
        )
        self._roller_geoms = np.array(
            [[self.model.geom(name).id for name in row] for row in rollers]
        )
        self._roller_radius = np.array([roller_rolling_radius(radius) for radius in self._radius])
        self._wheel_of_geom = np.full(self.model.ngeom, -1)
        self._wheel_of_geom[self._roller_geoms] = np.arange(WHEELS)[:, None]
        self._friction = design.floor_friction.copy()
        self._base = int(self.model.joint("base").dofadr[0])
        self._push_height = float(design.mass_center[2])
        self._yaw = 0.0
        self._settle(phase)
        self._zero = self.data.qpos[self._angles].copy()
        self._normal, self._carrying = self._contact_forces()

    def _settle(self, phase: Vector) -> None:
        gravity = self.model.opt.gravity.copy()
        self.model.opt.gravity[:] = [0.0, 0.0, -float(np.linalg.norm(gravity))]
        self.data.qpos[self._angles] = phase
        mujoco.mj_step(self.model, self.data, math.ceil(_SETTLING / self.timestep))
        self.model.opt.gravity[:] = gravity
        self.data.qpos[:2] = 0.0
        self.data.qpos[3:7] /= np.linalg.norm(self.data.qpos[3:7])
        self.data.qvel[:] = 0.0
        mujoco.mj_forward(self.model, self.data)

    @property
    def angle(self) -> Vector:
        """Wheel angles since the start [rad], shape (3,)."""
        return np.asarray(self.data.qpos[self._angles] - self._zero)

    @property
    def speed(self) -> Vector:
        """Wheel speeds [rad/s], shape (3,)."""
        return np.asarray(self.data.qvel[self._speeds])

    @property
    def position(self) -> Vector:
        """Origin of base_link in the world [m], shape (3,)."""
        return np.array(self.data.qpos[:3])

    @property
    def yaw(self) -> float:
        """Heading of base_link [rad], counted on over full turns."""
        w, x, y, z = self.data.qpos[3:7]
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        self._yaw = heading + 2.0 * math.pi * round((self._yaw - heading) / (2.0 * math.pi))
        return self._yaw

    @property
    def velocity(self) -> Vector:
        """Velocity of the origin of base_link in the world [m/s], shape (3,)."""
        return np.array(self.data.qvel[:3])

    @property
    def angular_velocity(self) -> Vector:
        """Angular velocity in base_link [rad/s], shape (3,)."""
        return np.array(self.data.qvel[3:6])

    @property
    def kinetic_energy(self) -> float:
        """Of all bodies and rotors [J]."""
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy[1])

    def contacts(self, yaw: float) -> Vector:
        """Wheel contacts in the world [m], shape (3, 2)."""
        cosine, sine = math.cos(yaw), math.sin(yaw)
        rotation = np.array([[cosine, sine], [-sine, cosine]])
        return np.asarray(self._arms @ rotation + self.data.qpos[:2])

    def normal_forces(self, duration: float) -> Vector:
        """Smoothed normal force on each wheel [N], shape (3,); call once per stretch.

        How many rollers carry each wheel, which `set_loads` needs, is smoothed with it.
        """
        share = min(1.0, duration / _NORMAL_SMOOTHING)
        force, carrying = self._contact_forces()
        self._normal = self._normal + share * (force - self._normal)
        self._carrying = self._carrying + share * (carrying - self._carrying)
        return self._normal

    def _contact_forces(self) -> tuple[Vector, Vector]:
        """Normal force on each wheel [N], and how many of its rollers carry it; shape (3,)."""
        force, carrying = np.zeros(WHEELS), np.zeros(WHEELS)
        contact = self.data.contact
        if self.data.ncon:
            wheels = self._wheel_of_geom[contact.geom].max(axis=1)
            pressed = self.data.efc_force[contact.efc_address]
            np.add.at(force, wheels, pressed)
            np.add.at(carrying, wheels, pressed > 0.0)
        return force, np.maximum(carrying, 1.0)

    def set_friction(self, friction: Vector) -> None:
        """Set the traction coefficient under each wheel, shape (3,)."""
        if not np.array_equal(friction, self._friction):
            self.model.geom_friction[self._roller_geoms, 0] = friction[:, None]
            self._friction = friction.copy()

    def set_loads(self, loads: WheelLoads) -> None:
        """Set the resistance of the axles and rollers for the next stretch."""
        self.model.dof_frictionloss[self._speeds] = np.maximum(loads.dry, 0.0)
        # MuJoCo's friction yields a little, in proportion: a wheel that is held must not creep.
        impedance = np.where((loads.dry > _HOLDING)[:, None], _RIGID, self._impedance)
        self.model.dof_solimp[self._speeds, :2] = impedance
        self.model.dof_damping[self._speeds] = loads.viscous
        self.data.qfrc_applied[self._speeds] = loads.torque
        # Where one roller hands over to the next both turn, and each drags with its own load only.
        torque = loads.roller_force * self._roller_radius / self._carrying
        self.model.dof_frictionloss[self._roller_speeds] = torque[:, None]

    def set_push(self, push: Vector) -> None:
        """Set the force on the body [N, N in the world] and the moment about the vertical [N m].

        The force acts above the origin of base_link at the height of the mass centre.
        """
        x, y, moment = push
        cosine, sine = math.cos(self._yaw), math.sin(self._yaw)
        # A free joint takes forces in the world and moments in its own frame.
        tilt_x, tilt_y = -self._push_height * y, self._push_height * x
        self.data.qfrc_applied[self._base : self._base + 6] = [
            x, y, 0.0,
            cosine * tilt_x + sine * tilt_y, cosine * tilt_y - sine * tilt_x, moment,
        ]  # fmt: skip

    def set_motors(self, resistance: Vector, constant: Vector) -> None:
        """Set the circuits of the motors for the next stretch.

        Args:
            resistance: [ohm], shape (3,); OPEN_CIRCUIT for a bridge that is off.
            constant: torque and back-EMF, times the motor's own [-], shape (3,).
        """
        self._resistance = resistance
        self._constant = self._healthy_constant * constant
        self.model.actuator_gainprm[:, 0] = resistance
        self.model.actuator_gainprm[:, 1] = self._shaft_constant * constant

    def advance(self, steps: int, voltage: Vector) -> tuple[Vector, Vector]:
        """Integrate; return the mean motor currents [A] and the turn of the wheels [rad].

        Raises InputError when the plant has blown up.

        Args:
            steps: number of integration steps.
            voltage: at the motor terminals, held [V], shape (3,).
        """
        self.data.ctrl[:] = voltage
        before = self.data.qpos[self._angles].copy()
        mujoco.mj_step(self.model, self.data, steps)
        turned = self.data.qpos[self._angles] - before
        if not math.isfinite(turned[0]):
            raise InputError(
                "the simulated robot has become unstable: its description asks for forces that a "
                "step of 1 ms cannot follow; check resistance, gains and inertias"
            )
        mean_speed = turned / (steps * self.timestep)
        return (voltage - self._constant * mean_speed) / self._resistance, turned
