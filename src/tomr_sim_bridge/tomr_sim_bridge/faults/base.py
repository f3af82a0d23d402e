"""What a fault is, and the registry that parameters and mission files are made from."""

from collections.abc import Mapping
from typing import ClassVar, cast

import numpy as np
from attrs import define
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.robot.parameters import ParameterSpec, Value, check_all

Vector = NDArray[np.float64]


def severity_spec(description: str) -> ParameterSpec:
    """Severity of a fault: 0 is off."""
    return ParameterSpec(
        "severity", description, default=0.0, minimum=0.0, maximum=1.0, read_only=False
    )


WHEEL_SPEC = ParameterSpec(
    "wheel",
    "number of the wheel, 1 to 3 in the order of robot.wheel_names",
    kind="int",
    default=1,
    minimum=1,
    maximum=3,
    read_only=False,
)


@define
class FaultActions:
    """Where faults take hold of the plant during one stretch. Arrays have shape (3,): per wheel."""

    contact: Vector  # m, wheel contacts in the world, shape (3, 2)
    drive: Vector  # share of the commanded voltage that reaches the bridge
    connected: NDArray[np.bool_]  # False: the bridge is off and the motor carries no current
    encoder: Vector  # share of the counts that is reported
    friction: Vector  # traction coefficient under each wheel


class Fault:
    """One kind of fault with its settings; a subclass is registered and says what it does."""

    fault_id: ClassVar[str]
    description: ClassVar[str]
    parameters: ClassVar[tuple[ParameterSpec, ...]]

    def __init__(self, settings: Mapping[str, Value]) -> None:
        self.settings = dict(settings)

    def number(self, name: str) -> float:
        """One setting, in the unit of its parameter."""
        return float(cast(float, self.settings[name]))

    @property
    def severity(self) -> float:
        return self.number("severity")

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
