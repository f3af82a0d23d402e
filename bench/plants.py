"""Robots that are not quite as they are described."""

from collections.abc import Callable

from attrs import evolve

from tomr_power_model.robot import Robot


def every_value(robot: Robot, off: Callable[[float], float]) -> Robot:
    """A robot with every value of its body, motors and effects passed through `off`."""
    first, second, third = (
        evolve(
            motor,
            resistance=off(motor.resistance),
            torque_constant=off(motor.torque_constant),
            rotor_inertia=off(motor.rotor_inertia),
        )
        for motor in robot.motors
    )
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
        wheel_inertia=off(robot.wheel_inertia),
        motors=(first, second, third),
        physics=physics,
    )
