"""The MuJoCo model of a three-wheeled omni robot, written from its description.

Each wheel carries twelve free ellipsoid rollers: their envelope is round to 0.05 %, so the wheel
neither bumps nor creeps. The body takes what mass and inertia the wheels leave, so that the
totals are exactly those of the description.
"""

import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant import scenery
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.wheels import Vector, wheel_angles

ROLLERS = 12
_REFERENCE_RADIUS = 0.05  # m, the wheel for which the roller's values were found
# Of the wheel radius. Thick rollers make a rounder wheel: 0.4 has a third of the ripple of 0.2.
_ROLLER_RADIUS = 0.4
# Light rollers: each is spun up when it meets the floor, and heavy ones would draw power for it.
_ROLLER_DAMPING = 2e-6  # N m s/rad at the reference radius
_ROLLER_ARMATURE = 1e-7  # kg m^2 at the reference radius
_ROLLER_INERTIA_SHARE = 0.05  # of the wheel's inertia about its axle
# Dry friction of a wheel stops it within 4 ms. MuJoCo's own 20 ms at an impedance of 0.9 would be
# viscous friction up to some tenths of a rad/s: no wheel would stick, and Stribeck friction would
# lack its peak. Two steps of 1 ms are the least that is stable.
_WHEEL_STOPS, _ROLLER_STOPS = "0.004 1", "0.002 1"
_FIRM = "0.99 0.99 0.001"
_LEAST_INERTIA = 1e-7  # kg m^2: MuJoCo needs a positive one
_LEAST_DRIVEN_INERTIA = 1e-4  # kg m^2 with the rotor, at the reference radius: less chatters


@frozen
class WheelParts:
    """Masses and inertias of one wheel: hub and rollers together have the wheel's inertia."""

    hub_mass: float  # kg
    hub_axial: float  # kg m^2 about the axle
    hub_transverse: float  # kg m^2 about a diameter
    roller_mass: float  # kg
    roller_axial: float  # kg m^2 about the roller's own axis
    roller_transverse: float  # kg m^2
    ring_radius: float  # m, axle to roller centres

    @property
    def mass(self) -> float:
        return self.hub_mass + ROLLERS * self.roller_mass

    @property
    def vertical(self) -> float:
        """Inertia about the vertical through the wheel's centre [kg m^2], at any wheel angle.

        A ring of three or more alike parts has the same inertia about every diameter.
        """
        ring = self.roller_mass * self.ring_radius**2 / 2
        own = (self.roller_axial + self.roller_transverse) / 2
        return self.hub_transverse + ROLLERS * (ring + own)


def roller_semi_axes(wheel_radius: float) -> tuple[float, float]:
    """Radial and tangential semi-axes of a roller [m].

    The tangential one makes the support function of the ellipse equal the wheel radius half-way
    between two rollers, as it is at their middles.
    """
    radial = _ROLLER_RADIUS * wheel_radius
    half = math.pi / ROLLERS
    reach = wheel_radius - (wheel_radius - radial) * math.cos(half)
    tangential = math.sqrt(reach**2 - (radial * math.cos(half)) ** 2) / math.sin(half)
    return radial, tangential


def roller_rolling_radius(wheel_radius: float) -> float:
    """Distance from a roller's axis to the floor [m], averaged over a turn of the wheel.

    The average is the harmonic one: a drag force is the roller's friction torque over it.
    """
    radial, tangential = roller_semi_axes(wheel_radius)
    tilt = np.linspace(0.0, math.pi / ROLLERS, 101)
    support = np.hypot(radial * np.cos(tilt), tangential * np.sin(tilt))
    return float(1.0 / np.mean(support / (radial**2 * np.cos(tilt))))


