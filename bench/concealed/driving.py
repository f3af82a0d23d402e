"""A drive of the MuJoCo robot as it really was: exact, fine in time, before any sensor."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.signal import lfilter

from concealed.concealing import Hidden, beyond_effects, robot_of
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import WHEELS
from tomr_sim_bridge.missions.mission import Plan
from tomr_sim_bridge.plant import moments
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects import make_effects
from tomr_sim_bridge.plant.simulation import Simulation

Array = NDArray[np.float64]

BATTERY = WHEELS  # its column among the supplies
STEP = 0.005  # s: a stretch of the plant, and the window of a power monitor
_STEP_NS = round(STEP * NANOSECONDS)
_ACCELERATION_SPAN = 2  # steps
# The plant's own sensors stay idle: this bench has its own, see sensing.py. The drivers count
# without quanta: what quanta stir up in the loop is chance, and no oracle could predict it.
_IDLE = {
    "power_rate": 1.0,
    "encoder_rate": 1.0,
    "imu_rate": 1.0,
    "odometry_rate": 0.1,
    "encoder_resolution": 0.0,
}


@frozen
class Track:
    """What happened; times in seconds since the start. Supplies: wheels 1 to 3, battery."""

    command_time: Array  # (c,)
    command: Array  # m/s, m/s, rad/s, (c, 3)
    time: Array  # every 5 ms, (n,)
    angle: Array  # of the wheels [rad], (n, 3)
    voltage: Array  # integral of the bus voltage [V s], (n,)
    charge: Array  # integral of the current drawn, as the power monitors see it [A s], (n, 4)
    turning: Array  # angular velocity in base_link [rad/s], (n, 3)
    pull: Array  # acceleration less gravity in base_link [m/s^2], (n, 3)
    delay: Array  # of the power monitors' clocks [s], (4,)

    def supply_at(self, when: Array, supply: int) -> tuple[Array, Array]:
        """Voltage [V] and current drawn [A] averaged over the 5 ms before each time."""
        return self._mean(self.voltage, when, 0.0), self._mean(
            self.charge[:, supply], when, float(self.delay[supply])
        )

    def power_at(self, when: Array, supply: int) -> Array:
        """Power drawn [W], from the averaged voltage and current as a monitor reports it."""
        voltage, current = self.supply_at(when, supply)
        return voltage * current

    def _mean(self, integral: Array, when: Array, delay: float) -> Array:
        until = np.maximum(when - delay, self.time[1])
        after, before = (np.interp(at, self.time, integral) for at in (until, until - STEP))
        return np.asarray((after - before) / STEP)


def commands_of(plan: Plan) -> tuple[Array, Array]:
    """Times [s] and twists (v_x, v_y [m/s], omega_z [rad/s]) of a mission's commands."""
    planned = list(plan.commands())
    return np.array([at for at, _ in planned]), np.array([twist for _, twist in planned])


def track_of(
    parameters: Mapping[str, Any],
    hidden: Sequence[Hidden],
    commands: tuple[Array, Array],
    seed: int,
) -> Track:
    """Drive.

    Args:
        parameters: flat, of the robot; its drivers must run at 200 Hz or a whole part of it.
        hidden: what is concealed; only what lies outside the vocabulary is looked at here.
        commands: times [s] and twists (v_x, v_y [m/s], omega_z [rad/s]).
        seed: of the rollers' places at the start.
    """
    robot = robot_of(parameters, **_IDLE)
    design = PlantDesign.of(robot)
    for effect in make_effects(robot):
        effect.shape(design)
    simulation = Simulation(robot, seed, further_effects=beyond_effects(hidden, robot))
    rows = [simulation.latest.values]
    for at, twist in zip(*commands, strict=True):
        stamp = round(at * NANOSECONDS)
        _step_to(simulation, stamp, rows)
        v_x, v_y, omega_z = (float(value) for value in twist)
        simulation.command(v_x, v_y, omega_z, stamp_ns=stamp)
    return _track(np.array(rows), design, commands)


def _step_to(simulation: Simulation, stamp: int, rows: list[Array]) -> None:
    while len(rows) * _STEP_NS <= stamp:
        simulation.step_to(len(rows) * _STEP_NS)
        rows.append(simulation.latest.values)


def _track(rows: Array, design: PlantDesign, commands: tuple[Array, Array]) -> Track:
    voltage = rows[:, moments.VOLTAGE]
    charge = np.column_stack([rows[:, moments.SUPPLY_CURRENT], rows[:, moments.TOTAL_CURRENT]])
    for wheel in range(WHEELS):
        charge[:, wheel] = _as_monitored(charge[:, wheel], voltage, design, wheel)
    charge[:, WHEELS] *= design.total_scale
    return Track(
        command_time=commands[0],
        command=commands[1],
        time=STEP * np.arange(len(rows), dtype=np.float64),
        angle=rows[:, moments.ENCODER],
        voltage=voltage,
        charge=charge,
        turning=rows[:, moments.ANGULAR],
        pull=_pull(rows, design),
        delay=np.append(design.power_delay, 0.0),
    )


def _as_monitored(charge: Array, voltage: Array, design: PlantDesign, wheel: int) -> Array:
    """Charge [A s] that a wheel's monitor counts: with its lag, its scale and its bias."""
    current, bus = np.diff(charge) / STEP, np.diff(voltage) / STEP
    lag = float(design.power_lag[wheel])
    if lag > 0.0:
        keep = np.exp(-STEP / lag)
        first = current[0]
        current = first + lfilter([1.0 - keep], [1.0, -keep], current - first)
    current = float(design.power_scale[wheel]) * current + float(design.power_bias[wheel]) / bus
    return np.concatenate([[0.0], np.cumsum(current) * STEP])


def _pull(rows: Array, design: PlantDesign) -> Array:
    """What an accelerometer feels [m/s^2], shape (n, 3)."""
    span = _ACCELERATION_SPAN
    velocity = rows[:, moments.VELOCITY]
    felt = np.zeros_like(velocity) - design.gravity
    felt[span:] += (velocity[span:] - velocity[:-span]) / (span * STEP)
    cosine, sine = np.cos(rows[:, moments.YAW]), np.sin(rows[:, moments.YAW])
    x, y, z = felt.T
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x, z])
