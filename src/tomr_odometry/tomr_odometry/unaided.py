"""Where no IMU shows that wheels slide: what the motors' power shows of it.

A slide shows some tenths of a second late, and which of two motions it was later still. Particles
carry places, and those that turn out to be right have gone their own ways since before that: so
the pose is corrected by what they were apart.
"""

import math

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.estimate import SLIDES_UNAIDED
from tomr_odometry.traction import Traction
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.slides.body import ContactBody, rolling_forces
from tomr_power_model.slides.particles import Particles, ParticleSettings

Array = NDArray[np.float64]
_STEP = 0.05  # s, of the particles
_HINDSIGHT = 5.0  # s, for which what is found out later changes the way
_PATCHES = 0.01  # 1/s, at which a wheel alone comes to another floor
_MOVES = 0.5  # rad/s: dry friction hides what a slower wheel hands on
FEWEST_POWERS = 2  # motors whose power has to be known


class Unaided:
    """The ways that contacts slid, for a filter that takes its wheels for gripping."""

    def __init__(self, robot: Robot, body: ContactBody, radius: Array) -> None:
        self._body = body
        friction = np.array(robot.everywhere("friction.coulomb", "torque")) / radius
        self._drag = robot.everywhere("contact.roller_drag", "coefficient")[0]
        settings = ParticleSettings(patches=_PATCHES)
        self._particles = Particles(body, friction, self._drag, settings)
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self.slid = np.zeros(WHEELS)  # m, by which each rim turned more than the ground went by
        self.rest()

    def rest(self) -> None:
        """An IMU shows it, or nothing does: the wheels are taken for gripping."""
        self.is_at_work = False
        self._sliding = np.zeros(WHEELS)  # m/s
        self.force = np.zeros(WHEELS)  # N, of each contact
        self.probability = np.zeros(WHEELS)  # that each wheel slides
        self.covariance = np.zeros((3, 3))  # of the twist while wheels slide
        # Of the pose in its own frame [m, m, rad].
        self.correction: Array | None = None
        self._slid_ago = math.inf  # s

    def step(self, dt: float, twist: Array, rims: Array, readings: list[Traction]) -> None:
        """Go on by dt [s]: twist of the body so far, speeds of the rims [m/s], new tractions."""
        if not self.is_at_work:
            self._particles.start(twist)
            self._begin(rims)
            self.is_at_work = True
        self._elapsed += dt
        self._readings += [one for one in readings if abs(one.speed) > _MOVES]
        self.correction = None
        if self._elapsed >= _STEP:
            self._weigh(rims)
        self.slid = self.slid + dt * self._sliding
        self._ways += dt * np.stack([rims, rims - self._sliding])

    def _begin(self, rims: Array) -> None:
        """A step of the particles begins with rims that turn so fast [m/s]."""
        self._elapsed, self._rims = 0.0, rims
        self._ways: Array = np.zeros((2, WHEELS))  # m, of the rims, and over the ground
        self._readings: list[Traction] = []

    def _weigh(self, rims: Array) -> None:
        """Particles go on to rims that turn so fast [m/s].

        The force of a contact is that of rolling in this step, and what the powers say beyond
        rolling at their own instants: so what the encoders do not show of the instant of an
        acceleration cancels.
        """
        to_twist = self._body.to_twist
        change = to_twist @ (rims - self._rims) / self._elapsed
        rolling = rolling_forces(self._body, self._drag, to_twist @ rims, change)
        for wheel in range(WHEELS):
            own = [one for one in self._readings if one.wheel == wheel]
            if own:
                beyond = [np.array(one.either[0]) - one.rolling for one in own]
                one, other = (rolling[wheel] + np.mean(beyond, axis=0)).tolist()
                first, second = np.mean([one.either[1] for one in own], axis=0).tolist()
                self._particles.take(wheel, ((one, other), (first, second)))
        if self._particles.step(self._elapsed, rims):
            found = self._particles.slides(rims)
            slides = found.any_probability > SLIDES_UNAIDED
            self.force, self.probability = found.force, found.probability
            self._correct(rims, slides)
            self._sliding = rims - self._body.rows @ found.twist if slides else np.zeros(WHEELS)
            self.covariance = found.covariance if slides else np.zeros((3, 3))
        self._begin(rims)

    def _correct(self, rims: Array, slides: bool) -> None:
        """The place that the body has by the particles, where they say that it slides or did."""
        rolled, taken = self._ways @ self._body.to_twist.T
        keep = math.exp(-self._elapsed / _HINDSIGHT)
        self._particles.part(self._elapsed, rims, rolled, taken, keep)
        self._slid_ago = 0.0 if slides else self._slid_ago + self._elapsed
        if self._slid_ago < _HINDSIGHT:
            self.correction = self._particles.settle()
