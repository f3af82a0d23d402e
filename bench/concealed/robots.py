"""Robots at random: what a simulation believes, and the real one that is a little off."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import yaml
from attrs import frozen

from concealed.catalogue import PARAMETER, Case
from concealed.scales import Scales
from tomr_power_model.effects import EFFECTS

Range = tuple[float, float]
Nested = dict[str, dict[str, Any]]
Deviations = dict[str, float | list[float]]

WHEEL_JOINTS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
DEVIATION = 0.02  # of a real robot from its description, uniform
_OFF_BY_WHEEL = ("motor.resistance", "motor.torque_constant")
_OFF_AS_A_WHOLE = ("robot.mass", "robot.inertia_z")


@frozen
class Family:
    """Ranges that the robots of a kind are drawn from."""

    mass: Range  # kg
    robot_radius: Range  # m
    wheel_radius: Range  # m
    resistance: Range  # ohm
    torque_constant: Range  # N m/A
    gear_ratio: tuple[int, int]
    rotor_inertia: Range  # kg m^2
    voltage: float  # V
    auxiliary_power: Range  # W
    current_noise: Range  # A, standard deviation of a reading
    current_resolution: float  # A


FAMILIES: Mapping[str, Family] = {
    "small": Family(
        (4.5, 7.0), (0.10, 0.14), (0.029, 0.036), (1.5, 2.2), (0.011, 0.014), (35, 44),
        (4e-7, 8e-7), 12.0, (4.0, 7.0), (0.0010, 0.0016), 0.001,
    ),
    "light": Family(
        (8.5, 17.0), (0.15, 0.22), (0.045, 0.06), (0.6, 1.0), (0.032, 0.038), (15, 21),
        (4e-6, 8e-6), 24.0, (10.0, 16.0), (0.0030, 0.0055), 0.0025,
    ),
    "heavy": Family(
        (30.0, 42.0), (0.24, 0.30), (0.058, 0.073), (0.42, 0.72), (0.034, 0.042), (13, 16),
        (1.8e-5, 3.0e-5), 24.0, (16.0, 25.0), (0.0030, 0.0055), 0.0025,
    ),
}  # fmt: skip

Effects = dict[str, dict[str, float]]
_EXTRA_CHANCE = 0.3
# What a description may hold beside friction and standby.
_EXTRAS: Mapping[str, Callable[[Scales, np.random.Generator], dict[str, float]]] = {
    "friction.stribeck": lambda u, random: {
        "torque": random.uniform(0.2, 0.4) * u.torque, "speed": random.uniform(0.1, 0.2) * u.speed,
    },
    "friction.load_dependent": lambda _, random: {"coefficient": random.uniform(0.03, 0.1)},
    "contact.roller_drag": lambda _, random: {"coefficient": random.uniform(0.005, 0.015)},
    "electrical.switching_loss": lambda u, random: {
        "coefficient": random.uniform(0.03, 0.1) * u.power / u.current
    },
    "electrical.regeneration_loss": lambda _, random: {"efficiency": random.uniform(0.4, 0.8)},
}  # fmt: skip


def described(case: Case, random: np.random.Generator) -> tuple[str, Nested]:
    """Family and description of a case's robot, as nested groups, three digits each."""
    family = case.family or str(random.choice(list(FAMILIES)))
    nominal = _body(FAMILIES[family], case.stiffness, random)
    units = Scales.of(nominal)
    nominal["physics"] = {
        effect: {key: _rounded(value) for key, value in parameters.items()}
        for effect, parameters in sorted(_physics(case, units, random).items())
    }
    return family, nominal


