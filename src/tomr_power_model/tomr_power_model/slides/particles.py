"""Slides estimated from power alone: a particle filter over the floor and what the body does on it.

Each particle is a floor (traction coefficient of each wheel, slope), what friction and drag are off
by, and the twist that the body has on this floor when its rims turn as the encoders say. It
predicts the force of each contact; a motor's power has two currents, and so gives one of two
forces. A particle whose forces are those of the power, near either of the two, lives on. Where
wheels grip all floors agree.

The contacts are those of the one dynamics (dynamics/contacts.py: sticking up to traction times
load), but with rims that are given and for all particles at once, which makes a step cheap.
"""

import math
from typing import NamedTuple

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.geometry.poses import moved, seen_from
from tomr_power_model.robot import GRAVITY, WHEELS
from tomr_power_model.slides.body import STICKING, ContactBody
from tomr_power_model.slides.roughness import Roughness

Array = NDArray[np.float64]
Pair = tuple[tuple[float, float], tuple[float, float]]

_SEED = 20_240_101  # the same messages give the same numbers
_LEAST_STEP = 0.018  # s
_LONGEST_STEP = 0.1  # s
_RESTING = 0.025  # m/s of a rim, below which dry friction fades
_SLIDING = 0.05  # m/s, of a contact that is said to slide
_PLAINLY = 3.0  # standard deviations of an accelerometer


class ParticleSettings(NamedTuple):
    """How many, what floors there are, how they change, and how exactly forces are known."""

    particles: int = 800
    sweeps: int = 5  # over the contacts
    gripping: float = 0.8  # share of floors that grip
    least: float = 0.02  # traction coefficient, evenly by its logarithm up to `grips` and `most`
    grips: float = 0.3
    most: float = 1.0
    new_floor: float = 0.03  # 1/s, at which a robot comes to another floor
    patches: float = 0.0  # 1/s, at which each of its wheels alone comes to another floor
    regain: float = 0.3  # 1/s, at which its wheels find their grip
    comes_to_rest: float = 1.0  # 1/s, at which it stands where no wheel turns: forces show nothing
    wander: float = 0.1  # 1/sqrt(s), of the logarithm of the traction coefficient
    sloping: float = 0.15  # share of floors that slope
    slope: float = 0.4  # m/s^2, of those
    level: float = 0.02  # m/s^2, of the others
    otherwise: float = 0.5  # share of those that find their grip, on another slope; other drag
    walk_slope: float = 0.02  # m/s^2/sqrt(s)
    holds: float = 0.7  # of the traction: a slope pulls no more, or no wheel would hold the robot
    friction: float = 0.08  # of a wheel's dry friction, by which it is off
    friction_least: float = 0.1  # N
    drag: float = 0.3  # of the rollers' drag
    dragging: float = 0.2  # share of floors on which rollers drag by anything up to
    drag_most: float = 0.4
    ramps: float = 0.0  # 1/s, at which a robot comes to a slope, or to its end
    felt_rate: float = (
        0.2  # 1/s, at which it does where an accelerometer feels how steep one is, and
    )
    # at which it comes to a slippery floor, which feels alike at first
    felt: float = 0.15  # m/s^2, by which such a slope is another
    shoved: float = 0.0  # 1/s, at which somebody shoves the robot
    shove: float = 1.5  # N per kg of the robot, standard deviation of each direction
    shove_ends: float = 6.0  # 1/s
    walk_twist: float = 0.02  # m/s/sqrt(s), while wheels slide
    force: float = 0.07  # N per kg of the robot, by which predicted forces are off
    force_share: float = 0.1  # of a force and of dry friction, the same
    roughness: float = 2.0  # of the variance from sample to sample
    farthest: float = 6.0  # standard deviations
    time: float = 0.12  # s, over which what is off is averaged
    tails: float = 4.0  # degrees of freedom of its distribution
    trust: float = 0.7  # share of the evidence that counts: what a model is off by stays off


