"""Where each number of a robot, of its state, its inputs and its outputs stands in flat arrays.

The step is written once, in scalar Python on flat sequences: arrays where numba compiles it, lists
where it runs as it is. Every field is an offset; those of a wheel count from its record's start.
"""

# Numbers of the robot: p[FIELD].
(
    STRIDE,  # length of a wheel's record
    COUPLING,  # where the coupling of the contacts begins, (2 n, 2 n)
    TRACTION,  # where the inverse coupling of the tractions begins, (n, n)
    PERIOD,  # of the drivers [s]
    SUBSTEPS,
    STEP,  # s
    CONTINUOUS,  # whether the loop is so fast that it is taken as continuous
    BACKWARD,  # whether the sum of errors holds the present one (backward Euler)
    PROPORTIONAL,  # V s/rad
    INTEGRAL_GAIN,  # V/rad
    LINEAR_STEP,  # of the ramp in a period [m/s]
    YAW_STEP,  # rad/s
    VOLTAGE,  # nominal [V]
    SAG,  # ohm
    AUXILIARY,  # W
    MASS,  # kg
    CENTER_X,  # of the mass [m]
    CENTER_Y,
    FLOOR_X,  # pull of a tilted floor in the world [N]
    FLOOR_Y,
    HOLDS,  # whether forces along the rollers are solved for with dry friction
    DRAGS,  # whether they fade with sliding instead
    LEANS,  # whether anything depends on the wheels' loads
    SLIDES,  # whether traction is limited
    HEATS,  # whether windings heat up
    SUPPLY_SCALE,  # of the supply's sensor
) = range(26)
DECAY = 26  # E, (3, 3)
GAIN = DECAY + 9  # G, (3, 3)
MOBILITY = GAIN + 9  # inverse mass matrix at base_link, (3, 3)
INERTIA = MOBILITY + 9  # mass matrix at base_link, (3, 3)
HEADER = INERTIA + 9

# Numbers of a wheel: p[HEADER + wheel * stride + FIELD]; rows of three are of the body's twist.
ROLL = 0  # wheel speed per twist, rolling [1/m, 1/m, -]
ASK = 3  # the same as the driver believes
ALONG = 6  # sliding along the rollers' free direction per twist [-, -, m]
FROM_ROLL = 9  # change of twist per unit of torque held for a step
FROM_ALONG = 12  # the same per unit of force along the free direction
PULL = 15  # the same per unit of traction in a part of a step, where wheels slide
TO_TWIST = 18  # twist per wheel speed, pseudo-inverse of ROLL
(
    CONSTANT,  # k at the wheel [N m/A = V s/rad]
    RESISTANCE,  # ohm at 25 C
    DAMPING,  # motor and viscous friction [N m s/rad]
    VISCOUS,  # N m s/rad
    RADIUS,  # speed of the contact's grip per wheel speed [m]
    NOMINAL_RADIUS,  # m
    GEAR,
    ROTOR,  # inertia of the rotor at the wheel [kg m^2]
    AXLE_INERTIA,  # of wheel and rotor [kg m^2]
    LOAD,  # at rest [N]
    LOAD_X,  # change of the load per acceleration of the body [N s^2/m]
    LOAD_Y,
    DRAG,  # coefficient along the free direction [-]
    ROLLER_SLIP,  # sliding in the rolling direction per wheel speed [m]
    GRIP,  # friction coefficient of traction [-]
    THERMAL_RESISTANCE,  # K/W
    THERMAL_KEEP,  # share of a temperature left after a step
    INITIAL_RISE,  # K
    QUANTUM,  # of the encoder [rad], 0: ideal
    SLIDING_DECAY,  # of wheel speed in a part of a step
    SLIDING_GAIN,  # s/(kg m^2)
    SLIDING_OWN,  # diagonal of the coupling of the tractions
    POWER_SCALE,  # of the power sensor
    POWER_BIAS,  # W
    POWER_LAG,  # s
    POWER_DELAY,  # s
    ENCODER_SCALE,  # angle that the encoder shows per angle turned
    ENCODER_COSINE,  # of its disc's eccentricity
    ENCODER_SINE,
) = range(21, 50)
LAWS_START = 50  # parameters of the effects with laws follow

# State: s[FIELD].
TWIST = 0  # of the body in base_link [m/s, m/s, rad/s]
RATE = 3  # its change [m/s^2, m/s^2, rad/s^2]
SET = 6  # ramped set point
(
    HEADING,  # against the start [rad]
    DRAWN,  # current of the whole robot [A]
    SLIDING,  # whether any wheel slides
    YAW_MEAN,  # of the last step [rad/s]
) = range(9, 13)
STATE_HEADER = 13

