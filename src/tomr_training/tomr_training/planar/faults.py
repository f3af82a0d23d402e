"""The faults of training drives: how often, how large, and what each changes.

Ids and settings are those of `tomr_sim_bridge.faults`, so that drives of both are labelled alike.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    EXTERNAL,
    METERS,
    OTHER,
    WEAKS,
)
from tomr_fault_diag.classifier.states import SLIP
from tomr_power_model.robot import WHEELS, Motor, Robot
from tomr_power_model.robot.description import PerWheel
from tomr_sim_bridge.faults.floor_slippery import SLIPPERIEST
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import severity_of, wheel_of

Array = NDArray[np.float64]
Settings = dict[str, float | int]
Draw = Callable[[Robot, np.random.Generator], Settings]

TOTAL_METER = "total_meter_scaled"  # of the battery's monitor: no fault of the simulator
DRY = "friction.coulomb"
DRAG, SLOPE, DOWNHILL = "drag", "slope", "downhill"  # settings of what loads the body


def number(fault: PlannedFault, name: str) -> float:
    """A setting of a fault, in its unit."""
    return float(str(fault.settings[name]))


def _log(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def dry_friction(robot: Robot) -> float:
    """Mean dry friction at the axles [N m]."""
    return sum(robot.everywhere(DRY, "torque")) / WHEELS


# Draws of the settings besides wheel and severity.
_DRAWS: Mapping[str, Draw] = {
    "control_signal_lost": lambda robot, random: {},
    "encoder_lost": lambda robot, random: {},
    "floor_slippery": lambda robot, random: {},
    "bearing_dragging": lambda robot, random: {
        "torque": max(dry_friction(robot), 0.03) * _log(random, 0.3, 6.0)
    },
    "wheel_stuck": lambda robot, random: {"torque": 40.0},
    "motor_resistance_high": lambda robot, random: {"rise": _log(random, 0.15, 2.0)},
    "motor_torque_weak": lambda robot, random: {"loss": _log(random, 0.1, 0.6)},
    "power_sensor_frozen": lambda robot, random: {},
    "power_sensor_scaled": lambda robot, random: {"factor": _factor(random)},
    "power_sensor_biased": lambda robot, random: {
        "bias": _log(random, 0.4, 8.0) * (1.0 if random.random() < 0.5 else -1.0)
    },
    "load_towed": lambda robot, random: {DRAG: robot.mass * _log(random, 0.4, 2.0)},
    "supply_low": lambda robot, random: {
        "undervoltage": robot.supply.nominal_voltage * float(random.uniform(0.12, 0.45))
    },
    TOTAL_METER: lambda robot, random: {"factor": _factor(random)},
}
_ON_NO_WHEEL = ("floor_slippery", "load_towed", "supply_low", TOTAL_METER)


def _factor(random: np.random.Generator) -> float:
    if random.random() < 0.2:
        return 0.0
    return float(random.uniform(0.3, 0.85) if random.random() < 0.6 else random.uniform(1.15, 2.0))


# What befalls a drive, how often: no fault, one, or two of these.
PAIR = "two"
_SHARES: Mapping[str | None, float] = {
    None: 0.20,
    "floor_slippery": 0.13,
    "control_signal_lost": 0.13,
    "encoder_lost": 0.12,
    "bearing_dragging": 0.08,
    "wheel_stuck": 0.03,
    "motor_resistance_high": 0.06,
    "motor_torque_weak": 0.04,
    "power_sensor_frozen": 0.025,
    "power_sensor_scaled": 0.035,
    "power_sensor_biased": 0.03,
    "load_towed": 0.05,
    "supply_low": 0.02,
    TOTAL_METER: 0.02,
    PAIR: 0.04,
}
_PAIRED = (
    "floor_slippery",
    "control_signal_lost",
    "encoder_lost",
    "bearing_dragging",
    "motor_resistance_high",
    "power_sensor_scaled",
)
# A wheel slides where it has to push: of the slippery floors alone so many drag as well, as water
# and mud do, or slope; that takes a share of the weight times the friction that is left.
_LOADED = 0.5
_TAKEN = (0.2, 0.75)
# N/kg. `GRAVITY` is 0.03 % less: with it the shipped networks would not come out again bit by bit.
_WEIGHT = 9.81
_BRAKED = 1e-6  # share of the voltage at which the terminals are shorted, not open


def random_faults(
    robot: Robot, length: float, random: np.random.Generator
) -> tuple[PlannedFault, ...]:
    """Faults of a drive of a length [s]."""
    kinds, shares = list(_SHARES), np.array(list(_SHARES.values()))
    kind = kinds[int(random.choice(len(kinds), p=shares / shares.sum()))]
    start, end = (
        float(random.uniform(low, high) * length) for low, high in ((0.2, 0.5), (0.7, 1.0))
    )
    if kind is None:
        return ()
    wheel = int(random.integers(1, WHEELS + 1))
    if kind != PAIR:
        return (_fault(kind, (start, end), wheel, robot, random),)
    first, second = (str(name) for name in random.choice(_PAIRED, 2, replace=False))
    later = start + float(random.uniform(0.0, 0.5)) * (end - start)
    other = 1 + (wheel + int(random.integers(0, 2))) % WHEELS
    return (
        _fault(first, (start, end), wheel, robot, random),
        _fault(second, (later, end), other, robot, random),
    )


def loaded(
    faults: tuple[PlannedFault, ...], robot: Robot, floor: float, random: np.random.Generator
) -> tuple[PlannedFault, ...]:
    """The same, a slippery floor maybe with what it drags [N], or pulls downhill [N, rad].

    `floor`: its friction before.
    """
    if [fault.fault_id for fault in faults] != ["floor_slippery"] or random.random() >= _LOADED:
        return faults
    (fault,) = faults
    weight = robot.mass * _WEIGHT
    load = weight * friction_left(fault, floor) * float(random.uniform(*_TAKEN))
    given: Settings = {DRAG: load}
    if random.random() < 0.5:
        given = {SLOPE: load, DOWNHILL: float(random.uniform(-math.pi, math.pi))}
    return (evolve(fault, settings={**fault.settings, **given}),)


def is_load(fault: PlannedFault) -> bool:
    """Whether a force on the body comes with it."""
    return DRAG in fault.settings or SLOPE in fault.settings


def friction_left(fault: PlannedFault, floor: float) -> float:
    """Friction of a floor while it is slippery, of what it was before."""
    return float(floor * min(SLIPPERIEST / floor, 1.0) ** severity_of(fault))


def _fault(
    kind: str, times: tuple[float, float], wheel: int, robot: Robot, random: np.random.Generator
) -> PlannedFault:
    settings = _DRAWS[kind](robot, random)
    settings["severity"] = _severity(kind, random)
    if kind not in _ON_NO_WHEEL:
        settings["wheel"] = wheel
    return PlannedFault(kind, *times, settings)


def _severity(kind: str, random: np.random.Generator) -> float:
    if kind == "floor_slippery":
        return float(random.uniform(0.5, 1.0))
    if kind not in ("control_signal_lost", "encoder_lost"):
        return 1.0
    chance = random.random()
    if kind == "control_signal_lost" and chance < 0.2:
        return 1.0 - _BRAKED
    return 1.0 if chance < 0.6 else float(random.uniform(0.3, 1.0))


_OF_WHEEL: Mapping[str, slice] = {
    "control_signal_lost": CONTROLS,
    "encoder_lost": ENCODERS,
    "bearing_dragging": DRAGS,
    "wheel_stuck": DRAGS,
    "motor_resistance_high": WEAKS,
    "motor_torque_weak": WEAKS,
    "power_sensor_frozen": METERS,
    "power_sensor_scaled": METERS,
    "power_sensor_biased": METERS,
    "power_sensor_dead": METERS,
}
_OF_BODY: Mapping[str, int] = {"floor_slippery": SLIP, "load_towed": EXTERNAL, "pushed": EXTERNAL}


def class_of(fault: PlannedFault) -> int:
    """Hypothesis that is true while a fault is in force."""
    wheel = wheel_of(fault)
    if fault.fault_id in _OF_WHEEL and wheel is not None:
        first: int = _OF_WHEEL[fault.fault_id].start
        return first + wheel
    return _OF_BODY.get(fault.fault_id, OTHER)


def _dragging(robot: Robot, fault: PlannedFault) -> Robot:
    wheels: list[Mapping[str, float] | None] = [
        {"torque": torque} for torque in robot.everywhere(DRY, "torque")
    ]
    wheel = wheel_of(fault)
    assert wheel is not None
    known = robot.everywhere(DRY, "torque")[wheel]
    wheels[wheel] = {"torque": known + number(fault, "torque")}
    one, two, three = wheels
    changed: PerWheel = (one, two, three)
    return evolve(robot, physics={**robot.physics, DRY: changed})


def _with_motor(robot: Robot, fault: PlannedFault, change: Callable[[Motor], Motor]) -> Robot:
    first, second, third = (
        change(motor) if wheel == wheel_of(fault) else motor
        for wheel, motor in enumerate(robot.motors)
    )
    return evolve(robot, motors=(first, second, third))


def _resisting(robot: Robot, fault: PlannedFault) -> Robot:
    share = 1.0 + number(fault, "rise")
    return _with_motor(robot, fault, lambda m: evolve(m, resistance=share * m.resistance))


def _weak(robot: Robot, fault: PlannedFault) -> Robot:
    share = 1.0 - number(fault, "loss")
    return _with_motor(robot, fault, lambda m: evolve(m, torque_constant=share * m.torque_constant))


# Faults that make another robot of it.
CHANGES: Mapping[str, Callable[[Robot, PlannedFault], Robot]] = {
    "bearing_dragging": _dragging,
    "wheel_stuck": _dragging,
    "motor_resistance_high": _resisting,
    "motor_torque_weak": _weak,
}


def _frozen(power: Array, fault: PlannedFault) -> Array:
    return np.full_like(power, power[0] if len(power) else 0.0)


# Faults of what is measured of a wheel's power [W], or the battery's, while they are in force.
READINGS: Mapping[str, Callable[[Array, PlannedFault], Array]] = {
    "power_sensor_frozen": _frozen,
    "power_sensor_scaled": lambda power, fault: power * number(fault, "factor"),
    "power_sensor_biased": lambda power, fault: power + number(fault, "bias"),
    TOTAL_METER: lambda power, fault: power * number(fault, "factor"),
}
