"""Parameters of the classifier stage, shared by the node and the offline tools."""

from collections.abc import Mapping
from typing import Self, cast

from attrs import frozen

from tomr_fault_diag.classifier.stored import SHIPPED
from tomr_fault_diag.residuals.frame import INPUT_ORDERS
from tomr_power_model.errors import InputError
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot.parameters import HARDWARE_ID, NAMELESS, ParameterSpec

_S = ParameterSpec


def _live(
    name: str, description: str, default: float, unit: str, low: float, high: float
) -> ParameterSpec:
    return _S(name, description, "float", default, unit, low, high, read_only=False)


CLASSIFIER_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S(
        "classifier",
        "window: continuous residuals of the last 0.4 s; wang2024: the paper's codes and network",
        "str",
        "window",
        choices=tuple(SHIPPED),
    ),
    _S("weights", "file of network weights; empty: the shipped ones", "str", ""),
    _S(
        "input_order",
        "of wang2024: whether the weights take speeds or derived powers as inputs 5-7",
        "str",
        "speeds_first",
        choices=tuple(INPUT_ORDERS),
    ),
    _S(
        "commissioned",
        "when tomr_commission set bands and caution, and what with",
        "str",
        "",
    ),
    _S(
        "small_faults",
        "of window: look for small faults that last within the robot's own bands; tomr_commission "
        "sets it where healthy driving looks like none",
        "bool",
        False,
    ),
    HARDWARE_ID,
    _S("evidence_weight", "of window: what one window counts", "float", 0.5, "", 0.01, 1.0),
    _S(
        "caution",
        "of window: decades of evidence needed before a fault is named",
        "float",
        11.0,
        "",
        0.0,
        30.0,
    ),
    _S(
        "striking",
        "of window: log-likelihood ratio to normal that a single window must reach besides",
        "float",
        9.0,
        "",
        0.0,
        50.0,
    ),
    _live("filter_time", "of wang2024: of the probabilities", 0.15, "s", 0.0, 10.0),
    _live("confirm_time", "of wang2024: a fault must lead so long to be named", 0.15, "s", 0.0, 10),
    _live("raise_time", "a fault must be sure so long to be named", 0.0, "s", 0.0, 60.0),
    _live(
        "recovery_time",
        "normal must lead this long before it is named again after a fault",
        0.5,
        "s",
        0.0,
        60.0,
    ),
    _live(
        "slip_recovery_time",
        "the same after slip, external load or unknown, which show only while wheels push",
        1.0,
        "s",
        0.0,
        60.0,
    ),
    _S(
        "latch",
        "a named fault stays until the service ~/clear is called",
        "bool",
        False,
        read_only=False,
    ),
    _live(
        "low_supply", "share of supply.nominal_voltage that is too low; 0: none", 0.88, "", 0.0, 1.0
    ),
    _live("report_period", "of /diagnostics besides changes", 1.0, "s", 0.05, 60.0),
)


@frozen
class ClassifierSettings:
    """Settings of the classifier; times in nanoseconds."""

    classifier: str = "window"
    weights: str = ""
    evidence_weight: float = 0.5
    caution: float = 11.0
    striking: float = 9.0
    filter_time: int = to_ns(0.15)
    confirm_time: int = to_ns(0.15)
    raise_time: int = 0
    recovery_time: int = to_ns(0.5)
    slip_recovery_time: int = to_ns(1.0)
    latch: bool = False
    low_supply: float = 0.88
    report_period: int = to_ns(1.0)
    hardware_id: str = NAMELESS
    input_order: str = "speeds_first"
    commissioned: str = ""
    small_faults: bool = False

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Settings from checked parameters; raises InputError for an order that no weights have."""
        if values["input_order"] != "speeds_first" and not values["weights"]:
            raise InputError(
                f"input_order = {values['input_order']}: the shipped weights take speeds_first; "
                "give weights trained in that order as weights"
            )

        def number(name: str) -> float:
            return cast(float, values[name])

        return cls(
            classifier=str(values["classifier"]),
            weights=str(values["weights"]),
            evidence_weight=number("evidence_weight"),
            caution=number("caution"),
            striking=number("striking"),
            filter_time=to_ns(number("filter_time")),
            confirm_time=to_ns(number("confirm_time")),
            raise_time=to_ns(number("raise_time")),
            recovery_time=to_ns(number("recovery_time")),
            slip_recovery_time=to_ns(number("slip_recovery_time")),
            latch=bool(values["latch"]),
            low_supply=number("low_supply"),
            report_period=to_ns(number("report_period")),
            hardware_id=str(values["hardware_id"]) or NAMELESS,
            input_order=str(values["input_order"]),
            commissioned=str(values["commissioned"]),
            small_faults=bool(values["small_faults"]),
        )
