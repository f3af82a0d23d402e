"""Values of effects, and sizes of a robot, that tests of several packages try."""

from collections.abc import Mapping

from tomr_power_model.effects.scales import Scales

Physics = Mapping[str, Mapping[str, float]]

SCALES = Scales(
    torque=0.1,
    speed=5.0,
    current=0.2,
    power=2.0,
    copper=0.1,
    load=50.0,
    radius=0.05,
    arm=0.2,
    mass=15.0,
    gear=20.0,
    voltage=24.0,
    duration=60.0,
    period=0.005,
)
# As a robot may well have them.
MODERATE: Physics = {
    "friction.coulomb": {"torque": 0.09},
    "friction.viscous": {"coefficient": 0.006},
    "friction.stribeck": {"torque": 0.04, "speed": 1.5},
    "friction.asymmetric": {"torque": -0.02},
    "friction.load_dependent": {"coefficient": 0.05},
    "friction.quadratic": {"coefficient": 5e-4},
    "drivetrain.torque_ripple": {"torque": 0.03, "order": 6.0, "phase": 0.4},
    "contact.roller_drag": {"coefficient": 0.01},
    "contact.rolling_resistance": {"coefficient": 0.01},
    "contact.slip": {"friction": 0.4},
    "body.payload_mass": {"mass": 2.0},
    "body.mass_center_offset": {"x": 0.01, "y": -0.02},
    "body.slope": {"angle": 0.01, "azimuth": 0.7},
    "electrical.winding_heating": {
        "thermal_resistance": 4.0,
        "time_constant": 60.0,
        "initial": 30.0,
    },
    "electrical.supply_sag": {"resistance": 0.1},
    "electrical.driver_standby": {"power": 1.5},
    "electrical.switching_loss": {"coefficient": 0.3},
    "electrical.regeneration_loss": {"efficiency": 0.5},
    "electrical.iron_loss": {"hysteresis": 5e-4, "eddy": 2e-6},
    "kinematic.wheel_radius": {"scale": 1.01},
    "sensor.power_scale": {"scale": 1.05},
    "sensor.power_bias": {"power": 0.4},
    "sensor.power_lag": {"time_constant": 0.05},
    "sensor.clock_offset": {"delay": 0.02},
    "sensor.encoder_scale": {"scale": 0.98},
    "sensor.encoder_eccentricity": {"cosine": 0.02, "sine": -0.01},
    "sensor.supply_scale": {"scale": 1.04},
}
# As large as they come; sensors are not part of the motion.
LARGE: Physics = {
    "friction.coulomb": {"torque": 0.4},
    "friction.viscous": {"coefficient": 0.05},
    "friction.stribeck": {"torque": 0.2, "speed": 0.5},
    "friction.asymmetric": {"torque": 0.1},
    "friction.load_dependent": {"coefficient": 0.3},
    "friction.quadratic": {"coefficient": 0.005},
    "drivetrain.torque_ripple": {"torque": 0.1, "order": 7.0, "phase": 0.3},
    "contact.roller_drag": {"coefficient": 0.2, "slip": 0.2},
    "contact.rolling_resistance": {"coefficient": 0.05},
    "contact.slip": {"friction": 0.2},
    "body.payload_mass": {"mass": 10.0},
    "body.mass_center_offset": {"x": 0.05, "y": -0.04},
    "body.slope": {"angle": 0.05, "azimuth": 1.0},
    "electrical.winding_heating": {
        "thermal_resistance": 10.0,
        "time_constant": 20.0,
        "initial": 10.0,
    },
    "electrical.supply_sag": {"resistance": 0.8},
    "electrical.driver_standby": {"power": 3.0},
    "electrical.switching_loss": {"coefficient": 0.5},
    "electrical.regeneration_loss": {"efficiency": 0.3},
    "electrical.iron_loss": {"hysteresis": 0.01, "eddy": 1e-4},
    "kinematic.wheel_radius": {"scale": 0.95},
}