# State of a wheel: s[STATE_HEADER + wheel * STATE_WHEEL + FIELD]. What comes after RISE is
# worked out anew in every step.
(
    SPEED,  # rad/s
    INTEGRAL,  # sum of errors [rad]
    MEASURED,  # speed that the driver sees [rad/s]
    HELD,  # dry friction at the axle [N m]
    SIDE,  # force along the free direction [N]
    TRANSMITTED,  # torque that the gear carried [N m]
    ANGLE,  # as the encoder shows it [rad]
    COUNTED,  # angle as the encoder counts it [rad]
    TURNED,  # angle as the encoder would count it ideally [rad]
    RISE,  # of the winding above 25 C [K]
    VOLTS,  # at the terminals at the step's start [V]
    WHEEL_LOAD,  # N
    DRY,  # limit of dry friction [N m]
    SIDE_LIMIT,  # N
    TORQUE,  # of a motor at standstill, less what resists [N m]
    HOT,  # resistance of the winding [ohm]
    AXLE_RATE,  # rows of the contact problem
    SIDE_RATE,
    NEXT,  # speed after the step [rad/s]
    MEAN,  # in it
    GAP,  # sliding in the rolling direction [m/s]
    FORCE,  # traction while sliding [N]
    FIRST,  # speed at the start of a part of a step
    ASKED,  # speed that the driver is asked for [rad/s]
    SHOWN,  # speed as the encoder shows it [rad/s]
) = range(25)
STATE_WHEEL = 25

# Inputs of one driver period: u[FIELD].
COMMAND = 0  # twist asked for, held over the period
PUSH = 3  # force and moment on the body, force in the world [N, N, N m]
SEEN_HEADING = 6  # at the start of the period [rad]; NaN: as simulated
INPUT_HEADER = 7
# Of a wheel: u[INPUT_HEADER + wheel * INPUT_WHEEL + FIELD].
(
    SEEN_ANGLE,  # at the start of the period [rad]; NaN: as simulated
    RESISTING,  # torque that resists besides [N m]
    CONNECTED,  # share of the voltage that reaches the motor; 0: open terminals
    COUNTS,  # share of the encoder's counts that the driver sees
    FLOOR,  # factor of the grip
) = range(5)
INPUT_WHEEL = 5

# Outputs of one step: out[row + FIELD], means over it.
(
    OUT_VOLTAGE,  # of the supply [V]
    OUT_YAW,  # rad/s
) = range(2)
OUT_HEADER = 2
# Of a wheel: out[row + OUT_HEADER + wheel * OUT_WHEEL + FIELD].
(
    OUT_SPEED,  # rad/s
    OUT_POWER,  # drawn by the driver [W]
    OUT_TILT,  # its change from the step's start to its end [W]
    OUT_CURRENT,  # of the motor [A]
    OUT_COPPER,  # i^2 R [W]
    OUT_TORQUE,  # of the motor at the wheel [N m]
    OUT_GAP,  # sliding of the contact in the rolling direction [m/s]
    OUT_ASKED,  # speed that the driver is asked for [rad/s]
    OUT_SUM,  # of its errors [rad]
    OUT_SHOWN,  # speed as the encoder shows it [rad/s]
) = range(10)
OUT_WHEEL = 10

# Motion of the wheels, of which inverse dynamics computes the power: m[FIELD].
MOTION_YAW = 0  # of a gyro [rad/s]; NaN: as the wheels say
MOTION_HEADING = 1  # against the start [rad]; NaN: no floor's slope
MOTION_HEADER = 2
# Of a wheel: m[MOTION_HEADER + wheel * MOTION_WHEEL + FIELD].
(
    MOTION_SPEED,  # rad/s
    MOTION_ACCELERATION,  # rad/s^2
    MOTION_ANGLE,  # rad; NaN: not known
    MOTION_RESISTING,  # torque that resists besides [N m]
    MOTION_RISE,  # of the winding above 25 C [K]
    MOTION_VOLTAGE,  # that the driver holds, should the wheel be at rest [V]; NaN: not known
) = range(6)
MOTION_WHEEL = 6
# What comes of it, of a wheel: out[wheel * POWER_WHEEL + FIELD].
(
    POWER_TORQUE,  # of the motor at the wheel [N m]
    POWER_CURRENT,  # A
    POWER_VOLTAGE,  # at the terminals [V]
    POWER_DRAWN,  # from the supply [W]
    POWER_OBEYED,  # whether friction can hold a resting wheel against its driver's voltage
) = range(5)
POWER_WHEEL = 5


def state_size(wheels: int) -> int:
    """Numbers of a state."""
    return STATE_HEADER + wheels * STATE_WHEEL


def input_size(wheels: int) -> int:
    """Numbers of one period's inputs."""
    return INPUT_HEADER + wheels * INPUT_WHEEL


def output_size(wheels: int) -> int:
    """Numbers of one step's outputs."""
    return OUT_HEADER + wheels * OUT_WHEEL
