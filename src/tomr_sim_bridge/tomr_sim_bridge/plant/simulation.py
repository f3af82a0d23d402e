"""The simulated robot: commands and faults in, samples of its sensors out. No ROS."""

import math
from collections.abc import Sequence

import numpy as np
from attrs import define, frozen

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.faults import BodyMotion, FaultActions, FaultBoard
from tomr_sim_bridge.plant import moments
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.drivers import WheelDrivers
from tomr_sim_bridge.plant.effects import DriverPower, PlantEffect, WheelLoads, make_effects
from tomr_sim_bridge.plant.engine import OPEN_CIRCUIT, Engine
from tomr_sim_bridge.plant.moments import Memory, Moment
from tomr_sim_bridge.plant.power_monitor import WINDOW_NS
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.sensors import Sensors, quantise
from tomr_sim_bridge.plant.wheels import Vector, rolling_rows

LONGEST_STRETCH = 0.005  # s between two looks at friction, faults and supply
LONGEST_TIMESTEP = 0.001  # s
_LEAST_VOLTAGE = 1.0  # V that a flat battery keeps


@frozen
class TimeGrid:
    """How time is cut: steps make ticks of the drivers, ticks make stretches, or the reverse.

    Between two looks at friction, faults and supply lies a stretch of at most 5 ms: a whole
    number of control periods, or a whole part of one. The time step divides the control period.
    """

    control_period: float  # s
    stretch: float  # s
    stretches_per_tick: int  # 1 unless the control period is longer than a stretch
    runs: int  # pieces of a stretch, each with its own tick of the drivers
    steps: int  # integration steps per piece

    @classmethod
    def of(cls, rate: float) -> "TimeGrid":
        """The grid for drivers that run at `rate` [Hz]."""
        period = 1.0 / rate
        per_tick = math.ceil(period / LONGEST_STRETCH - 1e-9)
        runs = 1 if per_tick > 1 else max(1, math.floor(LONGEST_STRETCH / period + 1e-9))
        piece = period / per_tick
        steps = math.ceil(piece / LONGEST_TIMESTEP - 1e-9)
        return cls(period, piece * runs, per_tick, runs, steps)

    @property
    def timestep(self) -> float:
        """Integration step [s]."""
        return self.stretch / (self.runs * self.steps)


@define
class Ledger:
    """Where the energy went since the start [J]."""

    motors: float = 0.0  # electrical, into the motor terminals
    drivers: float = 0.0  # electrical, into the drivers
    copper: float = 0.0
    axles: float = 0.0  # dry and viscous resistance at the axles


