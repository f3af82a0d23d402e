"""Whether wheels slide, as the forces of their contacts show: evidence beside the network's.

The network sees residuals, wheel by wheel, and what a slide does to them looks like a load or a
push. But a contact that slides hands on its traction, whichever way the body goes, and the body
follows what its contacts hand on: particles (`slides/particles.py`) weigh that tick by tick against
floors that slope or drag.

A contact's force is that of rolling as the ticks' speeds have it, and what the measured power says
beyond the power that the encoders explain. So what both lack, as the instant of an acceleration,
cancels, and a wheel that rolls as described differs by noise alone.

A robot whose residuals lie within their bands does not slide: particles cost as much as the rest of
a decision, so they rest until something lies outside, and then begin with the last second.
"""

from collections import deque

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.contacts import NOTHING, Contacts, LoneWheelWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity.tick import MOVES, Tick
from tomr_fault_diag.classifier.slope import shows_motion
from tomr_fault_diag.residuals.frame import BAND_SIGMAS, ENCODERS, Residual, ResidualFrame
from tomr_power_model.model.ticks import NANOSECONDS, NEVER, to_ns
from tomr_power_model.robot import Robot
from tomr_power_model.slides.body import body_of, rolling_forces
from tomr_power_model.slides.particles import Felt, Pair, Particles, ParticleSettings, Pull

Array = NDArray[np.float64]

_SLOT = to_ns(0.05)  # of faster ticks the first in each is taken
_LONGEST = to_ns(0.11)  # between two ticks that show an acceleration
_BEFORE = to_ns(1.0)  # with which particles begin, before the first hint of a slide
_CALM = to_ns(2.0)  # without one, and they rest
_RAMPS = 0.1  # 1/s, at which it comes to a slope, or to its end
_SHOVED = 1.0  # 1/s, at which somebody may shove a robot that shows something
_POWER_SHARE = 0.01  # of a measured power that is not known
_LEAST_SLOPE = 2.0  # W/A
_STEEP = 0.2  # N/kg
_HOLDS = to_ns(0.5)  # where the motion changes
_PLAIN = 3.0  # standard deviations of a force that is there
_OFF = 1.2  # standard deviations of what it leaves
_LEAST_FORCE = 0.1  # m/s^2, that of an accelerometer
_LEAST_YAW = 0.02  # rad/s, standard deviation of a gyro beside the wheels


