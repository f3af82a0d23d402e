"""How far the values of a description are believed before a fit, and what would tell them."""

# Standard deviation relative to the value: data sheets are good for windings, poor for friction.
TOLERANCES = {
    "robot.mass": 0.1,
    "robot.inertia_z": 0.3,
    "robot.wheel_radius": 0.02,
    "robot.wheel_inertia": 0.5,
    "motor.resistance": 0.1,
    "motor.torque_constant": 0.05,
    "motor.rotor_inertia": 0.5,
    "supply.auxiliary_power": 0.5,
}
DEFAULT_TOLERANCE = 1.0

# (start, standard deviation) of values that a description does not give or gives as zero.
ABSENT = {
    "robot.mass_center.x": (0.0, 0.02),
    "robot.mass_center.y": (0.0, 0.02),
    "supply.auxiliary_power": (0.0, 50.0),
    "physics.friction.coulomb.torque": (0.0, 0.5),
    "physics.friction.viscous.coefficient": (0.0, 0.05),
    "physics.friction.stribeck.torque": (0.0, 0.2),
    "physics.friction.stribeck.speed": (1.0, 1.0),
    "physics.friction.asymmetric.torque": (0.0, 0.1),
    "physics.friction.load_dependent.coefficient": (0.0, 0.2),
    "physics.friction.quadratic.coefficient": (0.0, 0.01),
    "physics.contact.roller_drag.coefficient": (0.2, 0.3),
    "physics.contact.roller_drag.slip": (0.3, 0.3),
    "physics.contact.rolling_resistance.coefficient": (0.0, 0.05),
    "physics.body.payload_mass.mass": (0.0, 5.0),
    "physics.body.mass_center_offset.x": (0.0, 0.02),
    "physics.body.mass_center_offset.y": (0.0, 0.02),
    "physics.electrical.supply_sag.resistance": (0.0, 0.2),
    "physics.electrical.driver_standby.power": (0.0, 3.0),
    "physics.electrical.switching_loss.coefficient": (0.0, 0.5),
    "physics.electrical.regeneration_loss.efficiency": (0.8, 0.3),
    "physics.electrical.iron_loss.hysteresis": (0.0, 0.01),
    "physics.electrical.iron_loss.eddy": (0.0, 1e-4),
    # What an instant's motion does not tell: if asked for, a fit finds them undetermined.
    "physics.drivetrain.torque_ripple.torque": (0.0, 0.05),
    "physics.drivetrain.torque_ripple.order": (1.0, 10.0),
    "physics.body.slope.angle": (0.0, 0.05),
    "physics.electrical.winding_heating.thermal_resistance": (0.0, 5.0),
    "physics.electrical.winding_heating.time_constant": (100.0, 100.0),
    "physics.electrical.winding_heating.initial": (0.0, 20.0),
    "physics.sensor.power_scale.scale": (1.0, 0.1),
    "physics.sensor.power_lag.time_constant": (0.0, 0.1),
    "physics.sensor.clock_offset.delay": (0.0, 0.05),
}

# The drive that would tell a value, by the beginning of its key.
_DRIVES = (
    ("robot.mass_center", "circles and spins while driving, at several headings"),
    ("robot.mass", "starts and stops at full acceleration, straight, at several headings"),
    ("robot.inertia_z", "spins on the spot that start and stop at full acceleration"),
    ("robot.wheel_inertia", "spins and straight starts: it shows only beside mass and inertia_z"),
    ("motor.rotor_inertia", "spins and straight starts: it shows only beside mass and inertia_z"),
    ("motor.torque_constant", "none, power tells R / k^2 alone: measure the motor's idle speed"),
    ("motor.resistance", "hard acceleration, where copper loss counts, and k known otherwise"),
    (
        "supply.auxiliary_power",
        "standing still for ten seconds, battery_state and motor power recorded",
    ),
    ("physics.electrical.driver_standby", "standing still for ten seconds"),
    ("physics.electrical.regeneration_loss", "hard braking from full speed"),
    ("physics.electrical.supply_sag", "hard acceleration with the supply's voltage recorded"),
    ("physics.electrical", "steady speeds under several loads: empty and with a payload"),
    ("physics.friction.asymmetric", "the same straight both ways, at several headings"),
    ("physics.friction.stribeck", "crawling: steady speeds from 0.2 to 3 rad/s at the wheel"),
    ("physics.friction.load_dependent", "the same drives empty and with a payload"),
    ("physics.contact.roller_drag", "straight drives at many headings, 15 degrees apart"),
    ("physics.contact.rolling_resistance", "the same drives empty and with a payload"),
    ("physics.body", "circles and spins while driving, at several headings"),
    ("physics.friction", "steady speeds at three levels or more, slow to fast, on every wheel"),
)


def drive_for(general: str) -> str:
    """The drive that would determine a value."""
    found = (text for start, text in _DRIVES if general.startswith(start))
    return next(found, "a longer drive with more headings, speeds and accelerations")
