"""What the measures look at: one tick in powers, currents and speeds."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.body import Body
from tomr_power_model.dynamics.numbers import laid_out, wheel_records
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

MOVES = 0.5  # rad/s
NEXT = to_ns(0.3)  # the longest from one tick to the next
_UNKNOWN = float("nan")


class Motors:
    """What the measures need to know of a robot."""

    def __init__(self, robot: Robot) -> None:
        numbers = laid_out(vehicle_of(robot))
        wheels = wheel_records(numbers)
        self.constant = wheels[:, at.CONSTANT]  # N m/A at the wheel
        self.resistance = wheels[:, at.RESISTANCE]  # ohm
        self.load = wheels[:, at.LOAD]  # N
        self.radius = wheels[:, at.RADIUS]  # m
        self.voltage = robot.supply.nominal_voltage
        self.reports_currents = robot.measurement.quantity == "motor_current"
        self.reports_signs = robot.measurement.signed
        body = Body.of(robot)
        self.to_twist = body.to_twist
        self.to_force = np.linalg.pinv(body.from_force)  # wheel torques to the body's force
        self._numbers = numbers.tolist()
        self._laws = plain(tuple(robot.physics))
        self.mass = body.mass  # kg
        self.idle = self._idle()  # W

    def friction(self, speed: float) -> Array:
        """Of each axle at a speed [N m]."""
        still = np.zeros(WHEELS)
        return self.radius * np.abs(self.forces(still, still + speed, still))

    def _idle(self) -> Array:
        """What drivers draw that feed no motor."""
        out = [0.0] * (WHEELS * at.POWER_WHEEL)
        still = np.zeros(WHEELS)
        self._laws.drive_power(self._numbers, _motion(still, still), out, WHEELS)
        return np.array(out[at.POWER_DRAWN :: at.POWER_WHEEL])

    def currents(self, power: Array, speed: Array, way: Array) -> Array:
        """That drive the wheels forwards or backwards [A], of powers [W] at speeds [rad/s]."""
        both = [0.0] * (2 * WHEELS)
        motion = _motion(speed, np.zeros(WHEELS))
        self._laws.motor_currents(self._numbers, motion, power.tolist(), both, WHEELS)
        return np.where(way < 0.0, both[::2], both[1::2])

    def forces(self, current: Array, speed: Array, change: Array) -> Array:
        """That wheels hand to the floor [N], at speeds and their change [rad/s^2]."""
        out = [0.0] * (2 * WHEELS)
        motion = _motion(speed, change)
        self._laws.tractions(self._numbers, motion, current.tolist(), out, WHEELS)
        return np.array(out[::2])


def _motion(speed: Array, change: Array) -> list[float]:
    """A row of motion, as the inverse dynamics take it."""
    row = [_UNKNOWN, _UNKNOWN]
    for turning, faster in zip(speed.tolist(), change.tolist(), strict=True):
        row += [turning, faster, _UNKNOWN, 0.0, 0.0, _UNKNOWN]
    return row


@frozen
class Tick:
    """One tick: of each wheel what was measured, what the encoders and the commands explain."""

    stamp_ns: int
    motors: Motors
    speed: Array  # rad/s
    change: Array  # rad/s^2
    expected: Array  # speed that was commanded [rad/s]
    power: Array  # W; A of the motor where that is measured
    from_encoders: Array  # the same
    commanded: Array  # the same
    current: Array  # A, forwards
    expected_current: Array  # of what the encoders explain [A]
    supply: float  # voltage over the nominal one

    @classmethod
    def of(cls, motors: Motors, frame: ResidualFrame, last: Self | None) -> Self | None:
        """None where something is missing; `last`: the tick before."""
        powers, speeds, derived = (
            [frame.residuals[index] for index in group] for group in (MOTORS, SPEEDS, ENCODERS)
        )
        if any(item.stale for item in (*powers, *speeds, *derived)):
            return None
        speed = np.array([measured_speed(item) for item in speeds])
        change = np.zeros(WHEELS)
        if last is not None and 0 < frame.stamp_ns - last.stamp_ns <= NEXT:
            change = (speed - last.speed) * (NANOSECONDS / (frame.stamp_ns - last.stamp_ns))
        expected = _modelled(speeds)
        is_supplied = powers[0].unit == "A" and not motors.reports_currents
        scale = motors.voltage if is_supplied else 1.0  # a supply's current without its voltage
        measured = scale * np.array([item.modelled + item.residual for item in powers])
        from_encoders, commanded = scale * _modelled(derived), scale * _modelled(powers)
        # A wheel that stands is driven the way that it should turn.
        turns = np.where(np.abs(speed) > MOVES, speed, expected)
        way = np.where(turns < 0.0, -1.0, 1.0)

        def current(drawn: Array) -> Array:
            if not motors.reports_currents:
                return motors.currents(drawn, speed, way)
            return drawn if motors.reports_signs else way * drawn

        return cls(
            *(frame.stamp_ns, motors, speed, change, expected, measured, from_encoders, commanded),
            *(current(measured), current(from_encoders), frame.supply),
        )


def _modelled(residuals: Sequence[Residual]) -> Array:
    return np.array([item.modelled for item in residuals])
