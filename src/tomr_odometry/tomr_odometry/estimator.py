"""Streaming odometry: messages in, an estimate per tick out; driven by stamps alone."""

import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tomr_odometry.aided import Aided, mean_of
from tomr_odometry.belief import Belief
from tomr_odometry.estimate import NOT_USED, SLIDES, SLIDES_UNAIDED, Estimate, assumptions
from tomr_odometry.grip import Available, Floor
from tomr_odometry.hindsight import Inputs
from tomr_odometry.kernel import AX, CREEP, GYRO, RIM, SLOPE, VX, WZ, step
from tomr_odometry.lifted import Lifted
from tomr_odometry.rims import Rims
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.start import Beginning, start
from tomr_odometry.traction import Traction, Tractions
from tomr_odometry.unaided import FEWEST_POWERS, Unaided
from tomr_odometry.used import UsedTraction
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.geometry.poses import moved
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.stamps import RecentStamps
from tomr_power_model.model.ticks import Arrival, TickClock, to_ns
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

_LEAST_STEP_NS = to_ns(0.004)  # between encoder samples that are used
_SILENT_NS = to_ns(0.1)  # of the encoders, from which the IMU alone goes on
_UNKNOWN_WAY = 1e4  # m^2
_FRESH_NS = to_ns(0.25)  # how long a sensor may be silent
_NONE_SLIDES, _ALL = np.zeros(WHEELS, dtype=bool), np.ones(WHEELS, dtype=bool)
_ALONG, _EACH = np.diag([1.0, 1.0, 0.0]), np.eye(3)
_TURNING = 0.02  # m/s: below it there is no slip ratio, for next to nothing moves
_SEEN = 0.01  # m/s, the least sliding that is one
_SLIDES_ON = 2.0  # s, for which a slide may go on unseen
_GRID_NS = to_ns(1.0)  # of data, between two maps of the floor
_TRAVEL_TIME = 0.3  # s, over which the speed of travel is averaged where creep depends on it
_AHEAD = 0.25  # s, for which the motion of the last encoder sample is taken to go on
_LOST_SPEED = 1.0  # m/s, by which a robot without encoders may be off
_LOST_MOST = 10.0  # s, after which it may be off no further
_FASTEST = 30.0  # m/s, of a rim
_TILTED = 1.5  # m/s^2, of gravity in what a tilted robot feels along the floor
_CARRIED_SPEED = 1.0  # m/s/sqrt(Hz)


