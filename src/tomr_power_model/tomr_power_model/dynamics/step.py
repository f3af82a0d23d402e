"""One period of the drivers, in scalar Python that numba compiles as it stands.

Driver, once a period:

    command, ramped  -> twist set point;  e = K_driver twist - omega_measured
    v = k_p e + k_i sum(e) h, within +-V, held over the period; the bus sags with the last current

Plant, in steps h of the period. While all wheels roll, omega = K nu and the body's twist nu is all:

    M_w nu' = K^T (k/R v - D omega - moving) - c(nu) - drag + floor - S^T f,   M_w = M + K^T J K
    nu+ = E nu + G (..) - G S^T f,    E = exp(-h M_w^-1 K^T D K),  G = int_0^h e^.. M_w^-1 dt

f holds dry friction at the axles and the forces along the rollers' free directions: within its
limit each brings its own rate S nu to rest if it can (Coulomb's law as a complementarity problem,
solved by projected Gauss-Seidel from the last step's forces), so that wheels stick at standstill.

Where a wheel slides, `contacts.slide` integrates body and wheels apart. The names `dry_torque`,
`moving_torque`, `supplied` and `driver_power` are bound by `binding` to the laws of the effects;
here they stand for a robot without any.
"""

import math

from tomr_power_model.dynamics.contacts import (
    STICKING_SLIDE,
    Mutable,
    Numbers,
    body_force,
    contacts,
    slide,
    times,
    too_much,
)
from tomr_power_model.dynamics.layout import (
    ALONG,
    ANGLE,
    ASK,
    ASKED,
    AUXILIARY,
    BACKWARD,
    COMMAND,
    CONNECTED,
    CONSTANT,
    CONTINUOUS,
    COUNTED,
    COUNTS,
    DECAY,
    DRAG,
    DRAGS,
    DRAWN,
    DRY,
    ENCODER_COSINE,
    ENCODER_SCALE,
    ENCODER_SINE,
    GAIN,
    GAP,
    GEAR,
    HEADER,
    HEADING,
    HEATS,
    HOT,
    INPUT_HEADER,
    INPUT_WHEEL,
    INTEGRAL,
    INTEGRAL_GAIN,
    LEANS,
    LINEAR_STEP,
    LOAD,
    LOAD_X,
    LOAD_Y,
    MEAN,
    MEASURED,
    NEXT,
    NOMINAL_RADIUS,
    OUT_ASKED,
    OUT_COPPER,
    OUT_CURRENT,
    OUT_GAP,
    OUT_HEADER,
    OUT_POWER,
    OUT_SHOWN,
    OUT_SPEED,
    OUT_SUM,
    OUT_TILT,
    OUT_TORQUE,
    OUT_VOLTAGE,
    OUT_WHEEL,
    OUT_YAW,
    PERIOD,
    PROPORTIONAL,
    QUANTUM,
    RATE,
    RESISTANCE,
    RESISTING,
    RISE,
    ROLL,
    ROLLER_SLIP,
    ROTOR,
    SAG,
    SEEN_ANGLE,
    SEEN_HEADING,
    SET,
    SHOWN,
    SIDE_LIMIT,
    SLIDES,
    SLIDING,
    SPEED,
    STATE_HEADER,
    STATE_WHEEL,
    STEP,
    STRIDE,
    SUBSTEPS,
    THERMAL_KEEP,
    THERMAL_RESISTANCE,
    TORQUE,
    TRANSMITTED,
    TURNED,
    TWIST,
    VOLTAGE,
    VOLTS,
    WHEEL_LOAD,
    YAW_MEAN,
    YAW_STEP,
)
from tomr_power_model.effects.base import Wheel

COPPER = 0.00393  # 1/K, growth of the winding resistance


def dry_torque(p: Numbers, at: int, wheel: Wheel) -> float:
    """Limit of dry friction at a wheel [N m]."""
    return 0.0


def moving_torque(p: Numbers, at: int, wheel: Wheel) -> float:
    """Torque that resists positive motion, neither dry nor viscous [N m]."""
    return 0.0


