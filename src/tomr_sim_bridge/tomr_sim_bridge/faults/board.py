"""The faults in force, all switched off at first."""

from collections.abc import Mapping

from attrs import frozen

from tomr_sim_bridge.faults.base import (
    BodyMotion,
    Fault,
    FaultActions,
    Vector,
    check_settings,
    fault_ids,
    fault_kind,
)


@frozen
class FaultState:
    """One line of the truth about a fault."""

    fault_id: str
    active: bool  # switched on and bearing on a wheel now
    wheel: int | None  # index 0..2
    severity: float


class FaultBoard:
    """Settings of every fault, changeable while the plant runs."""

    def __init__(self) -> None:
        self._faults = {name: self._make(name, {}) for name in fault_ids()}
        self._bearing = dict.fromkeys(self._faults, False)
        self._on: list[tuple[str, Fault]] = []

    def set(self, fault_id: str, values: Mapping[str, object]) -> None:
        """Set a fault; settings not named return to their defaults.

        Raises InputError for an unknown fault or setting, or a value out of range.
        """
        self._faults[fault_id] = self._make(fault_id, values)
        self._bearing[fault_id] = False
        self._on = [(name, fault) for name, fault in self._faults.items() if fault.severity > 0]

    def actions(self, contact: Vector, friction: Vector, body: BodyMotion) -> FaultActions:
        """What the faults do to the plant now.

        Args:
            contact: wheel contacts in the world [m], shape (3, 2).
            friction: traction coefficients of the healthy floor, shape (3,).
            body: how the robot moves.
        """
        actions = FaultActions(contact, friction.copy(), body)
        for name, fault in self._on:
            self._bearing[name] = fault.apply(actions)
        return actions

    def states(self) -> list[FaultState]:
        """The truth about every fault."""
        return [
            FaultState(name, self._bearing[name], fault.wheel, fault.severity)
            for name, fault in self._faults.items()
        ]

    @staticmethod
    def _make(fault_id: str, values: Mapping[str, object]) -> Fault:
        return fault_kind(fault_id, "fault")(check_settings(fault_id, values, "fault"))
