"""Gross mistakes in a description, found in the recordings: which one, and what to mend.

Encoders against commands show the order, directions, places and radius of the wheels
(`drive.mistakes`); power against both shows motor, gear and mass. What is a little off is for
`tomr_gap explain`.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.cut import without
from tomr_power_model.drive.inertial import without_mistaken_imu
from tomr_power_model.drive.mistakes import gross_mistake
from tomr_power_model.drive.motion import measured_speed
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation

Array = NDArray[np.float64]

_FACTORS = (2.0, 0.5)
_SHOWN = 60.0  # s of a recording that are simulated
_FOREVER = 1e9  # s
_POWER_OFF = 0.3  # NRMSE of power from which on a value may be grossly wrong; mended it is less
_POWER_BETTER = 0.5  # part of it that mending must leave, at most
_ALIKE = 1.4  # mistakes whose error is within this factor of the least are named together


def check_wheels(drives: Sequence[Drive], robot: Robot, place: str) -> None:
    """Raise InputError where wheels answer to commands as another description says."""
    known = [drive for drive in drives if len(drive.command_time) > 1]
    asked = [drive.command_at(drive.encoder_time) for drive in known]
    if not known:
        return
    speed = [measured_speed(drive) for drive in known]
    seen, remedy = gross_mistake(np.concatenate(asked), np.concatenate(speed), robot)
    if seen:
        raise InputError(f"{place}: {seen}: {remedy}")


def notes_on(drives: Sequence[Drive], robot: Robot) -> list[str]:
    """What is to be said of recordings, and of an IMU that is not as described."""
    return [
        note for drive in drives for note in (*drive.notes, *without_mistaken_imu(drive, robot)[1])
    ]


_VALUES: Mapping[str, str] = {
    "motor.gear_ratio": "the gear ratio",
    "motor.torque_constant": "the torque constant",
    "motor.resistance": "the resistance of the motors",
    "robot.mass": "the mass",
    "robot.inertia_z": "the moment of inertia",
}


def check_values(drive: Drive, values: Mapping[str, object], place: str) -> None:
    """Raise InputError where one value twice or half as large simulates the power far better."""
    robot = robot_from_parameters(values, place)
    simulation = _simulation(drive, robot)
    tried = [
        (key, factor)
        for key in _VALUES
        for factor in _FACTORS
        if isinstance(values.get(key), int | float)
    ]
    robots = [robot, *(_changed(values, key, factor, place) for key, factor in tried)]
    errors = [_error(simulation, row) for row in simulation.predict(robots)]
    described, others = errors[0], errors[1:]
    least = min(others, default=described)
    if described < _POWER_OFF or least > min(_POWER_OFF, _POWER_BETTER * described):
        return
    alike = sorted(
        (error, key, factor)
        for error, (key, factor) in zip(others, tried, strict=True)
        if error < _ALIKE * least
    )
    suspects = " or ".join(f"{_VALUES[key]} seems {_times(factor)}" for _, key, factor in alike)
    checks = " and ".join(f"{key} = {values[key]}" for _, key, _ in alike)
    raise InputError(
        f"{place}: {suspects} what is described: simulated power is {100 * described:.0f} % off "
        f"as described, {100 * least:.0f} % so: check {checks}"
    )


def _times(factor: float) -> str:
    return "half" if factor == 0.5 else "twice" if factor == 2.0 else f"{factor:g} times"


def _simulation(drive: Drive, robot: Robot) -> RecordingSimulation:
    shown = without(cleaned(drive, robot), [(_SHOWN, _FOREVER)])
    return RecordingSimulation.of(shown, robot, channels_of(shown, robot))


def _changed(values: Mapping[str, object], key: str, factor: float, place: str) -> Robot:
    value = values[key]
    assert isinstance(value, int | float)
    return robot_from_parameters({**values, key: factor * value}, place)


def _error(simulation: RecordingSimulation, row: Array) -> float:
    """RMS of measured - simulated over the spread, of everything that is drawn."""
    errors = [
        float(np.mean((channel.value - row[part]) ** 2) / max(float(np.var(channel.value)), 1e-12))
        for channel, part in zip(simulation.channels, rows_of(simulation.channels), strict=True)
        if channel.kind in DRAWN_KINDS
    ]
    return float(np.sqrt(np.mean(errors))) if errors else 0.0
