"""What the measures look at: one tick in powers, currents and speeds."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    Residual,
    ResidualFrame,
    measured_speed,
)
from tomr_power_model.model.ticks import NANOSECONDS, to_ns
from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]

MOVES = 0.5  # rad/s
NEXT = to_ns(0.3)  # the longest from one tick to the next


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
        scale = motors.scale_of(powers[0].unit)
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
