"""The voltages that drivers hold while their wheels are at rest, from what the drivers see.

A wheel at rest may hold any torque up to its dry friction: its motion does not show it. Its
driver's law does, on the measured speeds:

    v = k_p (asked - omega) + k_i I,   I = integral of (asked - omega) = I_sim + theta_sim - theta

for simulation and driver are asked for the same, and both sum up. What a start in motion,
saturation or a fault left different fades while the wheel turns: soon for a while after it has
turned otherwise than simulated, for what moves alike is driven alike, else slowly, for by as much
as its friction is not as described its driver's sum does differ.

What a push leaves in a driver's sum stays while friction holds the wheel, seconds long, and what
is expected of the wheel then would be wrong. So while a wheel stands that in the simulation stands
too, or turns slowly and no faster than it is asked to, the simulation's sum follows the driver's as
far as friction holds the simulated wheel: more no push leaves, but an encoder that reads standstill
does, and a fault that has just ended. Elsewhere it must not: what a faulty wheel does would be
expected of it. A sum that makes the simulated wheel creep is not the driver's: from then on the
sums have nothing in common until the wheel turns.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from attrs import frozen

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.holding import Holding
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.driver_law import DriverLaw
from tomr_power_model.model.offsets import UNKNOWN, Offsets, between
from tomr_power_model.robot import WHEELS, Robot

_MOVING = 1.0  # rad/s
_FADES = 0.1  # 1/s, of the difference in motion, ...
_FADES_SOON, _SOON = 2.1, 2.0  # ... and for so many seconds after ...
_DIFFERS = 0.5  # ... the speed was not as simulated [rad/s]
_STANDS = 0.05  # rad/s
_TURNS = 0.2  # rad/s, which an encoder that reads standstill does not show
_CREEPS = 0.01  # rad/s: faster than it is asked to
_SLOW = 0.5  # rad/s
_FOLLOWS = 0.5  # share of the difference in a tick


class SimulatedDrivers(Protocol):
    """What simulates the drivers; `CommandPath` does."""

    @property
    def state(self) -> object | None:
        """None before the first command."""
        ...

    def wheel(self, field: int, /) -> list[float]:
        """A field of the wheels' state, see `layout`."""
        ...

    def add_to_sum(self, wheel: int, angle: float) -> None:
        """Add to what a wheel's driver has summed up of its errors [rad]."""
        ...


@frozen
class Voltages:
    """Of the drivers at some time, one per wheel [V]; NaN before the first command."""

    held: list[float]
    simulated: list[float]  # by those of the simulation
    by_law: list[float]  # by the drivers as their law alone has it, see `DriverLaw`