def supplied(p: Numbers, at: int, power: float) -> float:
    """Power at the supply from that at the terminals [W]."""
    return power


def driver_power(p: Numbers, at: int, current: float) -> float:
    """Power lost in the driver [W]."""
    return 0.0


def advance(p: Numbers, s: Mutable, u: Numbers, out: Mutable, n: int) -> None:
    """One period of the drivers: the state `s` goes on, `out` gets its steps' means."""
    control(p, s, u, n)
    stride, width = int(p[STRIDE]), OUT_HEADER + n * OUT_WHEEL
    steps = int(p[SUBSTEPS])
    if u[SEEN_HEADING] == u[SEEN_HEADING]:
        s[HEADING] = u[SEEN_HEADING]
    for i in range(n):
        seen = u[INPUT_HEADER + i * INPUT_WHEEL + SEEN_ANGLE]
        if seen == seen:
            s[STATE_HEADER + i * STATE_WHEEL + ANGLE] = seen
        s[STATE_HEADER + i * STATE_WHEEL + MEASURED] = 0.0
    drawn = 0.0
    for k in range(steps):
        substep(p, s, u, n)
        drawn += report(p, s, u, out, k * width, n)
    # Half of what was drawn before: a sag answered a period late would ring where it is large.
    s[DRAWN] = 0.5 * (s[DRAWN] + supply_current(p, drawn / steps + p[AUXILIARY]))
    for k in range(steps):
        out[k * width + OUT_VOLTAGE] = p[VOLTAGE] - p[SAG] * s[DRAWN]
    for i in range(n):
        z, w = STATE_HEADER + i * STATE_WHEEL, HEADER + i * stride
        turned = s[z + MEASURED] * u[INPUT_HEADER + i * INPUT_WHEEL + COUNTS]
        s[z + TURNED] += turned
        quantum = p[w + QUANTUM]
        if quantum > 0.0:
            counted = quantum * math.floor(s[z + TURNED] / quantum + 0.5)
            turned = counted - s[z + COUNTED]
            s[z + COUNTED] = counted
        if p[CONTINUOUS] > 0.0:
            s[z + MEASURED] = s[z + SHOWN]
        else:
            s[z + MEASURED] = turned / p[PERIOD]


def shown(p: Numbers, w: int, angle: float) -> float:
    """Speed that a wheel's encoder shows, per speed, where it shows an angle [rad].

    Where the angle is not known its disc is taken for centred.
    """
    x, y = p[w + ENCODER_COSINE], p[w + ENCODER_SINE]
    if (x != 0.0 or y != 0.0) and angle == angle:
        return p[w + ENCODER_SCALE] / (1.0 + x * math.cos(angle) + y * math.sin(angle))
    return p[w + ENCODER_SCALE]


def supply_current(p: Numbers, power: float) -> float:
    """Current I of the whole robot [A] that draws a power: I (V - R I) = P, at most at V / 2."""
    volts, sag = p[VOLTAGE], p[SAG]
    power = min(power, 0.25 * volts * volts / sag) if sag > 0.0 else power
    return 2.0 * power / (volts + math.sqrt(max(volts * volts - 4.0 * sag * power, 0.0)))


def control(p: Numbers, s: Mutable, u: Numbers, n: int) -> None:
    """Ramp the set point and find the voltages of the period."""
    dx, dy = u[COMMAND] - s[SET], u[COMMAND + 1] - s[SET + 1]
    length = math.sqrt(dx * dx + dy * dy)
    part = p[LINEAR_STEP] / length if length > p[LINEAR_STEP] else 1.0
    vx = s[SET] = s[SET] + part * dx
    vy = s[SET + 1] = s[SET + 1] + part * dy
    yaw = p[YAW_STEP]
    wz = s[SET + 2] = s[SET + 2] + min(max(u[COMMAND + 2] - s[SET + 2], -yaw), yaw)
    stride, most = int(p[STRIDE]), p[VOLTAGE]
    share = 1.0 - p[SAG] * s[DRAWN] / most
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        s[z + ASKED] = times(p, w + ASK, vx, vy, wz)
        error = s[z + ASKED] - s[z + MEASURED]
        total = s[z + INTEGRAL] + error * p[PERIOD]
        summed = total if p[BACKWARD] > 0.0 else s[z + INTEGRAL]
        wanted = p[PROPORTIONAL] * error + p[INTEGRAL_GAIN] * summed
        volts = min(max(wanted, -most), most)
        if volts == wanted:  # in saturation it does not wind up
            s[z + INTEGRAL] = total
        s[z + VOLTS] = volts * share * u[INPUT_HEADER + i * INPUT_WHEEL + CONNECTED]
        if p[CONTINUOUS] > 0.0:  # what it takes back while the wheel speeds up is in the damping
            s[z + VOLTS] += p[PROPORTIONAL] * s[z + SPEED]


