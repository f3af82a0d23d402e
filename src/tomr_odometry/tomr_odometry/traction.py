"""Force of each contact from the power of its motor and the motion of its encoder.

    r F = k i - friction(omega) - J omega'

Power leaves two currents of it. The driver's law shows which: the voltage that a driver holds
follows from commands and measured speeds (`dynamics.step.control`); where that is not exact enough,
the current that rolling would take helps. What doubt is left is part of the force's deviation.
"""

import math
from collections import deque

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.encoders import WheelEstimate
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.slides.particles import Pair
from tomr_power_model.slides.roughness import Roughness

Triple = tuple[float, float, float]
Fitted = tuple[list[float], list[float], list[float]]  # angles, speeds, accelerations
_SPAN_NS = 60_000_000  # of the encoder samples that show speed and acceleration
_FEWEST = 8  # samples
_KEPT = 1024  # commands, should no encoder sample come
_RESTING = 0.3  # rad/s
_STALE_NS = 250_000_000
_FOLLOW = 0.05  # of what is missing, by which a driver's sum of errors follows the measured power
_MOVING = 1.0  # rad/s
_LAW_VOLTS, _LAW_SHARE = 0.15, 0.03  # V and of it: how exactly a driver's law gives its voltage
_ROLLING_NEWTONS = 10.0  # of a contact's force that rolling would take, where the wheel may slide
_POWER_SHARE = 0.01  # of a measured power
_LEAST_SLOPE = 2.0  # W/A
_SURE = 1e-3  # odds of the other current below which the measurement is taken at its word


@frozen
class Traction:
    """Force of one contact along its wheel's rolling direction."""

    stamp_ns: int
    wheel: int
    force: float  # N
    std: float  # of noise and of what dry friction leaves open [N]
    speed: float  # of the wheel [rad/s]
    either: Pair  # forces of both currents that the power leaves, and their deviations [N]
    rolling: float  # force that rolling takes by the encoders, at the same instant [N]

    def nearer(self, force: float) -> tuple[float, float]:
        """Of the two forces the one that is nearer to another [N], and its deviation."""
        first, second = zip(*self.either, strict=True)
        return min(first, second, key=lambda one: abs(one[0] - force))


