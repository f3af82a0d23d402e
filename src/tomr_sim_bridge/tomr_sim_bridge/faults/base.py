"""What a fault is, and the registry that parameters and mission files are made from."""

from collections.abc import Mapping
from typing import ClassVar, Literal, cast

import numpy as np
from attrs import define, field, frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.robot import WHEELS
from tomr_power_model.robot.parameters import ParameterSpec, Value, check_all

Vector = NDArray[np.float64]


def setting_spec(
    name: str, description: str, unit: str, default: float, minimum: float, maximum: float
) -> ParameterSpec:
    """A number that may be changed while the simulation runs."""
    return ParameterSpec(
        name, description, "float", default, unit, minimum, maximum, read_only=False
    )


def severity_spec(description: str) -> ParameterSpec:
    """Severity of a fault: 0 is off."""
    return setting_spec("severity", description, "", 0.0, 0.0, 1.0)


WHEEL_SPEC = ParameterSpec(
    "wheel",
    "number of the wheel, 1 to 3 in the order of robot.wheel_names",
    kind="int",
    default=1,
    minimum=1,
    maximum=3,
    read_only=False,
)


def size_spec(name: str, unit: str, default: float, maximum: float, what: str) -> ParameterSpec:
    """What a fault changes at severity 1; below it is that much less."""
    return setting_spec(name, f"{what}, at severity 1", unit, default, 0.0, maximum)


@frozen
class BodyMotion:
    """Where the robot is and how it moves, in the world."""

    time: float  # s
    mass: float  # kg
    position: Vector  # m, of base_link, shape (2,)
    yaw: float  # rad
    velocity: Vector  # m/s, of base_link, shape (2,)
    yaw_rate: float  # rad/s


def _ones() -> Vector:
    return np.ones(WHEELS)


def _zeros() -> Vector:
    return np.zeros(WHEELS)


@define
class FaultActions:
    """Where faults take hold of the plant during one stretch. Arrays have shape (3,): per wheel."""

    contact: Vector  # m, wheel contacts in the world, shape (3, 2)
    friction: Vector  # traction coefficient under each wheel
    body: BodyMotion
    drive: Vector = field(factory=_ones)  # share of the voltage that reaches the bridge
    connected: NDArray[np.bool_] = field(factory=lambda: np.ones(WHEELS, dtype=bool))  # bridge on
    encoder: Vector = field(factory=_ones)  # share of the counts that is reported
    dry: Vector = field(factory=_zeros)  # N m, dry friction added at the axle
    resistance: Vector = field(factory=_ones)  # of the motor circuit, times that of the winding
    constant: Vector = field(factory=_ones)  # of torque and back-EMF, times that of the motor
    obedience: float = 1.0  # share of the commanded twist that the drivers act upon
    undervoltage: float = 0.0  # V that the supply lacks
    push: Vector = field(factory=lambda: np.zeros(3))  # N, N in the world; N m upward
    meter_scale: Vector = field(factory=_ones)  # of measured power
    meter_bias: Vector = field(factory=_zeros)  # W
    meter_frozen: Vector = field(factory=_zeros)  # share of an old reading in each new one
    meter_lost: Vector = field(factory=_zeros)  # share of the readings that never come


# What a diagnosis should make of it: a fault that it can know by name, something wrong that is
# none of these, or nothing wrong at all.
Nature = Literal["fault", "unknown", "disturbance"]


class Fault:
    """One kind of fault with its settings; a subclass is registered and says what it does."""

    fault_id: ClassVar[str]
    description: ClassVar[str]
    parameters: ClassVar[tuple[ParameterSpec, ...]]
    nature: ClassVar[Nature] = "fault"

    def __init__(self, settings: Mapping[str, Value]) -> None:
        self.settings = dict(settings)

    def number(self, name: str) -> float:
        """One setting, in the unit of its parameter."""
        return float(cast(float, self.settings[name]))

    @property
    def severity(self) -> float:
        return self.number("severity")

    def sized(self, name: str) -> float:
        """What a setting of the size at severity 1 amounts to, in its unit."""
        return self.severity * self.number(name)

    @property
    def wheel(self) -> int | None:
        """Index 0..2 of the faulty wheel, None for a fault that sits on no wheel."""
        return int(self.number("wheel")) - 1 if "wheel" in self.settings else None

    def apply(self, actions: FaultActions) -> bool:
        """Take hold of the plant; called while severity > 0. True if it bears on a wheel now."""
        raise TypeError(f"{type(self).__name__} does not say what it does")


_REGISTRY: dict[str, type[Fault]] = {}


def register(fault: type[Fault]) -> type[Fault]:
    """Class decorator: make a fault known to parameters and mission files."""
    _REGISTRY[fault.fault_id] = fault
    return fault


def fault_ids() -> list[str]:
    """Ids of all faults."""
    return sorted(_REGISTRY)


def fault_kind(fault_id: str, place: str) -> type[Fault]:
    """The class of a fault. Raises InputError for an unknown one."""
    if fault_id not in _REGISTRY:
        raise InputError(f"{place}: fault {fault_id!r} is unknown: give {', '.join(fault_ids())}")
    return _REGISTRY[fault_id]


def check_settings(fault_id: str, values: Mapping[str, object], place: str) -> dict[str, Value]:
    """All settings of a fault, absent ones at their default.

    Raises InputError for an unknown fault or setting, a wrong type or a value out of range.
    """
    kind = fault_kind(fault_id, place)
    known = [spec.name for spec in kind.parameters]
    for name in values:
        if name not in known:
            raise InputError(
                f"{place}: {fault_id} has no setting {name!r}: give {', '.join(known)}"
            )
    return check_all(kind.parameters, values, f"{place}: {fault_id}")


def natures() -> dict[str, Nature]:
    """What a diagnosis should make of each fault, by id."""
    return {fault_id: _REGISTRY[fault_id].nature for fault_id in fault_ids()}


def all_parameters() -> dict[str, ParameterSpec]:
    """Every fault parameter by its full name, e.g. faults.encoder_lost.wheel."""
    return {
        f"faults.{fault_id}.{spec.name}": spec
        for fault_id in fault_ids()
        for spec in _REGISTRY[fault_id].parameters
    }


def split_name(parameter: str) -> tuple[str, str]:
    """(fault id, setting) of a full parameter name."""
    fault_id, _, name = parameter.removeprefix("faults.").rpartition(".")
    return fault_id, name