def substep(p: Numbers, s: Mutable, u: Numbers, n: int) -> None:
    """Advance body and wheels by one step."""
    if p[LEANS] > 0.0:
        lean(p, s, n)
    torques(p, s, u, n)
    vx, vy, wz = s[TWIST], s[TWIST + 1], s[TWIST + 2]
    fx, fy, mz = body_force(p, s, u, vx, vy, wz)
    stride = int(p[STRIDE])
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        torque = s[z + TORQUE]
        fx += p[w + ROLL] * torque
        fy += p[w + ROLL + 1] * torque
        mz += p[w + ROLL + 2] * torque
        if p[DRAGS] > 0.0:
            along = times(p, w + ALONG, vx, vy, wz)
            across = p[w + ROLLER_SLIP] * s[z + SPEED]
            sliding = math.sqrt(along * along + across * across)
            if sliding > 0.0:
                drag = s[z + SIDE_LIMIT] * math.tanh(sliding / STICKING_SLIDE) * along / sliding
                fx -= p[w + ALONG] * drag
                fy -= p[w + ALONG + 1] * drag
                mz -= p[w + ALONG + 2] * drag
    e, g = DECAY, GAIN
    x = p[e] * vx + p[e + 1] * vy + p[e + 2] * wz + p[g] * fx + p[g + 1] * fy + p[g + 2] * mz
    y = p[e + 3] * vx + p[e + 4] * vy + p[e + 5] * wz
    y += p[g + 3] * fx + p[g + 4] * fy + p[g + 5] * mz
    yaw = p[e + 6] * vx + p[e + 7] * vy + p[e + 8] * wz
    yaw += p[g + 6] * fx + p[g + 7] * fy + p[g + 8] * mz
    x, y, yaw = contacts(p, s, n, x, y, yaw)
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        s[z + NEXT] = times(p, w + ROLL, x, y, yaw)
        s[z + MEAN] = 0.5 * (s[z + SPEED] + s[z + NEXT])
        s[z + GAP] = 0.0
    s[YAW_MEAN] = 0.5 * (wz + yaw)
    if p[SLIDES] > 0.0 and (s[SLIDING] > 0.0 or too_much(p, s, u, n)):
        slide(p, s, u, n)
        x, y, yaw = s[RATE], s[RATE + 1], s[RATE + 2]
    else:
        s[SLIDING] = 0.0
    rate = 1.0 / p[STEP]
    s[RATE], s[RATE + 1], s[RATE + 2] = rate * (x - vx), rate * (y - vy), rate * (yaw - wz)
    s[TWIST], s[TWIST + 1], s[TWIST + 2] = x, y, yaw
    s[HEADING] += s[YAW_MEAN] * p[STEP]


def lean(p: Numbers, s: Mutable, n: int) -> None:
    """Loads of the wheels [N]: speeding up leans on the wheels behind."""
    wz = s[TWIST + 2]
    along_x, along_y = s[RATE] - wz * s[TWIST + 1], s[RATE + 1] + wz * s[TWIST]
    stride = int(p[STRIDE])
    for i in range(n):
        w = HEADER + i * stride
        load = p[w + LOAD] + p[w + LOAD_X] * along_x + p[w + LOAD_Y] * along_y
        s[STATE_HEADER + i * STATE_WHEEL + WHEEL_LOAD] = max(load, 0.0)


