"""Forces at the axles and contacts: what holds, what drags, and what happens where wheels slide.

A wheel slides where rolling would take more traction than friction times load. Body and wheels are
then integrated apart, in parts of a step, until all roll again:

    J omega' = torque - friction - r F,   M nu' = D^T F - c(nu) - drag + floor,   |F_i| <= mu_i N_i
"""

import math
from collections.abc import Sequence
from typing import Any

from tomr_power_model.dynamics.layout import (
    ALONG,
    AXLE_INERTIA,
    AXLE_RATE,
    CENTER_X,
    CENTER_Y,
    COUPLING,
    DAMPING,
    DRY,
    FIRST,
    FLOOR,
    FLOOR_X,
    FLOOR_Y,
    FORCE,
    FROM_ROLL,
    GAP,
    GRIP,
    HEADER,
    HEADING,
    HELD,
    HOLDS,
    INPUT_HEADER,
    INPUT_WHEEL,
    MASS,
    MEAN,
    MOBILITY,
    NEXT,
    PULL,
    PUSH,
    RADIUS,
    RATE,
    ROLL,
    SIDE_LIMIT,
    SIDE_RATE,
    SLIDING,
    SLIDING_DECAY,
    SLIDING_GAIN,
    SLIDING_OWN,
    SPEED,
    STATE_HEADER,
    STATE_WHEEL,
    STEP,
    STRIDE,
    TORQUE,
    TRACTION,
    TWIST,
    WHEEL_LOAD,
    YAW_MEAN,
)

Numbers = Sequence[float]
Mutable = Any  # a list of floats, or an array

# Sliding along the free direction below which drag fades where it is not solved for [m/s].
STICKING_SLIDE = 0.005
SWEEPS = 2  # of Gauss-Seidel; the last step's forces are the first guess
SLIDING_PARTS = 3  # of a step while a wheel slides
SLIDING_SWEEPS = 4
ROLLS = 1e-4  # m/s: slower than this a wheel does not slide


def times(p: Numbers, row: int, x: float, y: float, yaw: float) -> float:
    """A row of three of the robot's numbers times a twist, or a force."""
    return p[row] * x + p[row + 1] * y + p[row + 2] * yaw


def body_force(
    p: Numbers, s: Numbers, u: Numbers, vx: float, vy: float, wz: float
) -> tuple[float, float, float]:
    """Force on the body besides its wheels' [N, N, N m]: -c(nu), the floor's slope, pushes."""
    m, x, y = p[MASS], p[CENTER_X], p[CENTER_Y]
    fx = m * wz * (vy + wz * x)
    fy = -m * wz * (vx - wz * y)
    mz = -m * wz * (x * vx + y * vy) + u[PUSH + 2]
    world_x, world_y = p[FLOOR_X] + u[PUSH], p[FLOOR_Y] + u[PUSH + 1]
    if world_x != 0.0 or world_y != 0.0:
        cos, sin = math.cos(s[HEADING]), math.sin(s[HEADING])
        fx += cos * world_x + sin * world_y
        fy += cos * world_y - sin * world_x
        # The slope pulls at the mass centre, which need not be the middle.
        pull_x = cos * p[FLOOR_X] + sin * p[FLOOR_Y]
        pull_y = cos * p[FLOOR_Y] - sin * p[FLOOR_X]
        mz += x * pull_y - y * pull_x
    return fx, fy, mz


def held_twist(
    p: Numbers, s: Mutable, n: int, x: float, y: float, yaw: float
) -> tuple[float, float, float]:
    """Twist with the last step's forces; leaves the rates that they act against."""
    stride = int(p[STRIDE])
    rows = 2 if p[HOLDS] > 0.0 else 1
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        for part in range(rows):  # at the axle, then along the rollers
            held, way = s[z + HELD + part], w + FROM_ROLL + 3 * part
            x -= p[way] * held
            y -= p[way + 1] * held
            yaw -= p[way + 2] * held
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        s[z + AXLE_RATE] = times(p, w + ROLL, x, y, yaw)
        if rows > 1:
            s[z + SIDE_RATE] = times(p, w + ALONG, x, y, yaw)
    return x, y, yaw


def contacts(
    p: Numbers, s: Mutable, n: int, x: float, y: float, yaw: float
) -> tuple[float, float, float]:
    """Twist after dry friction, from the twist without it; finds the forces that hold."""
    stride = int(p[STRIDE])
    rows = 2 if p[HOLDS] > 0.0 else 1
    x, y, yaw = held_twist(p, s, n, x, y, yaw)
    first = int(p[COUPLING])
    for _ in range(SWEEPS):
        for part in range(rows):
            for i in range(n):
                z = STATE_HEADER + i * STATE_WHEEL
                row = first + (part * n + i) * 2 * n
                before, limit = s[z + HELD + part], s[z + DRY + part]
                wanted = before + s[z + AXLE_RATE + part] / p[row + part * n + i]
                force = min(max(wanted, -limit), limit)
                change = force - before
                if change == 0.0:
                    continue
                s[z + HELD + part] = force
                w = HEADER + i * stride
                way = w + FROM_ROLL + 3 * part
                x -= p[way] * change
                y -= p[way + 1] * change
                yaw -= p[way + 2] * change
                for j in range(n):
                    other = STATE_HEADER + j * STATE_WHEEL
                    for acted in range(rows):
                        s[other + AXLE_RATE + acted] -= p[row + acted * n + j] * change
    return x, y, yaw


