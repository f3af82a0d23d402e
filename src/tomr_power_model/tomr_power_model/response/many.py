"""The drivers' closed loop of many robots at once, over many stretches of one recording.

The same loop as `closed_loop`, with every quantity an array (v, c, 3): v variants of a robot, c
stretches that begin a warm-up earlier, wheels. Stretches run side by side because the loop forgets
in less than a second; variants, because a derivative is the difference of two of them.

Each driver period h is integrated in `substeps` equal parts; the voltage holds over the period.
Drivers far faster than a step need to be are taken as continuous, in steps of `_COARSEST`:

    v(t) = v(0) - k_p (omega(t) - omega(0)),   so that D grows by k k_p / R

with v(0) of the error at the step's start, limited; the exponential is exact for it.
"""

import math
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray
from scipy.linalg import expm

from tomr_power_model.physics.effects import COPPER, Effect, WheelState, acting, stacked_effects
from tomr_power_model.physics.model import STICKING_SLIDE, PhysicalModel
from tomr_power_model.response.contacts import Contacts
from tomr_power_model.response.sliding import Sliding
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]

_COARSEST = 0.005  # s, of a substep
_FAST = 0.4  # of it: drivers with a shorter period are continuous
_NO_SLIDE = 1e-12


def is_continuous(robot: Robot) -> bool:
    """Whether a robot's drivers are so fast that their loop is taken as continuous."""
    return robot.controller.rate * _FAST * _COARSEST > 1.0


def step_of(robot: Robot) -> float:
    """The driver's period, or what stands for it where the loop is continuous [s]."""
    return _COARSEST if is_continuous(robot) else 1.0 / robot.controller.rate


@frozen
class Stretches:
    """What the loops are driven with: c stretches of s driver periods, variants alike.

    Where variants differ the first axis has length v, else 1.
    """

    set_speed: Array  # wheel speeds asked for by the ramped command [rad/s], (1 or v, c, s, 3)
    speed: Array  # wheel speeds at the start [rad/s], (c, 3)
    acceleration: Array  # rad/s^2, (c, 3)
    angle: Array  # wheel angles at the start, as joint_states count them [rad], (c, 3)
    heading: Array  # of base_link against the start of the recording [rad], (c,)
    warm: Array | None = None  # winding temperature above 25 C [K], (v, c, s, 3); None: cold
    prompt: bool = False  # whether the drivers' sum of errors holds the present one already
    torque: Array | None = None  # that resists besides, as a function of time [N m], (v, c, s, 3)
    # Angles at the start of each period as measured: a simulated wheel is soon a tooth off [rad].
    told: Array | None = None  # (c, s, 3); None: as simulated


@frozen
class Runs:
    """What came out, means over substeps of the driver periods; arrays (s, v, c, ...)."""

    speed: Array  # of the wheels [rad/s], (s, v, c, 3)
    power: Array  # drawn by each driver [W], (s, v, c, 3)
    tilt: Array  # change of that power from a substep's start to its end [W], (s, v, c, 3)
    voltage: Array  # of the supply [V], (s, v, c)
    yaw_rate: Array  # rad/s, (s, v, c)
    copper: Array  # i^2 R of each motor [W], (s, v, c, 3)
    current: Array  # of each motor, positive where it drives forwards [A], (s, v, c, 3)