@frozen
class Slides:
    """What the particles say of a moment."""

    twist: Array  # m/s, m/s, rad/s
    covariance: Array  # (3, 3)
    force: Array  # of each contact [N]
    probability: Array  # that each wheel slides
    any_probability: float  # that any wheel does


@frozen
class Felt:
    """What an accelerometer shows of the body, along x and y of base_link [m/s^2], (2,) each."""

    force: Array  # specific force
    std: Array  # standard deviation
    pull: Array  # of a slope, if wheels grip


@frozen
class Pull:
    """A force on the body that stays, of a slope or of whatever pulls."""

    mean: Array  # along the axes of the world [N/kg], (2,)
    std: float  # of the less certain of the two [N/kg]
    off: float  # standard deviations by which forces have been off of late, at the worst wheel of
    # those whose forces are known


class Particles:
    """Encoder samples and tractions in, the twist of the body on a floor nobody knows out."""

    def __init__(
        self,
        body: ContactBody,
        friction: Array,
        drag: float,
        settings: ParticleSettings | None = None,
    ) -> None:
        """friction: dry friction of each wheel [N] at its rim; drag: of the rollers [-]."""
        self._set = settings or ParticleSettings()
        self._body, self._dry, self._described_drag = body, friction, drag
        self._light = np.asarray(np.linalg.inv(body.inertia))
        self._per_force = body.rows @ self._light  # change of the twist by each contact's impulse
        self._each = self._per_force @ body.rows.T  # way of each contact by each one's impulse
        self._yields = self._each.diagonal()
        self.start(np.zeros(3))

    def start(self, twist: Array) -> None:
        """Begin with a known twist on any floor."""
        s, n = self._set, self._set.particles
        self._random = np.random.default_rng(_SEED)
        self._twist = np.tile(twist, (n, 1))
        self._yaw = np.zeros(n)
        self._offset = np.zeros((n, 3))  # m, m, rad
        self._traction = np.tile(self._floors(n)[:, None], (1, WHEELS))
        steep = np.where(self._random.random((n, 1)) < s.sloping, s.slope, s.level)
        self._slope = steep * self._random.standard_normal((n, 2))
        off = s.friction * self._dry + s.friction_least
        self._friction = off * self._random.standard_normal((n, WHEELS))
        near = self._described_drag * (1.0 + s.drag * self._random.standard_normal(n))
        other = s.drag_most * self._random.random(n) ** 2
        self._drag = np.where(self._random.random(n) < s.dragging, other, near)
        self._shove = np.zeros((n, 2))  # N, on the body
        self._force = np.zeros((n, WHEELS))
        self._off = np.zeros((n, WHEELS))  # standard deviations, averaged
        self._specific = np.zeros((n, 2))  # force that an accelerometer would feel [m/s^2]
        self._felt_off = np.zeros((n, 2))  # standard deviations, averaged
        self._is_heard = np.zeros(WHEELS, dtype=bool)  # in the last step
        self._weight = np.full(n, 1.0 / n)
        self._readings: list[tuple[int, Pair]] = []
        self._turning: tuple[float, float] | None = None
        self._felt: Felt | None = None
        self._rough = [Roughness() for _ in range(WHEELS)]
        self._since = 0.0

    def _floors(self, count: int) -> Array:
        s, random = self._set, self._random
        good = random.random(count) < s.gripping
        low, high = np.where(good, s.grips, s.least), np.where(good, s.most, s.grips)
        return np.asarray(low * (high / low) ** random.random(count))

    def take(self, wheel: int, either: Pair) -> None:
        """Take what a motor's power shows of its contact: the forces of both currents that the
        power leaves, and their standard deviations [N]."""
        self._readings.append((wheel, either))

    def turns(self, rate: float, std: float) -> None:
        """Take what a gyro shows of the body until the next step: yaw rate and its standard
        deviation [rad/s]."""
        self._turning = rate, std

    def feels(self, felt: Felt) -> None:
        """Take what an accelerometer shows of the body until the next step."""
        self._felt = felt

    def step(self, dt: float, rims: Array) -> bool:
        """Go on by dt [s] to rims that turn so fast [m/s]; False: too soon for a step."""
        self._since += dt
        if self._since < _LEAST_STEP:
            return False
        dt, self._since = min(self._since, _LONGEST_STEP), 0.0
        self._change(dt, rims)
        self._move(dt, rims)
        self._judge(dt, rims)
        return True

    def slides(self, rims: Array) -> Slides:
        """What the particles say."""
        mean = self._weight @ self._twist
        off = self._twist - mean
        sliding = np.abs(rims - self._twist @ self._body.rows.T) > _SLIDING
        return Slides(
            twist=mean,
            covariance=(off * self._weight[:, None]).T @ off,
            force=self._weight @ self._force,
            probability=self._weight @ sliding,
            any_probability=float(self._weight @ sliding.any(axis=1)),
        )

    def part(self, dt: float, rims: Array, rolled: Array, taken: Array, keep: float) -> None:
        """Go on with the place that the body has by each particle, beside where it is taken to be.

        rolled: way if wheels grip; taken: that which was taken for the body's, both in its frame
        [m, m, rad], of the last dt [s]; keep: share of what they are apart that goes on.
        """
        apart = rims - self._twist @ self._body.rows.T
        slides = np.any(np.abs(apart) > _SLIDING, axis=1, keepdims=True)
        ways = rolled - dt * slides * (apart @ self._body.to_twist.T)
        there = moved(np.zeros(3), taken)
        self._offset = keep * seen_from(moved(self._offset, ways), there)

    def settle(self) -> Array:
        """Take the body to be where they have it; seen from where it was, that is [m, m, rad]."""
        mean = np.asarray(self._weight @ self._offset)
        self._offset = seen_from(self._offset, mean)
        return mean

    def pull(self) -> Pull:
        """What they say of the force that stays."""
        mean = self._weight @ self._slope
        return Pull(
            mean=mean,
            std=float(np.sqrt((self._weight @ (self._slope - mean) ** 2).max())),
            off=float(np.sqrt((self._weight @ self._off**2)[self._is_heard].max(initial=0.0))),
        )

    def _change(self, dt: float, rims: Array) -> None:
        """Floors change, and wheels find their grip again."""
        s, random, n = self._set, self._random, self._set.particles
        other = np.flatnonzero(random.random(n) < s.new_floor * dt)
        self._traction[other] = self._floors(len(other))[:, None]
        if s.patches:
            patches = random.binomial(n * WHEELS, s.patches * dt)
            where = random.integers(n, size=patches), random.integers(WHEELS, size=patches)
            self._traction[where] = self._floors(patches)
        back = np.flatnonzero(random.random(n) < s.regain * dt)
        if len(back):
            grips = (self._traction > s.grips).all(axis=1)
            self._force[back] = self._force[grips].mean(axis=0) if grips.any() else 0.0
            self._twist[back] = self._body.to_twist @ rims
            self._traction[back] = s.grips * (s.most / s.grips) ** random.random((len(back), 1))
            # What was taken for a slide may be a slope or drag: else nothing that grips agrees.
            slopes, drags = (back[random.random(len(back)) < s.otherwise] for _ in range(2))
            self._slope[slopes] = s.slope * random.standard_normal((len(slopes), 2))
            self._drag[drags] = s.drag_most * random.random(len(drags)) ** 2
        if float(np.abs(rims).max()) < _RESTING:
            self._twist[random.random(n) < s.comes_to_rest * dt] = 0.0
        if s.shoved:
            self._shove[random.random(n) < s.shove_ends * dt] = 0.0
            hit = np.flatnonzero(random.random(n) < s.shoved * dt)
            self._shove[hit] = s.shove * self._body.mass * random.standard_normal((len(hit), 2))
        if s.ramps:
            onto = np.flatnonzero(random.random(n) < s.ramps * dt)
            self._slope[onto] = s.slope * random.standard_normal((len(onto), 2))
        if s.ramps and self._felt is not None:
            self._explain(dt, self._felt)
        self._traction *= np.exp(s.wander * math.sqrt(dt) * random.standard_normal((n, 1)))
        np.clip(self._traction, 0.5 * s.least, 1.2 * s.most, out=self._traction)
        self._slope += s.walk_slope * math.sqrt(dt) * random.standard_normal((n, 2))

    def _explain(self, dt: float, felt: Felt) -> None:
        """What an accelerometer feels beside the wheels is a slope, the less likely the steeper it
        is, or wheels that begin to slide."""
        s, random, n = self._set, self._random, self._set.particles
        onto = np.flatnonzero(random.random(n) < s.felt_rate * dt)
        cos, sin = np.cos(self._yaw[onto]), np.sin(self._yaw[onto])
        x, y = felt.pull.tolist()
        slope = np.column_stack([cos * x - sin * y, sin * x + cos * y])
        self._slope[onto] = slope + s.felt * random.standard_normal((len(onto), 2))
        self._weight[onto] *= math.exp(-0.5 * (x * x + y * y) / s.slope**2)
        if math.hypot(x, y) > _PLAINLY * float(felt.std.max()):
            slippery = np.flatnonzero(random.random(n) < s.felt_rate * dt)
            least = random.random((len(slippery), 1))
            self._traction[slippery] = s.least * (s.grips / s.least) ** least

    def _move(self, dt: float, rims: Array) -> None:
        """Twists and forces on each floor, by sweeps over the contacts."""
        b, s, twist = self._body, self._set, self._twist
        others, slope = self._wrenches()
        free = twist + dt * ((others + slope) @ self._light + self._force @ self._per_force)
        free[:, 0] += dt * twist[:, 2] * twist[:, 1]
        free[:, 1] -= dt * twist[:, 2] * twist[:, 0]
        free += self._pushed(dt, free, rims) @ self._per_force * dt
        slides = np.flatnonzero((np.abs(rims - free @ b.rows.T) > _SLIDING).any(axis=1))
        shaken = self._random.standard_normal((len(slides), 3))
        free[slides] += s.walk_twist * math.sqrt(dt) * shaken
        self._twist = free
        self._yaw += dt * free[:, 2]
        if self._felt is not None:
            felt = others @ self._light + self._force @ self._per_force
            self._specific = felt[:, :2]

    def _pushed(self, dt: float, free: Array, rims: Array) -> Array:
        """What contacts give beside the forces of before, by sweeps over them [N], (n, 3).

        In ways of the contacts and wheel by wheel: the rows of one are near each other in memory.
        """
        b, before = self._body, self._force.T
        most = np.ascontiguousarray((b.load * self._traction).T)
        least, apart, force = -most, rims[:, None] - b.rows @ free.T, before.copy()
        for i in [*range(WHEELS)] * self._set.sweeps:
            more = apart[i] / (dt * self._yields[i])
            more += force[i]
            np.minimum(more, most[i], out=more)
            np.maximum(more, least[i], out=more)
            apart -= np.multiply.outer(dt * self._each[i], more - force[i])
            force[i] = more
        self._force = np.ascontiguousarray(force.T)
        return np.asarray((force - before).T)

    def _wrenches(self) -> tuple[Array, Array]:
        """Of drag and shoves, and of the slope, on the body [N, N, N m], (n, 3) each."""
        b, cos, sin = self._body, np.cos(self._yaw), np.sin(self._yaw)
        along = np.tanh(self._twist @ b.along.T / STICKING) * b.load
        wrench = -self._drag[:, None] * (along @ b.along)
        steep = np.hypot(self._slope[:, 0], self._slope[:, 1])
        most = self._set.holds * GRAVITY * self._traction.max(axis=1)  # others are on patches
        pull = b.mass * np.minimum(1.0, most / np.maximum(steep, 1e-9))
        sloping = np.zeros_like(wrench)
        sloping[:, 0] = pull * (cos * self._slope[:, 0] + sin * self._slope[:, 1])
        sloping[:, 1] = pull * (cos * self._slope[:, 1] - sin * self._slope[:, 0])
        wrench[:, :2] += self._shove
        return np.asarray(wrench), sloping

    def _judge(self, dt: float, rims: Array) -> None:
        """Weigh the particles by the powers, and leave those that nothing speaks for."""
        s, share = self._set, 1.0 - math.exp(-dt / self._set.time)
        logs = np.log(np.maximum(self._weight, 1e-300))
        turning = np.tanh(rims / _RESTING)
        for i in range(WHEELS):
            expected = self._force[:, i] + self._friction[:, i] * turning[i]
            apart = [self._apart(i, one, expected) for wheel, one in self._readings if wheel == i]
            self._is_heard[i] = bool(apart)
            if apart:  # as much evidence in a time, however often power is measured
                off = np.mean(apart, axis=0)
                self._off[:, i] += share * (off - self._off[:, i])
                logs += self._likelihood(dt, self._off[:, i])
        self._readings.clear()
        if self._turning is not None:
            rate, std = self._turning
            off = np.clip((self._twist[:, 2] - rate) / std, -s.farthest, s.farthest)
            logs -= 0.5 * s.trust * dt / s.time * off**2
            self._turning = None
        if self._felt is not None:
            off = np.clip(
                (self._specific - self._felt.force) / self._felt.std, -s.farthest, s.farthest
            )
            self._felt_off += share * (off - self._felt_off)
            logs += self._likelihood(dt, self._felt_off).sum(axis=1)
            self._felt = None
        weight = np.exp(logs - logs.max())
        self._weight = weight / weight.sum()
        if self._weight @ self._weight > 2.0 / s.particles:
            self._draw()

    def _likelihood(self, dt: float, off: Array) -> Array:
        """Logarithm of Student's distribution of what is off [standard deviations], as far as a
        step counts."""
        s = self._set
        return -0.5 * (s.tails + 1.0) * s.trust * dt / s.time * np.log1p(off**2 / s.tails)

    def _apart(self, i: int, either: Pair, expected: Array) -> Array:
        """Standard deviations between expected forces [N] and the nearer one of the power's."""
        s = self._set
        forces, stds = np.array(either)
        rough = s.roughness * self._rough[i].take(*either[0])
        common = (s.force * self._body.mass) ** 2 + rough
        share = s.force_share * (self._dry[i] + np.abs(forces))
        spread = np.sqrt(common + stds**2 + share**2)
        off = (forces[:, None] - expected) / spread[:, None]
        nearer = np.where(np.abs(off[0]) < np.abs(off[1]), off[0], off[1])
        return np.asarray(np.maximum(np.minimum(nearer, s.farthest), -s.farthest))

    def _draw(self) -> None:
        """As many particles again, each as often as it weighs; what is constant is spread a bit."""
        n, random = self._set.particles, self._random
        places = (random.random() + np.arange(n)) / n
        kept = np.minimum(np.searchsorted(np.cumsum(self._weight), places), n - 1)
        self._twist, self._yaw = self._twist[kept], self._yaw[kept]
        self._traction = self._traction[kept] * np.exp(0.05 * random.standard_normal((n, 1)))
        self._offset = self._offset[kept]
        self._slope = self._spread(self._slope, kept)
        self._friction = self._spread(self._friction, kept)
        self._drag = self._spread(self._drag, kept)
        self._force, self._off = self._force[kept], self._off[kept]
        self._felt_off = self._felt_off[kept]
        self._shove = self._shove[kept]
        self._weight = np.full(n, 1.0 / n)

    def _spread(self, values: Array, kept: NDArray[np.intp]) -> Array:
        """Those that are kept, each a tenth of their standard deviation off."""
        deviation = np.sqrt(self._weight @ (values - self._weight @ values) ** 2)
        noise = 0.1 * deviation * self._random.standard_normal(values.shape)
        return np.asarray(values[kept] + noise)
