"""Parameters of the prediction stage, shared by the node and the offline tools."""

from collections.abc import Mapping
from typing import Self, cast

from attrs import field, frozen

from tomr_power_model.model.power_models import POWER_MODELS, own_parameters
from tomr_power_model.model.ticks import TickSettings, to_ns
from tomr_power_model.robot.parameters import (
    CMD_VEL_TYPE,
    HARDWARE_ID,
    NAMELESS,
    ParameterSpec,
)

_S = ParameterSpec
GAP = _S(
    "gap",
    "a silence or jump of stamps that starts afresh; twice the patience if that is longer",
    "float",
    1.0,
    "s",
    0.1,
    60.0,
)
TICK_PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("decision_rate", "ticks on the grid of data stamps", "float", 20.0, "Hz", 5.0, 100.0),
    _S("settle_time", "data time to wait for late messages", "float", 0.02, "s", 0.0, 5.0),
    _S("patience", "silence after which a stream is not waited for", "float", 0.25, "s", 0.0, 5.0),
    GAP,
    _S("stale_after", "age at which an input counts as missing", "float", 0.5, "s", 0.01, 10.0),
)
MODEL_PARAMETERS: tuple[ParameterSpec, ...] = (
    *TICK_PARAMETERS,
    HARDWARE_ID,
    _S("encoder_window", "span of the fit to the encoders", "float", 0.07, "s", 0.01, 1.0),
    _S(
        "command_timeout",
        "a command this old counts as a stop; 0: it is held, and may come on a change only",
        "float",
        0.5,
        "s",
        0.0,
        60.0,
    ),
    CMD_VEL_TYPE,
    _S("use_imu", "take the yaw rate from imu/data", "bool", False),
    _S(
        "power_model",
        "what predicts power from motion",
        "str",
        "physical",
        choices=tuple(POWER_MODELS),
    ),
    *own_parameters(),
)


def tick_settings(values: Mapping[str, object]) -> TickSettings:
    """Timing of a stage from its parameters."""

    def nanoseconds(name: str) -> int:
        return to_ns(cast(float, values[name]))

    return TickSettings(
        period=to_ns(1.0 / cast(float, values["decision_rate"])),
        settle=nanoseconds("settle_time"),
        patience=nanoseconds("patience"),
        gap=nanoseconds("gap"),
    )


@frozen
class ModelSettings:
    """Settings of the predictor; times in nanoseconds."""

    ticks: TickSettings = field(factory=TickSettings)
    stale: int = to_ns(0.5)
    encoder_window: int = to_ns(0.07)
    command_timeout: int = to_ns(0.5)
    use_imu: bool = False
    power_model: str = "physical"
    hardware_id: str = NAMELESS
    model_values: Mapping[str, object] = field(factory=dict)  # of the models' own parameters

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Settings from checked parameters."""
        return cls(
            ticks=tick_settings(values),
            stale=to_ns(cast(float, values["stale_after"])),
            encoder_window=to_ns(cast(float, values["encoder_window"])),
            command_timeout=to_ns(cast(float, values["command_timeout"])),
            use_imu=bool(values["use_imu"]),
            power_model=str(values["power_model"]),
            hardware_id=str(values["hardware_id"]) or NAMELESS,
            model_values={spec.name: values[spec.name] for spec in own_parameters()},
        )
