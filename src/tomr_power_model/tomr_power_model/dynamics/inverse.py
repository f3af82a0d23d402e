"""Inverse dynamics: the power of each drive from the motion of its wheels, in scalar Python.

    tau = K^-T (M nu' + c(nu) + drag - floor) + J omega' + friction
    i = tau / k,  v = R i + k omega,  P = supplied(v i) + driver losses

A wheel at rest may hold any torque up to its dry friction, which motion does not show: there dry
friction fades over STICKING_SPEED, unless the voltage that its driver holds is known.
"""

import math

from tomr_power_model.dynamics.contacts import STICKING_SLIDE, Mutable, Numbers, times
from tomr_power_model.dynamics.layout import (
    ALONG,
    AXLE_INERTIA,
    CENTER_X,
    CENTER_Y,
    CONSTANT,
    DRAG,
    FLOOR_X,
    FLOOR_Y,
    GEAR,
    HEADER,
    INERTIA,
    LOAD,
    LOAD_X,
    LOAD_Y,
    MASS,
    MOTION_ACCELERATION,
    MOTION_ANGLE,
    MOTION_HEADER,
    MOTION_HEADING,
    MOTION_RESISTING,
    MOTION_RISE,
    MOTION_SPEED,
    MOTION_VOLTAGE,
    MOTION_WHEEL,
    MOTION_YAW,
    NOMINAL_RADIUS,
    POWER_CURRENT,
    POWER_DRAWN,
    POWER_OBEYED,
    POWER_TORQUE,
    POWER_VOLTAGE,
    POWER_WHEEL,
    RADIUS,
    RESISTANCE,
    ROLLER_SLIP,
    ROTOR,
    STRIDE,
    TO_TWIST,
    VISCOUS,
)
from tomr_power_model.dynamics.step import (
    COPPER,
    driver_power,
    dry_torque,
    moving_torque,
    supplied,
)
from tomr_power_model.effects.base import Wheel

# Wheel speed below which dry friction fades instead of jumping with the encoder's noise [rad/s].
STICKING_SPEED = 0.1
OBEYED = 1.3  # of dry friction: a voltage that asks a resting wheel for more has no effect
MESHING_SWEEPS = 8  # at most, of friction that grows with the torque that the gear carries
SETTLED = 1e-6  # N m
NEWTON_STEPS = 8  # at most, from a power to its current
SMALL_CURRENT = 1e-3  # A, over which the slope of the power is taken
LEAST_REACH = 1e-3  # A^2: no nearer to the least power do steps begin, where it is flat
LEAST_SLOPE = 0.2  # W/A: a power that hardly depends on the current is no equation for it


def carried_force(
    p: Numbers, m: Numbers, n: int
) -> tuple[float, float, float, float, float, float, float, float]:
    """Force that the body's motion takes [N, N, N m], its twist, and how it leans [m/s^2]."""
    stride = int(p[STRIDE])
    vx = vy = wz = ax = ay = yaw = 0.0
    for i in range(n):
        w, a = HEADER + i * stride, MOTION_HEADER + i * MOTION_WHEEL
        speed, change = m[a + MOTION_SPEED], m[a + MOTION_ACCELERATION]
        vx += p[w + TO_TWIST] * speed
        vy += p[w + TO_TWIST + 1] * speed
        wz += p[w + TO_TWIST + 2] * speed
        ax += p[w + TO_TWIST] * change
        ay += p[w + TO_TWIST + 1] * change
        yaw += p[w + TO_TWIST + 2] * change
    if m[MOTION_YAW] == m[MOTION_YAW]:
        wz = m[MOTION_YAW]
    mass, x, y = p[MASS], p[CENTER_X], p[CENTER_Y]
    fx = times(p, INERTIA, ax, ay, yaw) - mass * wz * (vy + wz * x)
    fy = times(p, INERTIA + 3, ax, ay, yaw) + mass * wz * (vx - wz * y)
    mz = times(p, INERTIA + 6, ax, ay, yaw) + mass * wz * (x * vx + y * vy)
    heading = m[MOTION_HEADING]
    if heading == heading and (p[FLOOR_X] != 0.0 or p[FLOOR_Y] != 0.0):
        cos, sin = math.cos(heading), math.sin(heading)
        pull_x, pull_y = cos * p[FLOOR_X] + sin * p[FLOOR_Y], cos * p[FLOOR_Y] - sin * p[FLOOR_X]
        fx, fy, mz = fx - pull_x, fy - pull_y, mz - x * pull_y + y * pull_x
    return fx, fy, mz, vx, vy, wz, ax - wz * vy, ay + wz * vx