def wheel_parts(robot: Robot, wheel: int, wheel_radius: float) -> WheelParts:
    """Share a wheel's inertia among hub and rollers; masses stay small against the robot's."""
    motor = robot.motors[wheel]
    rotor = motor.rotor_inertia * motor.gear_ratio**2
    least = _LEAST_DRIVEN_INERTIA * (wheel_radius / _REFERENCE_RADIUS) ** 2 - rotor
    radial, tangential = roller_semi_axes(wheel_radius)
    ring = wheel_radius - radial
    inertia = max(robot.wheel_inertia, least, _LEAST_INERTIA)
    # A solid ellipsoid of revolution has 2/5 m a^2 about its axis.
    shape_axial, shape_transverse = 0.4 * radial**2, 0.2 * (radial**2 + tangential**2)
    per_mass = ROLLERS * (ring**2 + shape_transverse)
    limit = 0.02 * min(robot.mass, robot.inertia_z / robot.robot_radius**2)
    roller_mass = min(_ROLLER_INERTIA_SHARE * inertia / per_mass, limit / ROLLERS)
    hub_axial = inertia - roller_mass * per_mass
    hub_mass = min(2.0 * hub_axial / wheel_radius**2, limit)
    return WheelParts(
        hub_mass=hub_mass,
        hub_axial=hub_axial,
        hub_transverse=0.6 * hub_axial,
        roller_mass=roller_mass,
        roller_axial=roller_mass * shape_axial,
        roller_transverse=roller_mass * shape_transverse,
        ring_radius=ring,
    )


def build_model(robot: Robot, design: PlantDesign, timestep: float) -> mujoco.MjModel:
    """Compile the model of a robot on a flat floor.

    Args:
        robot: its description.
        design: masses, radii and floor after the effects.
        timestep: integration step [s]; it must divide the control period.

    Raises:
        InputError: wheels heavier or with more inertia than the whole robot, or sizes beyond what
            MuJoCo takes.
    """
    root = ET.Element("mujoco", model="tomr")
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    level = design.gravity[0] == 0.0 and design.gravity[1] == 0.0
    option = ET.SubElement(
        root, "option", timestep=_text(timestep), integrator="implicitfast", cone="elliptic",
        jacobian="dense", solver="Newton", iterations="50", tolerance="1e-8",
        impratio="1" if level else "10", gravity=_text(design.gravity),
    )  # fmt: skip
    # A plant that blows up must be seen to: MuJoCo would quietly start again from its beginning.
    ET.SubElement(option, "flag", autoreset="disable")
    scenery.add_assets(root)
    world = ET.SubElement(root, "worldbody")
    scenery.add_surroundings(world, robot)
    # The floor takes all contact values, friction included, from the rollers.
    ET.SubElement(
        world, "geom", name="floor", type="plane", size="0 0 0.05", material="floor",
        contype="1", conaffinity="0", condim="3",
    )  # fmt: skip
    base = ET.SubElement(world, "body", name="base_link")
    ET.SubElement(base, "freejoint", name="base")
    parts = [
        wheel_parts(robot, wheel, float(radius)) for wheel, radius in enumerate(design.wheel_radius)
    ]
    _add_inertial(base, robot, design, parts)
    scenery.add_body(base, robot)
    actuators = ET.SubElement(root, "actuator")
    for wheel, angle in enumerate(wheel_angles(robot)):
        _add_wheel(base, robot, design, wheel, float(angle), parts[wheel])
        motor = robot.motors[wheel]
        ET.SubElement(
            actuators, "dcmotor", name=f"motor_{wheel}", joint=f"wheel_{wheel}", input="voltage",
            motorconst=_text(motor.torque_constant), resistance=_text(motor.resistance),
            gear=_text(motor.gear_ratio),
        )  # fmt: skip
    try:
        return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    except ValueError as error:
        reason = str(error).partition("\n")[0]
        raise InputError(
            f"this robot cannot be simulated ({reason}): check its masses and radii"
        ) from None