class SlipOdometry:
    """The core of `slip_odometry` and `tomr_odometry`."""

    def __init__(self, robot: Robot, settings: OdometrySettings | None = None) -> None:
        self.settings = given = settings or OdometrySettings()
        self._robot = robot
        self._clock = TickClock(given.ticks)
        self._tractions = Tractions(robot)
        self._body, self._radius = body_of(robot)
        self._flaws = EncoderFlaws.of(robot)
        # Without an IMU wheels may slide unseen: the covariance has to allow for it. With one whose
        # biases no standstill has shown yet, what slides from the start may look like a bias.
        noise = given.noise
        self._unsure = noise._replace(way=noise.unaided_way, turn=noise.unaided_turn)
        self._unaided = self._unsure._replace(slip_rate=0.0)
        # Magnitudes of currents are good for creep, but no evidence of what the body does.
        self._are_evidence = robot.measurement.signed
        self.floor = Floor(robot)
        self._wanted = {"encoders": "encoders", "imu": "imu/data"}  # streams, and what they are
        if robot.measurement.source != "total_only":
            names = enumerate(robot.wheel_topics)
            self._wanted |= {f"power {wheel}": f"{name}/power" for wheel, name in names}
        self._by_power = Unaided(robot, self._body, self._radius)
        self._belief = Belief(robot, self._body.to_twist)
        self._clear()

    def _clear(self) -> None:
        self._tractions.clear()
        self._by_power.clear()
        self._queues: dict[str, deque[tuple[int, str, tuple[float, ...]]]] = {}
        self._time = 0  # of the filter's state [ns]
        self._mode = np.zeros(4)
        self._beginning = Beginning(self.settings.creep)
        self._x, self._P = start(self.settings.noise, self.settings.creep)
        self._rims = Rims(self._radius)
        self._stamps = RecentStamps()
        self._forces, self._force_std = np.full((2, WHEELS), np.nan)
        self._used = UsedTraction(self._body, self._radius)
        self._travel = np.zeros(2)
        self._available = Available()
        self._inertial: list[tuple[float, ...]] = []
        self._aided = Aided(self._body)
        self._tractive: list[Traction] = []
        self._heard: dict[str, int] = {}
        self._is_aided = False
        self._lifted = Lifted()
        self._belief.clear(np.zeros(3))
        self._seen = np.zeros(3)  # m/s, m/s, rad/s: the twist at the last sample of the IMU

    def _start_afresh(self, stamp_ns: int) -> None:
        """After a leap of the stamps: where the robot was, and how far it may have come since.

        The frame goes on as before: a pose that leaps with the clock is wrong wherever it leaps to.
        """
        leap = min(1e-9 * abs(stamp_ns - self._time), _LOST_MOST) if self._time else 0.0
        pose, spread = self._x[:3].copy(), self._P[:3, :3] + (_LOST_SPEED * leap) ** 2 * np.eye(3)
        self._clear()
        self._x[:3] += pose
        self._belief.clear(pose)
        self._P[:3, :3] += spread

    def command(self, stamp_ns: int, twist: Triple) -> Arrival:
        """Take a commanded twist [m/s, m/s, rad/s]."""
        return self._arrive("command", stamp_ns, twist, periodic=False)

    def encoders(self, stamp_ns: int, position: Triple, velocity: Triple) -> Arrival:
        """Take wheel angles [rad]; the speeds that a message reports are not used."""
        return self._arrive("encoders", stamp_ns, position)

    def imu(self, stamp_ns: int, values: tuple[float, ...]) -> Arrival:
        """Take angular rates [rad/s] and specific forces [m/s^2], x, y and z each."""
        return self._arrive("imu", stamp_ns, values)

    def power(self, reading: PowerReading) -> Arrival:
        """Take what a motor draws."""
        value = reading.current if self._robot.measurement.quantity != "power" else reading.power
        return self._arrive(f"power {reading.wheel}", reading.stamp_ns, (value,))

    def _arrive(
        self, stream: str, stamp_ns: int, values: tuple[float, ...], periodic: bool = True
    ) -> Arrival:
        arrival = self._clock.arrive(stream, stamp_ns, periodic)
        if arrival is Arrival.RESTARTED:
            self._start_afresh(stamp_ns)
        if arrival in (Arrival.TAKEN, Arrival.RESTARTED):
            self._queues.setdefault(stream, deque()).append((stamp_ns, stream, values))
        return arrival

    def due(self) -> Iterator[Estimate]:
        """Estimates for the ticks that the stamps have reached, in order."""
        for tick in self._clock.due():
            for stamp, stream, values in self._until(tick):
                if stream == "imu" and not self._belief.take(stamp, values):
                    continue
                self._heard[stream] = stamp
                self._take(stamp, stream, values)
            if self._time:
                yield self._estimate(tick)

    def _until(self, tick: int) -> list[tuple[int, str, tuple[float, ...]]]:
        """All samples up to a tick, in the order of their stamps."""
        found = []
        for queue in self._queues.values():
            while queue and queue[0][0] <= tick:
                found.append(queue.popleft())
        return sorted(found)

    def _take(self, stamp: int, stream: str, values: tuple[float, ...]) -> None:
        if stream == "command":
            self._tractions.command(stamp, (values[0], values[1], values[2]))
        elif stream == "encoders":
            self._count(stamp, np.array(values))
        elif stream == "imu":
            if self.settings.use_imu and self._time:
                self._inertial.append(values)
                self._lifted.take(stamp, values)
                if self._is_aided and stamp - self._time > _SILENT_NS:
                    unknown = np.full(WHEELS, _UNKNOWN_WAY)
                    self._step(stamp, np.stack([self._x[RIM : RIM + WHEELS], unknown]))
        elif self.settings.use_power and self._time and int(stream[-1]) < WHEELS:
            found = self._tractions.power(stamp, int(stream[-1]), values[0])
            if found is not None:
                self._tractive.append(found)

    def _is_fresh(self, stream: str, now: int) -> bool:
        return now - self._heard.get(stream, -_FRESH_NS) < _FRESH_NS

    def _count(self, stamp: int, angle: Array) -> None:
        """Take an encoder sample: the filter goes on to it."""
        if not np.isfinite(angle).all():
            return
        counted = (angle[0], angle[1], angle[2])
        self._stamps.add(stamp, counted)
        (time,) = self._stamps.times([stamp])
        angle = self._flaws.angle(angle)
        if self._time:
            is_aided = self.settings.use_imu and self._is_fresh("imu", stamp)
            if self._is_aided and not is_aided:
                self._lose_sight()
            self._is_aided = is_aided
            # With an IMU the filter weighs itself whether encoders that repeat are frozen.
            is_frozen = not self._is_aided and self._rims.is_frozen(time, angle)
            if time - self._time < _LEAST_STEP_NS or is_frozen:
                return
        noise = self.settings.noise
        ways = self._rims.take(time, angle, noise.jitter)
        ways[1] += noise.rim**2
        is_stuck, is_mistaken = self._belief.look(time, self._rims.speed, ways[0])
        if (is_stuck or is_mistaken) and self._is_aided:
            self._disbelieve(all_along=is_mistaken)
        self._tractions.encoders(time, counted)
        if self._time:
            self._step(time, ways)
        self._time = time

    def _lose_sight(self) -> None:
        """The IMU is dead: wheels that slide go on unseen, and so do those that began since."""
        sliding = self._rims.speed - self._body.rows @ self._seen
        lost = (float(np.abs(sliding).max()) * _SLIDES_ON) ** 2
        for place in (0, 1):
            self._P[place, place] += lost

    def _disbelieve(self, *, all_along: bool) -> None:
        """The IMU has repeated itself for a while, or was wrong `all_along`: what came of that is
        forgotten."""
        was = self._x
        self._x = was.copy()
        if all_along:
            self._x, self._P = start(self.settings.noise, self.settings.creep)
            self._x[:3], self._x[RIM : RIM + WHEELS] = self._belief.pose, was[RIM : RIM + WHEELS]
        self._lose_sight()
        self._x[VX : WZ + 1] = self._body.to_twist @ self._rims.speed
        for place, off in enumerate(was[: WZ + 1] - self._x[: WZ + 1]):
            self._P[place, place] += off**2
        self._heard["imu"] -= _FRESH_NS
        self._inertial = []  # not what came since the last step, either
        self._is_aided = False

    def _step(self, time: int, ways: Array) -> None:
        """Go on to a time, with the ways of the rims there."""
        dt = 1e-9 * (time - self._time)
        self._keep_forces(dt)
        self._ask_power(dt)
        ways[0] -= self._by_power.slid
        inertial = mean_of(self._inertial)
        self._inertial, self._tractive = [], []
        self._advance(time, dt, ways, inertial)
        if self._by_power.correction is not None:
            self._x[:3] = moved(self._x[:3], self._by_power.correction)
        self._time = time
        self._rims.passes(self._body.rows @ self._x[VX : WZ + 1])
        if time < self._lifted.until:
            lost = _CARRIED_SPEED**2 * dt
            for place in (0, 1, 2, VX, VX + 1, WZ):
                self._P[place, place] += lost
        sliding = self._slides
        self._available.take(self._forces, self._force_std, sliding, dt)
        self.floor.take(self._x[:3], sliding, self._forces / self._body.load)

    @property
    def _probability(self) -> Array:
        """That each wheel slides."""
        return self._mode[:3] if self._is_aided else self._by_power.probability

    @property
    def _slides(self) -> NDArray[np.bool_]:
        """Which wheels are said to slide."""
        return self._probability > (SLIDES if self._is_aided else SLIDES_UNAIDED)

    def _ask_power(self, dt: float) -> None:
        """What the contacts slid in a step without an IMU."""
        is_known = self._are_evidence and np.isfinite(self._forces).sum() >= FEWEST_POWERS
        is_asked = is_known and not self._is_aided
        speeds = self._tractions.speeds if is_asked else None
        if speeds is None:
            self._by_power.rest()
            return
        twist, rims = self._x[VX : WZ + 1], speeds * self._radius
        if not max(np.abs(rims).max(), np.abs(self._body.rows @ twist).max()) < _FASTEST:
            self._by_power.rest()  # counts that leap, not a motion
            return
        self._by_power.step(dt, twist, rims, self._tractive)
        for found in self._tractive:
            near = found.nearer(self._by_power.force[found.wheel])
            self._forces[found.wheel], self._force_std[found.wheel] = near

    def _keep_forces(self, dt: float) -> None:
        """Keep what creep and messages need of the contacts' forces."""
        for found in self._tractive:
            self._forces[found.wheel], self._force_std[found.wheel] = found.force, found.std
        for wheel in range(WHEELS):
            if not self._is_fresh(f"power {wheel}", self._heard["encoders"]):
                self._forces[wheel] = self._force_std[wheel] = math.nan
        self._used.take(self._forces, self._tractions.shown if self._tractive else None, dt)

    def _advance(self, time: int, dt: float, rims: Array, inertial: Array) -> None:
        keep = math.exp(-dt / _TRAVEL_TIME)
        self._travel = self._x[VX : VX + 2] + keep * (self._travel - self._x[VX : VX + 2])
        used = self.settings.creep.shape(self._used.value) * math.hypot(*self._travel)
        if not self._is_aided:
            self._aided.clear()
            self._P = step(
                self._x, self._P, self._body, self._unaided, self._mode, used, dt,
                rims, inertial, _NONE_SLIDES,
            )  # fmt: skip
            return
        is_carried = time < self._lifted.until
        noise = self.settings.noise if self._beginning.has_stood else self._unsure
        if is_carried:
            noise = noise._replace(accelerometer=_TILTED)
        given = Inputs(1e-9 * time, dt, noise, used, rims, inertial)
        self._P = self._aided.step(
            self._x, self._P, self._mode, given, self._rims,
            is_known=self._beginning.has_stood and not is_carried,
        )  # fmt: skip
        if not np.isnan(inertial).all():
            self._seen = self._x[VX : WZ + 1].copy()
        self._x, self._P = self._beginning.step(
            (self._x, self._P), self._mode, given, self._rims.rest, is_carried
        )

    def _estimate(self, tick: int) -> Estimate:
        x, P, body = self._x, self._P, self._body
        ahead = 1e-9 * (tick - self._time)
        dt = min(ahead, _AHEAD)
        twist = x[VX : WZ + 1] + x[AX : AX + 3] * min(max(dt, 0.0), 0.05)
        pose = moved(x[:3], twist * dt)
        silent = 1e-9 * (tick - self._rims.time) - _AHEAD
        # Encoders are silent: anything may happen.
        lost = (_LOST_SPEED * max(silent, 0.0)) ** 2 * _EACH
        creeps = x[CREEP] * self.settings.creep.shape(self._used.value) * math.hypot(*self._travel)
        sliding, slip = self._slip(body.rows @ twist, creeps)
        missing, sensors = self._sensors(tick)
        is_due = self.settings.publish_floor and tick % _GRID_NS < self.settings.ticks.period
        return Estimate(
            stamp_ns=tick,
            pose=pose,
            pose_covariance=P[:3, :3] + lost,
            twist=twist,
            twist_covariance=P[VX : WZ + 1, VX : WZ + 1] + lost + self._unseen(),
            slip=slip,
            sliding=sliding,
            creeping=creeps,
            probability=self._probability.copy(),
            slides=self._slides,
            traction=self._forces.copy(),
            traction_std=self._force_std.copy(),
            available=self._available.interval,
            floor=self.floor.grid() if is_due else None,
            is_carried=tick < self._lifted.until,
            missing=missing,
            sensors=sensors,
            assumed=tuple(
                assumptions(
                    missing, creeps=self.settings.creep.is_known, by_power=self._by_power.is_at_work
                )
            ),
            learnt=self._learnt(),
        )

    def _slip(self, ground: Array, creeps: Array) -> tuple[Array, Array]:
        """How fast the rims turn over the ground [m/s], and the slip ratios.

        With an IMU the twist shows it, of wheels that slide too slowly to be noticed as well.
        """
        rim, is_sliding = self._rims.speed, self._slides
        if self._is_aided:
            sliding = self._rims.sliding
            is_seen = is_sliding | (np.abs(sliding) > np.maximum(_SEEN, 2.0 * self._rims.blur))
        else:
            # Creep is of the way of the last moments, and so is the rim that it is compared with.
            calm = self._body.rows @ (*self._travel, self._x[WZ]) + creeps
            sliding, rim = np.where(is_sliding, (rim - ground, rim), (creeps, calm))
            is_seen = _ALL
        larger = np.maximum(np.abs(rim), np.abs(rim - sliding))
        is_seen = is_seen & (larger > _TURNING)
        return sliding, np.where(is_seen, sliding / np.maximum(larger, _TURNING), 0.0)

    def _unseen(self) -> Array:
        """Variance of a velocity that nothing but the wheels shows, or an IMU alone."""
        adrift = self._aided.drift**2 * _ALONG
        if self._is_aided and self._beginning.has_stood:
            return adrift
        noise, travel = self._unsure, math.hypot(*self._travel)
        # What makes the pose spread as it does where slides last so long.
        unseen = np.square((noise.way, noise.way, noise.turn)) * travel**2 / _SLIDES_ON
        return self._by_power.covariance + np.diag(unseen) + adrift

    def _sensors(self, tick: int) -> tuple[tuple[str, ...], tuple[tuple[str, str], ...]]:
        """Sensors that are silent, and what is used of each."""
        missing, found = [], []
        for name, said in self._wanted.items():
            is_off = name == "imu" and not self.settings.use_imu
            if self._is_fresh(name, tick) and not is_off:
                found.append((said, "used"))
                continue
            missing.append(said)
            why = "silent" if name in self._heard else "not there"
            if name == "imu" and self._belief.mistake and not is_off:
                why = f"{NOT_USED}: {self._belief.mistake}"
            found.append((said, why))
        return tuple(missing), tuple(found)

    def _learnt(self) -> tuple[tuple[str, float], ...]:
        x = self._x
        named = [("creep", x[CREEP]), ("gyro_bias", x[GYRO])]
        named += [("slope_x", x[SLOPE]), ("slope_y", x[SLOPE + 1])]
        return tuple((name, float(value)) for name, value in named)