def torques(p: Numbers, s: Mutable, u: Numbers, n: int) -> None:
    """Torques of the motors and limits of friction, wheel by wheel."""
    stride = int(p[STRIDE])
    back = p[PROPORTIONAL] if p[CONTINUOUS] > 0.0 else 0.0
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        a = INPUT_HEADER + i * INPUT_WHEEL
        speed, k, cold = s[z + SPEED], p[w + CONSTANT], p[w + RESISTANCE]
        wheel = Wheel(
            speed,
            s[z + WHEEL_LOAD],
            s[z + TRANSMITTED],
            s[z + ANGLE],
            p[w + NOMINAL_RADIUS],
            p[w + GEAR],
        )
        s[z + DRY] = max(dry_torque(p, w, wheel), 0.0)
        torque = -moving_torque(p, w, wheel) - u[a + RESISTING]
        hot = cold
        if p[HEATS] > 0.0:
            hot = cold * (1.0 + COPPER * s[z + RISE])
        s[z + HOT] = hot
        conducting = 1.0 if u[a + CONNECTED] > 0.0 else 0.0
        # The discretised damping is that of connected, cold windings: what is less is given back.
        less = k * (k + back) * (1.0 / cold - conducting / hot)
        ahead = 2.0 * speed - s[z + MEAN]  # in the middle of this step, as the last one went on
        s[z + TORQUE] = torque + conducting * k / hot * s[z + VOLTS] + less * ahead
        s[z + SIDE_LIMIT] = p[w + DRAG] * s[z + WHEEL_LOAD]


def report(p: Numbers, s: Mutable, u: Numbers, out: Mutable, row: int, n: int) -> float:
    """Write a step's means and let it pass; returns the power drawn by all drivers [W]."""
    stride, duration = int(p[STRIDE]), p[STEP]
    back = p[PROPORTIONAL] if p[CONTINUOUS] > 0.0 else 0.0
    total = 0.0
    out[row + OUT_YAW] = s[YAW_MEAN]
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        o = row + OUT_HEADER + i * OUT_WHEEL
        conducting = 1.0 if u[INPUT_HEADER + i * INPUT_WHEEL + CONNECTED] > 0.0 else 0.0
        k, hot, mean = p[w + CONSTANT], s[z + HOT], s[z + MEAN]
        volts = s[z + VOLTS] - back * mean
        current = conducting * (volts - k * mean) / hot
        at_start = conducting * (volts - k * s[z + SPEED]) / hot
        at_end = 2.0 * current - at_start
        first = supplied(p, w, volts * at_start) + driver_power(p, w, at_start)
        last = supplied(p, w, volts * at_end) + driver_power(p, w, at_end)
        power = 0.5 * (first + last)
        total += power
        copper = hot * current * current
        out[o + OUT_SPEED] = mean
        out[o + OUT_POWER] = power
        out[o + OUT_TILT] = last - first
        out[o + OUT_CURRENT] = current
        out[o + OUT_COPPER] = copper
        out[o + OUT_TORQUE] = k * current
        out[o + OUT_GAP] = s[z + GAP]
        out[o + OUT_ASKED] = s[z + ASKED]
        out[o + OUT_SUM] = s[z + INTEGRAL]
        per_turn = shown(p, w, s[z + ANGLE])
        out[o + OUT_SHOWN] = per_turn * mean
        s[z + TRANSMITTED] = k * current - p[w + ROTOR] * (s[z + NEXT] - s[z + SPEED]) / duration
        s[z + SPEED] = s[z + NEXT]
        s[z + SHOWN] = per_turn * s[z + NEXT]
        s[z + ANGLE] += per_turn * mean * duration
        s[z + MEASURED] += per_turn * mean * duration  # of the period so far, as an angle
        if p[HEATS] > 0.0:
            settled = p[w + THERMAL_RESISTANCE] * copper
            s[z + RISE] = settled + p[w + THERMAL_KEEP] * (s[z + RISE] - settled)
    return total
