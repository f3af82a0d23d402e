"""Gross mistakes in a description, found in the recordings: which one, and what to mend.

Encoders against commands show the order, directions, places and radius of the wheels; power against
both shows motor, gear and mass. What is a little off is for `tomr_gap explain`; here a value is
twice what it should be, or belongs to another wheel.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.cut import without
from tomr_power_model.drive.motion import measured_speed
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import WHEELS, Robot, robot_from_parameters
from tomr_reality_gap.alignment.channels import DRAWN_KINDS, channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation

Array = NDArray[np.float64]

_FACTORS = (2.0, 0.5)
_SHOWN = 60.0  # s of a recording that are simulated
_FOREVER = 1e9  # s
_LEAST_SAMPLES = 200
_LEAST_LENGTH = 0.05  # (rad/s)/(m/s): a wheel that answers to nothing
_OFF = 0.3  # relative error of the answers as described from which on something is wrong
_FITS = 0.12  # and with the mistake mended
_POWER_OFF = 0.3  # NRMSE of power from which on a value may be grossly wrong; mended it is less
_POWER_BETTER = 0.5  # part of it that mending must leave, at most
_ALIKE = 1.4  # mistakes whose error is within this factor of the least are named together


@frozen
class _Answer:
    """How wheels would answer to commands if the description had one mistake."""

    mistake: str
    remedy: str
    matrix: Array  # wheel speeds by twist, (3, 3)


def check_wheels(drives: Sequence[Drive], robot: Robot, place: str) -> None:
    """Raise InputError where wheels answer to commands as another description says."""
    seen = _answers(drives)
    if seen is None:
        return
    expected = twist_to_wheels(robot, nominal=True)
    error = _distance(seen, expected)
    if error < _OFF:
        return
    # Of mistakes that look alike the first is the likeliest.
    best = min(
        _mistaken(robot, expected), key=lambda answer: round(_distance(seen, answer.matrix), 3)
    )
    if _distance(seen, best.matrix) < _FITS:
        raise InputError(
            f"{place}: {best.mistake}: encoders against commands are {100 * error:.0f} % off as "
            f"described, {100 * _distance(seen, best.matrix):.0f} % so: {best.remedy}"
        )


def _answers(drives: Sequence[Drive]) -> Array | None:
    """Wheel speeds by commanded twist, (3, 3); None where the commands do not show them."""
    asked, speeds = [], []
    for drive in drives:
        if len(drive.command_time) < 2:
            continue
        held = drive.command_at(drive.encoder_time)
        speed = measured_speed(drive)
        known = np.isfinite(held).all(axis=1) & np.isfinite(speed).all(axis=1)
        known &= np.abs(held).any(axis=1)
        asked.append(held[known])
        speeds.append(speed[known])
    if sum(map(len, asked)) < _LEAST_SAMPLES:
        return None
    commands = np.concatenate(asked)
    if np.linalg.cond(commands) > 100.0:
        return None
    found, *_ = np.linalg.lstsq(commands, np.concatenate(speeds), rcond=None)
    matrix = np.asarray(found.T)
    return matrix if (np.linalg.norm(matrix, axis=1) > _LEAST_LENGTH).all() else None


def _distance(seen: Array, expected: Array) -> float:
    """Relative difference; answers that lag seem a little small, so their size is free by 15 %."""
    scale = float(np.clip(np.sum(seen * expected) / np.sum(expected**2), 0.85, 1.05))
    return float(np.linalg.norm(seen - scale * expected) / np.linalg.norm(seen))


def _mistaken(robot: Robot, expected: Array) -> Iterator[_Answer]:
    names = robot.wheel_names
    for order in permutations(range(WHEELS)):
        if order != (0, 1, 2):
            # The wheel called names[i] turns as the one in place order[i] should.
            right = [names[order.index(position)] for position in range(WHEELS)]
            yield _Answer(
                "the order of the wheels is wrong",
                f"write robot.wheel_names: [{', '.join(right)}]",
                expected[list(order)],
            )
    for wheel, name in enumerate(names):
        signs = np.ones((WHEELS, 1))
        signs[wheel] = -1.0
        yield _Answer(
            f"the encoder of {name} counts against its sense",
            "change its sign in the driver",
            signs * expected,
        )
    yield _Answer(
        "all wheels turn against their sense", "change the signs in the driver", -expected
    )
    for degrees in range(30, 360, 30):
        angle = math.radians(degrees)
        turned = expected.copy()
        turned[:, :2] = expected[:, :2] @ _rotation(angle)
        offset = round(math.remainder(robot.wheel_offset + angle, 2.0 * math.pi), 4) + 0.0
        yield _Answer(
            f"the wheels stand {degrees} degrees further around than described",
            f"write robot.wheel_offset: {offset:g}",
            turned,
        )
    for axis, what in ((1, "linear.y"), (2, "angular.z")):
        flipped = expected.copy()
        flipped[:, axis] *= -1.0
        yield _Answer(
            f"{what} of the commands has the wrong sign",
            "commands are in base_link with y to the left and z up (REP 103): mend what sends them",
            flipped,
        )
    for factor in _FACTORS:
        yield _Answer(
            f"the wheels turn {factor:g} times as fast as described",
            f"write robot.wheel_radius: {robot.wheel_radius / factor:g}, or mend the gear ratio "
            "by which the driver counts",
            factor * expected,
        )
        wide = expected.copy()
        wide[:, 2] *= factor
        yield _Answer(
            f"the wheels stand {factor:g} times as far out as described",
            f"write robot.robot_radius: {factor * robot.robot_radius:g}",
            wide,
        )


def _rotation(angle: float) -> Array:
    """Takes a twist's linear part to that seen from axes turned by an angle [rad], (2, 2)."""
    return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])


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
