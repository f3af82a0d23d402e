"""Where no IMU shows that wheels slide: what the motors' power shows of it."""

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.estimate import SLIDES
from tomr_odometry.traction import Traction
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.slides.body import ContactBody
from tomr_power_model.slides.particles import Particles

Array = NDArray[np.float64]
FEWEST_POWERS = 2  # motors whose power has to be known


class Unaided:
    """The ways that contacts slid, for a filter that takes its wheels for gripping."""

    def __init__(self, robot: Robot, body: ContactBody, radius: Array) -> None:
        self._body = body
        friction = np.array(robot.everywhere("friction.coulomb", "torque")) / radius
        drag = robot.everywhere("contact.roller_drag", "coefficient")[0]
        self._particles = Particles(body, friction, drag)
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

    def step(self, dt: float, twist: Array, rims: Array, readings: list[Traction]) -> None:
        """Go on by dt [s]: twist of the body so far, speeds of the rims [m/s], new tractions."""
        if not self.is_at_work:
            self._particles.start(twist)
            self.is_at_work = True
        for reading in readings:
            self._particles.take(reading.wheel, reading.either)
        if self._particles.step(dt, rims):
            found = self._particles.slides(rims)
            slides = found.any_probability > SLIDES
            self.force, self.probability = found.force, found.probability
            self._sliding = rims - self._body.rows @ found.twist if slides else np.zeros(WHEELS)
            self.covariance = found.covariance if slides else np.zeros((3, 3))
        self.slid = self.slid + dt * self._sliding