class Tractions:
    """Streaming: commands, encoder samples and readings in, forces of the contacts out."""

    def __init__(self, robot: Robot) -> None:
        self._numbers = laid_out(vehicle_of(robot)).tolist()
        # Of each wheel as if it were the only one: what does not hang on the others costs a third.
        self._alone = [_of_wheel(self._numbers, wheel) for wheel in range(WHEELS)]
        self._laws = plain(tuple(robot.physics))
        self._flaws = EncoderFlaws.of(robot)
        self._delay = round(1e9 * robot.controller.delay)
        self._period = round(1e9 * self._numbers[at.PERIOD])
        self._window = round(0.5e9 * robot.sensors.power_window)
        self._unsigned = not robot.measurement.signed
        self._is_current = robot.measurement.quantity == "motor_current"
        volts = robot.supply.nominal_voltage
        noise = math.hypot(robot.sensors.current_noise, robot.sensors.current_resolution)
        self._noise = noise if self._is_current else noise * volts
        self._radius = robot.wheel_radius
        self._constant = [motor.wheel_constant for motor in robot.motors]
        self._resistance = [motor.resistance for motor in robot.motors]
        self.clear()

    def clear(self) -> None:
        """Forget all: what the drivers hold is that of a robot at rest."""
        self._state = [0.0] * at.state_size(WHEELS)
        self._drawn = [0.0] * (WHEELS * at.POWER_WHEEL)
        self._input = list(no_input(WHEELS))
        self._samples: deque[tuple[int, Triple]] = deque()
        self._commands: deque[tuple[int, Triple]] = deque(maxlen=_KEPT)
        self._now = 0
        self._is_commanded = False
        self._rough = [Roughness() for _ in range(WHEELS)]
        self._fitted: Fitted | None = None  # of the newest sample
        self._shown: Fitted | None = None  # the last that was asked for

    def command(self, stamp_ns: int, twist: Triple) -> None:
        """Take a command [m/s, m/s, rad/s]."""
        self._commands.append((stamp_ns + self._delay, twist))
        self._is_commanded = True

    def encoders(self, stamp_ns: int, angle: Triple) -> None:
        """Take wheel angles [rad] and run the drivers' law up to them."""
        samples = self._samples
        if samples and samples[-1][0] < stamp_ns:
            (before, old), elapsed = samples[-1], 1e-9 * (stamp_ns - samples[-1][0])
            seen = [(new - was) / elapsed for new, was in zip(angle, old, strict=True)]
            self._run(before, stamp_ns, seen)
        samples.append((stamp_ns, angle))
        self._fitted = None
        while len(samples) > _FEWEST and samples[1][0] <= stamp_ns - _SPAN_NS:
            samples.popleft()

    def _run(self, start: int, end: int, seen: list[float]) -> None:
        state, given, control = self._state, self._input, self._laws.control
        for wheel in range(WHEELS):
            state[at.STATE_HEADER + wheel * at.STATE_WHEEL + at.MEASURED] = seen[wheel]
        if self._now < start - self._period:
            self._now = start
        while self._now + self._period <= end:
            while self._commands and self._commands[0][0] <= self._now + self._period // 2:
                given[at.COMMAND : at.COMMAND + 3] = self._commands.popleft()[1]
            control(self._numbers, state, given, WHEELS)
            self._now += self._period

    def _fit(self) -> Fitted:
        """Angles [rad], speeds and accelerations at the newest encoder sample, by a parabola."""
        newest, last = self._samples[-1]
        angles = np.array([angle for _, angle in self._samples]) - last
        powers = np.ones((3, len(angles)))
        powers[1] = [1e-9 * (stamp - newest) for stamp, _ in self._samples]
        powers[1] /= -powers[1, 0]
        powers[2] = powers[1] * powers[1]
        shape = np.linalg.solve(powers @ powers.T, powers @ angles)
        scale = 1e-9 * (newest - self._samples[0][0])
        shown = WheelEstimate(shape[1] / scale, 2.0 / scale**2 * shape[2], np.array(last))
        wheels = self._flaws.turned(shown)
        return list(last), wheels.speed.tolist(), wheels.acceleration.tolist()

    @property
    def speeds(self) -> NDArray[np.float64] | None:
        """Of the wheels at the newest encoder sample [rad/s]; None before there are enough."""
        return None if len(self._samples) < _FEWEST else np.array(self._newest()[1])

    @property
    def shown(self) -> NDArray[np.float64] | None:
        """Speeds [rad/s] and accelerations [rad/s^2] of the wheels, (2, 3), that a power was last
        held against: to know them costs nothing more; None before."""
        return None if self._shown is None else np.array(self._shown[1:])

    def _newest(self) -> Fitted:
        if self._fitted is None:
            self._fitted = self._shown = self._fit()
        return self._fitted

    def _motion(self, time_ns: int) -> list[float] | None:
        """Wheels' speeds and accelerations at some time, as the inverse dynamics take them."""
        if len(self._samples) < _FEWEST:
            return None
        fitted = self._newest()
        ahead = 1e-9 * (time_ns - self._samples[-1][0])
        motion = [math.nan, math.nan]
        for wheel, (angle, speed, change) in enumerate(zip(*fitted, strict=True)):
            volts = self._state[at.STATE_HEADER + wheel * at.STATE_WHEEL + at.VOLTS]
            held = volts if self._is_commanded else math.nan
            motion += [speed + change * ahead, change, angle, 0.0, 0.0, held]
        return motion

    def power(self, stamp_ns: int, wheel: int, drawn: float) -> Traction | None:
        """Force of a contact from a measured power [W], or current [A]; None if it is not known."""
        motion = self._motion(stamp_ns - self._window)
        if motion is None or not self._is_commanded or drawn != drawn:
            return None
        if stamp_ns - self._samples[-1][0] > _STALE_NS:
            return None
        found = self._currents(wheel, drawn, motion)
        rolls = self._rolling_current(wheel, motion)
        current, noise, is_sure = self._current(wheel, drawn, motion, found, rolls)
        own = _motion_of(motion, wheel)
        speed = own[at.MOTION_HEADER + at.MOTION_SPEED]
        if is_sure and abs(speed) > _MOVING:
            self._follow(wheel, current, speed)
        each = {one: self._force(wheel, one, own) for one in found}
        force, left = each.get(current) or self._force(wheel, current, own)
        rough = math.sqrt(self._rough[wheel].take(force))
        newtons = self._constant[wheel] / self._radius
        std = math.hypot(newtons * noise, left, rough)
        first, second = (self._doubted(wheel, drawn, speed, one, each[one]) for one in found)
        either = (first[0], second[0]), (first[1], second[1])
        rolling = self._force(wheel, rolls, own)[0]
        return Traction(stamp_ns, wheel, force, std, speed, either, rolling)

    def _rolling_current(self, wheel: int, motion: list[float]) -> float:
        """Of a motor whose wheel rolls [A]; magnitudes of currents have nothing to compare."""
        if self._unsigned:
            return math.nan
        self._laws.one_drive_power(self._numbers, motion, self._drawn, WHEELS, wheel)
        return self._drawn[wheel * at.POWER_WHEEL + at.POWER_CURRENT]

    def _force(self, wheel: int, current: float, own: list[float]) -> tuple[float, float]:
        """Force of a contact at a motor's current, and what dry friction leaves open of it [N]."""
        forces = [0.0, 0.0]
        self._laws.tractions(self._alone[wheel], own, [current], forces, 1)
        return forces[0], forces[1]

    def _doubted(
        self, wheel: int, drawn: float, speed: float, current: float, force: tuple[float, float]
    ) -> tuple[float, float]:
        """Force of a current and its own deviation [N]: which current is right does not count."""
        newtons = self._constant[wheel] / self._radius
        spread = newtons * self._spread(wheel, drawn, current, speed)
        return force[0], math.hypot(spread, force[1])

    def _spread(self, wheel: int, drawn: float, current: float, speed: float) -> float:
        """Deviation of a current that follows from a power [A]."""
        if self._is_current:
            return self._noise
        slope = abs(2.0 * self._resistance[wheel] * current + self._constant[wheel] * speed)
        return (self._noise + _POWER_SHARE * abs(drawn)) / max(slope, _LEAST_SLOPE)

    def _currents(self, wheel: int, drawn: float, motion: list[float]) -> list[float]:
        """Both currents that a measured power leaves [A]."""
        if self._is_current:
            return [drawn, drawn]
        found = [0.0, 0.0]
        self._laws.motor_currents(self._alone[wheel], _motion_of(motion, wheel), [drawn], found, 1)
        return found

    def _current(
        self, wheel: int, drawn: float, motion: list[float], found: list[float], rolls: float
    ) -> tuple[float, float, bool]:
        """A motor's current [A], its noise, and whether the measurement's sign is beyond doubt;
        `rolls`: what rolling would take [A]."""
        place = at.MOTION_HEADER + wheel * at.MOTION_WHEEL
        constant, cold = self._constant[wheel], self._resistance[wheel]
        back = constant * motion[place + at.MOTION_SPEED]
        by_law = (motion[place + at.MOTION_VOLTAGE] - back) / cold
        law_std = (_LAW_VOLTS + _LAW_SHARE * abs(motion[place + at.MOTION_VOLTAGE])) / cold
        if self._is_current and not self._unsigned:
            return drawn, self._noise, True
        if self._is_current:  # a magnitude: a motor that brakes is taken for one that drives
            way = math.tanh(motion[place + at.MOTION_SPEED] / _RESTING)
            return abs(drawn) * way, self._noise, False
        spread = _ROLLING_NEWTONS * self._radius / constant
        cost = [((one - by_law) / law_std) ** 2 + ((one - rolls) / spread) ** 2 for one in found]
        side = int(cost[1] < cost[0])
        current, apart = found[side], found[1] - found[0]
        noise = self._spread(wheel, drawn, current, back / constant)
        other = math.exp(-0.5 * min(abs(cost[1] - cost[0]), 100.0))  # odds of the other current
        return current, math.hypot(noise, math.sqrt(other) * apart), other < _SURE

    def _follow(self, wheel: int, current: float, speed: float) -> None:
        """Let a driver's sum of errors follow what its motor draws."""
        gain = self._numbers[at.INTEGRAL_GAIN]
        if gain > 0.0:
            place = at.STATE_HEADER + wheel * at.STATE_WHEEL
            volts = self._resistance[wheel] * current + self._constant[wheel] * speed
            volts -= self._state[place + at.VOLTS]
            self._state[place + at.INTEGRAL] += _FOLLOW * volts / gain


def _of_wheel(numbers: list[float], wheel: int) -> list[float]:
    """Numbers of a robot with one of the wheels alone."""
    stride = int(numbers[at.STRIDE])
    start = at.HEADER + wheel * stride
    return numbers[: at.HEADER] + numbers[start : start + stride]


def _motion_of(motion: list[float], wheel: int) -> list[float]:
    start = at.MOTION_HEADER + wheel * at.MOTION_WHEEL
    return motion[: at.MOTION_HEADER] + motion[start : start + at.MOTION_WHEEL]
