"""The fixed parameters of a robot description, typed, bounded and described."""

import math

from tomr_power_model.robot.parameters import ParameterSpec

_S = ParameterSpec
MOTOR_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("motor.resistance", "winding resistance at 25 C", unit="ohm", above=0.0),
    _S("motor.torque_constant", "torque and back-EMF constant, shaft", unit="N m/A", above=0.0),
    _S("motor.gear_ratio", "motor turns per wheel turn", above=0.0),
    _S("motor.rotor_inertia", "rotor inertia at the shaft", unit="kg m^2", minimum=0.0),
)
ROBOT_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("robot.wheel_names", "joint names of wheels 1 to 3", kind="strs", length=3),
    _S("robot.wheel_offset", "angle of wheel 1 anti-clockwise from +x", unit="rad"),
    _S("robot.robot_radius", "centre to wheel contact", unit="m", above=0.0),
    _S("robot.wheel_radius", "wheel radius", unit="m", above=0.0),
    _S("robot.wheel_inertia", "one wheel about its axle", unit="kg m^2", minimum=0.0),
    _S("robot.mass", "whole robot", unit="kg", above=0.0),
    _S("robot.inertia_z", "about the vertical through the mass centre", unit="kg m^2", above=0.0),
    _S("robot.mass_center", "in base_link", kind="floats", default=(0.0,) * 3, unit="m", length=3),
    *MOTOR_PARAMETERS,
    _S("controller.rate", "wheel speed loop", unit="Hz", default=200.0, above=0.0, maximum=1e4),
    _S("controller.proportional", "gain on wheel speed error", unit="V s/rad", minimum=0.0),
    _S("controller.integral", "gain on wheel angle error", unit="V/rad", minimum=0.0, default=0.0),
    _S(
        "controller.acceleration_limit",
        "on the commanded body velocity; 0: none",
        unit="m/s^2",
        minimum=0.0,
        default=0.0,
    ),
    _S(
        "controller.delay",
        "from a command's stamp to the first response",
        unit="s",
        minimum=0.0,
        maximum=5.0,
        default=0.0,
    ),
    _S(
        "controller.integrator",
        "whether the drivers' sum holds the present error already: backward, or not yet: forward",
        kind="str",
        default="backward",
        choices=("backward", "forward"),
    ),
    _S("supply.nominal_voltage", "battery or rail voltage", unit="V", above=0.0),
    _S(
        "supply.auxiliary_power",
        "computer and sensors, in battery_state only",
        unit="W",
        minimum=0.0,
        default=0.0,
    ),
    _S("sensors.encoder_rate", "joint_states", unit="Hz", default=100.0, above=0.0, maximum=1e4),
    _S(
        "sensors.encoder_resolution",
        "quantum of wheel angle; 0: ideal",
        unit="rad",
        default=2 * math.pi / 8192,
        minimum=0.0,
    ),
    _S(
        "sensors.velocity_resolution",
        "quantum of wheel speed; 0: from the encoder",
        unit="rad/s",
        default=0.0,
        minimum=0.0,
    ),
    _S("sensors.power_rate", "power topics", unit="Hz", default=50.0, above=0.0, maximum=1e4),
    _S(
        "sensors.power_window",
        "average of the power sensors before their stamp",
        unit="s",
        default=0.005,
        minimum=0.0,
        maximum=1.0,
    ),
    _S("sensors.voltage_resolution", "quantum", unit="V", default=1.25e-3, minimum=0.0),
    _S("sensors.current_resolution", "quantum", unit="A", default=1.25e-3, minimum=0.0),
    _S("sensors.voltage_noise", "standard deviation", unit="V", default=2e-3, minimum=0.0),
    _S("sensors.current_noise", "standard deviation", unit="A", default=5e-3, minimum=0.0),
    _S("sensors.imu_rate", "imu/data", unit="Hz", default=100.0, above=0.0, maximum=1e4),
    _S("sensors.gyro_noise", "standard deviation", unit="rad/s", default=2e-3, minimum=0.0),
    _S(
        "sensors.accelerometer_noise", "standard deviation", unit="m/s^2", default=0.03, minimum=0.0
    ),
    _S("sensors.odometry_rate", "odom", unit="Hz", default=20.0, above=0.0, maximum=1e3),
    _S(
        "measurement.source",
        "where motor power comes from",
        kind="str",
        default="battery_state",
        choices=("battery_state", "multi_array", "joint_effort", "total_only"),
    ),
    _S(
        "measurement.quantity",
        "what is compared: power, or a current where the voltage is not known",
        kind="str",
        default="power",
        choices=("power", "supply_current", "motor_current"),
    ),
    _S(
        "measurement.signed",
        "false: the sensor gives a magnitude",
        kind="bool",
        default=True,
    ),
    _S(
        "measurement.total",
        "the whole robot's power: its own topic, the sum of the motors, or none",
        kind="str",
        default="battery_state",
        choices=("battery_state", "sum", "none"),
    ),
)