class SlideWatch:
    """Follows a robot tick by tick; driven by stamps."""

    def __init__(self, robot: Robot) -> None:
        self._motors = Motors(robot)
        self._body, self._radius = body_of(robot)
        dry = np.array(robot.everywhere("friction.coulomb", "torque")) / self._radius
        self._drag = robot.everywhere("contact.roller_drag", "coefficient")[0]
        settings = ParticleSettings(ramps=_RAMPS, shoved=_SHOVED)
        self._particles = Particles(self._body, dry, self._drag, settings)
        sensors = robot.sensors
        quantum = sensors.encoder_resolution * NANOSECONDS / _SLOT
        self._lone = LoneWheelWatch(max(quantum, sensors.velocity_resolution))
        self._noise = self._motors.noise(robot)
        # Magnitudes of currents do not show which way a contact pushes.
        self._is_able = robot.measurement.signed
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._recent: deque[ResidualFrame] = deque()
        self._newest = 0  # ns, of the last frame that was taken
        self._rest()

    def _rest(self) -> None:
        self._awake_until = 0  # ns
        self._last: Tick | None = None
        # ns, when a force that is known, or some force, last explained what all contacts hand on.
        self._pulled_at = self._explained_at = NEVER
        self._found = Contacts(0.0, calm=True)
        self._lone.clear()

    def take(self, frame: ResidualFrame) -> Contacts:
        """Take a tick; no wheel slides where nothing hints at it, and nothing is known where the
        measurements cannot show it."""
        if not self._is_able:
            return NOTHING
        if frame.stamp_ns // _SLOT == self._newest // _SLOT:
            return self._found
        if frame.stamp_ns - self._newest > _LONGEST:
            self.clear()
        self._newest = frame.stamp_ns
        if _is_hint(frame):
            if not self._awake_until:
                for before in self._recent:
                    self._follow(before)
            self._awake_until = frame.stamp_ns + _CALM
        if frame.stamp_ns < self._awake_until:
            self._found = self._follow(frame)
        else:
            self._rest()
            self._found = evolve(self._found, felt=shows_motion(frame))
        self._recent.append(frame)
        while self._recent[0].stamp_ns < frame.stamp_ns - _BEFORE:
            self._recent.popleft()
        return self._found

    def _follow(self, frame: ResidualFrame) -> Contacts:
        """Go on to a tick; where something is missing in it, begin anew with the next."""
        last = self._last
        with np.errstate(over="ignore", invalid="ignore"):
            tick = self._last = Tick.of(self._motors, frame, last)
            if tick is None or not np.isfinite([tick.speed, tick.power]).all():
                self._last = None
                self._lone.clear()
                return NOTHING
            rims = self._radius * tick.speed
            if last is None:
                self._particles.start(self._body.to_twist @ rims)
                return NOTHING
            self._weigh(tick, rims)
            yaw = frame.yaw
            if not yaw.stale:
                std = max(yaw.band / BAND_SIGMAS, _LEAST_YAW)
                self._particles.turns(yaw.modelled + yaw.residual, std)
            is_felt = shows_motion(frame)
            if is_felt:
                self._particles.feels(_felt(frame))
            self._particles.step((tick.stamp_ns - last.stamp_ns) / NANOSECONDS, rims)
            found = self._lone.take(tick, self._particles.slides(rims).any_probability)
            pull = self._particles.pull()
            if found.grips and _explains(pull):
                self._explained_at = tick.stamp_ns
                self._pulled_at = tick.stamp_ns if _is_plain(pull) else self._pulled_at
            force, slopes = (
                tick.stamp_ns - at <= _HOLDS for at in (self._pulled_at, self._explained_at)
            )
            return evolve(found, force=force, slopes=slopes, felt=is_felt)

    def _weigh(self, tick: Tick, rims: Array) -> None:
        """Hand on what the powers show of the contacts."""
        motors, body = self._motors, self._body
        change = body.to_twist @ (self._radius * tick.change)
        rolling = rolling_forces(body, self._drag, body.to_twist @ rims, change)
        measured, explained = (
            motors.both_currents(drawn, tick.speed) for drawn in (tick.power, tick.from_encoders)
        )
        forces = [motors.forces(current, tick.speed, tick.change) for current in measured.T]
        found = [motors.forces(current, tick.speed, tick.change) for current in explained.T]
        # Of the two currents that explain a power, the one that rolling takes.
        off = [np.abs(force - rolling) for force in found]
        nearer = np.where(off[0] <= off[1], found[0], found[1])
        stds = [self._spread(tick, current) for current in measured.T]
        for wheel in np.flatnonzero(np.abs(tick.speed) > MOVES):
            one, other = (float((force - nearer + rolling)[wheel]) for force in forces)
            if np.isfinite([one, other]).all():
                first, second = (float(std[wheel]) for std in stds)
                either: Pair = (one, other), (first, second)
                self._particles.take(int(wheel), either)

    def _spread(self, tick: Tick, current: Array) -> Array:
        """Standard deviations of contact forces that follow from powers or currents [N]."""
        motors, noise = self._motors, self._noise
        newtons = motors.constant / motors.radius
        if motors.reports_currents:
            return np.asarray(newtons * noise)
        slope = np.abs(2.0 * motors.resistance * current + motors.constant * tick.speed)
        watts = noise + _POWER_SHARE * np.abs(tick.power)
        return np.asarray(newtons * watts / np.maximum(slope, _LEAST_SLOPE))


def _felt(frame: ResidualFrame) -> Felt:
    """What an accelerometer shows of a tick."""
    beyond = np.array([item.residual for item in frame.along])
    std = np.array([item.band for item in frame.along]) / BAND_SIGMAS
    model = np.array([item.modelled for item in frame.along])
    return Felt(force=model + beyond, std=np.maximum(std, _LEAST_FORCE), pull=-beyond)


def _is_hint(frame: ResidualFrame) -> bool:
    """Whether anything that a slide would move lies outside its band."""
    motors = (frame.residuals[k] for k in ENCODERS)
    return any(_is_outside(item) for item in (frame.yaw, *frame.along, *motors))


def _is_outside(item: Residual) -> bool:
    return abs(item.residual) > item.band  # false where either is NaN


def _explains(pull: Pull) -> bool:
    """Whether some force stays, known or not, that explains what all contacts hand on."""
    return float(np.hypot(*pull.mean)) > _STEEP and pull.off < _OFF


def _is_plain(pull: Pull) -> bool:
    """Whether it is known which force that is."""
    return float(np.hypot(*pull.mean)) > _PLAIN * pull.std
