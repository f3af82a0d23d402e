"""The state with which a simulation begins: at rest, or driving on steadily."""

import math

from tomr_power_model.dynamics.contacts import Mutable, Numbers, times
from tomr_power_model.dynamics.inverse import drive_power
from tomr_power_model.dynamics.layout import (
    ANGLE,
    AUXILIARY,
    COUNTED,
    DRAWN,
    HEADER,
    HEADING,
    INITIAL_RISE,
    INTEGRAL,
    INTEGRAL_GAIN,
    LOAD,
    MEAN,
    MEASURED,
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
    POWER_DRAWN,
    POWER_VOLTAGE,
    POWER_WHEEL,
    RATE,
    RISE,
    ROLL,
    SAG,
    SET,
    SHOWN,
    SPEED,
    STATE_HEADER,
    STATE_WHEEL,
    STRIDE,
    TURNED,
    TWIST,
    VOLTAGE,
    WHEEL_LOAD,
)
from tomr_power_model.dynamics.step import shown, supply_current


def begin(p: Numbers, s: Mutable, motion: Mutable, power: Mutable, n: int) -> None:
    """Complete a state of which TWIST, RATE, HEADING and the wheels' ANGLE are given.

    Its drivers' sums hold that motion, the supply sags with it, the set point is its twist.
    `motion` and `power` are scratch, as long as a motion and its power are.
    """
    stride = int(p[STRIDE])
    motion[MOTION_YAW], motion[MOTION_HEADING] = math.nan, s[HEADING]
    for i in range(n):
        w, z = HEADER + i * stride, STATE_HEADER + i * STATE_WHEEL
        a = MOTION_HEADER + i * MOTION_WHEEL
        speed = times(p, w + ROLL, s[TWIST], s[TWIST + 1], s[TWIST + 2])
        change = times(p, w + ROLL, s[RATE], s[RATE + 1], s[RATE + 2])
        seen = shown(p, w, s[z + ANGLE]) * speed
        s[z + SPEED], s[z + MEAN], s[z + MEASURED], s[z + SHOWN] = speed, speed, seen, seen
        s[z + RISE] = p[w + INITIAL_RISE]
        s[z + WHEEL_LOAD], s[z + TURNED], s[z + COUNTED] = p[w + LOAD], 0.0, 0.0
        motion[a + MOTION_SPEED], motion[a + MOTION_ACCELERATION] = speed, change
        motion[a + MOTION_ANGLE], motion[a + MOTION_RESISTING] = s[z + ANGLE], 0.0
        motion[a + MOTION_RISE], motion[a + MOTION_VOLTAGE] = p[w + INITIAL_RISE], math.nan
    drive_power(p, motion, power, n)
    drawn = p[AUXILIARY]
    for i in range(n):
        drawn += power[i * POWER_WHEEL + POWER_DRAWN]
    s[DRAWN] = supply_current(p, drawn)
    share = 1.0 - p[SAG] * s[DRAWN] / p[VOLTAGE]
    for i in range(n):
        z = STATE_HEADER + i * STATE_WHEEL
        volts = power[i * POWER_WHEEL + POWER_VOLTAGE] / share
        s[z + INTEGRAL] = volts / p[INTEGRAL_GAIN] if p[INTEGRAL_GAIN] > 0.0 else 0.0
    for k in range(3):
        s[SET + k] = s[TWIST + k]