def grip_of(p: Numbers, s: Numbers, u: Numbers, i: int) -> float:
    """Most traction of wheel i [N]."""
    grip = p[HEADER + i * int(p[STRIDE]) + GRIP] * u[INPUT_HEADER + i * INPUT_WHEEL + FLOOR]
    return grip * s[STATE_HEADER + i * STATE_WHEEL + WHEEL_LOAD]


def gap_of(p: Numbers, s: Numbers, i: int, x: float, y: float, yaw: float) -> float:
    """Sliding of wheel i in its rolling direction, should it turn on at NEXT [m/s]."""
    w = HEADER + i * int(p[STRIDE])
    rolling = times(p, w + ROLL, x, y, yaw)
    return p[w + RADIUS] * (s[STATE_HEADER + i * STATE_WHEEL + NEXT] - rolling)


def too_much(p: Numbers, s: Numbers, u: Numbers, n: int) -> bool:
    """Whether rolling takes more traction than a contact can give."""
    stride = int(p[STRIDE])
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        speeding = p[w + AXLE_INERTIA] * (s[z + NEXT] - s[z + SPEED]) / p[STEP]
        torque = s[z + TORQUE] - p[w + DAMPING] * s[z + MEAN] - s[z + HELD] - speeding
        if abs(torque) > grip_of(p, s, u, i) * p[w + RADIUS]:
            return True
    return False


def slide(p: Numbers, s: Mutable, u: Numbers, n: int) -> None:
    """A step of body and wheels apart; leaves the twist after it in RATE."""
    for i in range(n):
        z = STATE_HEADER + i * STATE_WHEEL
        s[z + NEXT], s[z + MEAN], s[z + GAP] = s[z + SPEED], 0.0, 0.0
        s[z + HELD] = 0.0
    x, y, yaw = s[TWIST], s[TWIST + 1], s[TWIST + 2]
    mean_yaw = 0.0
    for _ in range(SLIDING_PARTS):
        before = yaw
        x, y, yaw = slide_part(p, s, u, n, x, y, yaw)
        mean_yaw += 0.5 / SLIDING_PARTS * (before + yaw)
        for i in range(n):
            z = STATE_HEADER + i * STATE_WHEEL
            s[z + MEAN] += 0.5 / SLIDING_PARTS * (s[z + FIRST] + s[z + NEXT])
    slides = 0.0
    for i in range(n):
        z = STATE_HEADER + i * STATE_WHEEL
        s[z + GAP] = gap_of(p, s, i, x, y, yaw)
        if abs(s[z + GAP]) > ROLLS:
            slides = 1.0
    s[SLIDING], s[YAW_MEAN] = slides, mean_yaw
    s[RATE], s[RATE + 1], s[RATE + 2] = x, y, yaw


def slide_part(
    p: Numbers, s: Mutable, u: Numbers, n: int, x: float, y: float, yaw: float
) -> tuple[float, float, float]:
    """A part of a step of body and wheels apart; returns the twist after it."""
    stride, h = int(p[STRIDE]), p[STEP] / SLIDING_PARTS
    fx, fy, mz = body_force(p, s, u, x, y, yaw)
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        s[z + FIRST] = s[z + NEXT]
        free = p[w + SLIDING_GAIN] * (s[z + TORQUE] - s[z + HELD])
        s[z + NEXT] = p[w + SLIDING_DECAY] * s[z + NEXT] + free
        drag = s[z + SIDE_LIMIT] * math.tanh(times(p, w + ALONG, x, y, yaw) / STICKING_SLIDE)
        fx -= p[w + ALONG] * drag
        fy -= p[w + ALONG + 1] * drag
        mz -= p[w + ALONG + 2] * drag
    x += h * times(p, MOBILITY, fx, fy, mz)
    y += h * times(p, MOBILITY + 3, fx, fy, mz)
    yaw += h * times(p, MOBILITY + 6, fx, fy, mz)
    inverse = int(p[TRACTION])
    for i in range(n):
        s[STATE_HEADER + i * STATE_WHEEL + GAP] = gap_of(p, s, i, x, y, yaw)
    for i in range(n):  # all at once as if none slid, then one after the other within its limit
        z = STATE_HEADER + i * STATE_WHEEL
        force = 0.0
        for j in range(n):
            force += p[inverse + i * n + j] * s[STATE_HEADER + j * STATE_WHEEL + GAP]
        s[z + FORCE] = force
    for sweep in range(SLIDING_SWEEPS):
        for i in range(n):
            w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
            grip, gain = grip_of(p, s, u, i), p[w + SLIDING_GAIN]
            wanted, before = s[z + FORCE], 0.0
            if sweep > 0:
                before = wanted
                wanted = before + gap_of(p, s, i, x, y, yaw) / p[w + SLIDING_OWN]
            force = min(max(wanted, -grip), grip)
            s[z + FORCE] = force
            change = force - before
            x += p[w + PULL] * change
            y += p[w + PULL + 1] * change
            yaw += p[w + PULL + 2] * change
            s[z + NEXT] -= gain * p[w + RADIUS] * change
            held = min(max(s[z + HELD] + s[z + NEXT] / gain, -s[z + DRY]), s[z + DRY])
            s[z + NEXT] -= gain * (held - s[z + HELD])
            s[z + HELD] = held
    return x, y, yaw
