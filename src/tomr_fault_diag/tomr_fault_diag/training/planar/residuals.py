"""The ten residuals of many drives at once: the numbers of the model and residual stages.

The stages go message by message; this goes step by step for all drives together, and test holds
the two against each other.
"""

import numpy as np
from attrs import frozen

from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.training.planar.fleet import RATE, Array, Fleet
from tomr_fault_diag.training.planar.plant import Drivers, times
from tomr_fault_diag.training.planar.schedule import STEPS, TICK, Schedule
from tomr_fault_diag.training.planar.sensors import ENCODER_RATE, Signals
from tomr_power_model.physics.model import _STICKING_SPEED as STICKING_SPEED

_SWEEPS = 2
_TRANSIENT_TICKS = 3
_WINDOW = 0.07  # s, of the fit to the encoders


@frozen
class Compared:
    """What is compared in each tick; arrays (ticks, channels, n)."""

    modelled: Array  # as in a frame: total, motors, speeds, motors from encoders; 10 channels
    measured: Array  # the same

    def residuals(self, bands: BandSettings) -> tuple[Array, Array]:
        """Residuals and bands, (ticks, 10, n), as `ResidualStage` gives them."""
        residual = self.measured - self.modelled
        speeds = slice(4, 7)
        residual[:, speeds] *= np.where(self.modelled[:, speeds] < 0.0, -1.0, 1.0)
        least = np.array([bands.power * bands.total_factor, *[bands.power] * 3])
        floor = np.concatenate([least, [bands.speed] * 3, [bands.power] * 3])[:, None]
        relative = np.array(
            [bands.total_relative]
            + [bands.relative] * 3
            + [bands.speed_relative] * 3
            + [bands.relative] * 3
        )
        band = np.maximum(floor, relative[:, None] * np.abs(self.modelled))
        change = np.full(10, bands.transient)
        change[speeds] = bands.speed_transient
        return residual, band + change[:, None] * spread(self.modelled)


def spread(values: Array) -> Array:
    """Largest minus least over this tick and the two before, (ticks, ...)."""
    low, high = values.copy(), values.copy()
    for back in range(1, _TRANSIENT_TICKS):
        low[back:] = np.minimum(low[back:], values[:-back])
        high[back:] = np.maximum(high[back:], values[:-back])
    return high - low


def compare(believed: Fleet, schedule: Schedule, signals: Signals) -> Compared:
    """Modelled and measured values of every tick, the description being `believed`."""
    edges = _expected(believed, schedule)
    speed = 0.5 * (edges[1:] + edges[:-1])
    power = _power(believed, speed, RATE * (edges[1:] - edges[:-1]))
    ticks = len(power) // STEPS

    def mean(values: Array) -> Array:
        return np.asarray(values.reshape(ticks, STEPS, *values.shape[1:]).mean(axis=1))

    commanded = mean(power)
    seen_speed, seen_acceleration = _fitted(signals, ticks)
    derived = _power(believed, seen_speed, seen_acceleration)
    total = commanded.sum(axis=1, keepdims=True) + believed.auxiliary
    drawn = _averaged(signals, ticks)
    return Compared(
        np.concatenate([total, commanded, mean(speed), derived], axis=1),
        np.concatenate([drawn[:, 3:], drawn[:, :3], seen_speed, drawn[:, :3]], axis=1),
    )


def _expected(fleet: Fleet, schedule: Schedule) -> Array:
    """Wheel speeds at the ends of the steps, (m + 1, 3, n): `response.closed_loop` side by side."""
    step = 1.0 / RATE
    damping = fleet.constant**2 / fleet.resistance + fleet.viscous
    decay, gain = _discretised(fleet, damping, step)
    drive = fleet.constant / fleet.resistance
    drivers = Drivers(fleet)
    speed = np.zeros((3, len(fleet)))
    measured, friction = speed.copy(), speed.copy()
    edges = np.zeros((len(schedule.command) + 1, 3, len(fleet)))
    for k, command in enumerate(schedule.command):
        volts = drivers.volts(command, measured)
        load = drive * volts - turning_torque(fleet, speed)
        free = times(decay, speed) + times(gain, load)
        for _ in range(_SWEEPS):
            for i in range(3):
                others = gain[i, i - 1] * friction[i - 1] + gain[i, i - 2] * friction[i - 2]
                wanted = (free[i] - others) / gain[i, i]
                friction[i] = np.minimum(np.maximum(wanted, -fleet.dry[i]), fleet.dry[i])
        after = free - times(gain, friction)
        measured = 0.5 * (after + speed)
        speed = edges[k + 1] = after
    return edges


