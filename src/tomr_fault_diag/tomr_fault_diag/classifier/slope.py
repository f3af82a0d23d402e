"""Residuals less what a slope does to them that an accelerometer feels.

On a slope the motors hand on more than the motion asks for, and the accelerometer feels exactly
that, and no push. So what it feels beyond the acceleration that the wheels show is no fault of a
motor, nor unknown. It is no slope where a wheel slides, and where an encoder is astray the wheels
do not show how the body moves.
"""

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.contacts import Contacts
from tomr_fault_diag.classifier.misfit import is_far
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import Tick
from tomr_fault_diag.residuals.frame import (
    BAND_SIGMAS,
    ENCODERS,
    MOTORS,
    SPEEDS,
    TOTAL,
    Residual,
    ResidualFrame,
)
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


def shows_motion(frame: ResidualFrame) -> bool:
    """Whether an accelerometer is heard, and wheels show how the body moves: no encoder is far off,
    and a gyro, if there is one, says the same."""
    is_far_off = any(is_far(frame.residuals[k]) for k in SPEEDS)
    return not (frame.along[0].stale or is_far_off or frame.yaw.code)


class SlopeFilter:
    """Takes a felt slope out of the residuals of a robot."""

    def __init__(self, robot: Robot) -> None:
        self._motors = Motors(robot)
        # Magnitudes of currents do not show which way a motor pushes.
        self._is_able = robot.measurement.signed

    def without(self, frame: ResidualFrame, contacts: Contacts) -> ResidualFrame:
        """The residuals of the same robot on a level floor; the frame itself where nothing is felt,
        or the wheels do not show the motion."""
        follows = shows_motion(frame) and not any(frame.residuals[k].code for k in SPEEDS)
        if not (self._is_able and contacts.grips and follows):
            return frame
        force = _plain(frame.along)
        tick = Tick.of(self._motors, frame, None) if force.any() else None
        if tick is None:
            return frame
        with np.errstate(over="ignore", invalid="ignore"):
            more = self._draws(tick, self._motors.per_newton @ np.array([*force, 0.0]))
        if not np.isfinite(more).all():
            return frame
        residuals = list(frame.residuals)
        for channels in (MOTORS, ENCODERS):
            for channel, explained in zip(channels, more.tolist(), strict=True):
                residuals[channel] = _less(residuals[channel], explained)
        if residuals[TOTAL].unit == residuals[MOTORS.start].unit:
            residuals[TOTAL] = _less(residuals[TOTAL], float(more.sum()))
        return evolve(frame, residuals=tuple(residuals))

    def _draws(self, tick: Tick, torque: Array) -> Array:
        """What motors draw more for torques beyond those of the motion [N m], in the unit of their
        residuals."""
        motors = self._motors
        amperes = torque / motors.constant
        if motors.reports_currents:
            return np.asarray(amperes)
        middle = tick.expected_current + 0.5 * amperes
        return np.asarray(motors.per_torque(tick.speed, middle) * torque)


def _plain(along: tuple[Residual, Residual]) -> Array:
    """What is felt beyond noise along x and y [m/s^2], (2,)."""
    force = np.array([item.residual for item in along])
    noise = max(item.band for item in along) / BAND_SIGMAS
    size = float(np.hypot(*force))
    return force * max(0.0, 1.0 - (noise / size) ** 2) if size > 0.0 else force


def _less(item: Residual, explained: float) -> Residual:
    return evolve(item, residual=item.residual - explained, modelled=item.modelled + explained)