class RestingDrivers:
    """Sums of the drivers, one per wheel."""

    def __init__(self, robot: Robot, period_s: float) -> None:
        """Of a robot, in ticks so long; only dry friction holds a wheel that its driver turns."""
        self._lasts = round(_SOON / period_s)
        self._slowly, self._quickly = (
            1.0 - math.exp(-rate * period_s) for rate in (_FADES, _FADES_SOON)
        )
        self._proportional = robot.controller.proportional
        self._integral = robot.controller.integral
        self._most = robot.supply.nominal_voltage
        self._holding = Holding(vehicle_of(robot))
        self._law = DriverLaw(robot, period_s)
        self.clear()

    def clear(self) -> None:
        """What the drivers' sums hold is not known until the next command."""
        self._offsets = Offsets()
        # At the end of the last tick [V], of the drivers and of the simulated ones.
        self._before = [UNKNOWN] * WHEELS, [UNKNOWN] * WHEELS
        self._strange = [False] * WHEELS  # differences that are not the drivers'
        self._soon = [0] * WHEELS  # ticks for which they fade soon
        self._followed = [False] * WHEELS  # in the last tick
        self._law.clear()

    def forget(self) -> None:
        """The drivers were asked for what is not known: what their sums differ by means nothing."""
        self._offsets.forget()
        self._law.forget()

    def voltages(
        self,
        path: SimulatedDrivers,
        angle: Sequence[float],
        speed: Sequence[float],
        *,
        simulated: Sequence[float],
        share: float,
    ) -> Voltages:
        """Voltages of the drivers at some time of a tick.

        Args:
            path: that simulates what the drivers are asked for.
            angle: of the wheels at the end of the tick [rad], NaN where not known.
            speed: of the wheels [rad/s].
            simulated: the same as simulated, mean of the tick as well.
            share: of the tick at that time.
        """
        if path.state is None:
            return Voltages(*([UNKNOWN] * WHEELS for _ in range(3)))
        turned, sums, asked = (path.wheel(part) for part in (at.TURNED, at.INTEGRAL, at.ASKED))
        ahead = [turned[wheel] - angle[wheel] for wheel in range(WHEELS)]
        found, expected, apart = [], [], []
        for wheel in range(WHEELS):
            if abs(speed[wheel]) > _TURNS:
                self._strange[wheel] = False
            fades = self._fades(wheel, speed[wheel], simulated[wheel])
            apart.append(self._offsets.beyond(wheel, ahead[wheel], fades))
            known = apart[wheel] if apart[wheel] == apart[wheel] else 0.0
            here, there = asked[wheel] - speed[wheel], asked[wheel] - simulated[wheel]
            expected.append(self._proportional * there + self._integral * sums[wheel])
            found.append(self._proportional * here + self._integral * (sums[wheel] + known))
        held, simulates = map(between, self._before, (found, expected), (share, share))
        holds = self._holding.voltages(*map(path.wheel, (at.DRY, at.SIDE_LIMIT, at.HOT)))
        beyond = self._law.beyond(
            ahead, speed, simulated, asked=asked, sums=sums, holds=holds, share=share
        )
        taken = self._follow(path, apart, ahead, speed)
        self._law.taken_over(taken)
        after = [volts + self._integral * more for volts, more in zip(expected, taken, strict=True)]
        self._before = found, after
        most = self._most
        by_law = [
            min(max(volts + more, -most), most)
            for volts, more in zip(simulates, beyond, strict=True)
        ]
        return Voltages(held, simulates, by_law)

    def _fades(self, wheel: int, speed: float, simulated: float) -> float:
        """Share of the difference that a tick takes off, of a wheel that turns so [rad/s]."""
        differs = abs(speed - simulated) > _DIFFERS
        if differs:
            self._soon[wheel] = self._lasts
        if not abs(speed) > _MOVING:
            return 0.0
        if differs or not self._soon[wheel]:
            return self._slowly
        self._soon[wheel] -= 1
        return self._quickly

    def _follow(
        self,
        path: SimulatedDrivers,
        apart: Sequence[float],
        ahead: Sequence[float],
        speed: Sequence[float],
    ) -> list[float]:
        """Take the differences over into the simulation, where a push may have left them; how
        much, one per wheel [rad]."""
        simulated, asked = path.wheel(at.SPEED), path.wheel(at.ASKED)
        held, limits = self._held(path)
        taken = [0.0] * WHEELS
        for wheel in range(WHEELS):
            excess = abs(simulated[wheel]) - abs(asked[wheel])
            if self._followed[wheel] and excess > _CREEPS:
                # With such a sum it would turn, and it does not: the difference is another's.
                self._strange[wheel] = True
                self._offsets.equal(wheel, ahead[wheel])
            is_slow = excess < _CREEPS and abs(simulated[wheel]) < _SLOW
            rests = is_slow and abs(speed[wheel]) < _STANDS and not self._strange[wheel]
            more = _FOLLOWS * apart[wheel]  # NaN where not known
            follows = rests and abs(held[wheel] + self._integral * more) < limits[wheel]
            self._followed[wheel] = follows
            if follows:
                path.add_to_sum(wheel, more)
                self._offsets.lower(wheel, more)
                taken[wheel] = more
        return taken

    def _held(self, path: SimulatedDrivers) -> tuple[list[float], list[float]]:
        """What friction holds each simulated wheel against, and could at most [V].

        While the robot moves, a wheel that stands bears its part of what turns the body aside, so
        friction holds what is left of its voltage; and rollers that slide hold nothing more.
        """
        dry, side, hot = map(path.wheel, (at.DRY, at.SIDE_LIMIT, at.HOT))
        if all(abs(speed) < _CREEPS for speed in path.wheel(at.SPEED)):
            held = [self._integral * angle for angle in path.wheel(at.INTEGRAL)]
            return held, self._holding.voltages(dry, side, hot)
        axles, nothing = path.wheel(at.HELD), [0.0] * WHEELS
        held, limits = (self._holding.voltages(part, nothing, hot) for part in (axles, dry))
        return held, limits
