"""What a robot's sensors cannot have measured, given its description, with a margin of two."""

import math
from typing import Self

from attrs import frozen

from tomr_power_model.drive.sources import TOTAL, PowerReading
from tomr_power_model.robot import Robot

IGNORED = "the sample is ignored"  # what then becomes of it
_MARGIN = 2.0
_CLEARLY = 2.0  # times what can be: more than a spike, mostly
_DEAD = 0.1  # of the nominal voltage: a supply below it feeds no driver that could report it


def fastest_wheel(robot: Robot) -> float:
    """No wheel turns faster [rad/s]: motors without load at full voltage, twice over."""
    full = robot.supply.nominal_voltage
    return _MARGIN * max(full / motor.wheel_constant for motor in robot.motors)


@frozen
class PowerLimits:
    """Largest magnitudes that are believed: of motors 1-3 and of the whole robot."""

    dead: float  # V, that a supply must have at least
    voltage: float  # V
    current: tuple[float, ...]  # A
    power: tuple[float, ...]  # W

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Stalled motors at full voltage, the whole robot with computer and sensors; twice over."""
        full, auxiliary = robot.supply.nominal_voltage, robot.supply.auxiliary_power
        stall = [full / motor.resistance for motor in robot.motors]
        # A motor that is reversed at speed draws twice as much as one that stalls.
        ways = 2.0 if robot.measurement.quantity == "motor_current" else 1.0
        current = [_MARGIN * ways * value for value in stall]
        total = _MARGIN * (sum(stall) + auxiliary / full)
        power = (*(_MARGIN * full * value for value in stall), full * total)
        # Where currents are compared a voltage may be left at zero.
        dead = _DEAD * full if robot.measurement.quantity == "power" else -math.inf
        return cls(dead, _MARGIN * full, (*current, total), power)

    def problem(self, reading: PowerReading) -> str | None:
        """Why a reading cannot be true, None if it can; what it does not say is not judged."""
        wheel = reading.wheel
        if (
            self.dead <= reading.voltage <= self.voltage
            and abs(reading.current) <= self.current[wheel]
            and abs(reading.power) <= self.power[wheel]
        ):
            return None  # as nearly all are
        name = "the robot" if reading.wheel == TOTAL else f"motor {reading.wheel + 1}"
        if reading.voltage < self.dead:
            return f"under {self.dead:.3g} V feed nothing of {name}"
        for value, most, unit in (
            (reading.voltage, self.voltage, "V"),
            (reading.current, self.current[reading.wheel], "A"),
            (reading.power, self.power[reading.wheel], "W"),
        ):
            if abs(value) > most:
                limit = f"{most:.3g} {unit} is twice what it can"
                is_milli = _CLEARLY * most < abs(value) < 1e3 * most
                guess = f", is it in m{unit}?" if is_milli else ""
                return f"more {unit} of {name} than can be ({limit}{guess})"
        return None
