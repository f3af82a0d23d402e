"""Parameters of the classifier stage, shared by the node and the offline tools."""

from collections.abc import Mapping
from typing import Self, cast

from attrs import frozen

from tomr_fault_diag.residuals.frame import INPUT_ORDERS
from tomr_power_model.errors import InputError
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot.parameters import ParameterSpec

_S = ParameterSpec
CLASSIFIER_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("weights", "file of network weights; empty: the shipped ones", "str", ""),
    _S(
        "input_order",
        "whether the weights take speeds or derived powers as inputs 5-7",
        "str",
        "speeds_first",
        choices=tuple(INPUT_ORDERS),
    ),
    _S("hardware_id", "of this robot, in every diagnostic status", "str", "tomr"),
    _S("filter_time", "of the probabilities", "float", 0.15, "s", 0.0, 10.0, read_only=False),
    _S(
        "confirm_time",
        "a fault must lead this long before it is named",
        "float",
        0.15,
        "s",
        0.0,
        10.0,
        read_only=False,
    ),
    _S(
        "recovery_time",
        "normal must lead this long before it is named again",
        "float",
        1.0,
        "s",
        0.0,
        60.0,
        read_only=False,
    ),
    _S(
        "report_period",
        "of /diagnostics besides changes",
        "float",
        1.0,
        "s",
        0.05,
        60.0,
        read_only=False,
    ),
)


@frozen
class ClassifierSettings:
    """Settings of the classifier; times in nanoseconds."""

    filter_time: int = to_ns(0.15)
    confirm_time: int = to_ns(0.15)
    recovery_time: int = to_ns(1.0)
    report_period: int = to_ns(1.0)
    hardware_id: str = "tomr"
    input_order: str = "speeds_first"

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Settings from checked parameters; raises InputError for an order that no weights have."""
        if values["input_order"] != "speeds_first" and not values["weights"]:
            raise InputError(
                f"input_order = {values['input_order']}: the shipped weights take speeds_first; "
                "give weights trained in that order as weights"
            )

        def nanoseconds(name: str) -> int:
            return to_ns(cast(float, values[name]))

        return cls(
            filter_time=nanoseconds("filter_time"),
            confirm_time=nanoseconds("confirm_time"),
            recovery_time=nanoseconds("recovery_time"),
            report_period=nanoseconds("report_period"),
            hardware_id=str(values["hardware_id"]),
            input_order=str(values["input_order"]),
        )