@frozen
class ManyLoops:
    """Loops of v robots that share a driver period; see `closed_loop.ClosedLoop` for the names."""

    period_s: float
    substeps: int
    continuous: bool
    inertia: Array  # M as the wheels feel it, (v, 3, 3)
    decay: Array  # E^T, (v, 3, 3): rows of wheels times it
    gain: Array  # G^T
    damping: Array  # of the wheels, motors included [N m s/rad], (v, 1, 3)
    body_mass: Array  # at base_link, (v, 3, 3)
    wheel_inertia: Array  # wheel and rotor at the axle [kg m^2], (v, 1, 3)
    constant: Array  # k, (v, 1, 3)
    resistance: Array  # ohm, (v, 1, 3)
    to_twist: Array  # transposed, (v, 3, 3)
    from_force: Array  # transposed
    turning: Array  # (v, 3, 3)
    axles: Array  # (3, 2)
    mass: Array  # (v, 1, 1)
    rotor: Array  # rotor inertia at the wheel [kg m^2], (v, 1, 3)
    normal: Array  # of a robot at rest [N], (v, 1, 3)
    tilting: Array  # change of the loads per acceleration along the axles [N s^2/m], (v, 1, 1)
    wheel_radius: Array  # (v, 1, 3)
    gear_ratio: Array  # (v, 1, 3)
    proportional: Array  # (v, 1, 1)
    integral: Array  # (v, 1, 1)
    voltage: Array  # nominal [V], (v, 1, 1)
    auxiliary: Array  # W, (v, 1)
    effects: tuple[Effect, ...] = field(repr=False)

    @classmethod
    def of(cls, robots: Sequence[Robot]) -> Self:
        """Discretise the loops of robots that differ in numbers, not in the driver's rate."""
        models = [PhysicalModel.of(robot) for robot in robots]
        period, continuous = step_of(robots[0]), is_continuous(robots[0])
        substeps = max(1, math.ceil(period / _COARSEST - 1e-9))
        bodies = [model.body for model in models]

        def rows(values: Callable[[int], object]) -> Array:
            return np.array([values(v) for v in range(len(robots))], dtype=np.float64)

        constant = rows(lambda v: models[v].constant)
        resistance = rows(lambda v: models[v].resistance)
        viscous = rows(lambda v: models[v].viscous)
        inertia = rows(lambda v: bodies[v].wheel_mass_matrix)
        proportional = rows(lambda v: robots[v].controller.proportional)[:, None]
        damping = np.zeros_like(inertia)
        damping[:, range(3), range(3)] = constant**2 / resistance + viscous
        if continuous:
            damping[:, range(3), range(3)] += constant * proportional / resistance
        decay = expm(-(period / substeps) * np.linalg.solve(inertia, damping))
        gain = (np.eye(3) - decay) @ np.linalg.inv(damping)
        transposed = (0, 2, 1)
        return cls(
            period_s=period,
            substeps=substeps,
            continuous=continuous,
            inertia=inertia.transpose(transposed),
            decay=decay.transpose(transposed),
            gain=gain.transpose(transposed),
            damping=np.einsum("vii->vi", damping)[:, None, :],
            body_mass=rows(lambda v: bodies[v].mass_matrix),
            wheel_inertia=rows(lambda v: bodies[v].wheel_inertia)[:, None, :],
            constant=constant[:, None, :],
            resistance=resistance[:, None, :],
            to_twist=rows(lambda v: bodies[v].to_twist.T),
            from_force=rows(lambda v: bodies[v].from_force.T),
            turning=rows(lambda v: bodies[v].turning),
            axles=bodies[0].axles,
            mass=rows(lambda v: bodies[v].mass)[:, None, None],
            rotor=rows(lambda v: [m.gear_ratio**2 * m.rotor_inertia for m in robots[v].motors])[
                :, None, :
            ],
            normal=rows(lambda v: bodies[v].normal)[:, None, :],
            tilting=rows(lambda v: 2.0 * bodies[v].mass * _height(robots[v]) / 3.0)[:, None, None],
            wheel_radius=rows(lambda v: models[v].wheel_radius)[:, None, :],
            gear_ratio=rows(lambda v: models[v].gear_ratio)[:, None, :],
            proportional=proportional[:, None],
            integral=rows(lambda v: robots[v].controller.integral)[:, None, None],
            voltage=rows(lambda v: robots[v].supply.nominal_voltage)[:, None, None],
            auxiliary=rows(lambda v: robots[v].supply.auxiliary_power)[:, None],
            effects=stacked_effects(robots),
        )

    def run(self, stretches: Stretches, tick: Callable[[], None] = lambda: None) -> Runs:
        """Run all variants over all stretches; `tick` is called once per driver period."""
        loop = _Stepper(self, stretches)
        count = stretches.set_speed.shape[2]
        shape = count * self.substeps, *loop.speed.shape[:2]
        runs = Runs(
            speed=np.empty((*shape, 3)),
            power=np.empty((*shape, 3)),
            tilt=np.empty((*shape, 3)),
            voltage=np.empty(shape),
            yaw_rate=np.empty(shape),
            copper=np.empty((*shape, 3)),
            current=np.empty((*shape, 3)),
        )
        for step in range(count):
            loop.period(step, runs)
            tick()
        return runs


