"""A wheeled robot as the dynamics see it: any number of wheels, anywhere, of any kind."""

import math
from collections.abc import Mapping, Sequence

from attrs import frozen

from tomr_power_model.effects import EFFECTS, NEVER_SLIDES, PlantNumbers
from tomr_power_model.robot import Controller, Motor, Robot, Supply

Physics = Mapping[str, Sequence[Mapping[str, float] | None]]


@frozen
class WheelPlace:
    """A driven wheel: where it stands, which way it drives, which way its contact rolls freely.

    An omni wheel rolls freely along its axle, a mecanum wheel at 45 degrees to it; a wheel without
    rollers does not, and its tyre holds sideways as it does forwards.
    """

    x: float  # m in base_link
    y: float
    drive: float  # direction in which it drives the robot, turning positively [rad]
    roller: float | None  # direction in which its contact rolls freely [rad]; None: no rollers


@frozen
class Vehicle:
    """All that the dynamics need to know; SI units as in robot.yaml."""

    wheels: tuple[WheelPlace, ...]
    wheel_radius: float
    wheel_inertia: float
    mass: float
    inertia_z: float
    mass_center: tuple[float, float, float]
    motors: tuple[Motor, ...]
    controller: Controller
    supply: Supply
    physics: Physics  # parameters of each effect at each wheel, None where it is left out
    ramp_radius: float  # m: the yaw rate is ramped by the acceleration limit over it
    encoder_quantum: float = 0.0  # rad that the drivers' encoders count; 0: ideal
    casters: tuple[tuple[float, float], ...] = ()  # places of wheels that only carry [m]

    @property
    def count(self) -> int:
        """Number of driven wheels."""
        return len(self.wheels)


def omni_wheel(x: float, y: float, drive: float) -> WheelPlace:
    """A wheel with rollers that roll along its axle."""
    return WheelPlace(x, y, drive, drive + 0.5 * math.pi)


def vehicle_of(robot: Robot) -> Vehicle:
    """Three omni wheels around the middle, as ros2_controllers' omni_wheel_drive_controller."""
    places = []
    for wheel in range(len(robot.wheel_names)):
        angle = robot.wheel_offset + 2.0 * math.pi * wheel / len(robot.wheel_names)
        x, y = robot.robot_radius * math.cos(angle), robot.robot_radius * math.sin(angle)
        places.append(omni_wheel(x, y, angle - 0.5 * math.pi))
    return Vehicle(
        wheels=tuple(places),
        wheel_radius=robot.wheel_radius,
        wheel_inertia=robot.wheel_inertia,
        mass=robot.mass,
        inertia_z=robot.inertia_z,
        mass_center=robot.mass_center,
        motors=robot.motors,
        controller=robot.controller,
        supply=robot.supply,
        physics=robot.physics,
        ramp_radius=robot.robot_radius,
    )


def plant_numbers(vehicle: Vehicle) -> PlantNumbers:
    """The numbers that effects change, after all effects of the vehicle have done so."""
    n = vehicle.count
    numbers = PlantNumbers(
        mass=vehicle.mass,
        mass_center=list(vehicle.mass_center[:2]),
        radius=[vehicle.wheel_radius] * n,
        gear_ratio=[motor.gear_ratio for motor in vehicle.motors],
        viscous=[0.0] * n,
        axle_drag=[0.0] * n,
        roller_slip=[0.0] * n,
        grip=[NEVER_SLIDES] * n,
        floor_force=[0.0, 0.0],
        voltage_drop=0.0,
        thermal_resistance=[0.0] * n,
        thermal_time=[0.0] * n,
        initial_rise=[0.0] * n,
        power_scale=[1.0] * n,
        power_bias=[0.0] * n,
        power_lag=[0.0] * n,
        power_delay=[0.0] * n,
        encoder_scale=[1.0] * n,
        encoder_eccentricity=[(0.0, 0.0)] * n,
        supply_scale=1.0,
    )
    for effect_id, per_wheel in vehicle.physics.items():
        effect = EFFECTS[effect_id]
        own = per_wheel if effect.place == "wheel" else per_wheel[:1]
        for wheel, given in enumerate(own):
            if given is not None:
                effect.configure(numbers, wheel, *(given[name] for name in effect.parameters))
    return numbers