def _add_inertial(
    base: ET.Element, robot: Robot, design: PlantDesign, parts: list[WheelParts]
) -> None:
    """Give the body what is left when the wheels are taken out of the totals."""
    angles = wheel_angles(robot)
    places = np.column_stack(
        [
            robot.robot_radius * np.cos(angles),
            robot.robot_radius * np.sin(angles),
            design.wheel_radius,
        ]
    )
    masses = np.array([part.mass for part in parts])
    mass = design.mass - masses.sum()
    if mass <= 0:
        raise InputError(
            f"robot.mass = {design.mass:g} kg leaves nothing for the body: "
            "raise robot.mass or body.payload_mass"
        )
    center = (design.mass * design.mass_center - masses @ places) / mass
    arms = places[:, :2] - design.mass_center[:2]
    wheels_z = sum(part.vertical for part in parts) + float(masses @ (arms**2).sum(axis=1))
    own_arm = center[:2] - design.mass_center[:2]
    inertia_z = robot.inertia_z - wheels_z - mass * float(own_arm @ own_arm)
    if inertia_z <= 0:
        raise InputError(
            f"robot.inertia_z = {robot.inertia_z:g} kg m^2 is less than that of the wheels "
            f"({robot.inertia_z - inertia_z:.3g} kg m^2): raise it"
        )
    ET.SubElement(
        base, "inertial", pos=_text(center), mass=_text(float(mass)),
        diaginertia=_text(np.array([0.6, 0.6, 1.0]) * inertia_z),
    )  # fmt: skip


def _add_wheel(
    base: ET.Element, robot: Robot, design: PlantDesign, wheel: int, angle: float, parts: WheelParts
) -> None:
    """A hub whose axle (its x axis) points outward, with its rollers on a ring."""
    radius = float(design.wheel_radius[wheel])
    scale = radius / _REFERENCE_RADIUS
    motor = robot.motors[wheel]
    place = [robot.robot_radius * math.cos(angle), robot.robot_radius * math.sin(angle), radius]
    hub = ET.SubElement(
        base, "body", name=f"hub_{wheel}", pos=_text(place), euler=_text([0.0, 0.0, angle])
    )
    ET.SubElement(
        hub, "joint", name=f"wheel_{wheel}", type="hinge", axis="1 0 0",
        armature=_text(motor.rotor_inertia * motor.gear_ratio**2),
        solreffriction=_WHEEL_STOPS, solimpfriction=_FIRM,
    )  # fmt: skip
    ET.SubElement(
        hub, "inertial", pos="0 0 0", mass=_text(parts.hub_mass),
        diaginertia=_text([parts.hub_axial, parts.hub_transverse, parts.hub_transverse]),
    )  # fmt: skip
    scenery.add_hub(hub, radius)
    radial, tangential = roller_semi_axes(radius)
    for number in range(ROLLERS):
        turn = 2.0 * math.pi * number / ROLLERS
        center = [0.0, -parts.ring_radius * math.sin(turn), parts.ring_radius * math.cos(turn)]
        roller = ET.SubElement(
            hub, "body", name=f"roller_{wheel}_{number}", pos=_text(center),
            euler=_text([turn, 0.0, 0.0]),
        )  # fmt: skip
        ET.SubElement(
            roller, "joint", name=f"roller_{wheel}_{number}", type="hinge", axis="0 1 0",
            damping=_text(_ROLLER_DAMPING * scale**3), armature=_text(_ROLLER_ARMATURE * scale**3),
            solreffriction=_ROLLER_STOPS, solimpfriction=_FIRM,
        )  # fmt: skip
        ET.SubElement(
            roller, "inertial", pos="0 0 0", mass=_text(parts.roller_mass),
            diaginertia=_text(
                [parts.roller_transverse, parts.roller_axial, parts.roller_transverse]
            ),
        )  # fmt: skip
        ET.SubElement(
            roller, "geom", name=f"roller_{wheel}_{number}", type="ellipsoid",
            size=_text([radial, tangential, radial]), contype="0", conaffinity="1", condim="3",
            priority="1", friction=_text([float(design.floor_friction[wheel]), 0.0, 0.0]),
            solref="0.004 1", solimp="0.95 0.99 0.0005", group="3",
        )  # fmt: skip
        scenery.add_roller(roller, radius, parts.ring_radius)


def _text(values: Vector | list[float] | float) -> str:
    return " ".join(repr(float(value)) for value in np.atleast_1d(values))
