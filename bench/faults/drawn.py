"""Faults to draw for a drive: those beyond the paper's, kinds that nobody knows, slip under a load;
and pushes."""

import math
from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
from attrs import evolve, frozen

from tomr_power_model.robot import Robot
from tomr_sim_bridge.faults import check_settings
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive

Random = np.random.Generator
Sized = tuple[dict[str, object], float]  # settings at severity 1, and the size to be scored by

EXTENDED = "extended states"
NOT_TRAINED = "unknown kinds"
LOADED_SLIP = "slip under a load"  # one of the paper's six, and no other state is right


def _severe(random: Random, robot: Robot) -> Sized:
    return {"severity": 0.8}, 0.8


@frozen
class Kind:
    """A fault to draw: its settings and the size by which it is scored."""

    fault_id: str
    draw: Callable[[Random, Robot], Sized]
    group: str = EXTENDED
    also: str = ""  # a second fault, of another kind, at once
    draw_also: Callable[[Random, Robot], Sized] = _severe


def _plain(random: Random, robot: Robot) -> Sized:
    return {}, 1.0


def _uniform(setting: str, low: float, high: float) -> Callable[[Random, Robot], Sized]:
    def draw(random: Random, robot: Robot) -> Sized:
        value = float(random.uniform(low, high))
        return {setting: value}, value

    return draw


def _drag(random: Random, robot: Robot) -> Sized:
    """In parts of the wheel's own dry friction."""
    own = robot.everywhere("friction.coulomb", "torque", 0.0)[0]
    share = float(random.uniform(0.3, 6.0))
    return {"torque": share * own}, share


def _scale(random: Random, robot: Robot) -> Sized:
    off = float(random.uniform(0.15, 0.7))
    return {"factor": 1.0 + off * float(random.choice([-1.0, 1.0]))}, off


def _bias(random: Random, robot: Robot) -> Sized:
    off = float(random.uniform(0.5, 6.0))
    return {"bias": off * float(random.choice([-1.0, 1.0]))}, off


def _towed(random: Random, robot: Robot) -> Sized:
    share = float(random.uniform(0.4, 1.5))  # N/kg
    return {"drag": share * robot.mass}, share


def _slippery(random: Random, robot: Robot) -> Sized:
    severity = float(random.uniform(0.5, 0.85))  # of traction 0.02 to 0.14 is left
    return {"severity": severity}, severity


def _hindered(random: Random, robot: Robot) -> Sized:
    share = float(random.uniform(0.15, 0.6))  # N/kg
    return {"drag": share * robot.mass}, share


def _wind(random: Random, robot: Robot) -> Sized:
    speed = float(random.uniform(8.0, 16.0))
    return {"speed": speed, "azimuth": float(random.uniform(-math.pi, math.pi))}, speed


KINDS: Mapping[str, Kind] = {
    kind.fault_id + ("" if not kind.also else f" and {kind.also}"): kind
    for kind in (
        Kind("drivers_off", _plain),
        Kind("commands_ignored", _plain),
        Kind("wheel_stuck", _plain),
        Kind("bearing_dragging", _drag),
        Kind("motor_resistance_high", _uniform("rise", 0.1, 2.0)),
        Kind("motor_torque_weak", _uniform("loss", 0.1, 0.6)),
        Kind("power_sensor_dead", _plain),
        Kind("power_sensor_frozen", _plain),
        Kind("power_sensor_scaled", _scale),
        Kind("power_sensor_biased", _bias),
        Kind("supply_low", _uniform("undervoltage", 2.0, 8.0)),
        Kind("control_signal_lost", _plain, also="floor_slippery"),
        Kind("load_towed", _towed, NOT_TRAINED),
        Kind("tethered", _uniform("stiffness", 10.0, 40.0), NOT_TRAINED),
        Kind("windy", _wind, NOT_TRAINED),
        Kind("floor_slippery", _slippery, LOADED_SLIP, "load_towed", _hindered),
    )
}


def faulty_drive(drive: Drive, name: str) -> tuple[Drive, float]:
    """A drive with a fault of a kind in it, and the size of the fault."""
    kind, seed = KINDS[name], drive.seed
    random = np.random.default_rng([seed, 1])
    settings, size = kind.draw(random, drive.plant)
    start = float(random.uniform(0.2, 0.5) * drive.length)
    end = float(random.uniform(0.7, 1.0) * drive.length)
    wheel = int(random.integers(1, 4))
    faults = [_planned(kind.fault_id, start, end, wheel, settings)]
    if kind.also:
        second, _ = kind.draw_also(random, drive.plant)
        faults.append(_planned(kind.also, start, end, wheel, second))
    return evolve(drive, mission=evolve(drive.mission, faults=tuple(faults))), size


def _planned(
    fault_id: str, start: float, end: float, wheel: int, given: Mapping[str, object]
) -> PlannedFault:
    settings = {"severity": 1.0, **given}
    if "wheel" in check_settings(fault_id, {}, fault_id):
        settings["wheel"] = wheel
    return PlannedFault(fault_id, start, end, check_settings(fault_id, settings, fault_id))


def pushed_drive(drive: Drive) -> Drive:
    """A healthy drive with two shoves and a lean, beside the bumps that all drives have."""
    random = np.random.default_rng([drive.seed, 2])
    begins = np.sort(random.uniform(1.0, drive.length - 1.0, 3))
    pushes = []
    for begin, until in pairwise([*begins, drive.length]):
        is_lean = random.random() < 0.3
        length = min(random.uniform(2.0, 6.0) if is_lean else 0.2, until - begin)
        if length <= 0.0:
            continue
        settings = {
            "force": float(random.uniform(0.3, 1.0) if is_lean else random.uniform(0.5, 3.0)),
            "azimuth": float(random.uniform(-math.pi, math.pi)),
            "lever": float(random.uniform(-0.5, 0.5) * drive.plant.robot_radius),
            "rise": length / 2.0 if is_lean else 0.0,
        }
        pushes.append(_planned("pushed", float(begin), float(begin + length), 1, settings))
    return evolve(drive, mission=evolve(drive.mission, faults=tuple(pushes)))