def _discretised(fleet: Fleet, damping: Array, step: float) -> tuple[Array, Array]:
    """E and G of the closed loop, (3, 3, n)."""
    body = np.moveaxis(fleet.mass_matrix, -1, 0)
    back = np.moveaxis(fleet.to_twist, -1, 0)
    eye = np.eye(3)
    inertia = back.swapaxes(1, 2) @ body @ back + eye * fleet.inertia.T[:, None, :]
    # exp(-h M^-1 D) by the eigenvectors of the symmetric D^-1/2 M D^-1/2.
    root = np.sqrt(damping.T)
    values, vectors = np.linalg.eigh(inertia / root[:, :, None] / root[:, None, :])
    shape = vectors * np.exp(-step / values)[:, None, :]
    decay = (shape @ vectors.swapaxes(1, 2)) / root[:, :, None] * root[:, None, :]
    gain = (eye - decay) / damping.T[:, None, :]
    return np.moveaxis(decay, 0, -1), np.moveaxis(gain, 0, -1)


def turning_torque(fleet: Fleet, speed: Array) -> Array:
    """Wheel torques of the omega x v terms [N m], (..., 3, n)."""
    twist = times(fleet.to_twist, speed)
    vx, vy, wz = twist[..., 0, :], twist[..., 1, :], twist[..., 2, :]
    mass, (x, y) = fleet.mass, fleet.mass_center
    force = np.stack([-(vy + wz * x), vx - wz * y, x * vx + y * vy], axis=-2)
    return times(fleet.to_twist.swapaxes(0, 1), (mass * wz)[..., None, :] * force)


def _power(fleet: Fleet, speed: Array, acceleration: Array) -> Array:
    """Power of each driver [W], (m, 3, n): inverse dynamics, motors, friction, standby."""
    inertia = np.einsum(
        "abn,bcn,cdn->adn", fleet.to_twist.swapaxes(0, 1), fleet.mass_matrix, fleet.to_twist
    )
    torque = times(inertia, acceleration) + turning_torque(fleet, speed)
    torque += acceleration * fleet.inertia
    torque += fleet.dry * np.tanh(speed / STICKING_SPEED) + fleet.viscous * speed
    current = torque / fleet.constant
    return np.asarray(
        (fleet.resistance * current + fleet.constant * speed) * current + fleet.standby
    )


def _fitted(signals: Signals, ticks: int) -> tuple[Array, Array]:
    """Speed and acceleration of the wheels by the fit of `model.encoders`, (ticks, 3, n)."""
    per_tick = round(TICK * ENCODER_RATE)
    last = (
        per_tick * np.arange(1, ticks + 1) + 1
    )  # a jittering sample may belong to the tick before
    reach = np.arange(-round(_WINDOW * ENCODER_RATE) - 2, 1)
    index = np.clip(last[:, None] + reach, 0, len(signals.encoder_time) - 1)
    real = (last[:, None] + reach == index)[:, :, None]
    tick = TICK * np.arange(1, ticks + 1)[:, None, None]
    time = signals.encoder_time[index]  # (ticks, candidates, n)
    inside = real & (time <= tick + 1e-9) & (time > tick - _WINDOW + 1e-9)
    unit = 0.05
    s = np.where(inside, (time - tick + 0.5 * TICK) / unit, 0.0)
    position = signals.position[index] - signals.position[index[:, :1]]
    weight = inside.astype(np.float64)
    p0, p1, p2, p3, p4 = (np.sum(weight * s**k, axis=1) for k in range(5))
    q = [np.einsum("tcn,tcwn->twn", weight * s**k, position) for k in range(3)]
    # Cramer's rule for the normal equations; only slope and curvature are wanted.
    c00, c01, c02 = p2 * p4 - p3 * p3, p2 * p3 - p1 * p4, p1 * p3 - p2 * p2
    c11, c12, c22 = p0 * p4 - p2 * p2, p1 * p2 - p0 * p3, p0 * p2 - p1 * p1
    determinant = p0 * c00 + p1 * c01 + p2 * c02
    determinant = np.where(determinant == 0.0, np.nan, determinant)[:, None]
    slope = (c01[:, None] * q[0] + c11[:, None] * q[1] + c12[:, None] * q[2]) / determinant
    curve = (c02[:, None] * q[0] + c12[:, None] * q[1] + c22[:, None] * q[2]) / determinant
    return slope / unit, 2.0 * curve / unit**2


def _averaged(signals: Signals, ticks: int) -> Array:
    """Mean measured power in each tick [W], (ticks, 4, n)."""
    power = signals.voltage * signals.drawn
    tick = np.ceil(signals.power_time / TICK - 1e-6).astype(np.int64) - 1  # (k, n)
    count = tick.shape[1]
    flat = np.clip(tick, -1, ticks)  # those of time 0 and after the end go to the borders
    place = (flat + 1) * count + np.arange(count)
    size = (ticks + 2) * count
    number = np.bincount(place.ravel(), minlength=size).reshape(ticks + 2, count)
    sums = [
        np.bincount(place.ravel(), power[:, channel].ravel(), size).reshape(ticks + 2, count)
        for channel in range(power.shape[1])
    ]
    return np.asarray(np.stack(sums, axis=1)[1:-1] / np.maximum(number[1:-1], 1)[:, None])
