"""The library that sparse regression chooses from, and which of its terms an effect brings.

Variables are the simulation's, free of noise: a regression on differentiated encoders does worse.
w: wheel speed, a: its derivative, i: motor current with the sign of its torque, h: where the wheel
rolls to against the start of the recording.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.simulation import RecordingSimulation

Array = NDArray[np.float64]
Shape = tuple[frozenset[str], frozenset[str]]

_SLOW = 0.15  # of the RMS speed: where friction at low speed is looked for


def series_of(simulation: RecordingSimulation, robot: Robot) -> dict[str, Array]:
    """All terms for a recording driven by a robot: means over driver periods by wheel, (n, 3)."""
    run, period = simulation.run(robot), simulation.timeline.period
    w, power, copper = run.speed, run.power, run.copper
    idle = [robot.effect("electrical.driver_standby", wheel) for wheel in range(WHEELS)]
    mechanical = power - copper - np.array([item["power"] if item else 0.0 for item in idle])
    resistance = np.array([motor.resistance for motor in robot.motors])
    i = np.sign(mechanical * w) * np.sqrt(copper / resistance)
    angle = robot.wheel_offset + 2.0 * np.pi * np.arange(WHEELS) / WHEELS
    h = period * np.cumsum(run.yaw_rate)[:, None] + angle - 0.5 * np.pi
    twist = w @ np.linalg.inv(twist_to_wheels(robot)).T
    slides = np.sign(twist[:, :2] @ np.stack([np.cos(angle), np.sin(angle)]))  # along the axles
    rollers = 0.5 * (np.roll(slides, -1, axis=1) - np.roll(slides, 1, axis=1))
    slow = np.exp(-((w / (_SLOW * np.sqrt(np.mean(w**2)) + 1e-9)) ** 2))
    return {
        "1": np.ones_like(w),
        "w": w,
        "|w|": np.abs(w),
        "w^2": w**2,
        "w|w|": w * np.abs(w),
        "|w|^3": np.abs(w) ** 3,
        "|w| slow": np.abs(w) * slow,
        "i": i,
        "|i|": np.abs(i),
        "i^2": i**2,
        "w i": w * i,
        "w a": w * np.gradient(w, period, axis=0),
        "w rollers": w * rollers,  # the other two wheels' drag
        "w cos h": w * np.cos(h),
        "w sin h": w * np.sin(h),
        "braking": np.maximum(-power, 0.0),
        "dP/dt": np.gradient(power, period, axis=0),
    }


def columns_of(
    simulation: RecordingSimulation, series: Mapping[str, Array], channel: Channel
) -> Array:
    """Terms at a power channel's times, (n, terms); summed over the wheels for the total."""
    when = channel.time - 0.5 * channel.span
    middle = simulation.timeline.middle
    columns = [
        np.interp(
            when, middle, term.sum(axis=1) if channel.wheel is None else term[:, channel.wheel]
        )
        for term in series.values()
    ]
    return np.stack(columns, axis=1)


def _shape(own: str, along: str = "") -> Shape:
    """Terms that show an effect, and terms that come along with it."""
    return frozenset(own.split(", ")), frozenset(along.split(", ")) - {""}


# The loop holds the speed: a torque T costs w T, and about |i| T in the winding.
# Effects that no term shows are missing.
_NOTHING: Shape = (frozenset(), frozenset())
_COPPER = _shape("i^2", "w i")
_BODY = _shape("w a", "i^2, w i, i, braking")
_SHAPES: Mapping[str, Shape] = {
    "friction.coulomb": _shape("|w|", "|i|"),
    "friction.viscous": _shape("w^2", "w i"),
    "friction.stribeck": _shape("|w| slow", "|w|, |i|"),
    "friction.asymmetric": _shape("w", "i"),
    "friction.load_dependent": _shape("w i", "braking, i^2"),
    "friction.quadratic": _shape("|w|^3", "w i"),
    "contact.roller_drag": _shape("w rollers", "i"),
    "contact.rolling_resistance": _shape("|w|", "|i|"),
    "body.payload_mass": _BODY,
    "body.slope": _shape("w cos h, w sin h", "i"),
    "electrical.winding_heating": _COPPER,
    "electrical.driver_standby": _shape("1"),
    "electrical.switching_loss": _shape("|i|"),
    "electrical.regeneration_loss": _shape("braking"),
    "electrical.iron_loss": _shape("|w|, w^2", "|i|, w i"),
    "sensor.power_scale": _shape("w i, i^2", "1, |i|, |w|, w^2, w a"),
    "sensor.power_bias": _shape("1"),
    "sensor.power_lag": _shape("dP/dt"),
    "sensor.clock_offset": _shape("dP/dt"),
    "parameter.robot.mass": _BODY,
    "parameter.robot.inertia_z": _BODY,
    "parameter.motor.resistance": _COPPER,
    "parameter.motor.torque_constant": _COPPER,
    "parameter.supply.auxiliary_power": _shape("1"),
}


def shape_of(effect: str) -> Shape:
    """Terms of an effect or of a wrong parameter; none where the library has no such term."""
    included = effect.removeprefix("parameter.physics.").rpartition(".")[0]
    return _SHAPES.get(effect, _SHAPES.get(included, _NOTHING))


def allowed(effects: Iterable[str]) -> frozenset[str]:
    """All terms that any of some effects brings."""
    shapes = [shape_of(effect) for effect in effects]
    return frozenset[str]().union(*(own | along for own, along in shapes))