class _Stepper:
    """State of all loops while they run; arrays (v, c, 3)."""

    def __init__(self, loops: ManyLoops, stretches: Stretches) -> None:
        self._loops = loops
        self._stretches = stretches
        torques = 1 if stretches.torque is None else len(stretches.torque)
        variants = max(len(loops.constant), torques)
        shape = (variants, *stretches.speed.shape)
        self.speed = np.broadcast_to(stretches.speed, shape).copy()
        self.turned = np.zeros(shape)
        self.before = self.turned  # at the start of the period, where the angle was `begin`
        self.begin = stretches.angle
        self.heading = np.broadcast_to(stretches.heading, shape[:2]).copy()
        self.torque = np.zeros(shape)  # of the motors [N m]
        self.acceleration = np.broadcast_to(stretches.acceleration, shape).copy()
        self.measured = self.speed.copy()
        self.drawn = np.zeros(shape[:2])  # A of the whole robot
        self.extra: Array | float = 0.0
        self.acting = acting(loops.effects)
        self.drag = self._drag(loops.normal)
        self.normal = np.broadcast_to(loops.normal, shape)
        self.slide = np.asarray(
            loops.wheel_radius * sum((e.axle_slip() for e in loops.effects), np.zeros((1, 1, 3)))
        )
        self.leans = any(e.needs_load for e in loops.effects) and bool(np.any(loops.tilting))
        self.holds = bool(np.any(self.drag)) and not np.any(self.slide)
        self.contacts = Contacts.of(loops.gain, loops.to_twist, loops.axles if self.holds else None)
        self.friction = np.zeros((*shape[:2], self.contacts.count))
        self.sag = np.asarray(sum((e.voltage_drop() for e in loops.effects), np.zeros(1)))
        self.integral = self._steady()
        self.sliding = self._sliding()

    def _sliding(self) -> Sliding | None:
        """What moves where wheels slide; None if none can."""
        limits = [effect.grip() for effect in self.acting["grip"]]
        if not limits:
            return None
        loops = self._loops
        return Sliding.of(
            np.asarray(limits[0]),
            loops.wheel_radius,
            loops.to_twist,
            loops.body_mass,
            loops.wheel_inertia,
            loops.damping,
            loops.turning,
            loops.axles,
            loops.period_s / loops.substeps,
            self.speed,
        )

    def _steady(self) -> Array:
        """Integrals [rad] that hold the motion which the stretches begin with."""
        loops = self._loops
        state = self._state()
        dry, moving = self._resistance(state)
        inertial = self.acceleration @ loops.inertia
        torque = inertial + self._external(self.speed) + dry * np.sign(self.speed) + moving
        volts = loops.constant * self.speed + torque * loops.resistance / loops.constant
        return np.where(loops.integral > 0.0, volts / np.maximum(loops.integral, 1e-12), 0.0)

    def _drag(self, normal: Array) -> Array:
        """Limits of the rollers' drag along the axles [N]."""
        still = np.zeros_like(normal)
        return np.asarray(sum((e.axle_drag(normal) for e in self._loops.effects), still))

    def _loads(self) -> Array:
        """Wheel loads [N]: speeding up leans on the wheels behind, height over radius much."""
        loops = self._loops
        if self.sliding is None:
            twist, change = self.speed @ loops.to_twist, self.acceleration @ loops.to_twist
        else:
            twist, change = self.sliding.twist, self.sliding.change
        yaw = twist[..., 2]
        along = np.stack(
            [change[..., 0] - yaw * twist[..., 1], change[..., 1] + yaw * twist[..., 0]], axis=-1
        )
        return np.maximum(loops.normal - loops.tilting * (along @ loops.axles.T), 0.0)

    def _state(self) -> WheelState:
        loops = self._loops
        transmitted = self.torque - loops.rotor * self.acceleration
        angle = self.begin + self.turned - self.before
        return WheelState(
            self.speed, self.normal, transmitted, loops.wheel_radius, loops.gear_ratio, angle
        )

    def _resistance(self, state: WheelState) -> tuple[Array, Array]:
        """Limit of dry friction, and the torque that is neither dry nor viscous [N m]."""
        still = np.zeros_like(self.speed)
        dry = sum((e.dry_torque(state) for e in self.acting["dry_torque"]), still)
        moving = sum((e.moving_torque(state) for e in self.acting["moving_torque"]), still)
        return np.maximum(dry, 0.0), np.asarray(moving)

    def _external(self, speed: Array) -> Array:
        """Wheel torques of omega x v, of axle drag and of the floor's slope [N m]."""
        loops = self._loops
        twist = speed @ loops.to_twist
        self.yaw_rate = twist[..., 2]
        force = twist[..., 2:] * (twist @ loops.turning)
        if np.any(self.slide):
            along = twist[..., :2] @ loops.axles.T
            sliding = np.maximum(np.hypot(along, self.slide * speed), _NO_SLIDE)
            share = np.tanh(sliding / STICKING_SLIDE) * along / sliding
            force[..., :2] += (self.drag * share) @ loops.axles
        if self.acting["floor_force"]:
            force -= self._slope()
        return np.asarray(force @ loops.from_force)

    def _slope(self) -> Array:
        """Force of a tilted floor on the body [N, N, N m]."""
        force = np.zeros_like(self.speed)
        for effect in self.acting["floor_force"]:
            force[..., :2] += effect.floor_force(self._loops.mass, self.heading[..., None])
        return force

    def _volts(self, step: int) -> Array:
        """Voltages of the drivers [V], after one control step."""
        loops = self._loops
        error = self._stretches.set_speed[:, :, step] - self.measured
        total = self.integral + error * loops.period_s
        summed = total if self._stretches.prompt else self.integral
        wanted = loops.proportional * error + loops.integral * summed
        volts = np.clip(wanted, -loops.voltage, loops.voltage)
        self.integral = np.where(volts == wanted, total, self.integral)
        return np.asarray(volts)

    def period(self, step: int, runs: Runs) -> None:
        """One driver period; writes its means into the runs."""
        loops, warm = self._loops, self._stretches.warm
        before = self.turned
        if self._stretches.told is not None:
            self.before, self.begin = before, self._stretches.told[:, step]
        bus = loops.voltage[..., 0] - self.sag * self.drawn
        volts = self._volts(step) * (bus[..., None] / loops.voltage)
        resistance = loops.resistance
        if warm is not None:
            resistance = resistance * (1.0 + COPPER * warm[:, :, step])
        drawn = np.zeros(volts.shape[:2])
        rows = range(step * loops.substeps, (step + 1) * loops.substeps)
        extra = self._stretches.torque
        self.extra = 0.0 if extra is None else extra[:, :, step]
        for row in rows:
            turned, speed = self.turned, self.speed
            mean_volts, current = self._substep(volts, resistance)
            before_it = (mean_volts - loops.constant * speed) / resistance
            after_it = 2.0 * current - before_it
            first = self._drawn(mean_volts * before_it, before_it)
            last = self._drawn(mean_volts * after_it, after_it)
            power = 0.5 * (first + last)
            runs.tilt[row] = last - first
            drawn += power.sum(axis=2)
            runs.power[row] = power
            runs.copper[row] = resistance * current**2
            runs.current[row] = current
            runs.speed[row] = (self.turned - turned) * (loops.substeps / loops.period_s)
            runs.yaw_rate[row] = self.yaw_rate
        mean_speed = (self.turned - before) / loops.period_s
        self.measured = self.speed if loops.continuous else mean_speed
        self.drawn = (drawn / loops.substeps + loops.auxiliary) / bus
        runs.voltage[rows.start : rows.stop] = loops.voltage[..., 0] - self.sag * self.drawn

    def _substep(self, volts: Array, resistance: Array) -> tuple[Array, Array]:
        """Advance all wheels; returns the mean voltages [V] and motor currents [A]."""
        loops = self._loops
        # What a continuous driver takes back while the wheel speeds up is in the damping.
        back = loops.proportional if loops.continuous else 0.0
        held = volts + back * self.speed if loops.continuous else volts
        duration = loops.period_s / loops.substeps
        if self.leans:
            self.normal = self._loads()
            self.drag = self._drag(self.normal)
        dry, moving = self._resistance(self._state())
        load = loops.constant / resistance * held - moving - self.extra
        if resistance is not loops.resistance:
            # The discretised damping is that of cold windings: what is less is given back.
            damped = loops.constant * (loops.constant + back)
            load += damped * (1.0 / loops.resistance - 1.0 / resistance) * self.speed
        free = self.speed @ loops.decay + (load - self._external(self.speed)) @ loops.gain
        limits = dry
        if self.holds:
            limits = np.concatenate([dry, np.broadcast_to(self.drag, dry.shape)], axis=-1)
        self.friction = self.contacts.solve(free, limits, self.friction)
        speed = free - self.contacts.effect(self.friction)
        mean = 0.5 * (speed + self.speed)
        if self.sliding is not None:
            speed, mean, self.yaw_rate = self.sliding.step(
                self.speed,
                speed,
                load,
                dry,
                self.friction[..., :3],
                self.normal,
                self.drag,
                self._slope(),
            )
        self.acceleration = (speed - self.speed) / duration
        self.speed = speed
        self.turned = self.turned + mean * duration
        self.heading += self.yaw_rate * duration
        mean_volts = held - back * mean if loops.continuous else volts
        current = (mean_volts - loops.constant * mean) / resistance
        self.torque = loops.constant * current
        return mean_volts, np.asarray(current)

    def _drawn(self, power: Array, current: Array) -> Array:
        for effect in self.acting["supplied"]:
            power = effect.supplied(power)
        for effect in self.acting["driver_power"]:
            power = power + effect.driver_power(current)
        return power


def _height(robot: Robot) -> float:
    """Height of the mass centre over the distance of the contacts from the middle [-]."""
    return robot.mass_center[2] / robot.robot_radius