def _body(family: Family, stiffness: float, random: np.random.Generator) -> Nested:
    def draw(limits: Range) -> float:
        return _rounded(random.uniform(*limits))

    mass, radius, wheel = draw(family.mass), draw(family.robot_radius), draw(family.wheel_radius)
    constant, gear = draw(family.torque_constant), float(random.integers(*family.gear_ratio))
    return {
        "robot": {
            "wheel_names": list(WHEEL_JOINTS),
            "wheel_offset": float(random.choice([0.0, 0.523599, 1.047198, 1.570796])),
            "robot_radius": radius,
            "wheel_radius": wheel,
            "wheel_inertia": _rounded(0.01 * mass * wheel**2 * random.uniform(0.8, 1.3)),
            "mass": mass,
            "inertia_z": _rounded(mass * radius**2 * random.uniform(0.45, 0.65)),
            "mass_center": [0.0, 0.0, _rounded(radius * random.uniform(0.55, 0.8))],
        },
        "motor": {
            "resistance": draw(family.resistance),
            "torque_constant": constant,
            "gear_ratio": gear,
            "rotor_inertia": draw(family.rotor_inertia),
        },
        "controller": {
            "rate": float(random.choice([100.0, 200.0])),
            "proportional": _rounded(stiffness * constant * gear * random.uniform(1.4, 2.2)),
            "integral": _rounded(stiffness * random.uniform(7.5, 11.0)),
            "acceleration_limit": _rounded(random.uniform(1.4, 2.5)),
        },
        "supply": {
            "nominal_voltage": family.voltage,
            "auxiliary_power": draw(family.auxiliary_power),
        },
    }


def _physics(case: Case, units: Scales, random: np.random.Generator) -> Effects:
    """Friction, standby and some more; with what is to be wrong, without what is concealed."""
    usual: Effects = {
        "friction.coulomb": {"torque": random.uniform(0.45, 1.2) * units.torque},
        "friction.viscous": {"coefficient": random.uniform(0.1, 0.25) * units.torque / units.speed},
        "electrical.driver_standby": {"power": random.uniform(1.0, 2.0) * units.power},
    }
    concealed = {item.effect for item in case.effects}
    for effect, make in _EXTRAS.items():
        if random.random() < _EXTRA_CHANCE:
            usual[effect] = make(units, random)
    return {effect: values for effect, values in usual.items() if effect not in concealed}


def drawn_deviations(nominal: Nested, random: np.random.Generator) -> Deviations:
    """Factors by dotted key: a list by wheel, or one number for what the robot has once."""

    def off() -> float:
        return float(random.uniform(1.0 - DEVIATION, 1.0 + DEVIATION))

    found: Deviations = {key: [off() for _ in WHEEL_JOINTS] for key in _OFF_BY_WHEEL}
    found |= {key: off() for key in _OFF_AS_A_WHOLE}
    for effect, parameters in nominal["physics"].items():
        for key in parameters:
            found[f"physics.{effect}.{key}"] = [off() for _ in WHEEL_JOINTS]
    return found


def flat(nominal: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Dotted keys of a nested description."""
    found: dict[str, Any] = {}
    for key, value in nominal.items():
        if isinstance(value, Mapping):
            found |= flat(value, f"{prefix}{key}.")
        else:
            found[prefix + key] = value
    return found


def nominal_value(nominal: Nested, key: str) -> float:
    """A number of the description by its dotted key."""
    return float(flat(nominal)[key])


def by_wheel(key: str, wheel: int) -> str:
    """A parameter's key at one wheel 0..2, e.g. motor.wheel_1_joint.resistance."""
    if key.startswith("motor."):
        return f"motor.{WHEEL_JOINTS[wheel]}.{key.removeprefix('motor.')}"
    effect = next(name for name in EFFECTS if key.startswith(f"physics.{name}."))
    return f"physics.{effect}.{WHEEL_JOINTS[wheel]}.{key.removeprefix(f'physics.{effect}.')}"


def deviating(nominal: Nested, deviations: Deviations) -> dict[str, Any]:
    """Flat parameters of the real robot, by wheel where it differs by wheel."""
    real = flat(nominal)
    for key, factor in deviations.items():
        value = float(real[key])
        if isinstance(factor, list):
            for wheel, share in enumerate(factor):
                real[by_wheel(key, wheel)] = _within(key, value * share)
        else:
            real[key] = value * factor
    return real


def _within(key: str, value: float) -> float:
    return min(value, 1.0) if key.endswith("efficiency") else value


def description_text(case: Case, nominal: Nested) -> str:
    """robot.yaml."""
    written: dict[str, Any] = dict(nominal)
    if case.total_only and case.says_so:
        written["measurement"] = {"source": "total_only"}
    return yaml.safe_dump(
        {"/**": {"ros__parameters": written}}, sort_keys=False, default_flow_style=None, width=100
    )


def is_parameter(effect: str) -> bool:
    """Whether it is a wrong value, not a left-out effect."""
    return effect.startswith(PARAMETER)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