class Simulation:
    """A robot on its floor, stepped in stretches of at most 5 ms.

    The same robot, seed and calls give the same samples.
    """

    def __init__(
        self,
        robot: Robot,
        seed: int = 0,
        *,
        start_ns: int = 0,
        floor_friction: float | None = None,
        payload: float = 0.0,
        stamp_jitter: float = 0.0,
        command_timeout: float = 0.0,
        further_effects: Sequence[PlantEffect] = (),
    ) -> None:
        """Build the plant at rest.

        Args:
            robot: its description; the effects in it are those of the plant.
            seed: of sensor noise, jitter and the rollers' places at the start.
            start_ns: stamp of the start [ns].
            floor_friction: traction coefficient, None for that of the description.
            payload: mass on top of the description [kg].
            stamp_jitter: standard deviation of the sampling times [s].
            command_timeout: a command this old counts as a stop [s]; 0: it is held.
            further_effects: physics that no description can name, on top of those in it.

        Raises:
            InputError: an effect that the plant cannot do, or impossible masses.
        """
        self.robot = robot
        self.faults = FaultBoard()
        self.ledger = Ledger()
        self._effects = [*make_effects(robot), *further_effects]
        design = PlantDesign.of(robot)
        for effect in self._effects:
            effect.shape(design)
        design.mass += payload
        if floor_friction is not None:
            design.floor_friction[:] = floor_friction
        self._design = design
        self._grid = TimeGrid.of(robot.controller.rate)
        random = np.random.default_rng(seed)
        phase = random.uniform(0.0, 2.0 * math.pi, WHEELS)
        self.engine = Engine(robot, design, self._grid.timestep, phase)
        self._drivers = WheelDrivers(robot, self._grid.control_period, command_timeout)
        self._start_ns = start_ns
        self._count = 0
        self._prepare_state()
        self._memory = self._idle_memory()
        self._sensors = Sensors(robot, design, self._memory, random, stamp_jitter)

    def _prepare_state(self) -> None:
        robot = self.robot
        self._rows = rolling_rows(robot)
        self._rotor = np.array(
            [motor.rotor_inertia * motor.gear_ratio**2 for motor in robot.motors]
        )
        self._constant = np.array([motor.wheel_constant for motor in robot.motors])
        self._resistance = np.array([motor.resistance for motor in robot.motors])
        self._needs_normal = any(effect.needs_normal_force for effect in self._effects)
        self._duty = np.zeros(WHEELS)
        self._transmitted = np.zeros(WHEELS)
        self._encoder = np.zeros(WHEELS)
        self._yaw = self.engine.yaw
        self._position = self.engine.position

    def _idle_memory(self) -> Memory:
        """A memory that starts as if the robot had stood idle for a while."""
        rates = self.robot.sensors
        longest = 1.0 / min(rates.encoder_rate, rates.power_rate) + float(
            self._design.power_delay.max()
        )
        depth = WINDOW_NS + round((longest + 0.05) * NANOSECONDS)
        idle = np.zeros(WHEELS)
        drivers = DriverPower(0.0, idle, idle, idle.copy(), self._resistance)
        for effect in self._effects:
            effect.bill(drivers)
        self._total_power = float(drivers.power.sum()) + self.robot.supply.auxiliary_power
        bus, past = self._bus_voltage(), depth / NANOSECONDS
        state = moments.blank()
        state[moments.VOLTAGE] = -bus * past
        state[moments.SUPPLY_CURRENT] = -drivers.power / bus * past
        state[moments.TOTAL_CURRENT] = -self._total_power / bus * past
        memory = Memory(Moment(self._start_ns - depth, state), depth)
        memory.append(Moment(self._start_ns, moments.blank()))
        return memory

    @property
    def stamp_ns(self) -> int:
        """Time of the plant [ns]."""
        return self._boundary(self._count)

    @property
    def latest(self) -> Moment:
        """What the sensors look at, at `stamp_ns`, before any flaw of theirs."""
        return self._memory.latest

    def _boundary(self, count: int) -> int:
        return self._start_ns + round(count * self._grid.stretch * NANOSECONDS)

    def command(self, v_x: float, v_y: float, omega_z: float, stamp_ns: int | None = None) -> None:
        """Command a body twist [m/s, rad/s], until the next or its timeout, from its stamp on."""
        stamp = self.stamp_ns if stamp_ns is None else stamp_ns
        self._drivers.command(stamp, np.array([v_x, v_y, omega_z]))

    def set_fault(self, fault_id: str, **settings: object) -> None:
        """Set a fault, in force from the next stretch on; severity 0 switches it off.

        Raises InputError for an unknown fault or setting, or a value out of range.
        """
        self.faults.set(fault_id, settings)

    def step_to(self, stamp_ns: int) -> list[Sample]:
        """Run up to a time and return the samples on the way, in the order of their stamps.

        Time advances in whole stretches: the plant stops at the last boundary not after
        `stamp_ns`, and the rest is run by the next call.
        """
        found: list[Sample] = []
        while self._boundary(self._count + 1) <= stamp_ns:
            found.extend(self._stretch())
        return found

    def _stretch(self) -> list[Sample]:
        engine = self.engine
        contact = engine.contacts(self._yaw)
        actions = self._actions(contact)
        engine.set_friction(actions.friction)
        bus = self._bus_voltage(actions.undervoltage)
        angle, speed = engine.angle, engine.speed
        loads = self._loads(angle, speed, actions)
        engine.set_push(actions.push + loads.push)
        current, motor_power = self._run(bus, actions)
        turned = engine.angle - angle
        power = self._settle_power(current, motor_power, loads, turned)
        rotor_acceleration = (engine.speed - speed) / self._grid.stretch
        constant = self._constant * actions.constant
        self._transmitted = constant * current - self._rotor * rotor_acceleration
        self._count += 1
        self._remember(bus, current, power, turned)
        commanded = (self._duty * self.robot.supply.nominal_voltage).tolist()
        return self._sensors.read(self.faults, actions, commanded)

    def _actions(self, contact: Vector) -> FaultActions:
        """What faults do during the coming stretch."""
        velocity = self.engine.velocity[:2]
        body = BodyMotion(
            time=(self.stamp_ns - self._start_ns) / NANOSECONDS,
            mass=self._design.mass,
            position=self._position[:2],
            yaw=self._yaw,
            velocity=velocity,
            yaw_rate=float(self.engine.angular_velocity[2]),
        )
        return self.faults.actions(contact, self._design.floor_friction, body)

    def _run(self, bus: float, actions: FaultActions) -> tuple[Vector, Vector]:
        """Mean motor currents [A] and terminal powers [W] of a stretch, each of shape (3,)."""
        engine, grid = self.engine, self._grid
        quantum = self.robot.sensors.encoder_resolution
        resistance = self._resistance * actions.resistance
        engine.set_motors(np.where(actions.connected, resistance, OPEN_CIRCUIT), actions.constant)
        self._drivers.obedience = actions.obedience
        mean_current, mean_power = np.zeros(WHEELS), np.zeros(WHEELS)
        for run in range(grid.runs):
            if self._count % grid.stretches_per_tick == 0:
                now = self.stamp_ns + round(run * grid.control_period * NANOSECONDS)
                self._duty = self._drivers.tick(now, quantise(self._encoder, quantum))
            voltage = np.where(actions.connected, self._duty * bus * actions.drive, 0.0)
            current, turned = engine.advance(grid.steps, voltage)
            self._encoder = self._encoder + self._counted(turned) * actions.encoder
            mean_current += current
            mean_power += voltage * current
        return mean_current / grid.runs, mean_power / grid.runs

    def _counted(self, turned: Vector) -> Vector:
        """What the encoders count of a turn [rad]: a disc off its centre runs fast and slow."""
        x, y = self._design.encoder_center.T
        rate = 1.0 + x * np.cos(self._encoder) + y * np.sin(self._encoder)
        return np.asarray(self._design.encoder_scale * turned / rate)

    def _loads(self, angle: Vector, speed: Vector, actions: FaultActions) -> WheelLoads:
        loads = WheelLoads(
            speed=speed,
            angle=angle,
            transmitted=self._transmitted,
            normal=(
                self.engine.normal_forces(self._grid.stretch)
                if self._needs_normal
                else np.zeros(WHEELS)
            ),
            contact=actions.contact,
            dry=actions.dry.copy(),
            viscous=np.zeros(WHEELS),
            torque=np.zeros(WHEELS),
            roller_force=np.zeros(WHEELS),
        )
        for effect in self._effects:
            effect.resist(loads)
        self.engine.set_loads(loads)
        return loads

    def _settle_power(
        self, current: Vector, motor_power: Vector, loads: WheelLoads, turned: Vector
    ) -> Vector:
        """Power drawn by the drivers [W], shape (3,), and the books."""
        drivers = DriverPower(
            self._grid.stretch, current, motor_power, motor_power.copy(), self._resistance
        )
        for effect in self._effects:
            effect.bill(drivers)
        copper = current**2 * self._resistance
        self._resistance = drivers.resistance
        others = drivers.other + self.robot.supply.auxiliary_power
        self._total_power = float(drivers.power.sum()) + others
        resisted = loads.dry * np.abs(turned) + loads.viscous * turned**2 / self._grid.stretch
        self.ledger.motors += float(motor_power.sum()) * self._grid.stretch
        self.ledger.drivers += float(drivers.power.sum()) * self._grid.stretch
        self.ledger.copper += float(copper.sum()) * self._grid.stretch
        self.ledger.axles += float(resisted.sum())
        return drivers.power

    def _bus_voltage(self, undervoltage: float = 0.0) -> float:
        """Voltage behind the battery's internal resistance at the power drawn last [V]."""
        open_voltage = max(self.robot.supply.nominal_voltage - undervoltage, _LEAST_VOLTAGE)
        room = open_voltage**2 - 4.0 * self._design.supply_resistance * self._total_power
        return (open_voltage + math.sqrt(max(room, 0.0))) / 2.0

    def _remember(self, bus: float, current: Vector, power: Vector, turned: Vector) -> None:
        engine, duration = self.engine, self._grid.stretch
        yaw, position = engine.yaw, engine.position
        state = self._memory.latest.values.copy()
        state[moments.ENCODER] = self._encoder
        state[moments.POSITION] = position[:2]
        state[moments.YAW] = yaw
        state[moments.VELOCITY] = engine.velocity
        state[moments.ANGULAR] = engine.angular_velocity
        state[moments.VOLTAGE] += bus * duration
        state[moments.SUPPLY_CURRENT] += power / bus * duration
        state[moments.MOTOR_CURRENT] += current * duration
        state[moments.TOTAL_CURRENT] += self._total_power / bus * duration
        middle = (yaw + self._yaw) / 2.0
        step = position - self._position
        cosine, sine = math.cos(middle), math.sin(middle)
        moved = np.array(
            [cosine * step[0] + sine * step[1], cosine * step[1] - sine * step[0], yaw - self._yaw]
        )
        state[moments.SLIP] += self._design.wheel_radius * turned - self._rows @ moved
        self._yaw, self._position = yaw, position
        self._memory.append(Moment(self.stamp_ns, state))
