"""What befalls a drive, driver period by driver period: commands, faults, bumps."""

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import no_input, timing_of
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive, severity_of, wheel_of
from tomr_training.planar.faults import DOWNHILL, SLOPE, friction_left, number

Array = NDArray[np.float64]

TICK = 0.05  # s


def tick_count(drive: Drive) -> int:
    """Whole ticks of a drive."""
    return math.floor(drive.length / TICK)


def commanded(drive: Drive, robot: Robot) -> Array:
    """Inputs of a robot that only hears the commands, (periods, input_size)."""
    period = timing_of(robot.controller.rate).period
    count = math.ceil(tick_count(drive) * TICK / period - 1e-6)
    inputs = np.tile(no_input(WHEELS), (count, 1))
    times, twists = drive.commands
    starts = np.ceil((times + robot.controller.delay) / period - 1e-6).astype(np.int64)
    lengths = np.diff(np.clip(np.append(starts, count), 0, count))
    held = np.repeat(twists, lengths, axis=0)
    inputs[count - len(held) :, at.COMMAND : at.COMMAND + 3] = held
    return inputs


def disturbed(drive: Drive, robot: Robot) -> Array:
    """Inputs of a robot that faults and bumps befall as well, (periods, input_size)."""
    inputs = commanded(drive, robot)
    period = timing_of(robot.controller.rate).period

    def rows(start: float, end: float) -> slice:
        return slice(period_at(start, period), period_at(end, period))

    for bump in (*drive.bumps, *drive.gusts):
        push = slice(at.PUSH, at.PUSH + 3)
        inputs[rows(bump.start, bump.start + bump.duration), push] += [*bump.force, bump.moment]
    for fault in drive.mission.faults:
        when = rows(fault.start, end_of(fault, drive))
        if fault.fault_id in _SHARES:
            field, share = _SHARES[fault.fault_id](fault, drive)
            wheel = wheel_of(fault)
            columns = _column(field) if wheel is None else [_column(field)[wheel]]
            inputs[when, columns] *= share
        if SLOPE in fault.settings:
            pull, azimuth = number(fault, SLOPE), number(fault, DOWNHILL)
            inputs[when, at.PUSH] += pull * math.cos(azimuth)
            inputs[when, at.PUSH + 1] += pull * math.sin(azimuth)
    return inputs


def _floor_left(fault: PlannedFault, drive: Drive) -> tuple[int, float]:
    floor = drive.mission.floor_friction
    return at.FLOOR, friction_left(fault, floor) / floor


def _voltage_left(fault: PlannedFault, drive: Drive) -> tuple[int, float]:
    missing = number(fault, "undervoltage")
    return at.CONNECTED, 1.0 - missing / drive.plant.supply.nominal_voltage


# Faults that leave a share of an input: of which, and how much.
_SHARES: Mapping[str, Callable[[PlannedFault, Drive], tuple[int, float]]] = {
    "floor_slippery": _floor_left,
    "supply_low": _voltage_left,
    "control_signal_lost": lambda fault, drive: (at.CONNECTED, 1.0 - severity_of(fault)),
    "encoder_lost": lambda fault, drive: (at.COUNTS, 1.0 - severity_of(fault)),
}


def counted_shares(inputs: Array) -> Array:
    """Share of the encoders' counts that is reported in each period, (periods, 3)."""
    return np.asarray(inputs[:, _column(at.COUNTS)])


def faulty_ticks(drive: Drive, fault: PlannedFault) -> NDArray[np.bool_]:
    """Whether a fault is in force, (ticks,)."""
    faulty = np.zeros(tick_count(drive), dtype=bool)
    faulty[math.floor(fault.start / TICK) : math.ceil(end_of(fault, drive) / TICK)] = True
    return faulty


def end_of(fault: PlannedFault, drive: Drive) -> float:
    """When a fault ends [s]."""
    return drive.length if fault.end is None else fault.end


def _column(field: int) -> list[int]:
    """Where the wheels' inputs of a kind stand."""
    return [at.INPUT_HEADER + wheel * at.INPUT_WHEEL + field for wheel in range(WHEELS)]


def period_at(time: float, period: float) -> int:
    """First period that does not begin before a time [s]."""
    return math.ceil(time / period - 1e-6)