def needed_force(
    p: Numbers, m: Numbers, n: int
) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Force that the body's motion and its rollers' drag take [N, N, N m]; its lean [m/s^2]."""
    stride = int(p[STRIDE])
    fx, fy, mz, vx, vy, wz, along_x, along_y = carried_force(p, m, n)
    for i in range(n):
        w, a = HEADER + i * stride, MOTION_HEADER + i * MOTION_WHEEL
        if p[w + DRAG] > 0.0:
            load = max(p[w + LOAD] + p[w + LOAD_X] * along_x + p[w + LOAD_Y] * along_y, 0.0)
            along = times(p, w + ALONG, vx, vy, wz)
            across = p[w + ROLLER_SLIP] * m[a + MOTION_SPEED]
            sliding = math.sqrt(along * along + across * across)
            if sliding > 0.0:
                fade = math.tanh(sliding / STICKING_SLIDE) * along / sliding
                drag = p[w + DRAG] * load * fade
                fx += p[w + ALONG] * drag
                fy += p[w + ALONG + 1] * drag
                mz += p[w + ALONG + 2] * drag
    return (fx, fy, mz), (along_x, along_y)


def one_drive_power(p: Numbers, m: Numbers, out: Mutable, n: int, wheel: int) -> None:
    """`drive_power` of one wheel alone; what is written for the others stays."""
    force, lean = needed_force(p, m, n)
    drive_state(p, m, out, wheel, force, lean)


def drive_power(p: Numbers, m: Numbers, out: Mutable, n: int) -> None:
    """Torque, current, voltage and power of each drive from one row of motion."""
    force, lean = needed_force(p, m, n)
    for i in range(n):
        drive_state(p, m, out, i, force, lean)


def drive_state(
    p: Numbers,
    m: Numbers,
    out: Mutable,
    i: int,
    force: tuple[float, float, float],
    lean: tuple[float, float],
) -> None:
    """Torque, current, voltage and power of drive i, of what `needed_force` returns."""
    w, a, o = HEADER + i * int(p[STRIDE]), MOTION_HEADER + i * MOTION_WHEEL, i * POWER_WHEEL
    speed = m[a + MOTION_SPEED]
    carried = times(p, w + TO_TWIST, force[0], force[1], force[2])
    carried += p[w + AXLE_INERTIA] * m[a + MOTION_ACCELERATION]
    load = max(p[w + LOAD] + p[w + LOAD_X] * lean[0] + p[w + LOAD_Y] * lean[1], 0.0)
    k, hot = p[w + CONSTANT], p[w + RESISTANCE] * (1.0 + COPPER * m[a + MOTION_RISE])
    carried += p[w + VISCOUS] * speed + m[a + MOTION_RESISTING]
    moves, held = math.tanh(speed / STICKING_SPEED), m[a + MOTION_VOLTAGE]
    torque = carried
    for _ in range(MESHING_SWEEPS):  # the gear carries what friction at the axle takes as well
        before = torque
        gear = before - p[w + ROTOR] * m[a + MOTION_ACCELERATION]
        wheel = Wheel(speed, load, gear, m[a + MOTION_ANGLE], p[w + NOMINAL_RADIUS], p[w + GEAR])
        dry, free = max(dry_torque(p, w, wheel), 0.0), carried + moving_torque(p, w, wheel)
        rests, obeyed = 0.0, 1.0
        if held == held:
            hold = k / hot * held - free
            # A driver that asks for more than friction holds is not obeyed: nothing is known.
            if abs(hold) < OBEYED * dry:
                rests = (1.0 - abs(moves)) * min(max(hold, -dry), dry)
            else:
                obeyed = 0.0
        torque = free + dry * moves + rests
        if abs(torque - before) < SETTLED:
            break
    current = torque / k
    volts = hot * current + k * speed
    out[o + POWER_TORQUE] = torque
    out[o + POWER_CURRENT] = current
    out[o + POWER_VOLTAGE] = volts
    out[o + POWER_DRAWN] = supplied(p, w, volts * current) + driver_power(p, w, current)
    out[o + POWER_OBEYED] = obeyed


def drive_powers(p: Numbers, motion: Mutable, out: Mutable, n: int) -> None:
    """`drive_power` of many rows; p one robot, motion (rows, ..), out (rows, ..)."""
    for row in range(len(motion)):
        drive_power(p, motion[row], out[row], n)


def wheel_at(p: Numbers, m: Numbers, w: int, a: int) -> Wheel:
    """What friction may depend on, of a wheel that moves as measured, its gear unloaded."""
    speed = m[a + MOTION_SPEED]
    return Wheel(speed, p[w + LOAD], 0.0, m[a + MOTION_ANGLE], p[w + NOMINAL_RADIUS], p[w + GEAR])


def motor_currents(p: Numbers, m: Numbers, drawn: Numbers, out: Mutable, n: int) -> None:
    """The two currents that each motor may carry at a measured power [W]: out[2 i], out[2 i + 1].

    Newton's steps from what a motor and driver without losses would carry, either side of the
    current at which the power is least, where both meet should less than that have been measured.
    """
    stride = int(p[STRIDE])
    for i in range(n):
        w, a = HEADER + i * stride, MOTION_HEADER + i * MOTION_WHEEL
        back = p[w + CONSTANT] * m[a + MOTION_SPEED]
        hot = p[w + RESISTANCE] * (1.0 + COPPER * m[a + MOTION_RISE])
        least = -0.5 * back / hot
        over = least * least + (drawn[i] - driver_power(p, w, 0.0)) / hot
        reach = math.sqrt(max(over, LEAST_REACH))
        for side in range(2):
            way = 2.0 * side - 1.0
            current = least + way * reach
            for _ in range(NEWTON_STEPS):
                power = supplied(p, w, (hot * current + back) * current)
                power += driver_power(p, w, current)
                more = current + way * SMALL_CURRENT
                above = supplied(p, w, (hot * more + back) * more) + driver_power(p, w, more)
                slope = way * max((above - power) / SMALL_CURRENT, LEAST_SLOPE)
                before = current
                current += (drawn[i] - power) / slope
                current = way * max(way * current, way * least)
                if abs(current - before) < SMALL_CURRENT:
                    break
            out[2 * i + side] = current


def tractions(p: Numbers, m: Numbers, current: Numbers, out: Mutable, n: int) -> None:
    """Force of each contact [N] and the part that dry friction leaves open [N], wheel by wheel."""
    stride = int(p[STRIDE])
    for i in range(n):
        w, a = HEADER + i * stride, MOTION_HEADER + i * MOTION_WHEEL
        speed, wheel = m[a + MOTION_SPEED], wheel_at(p, m, w, a)
        dry, moves = max(dry_torque(p, w, wheel), 0.0), math.tanh(speed / STICKING_SPEED)
        torque = p[w + CONSTANT] * current[i] - p[w + VISCOUS] * speed - dry * moves
        torque -= moving_torque(p, w, wheel) + p[w + AXLE_INERTIA] * m[a + MOTION_ACCELERATION]
        out[2 * i], out[2 * i + 1] = (
            torque / p[w + RADIUS],
            dry * (1.0 - abs(moves)) / p[w + RADIUS],
        )
