"""Parameters of the odometry, shared by the node and the offline tool."""

from collections.abc import Mapping
from typing import Self, cast

from attrs import field, frozen

from tomr_odometry.creep import CREEP_PARAMETERS, Creep
from tomr_odometry.kernel import Noise
from tomr_power_model.errors import InputError
from tomr_power_model.model.settings import GAP, tick_settings
from tomr_power_model.model.ticks import TickSettings, to_ns
from tomr_power_model.robot.parameters import HARDWARE_ID, NAMELESS, ParameterSpec, check_all

_S = ParameterSpec
PARAMETERS: tuple[ParameterSpec, ...] = (
    _S("decision_rate", "estimates on the grid of data stamps", "float", 50.0, "Hz", 1.0, 100.0),
    _S("settle_time", "data time to wait for late messages", "float", 0.02, "s", 0.0, 5.0),
    _S("patience", "silence after which a stream is not waited for", "float", 0.25, "s", 0.0, 5.0),
    GAP,
    _S("use_imu", "take imu/data where it is there", "bool", True),
    _S("use_power", "take the motors' power where it is there", "bool", True),
    *CREEP_PARAMETERS,
    _S("odom_frame", "frame of the pose", "str", "odom"),
    _S("base_frame", "frame of the robot", "str", "base_link"),
    _S("publish_tf", "odom_frame to base_frame on /tf as well", "bool", False),
    HARDWARE_ID,
    _S("publish_floor", "where wheels slid, on floor_traction, each second", "bool", False),
)


def _ticks() -> TickSettings:
    return TickSettings(period=to_ns(0.02))


@frozen
class OdometrySettings:
    """Timing, noise, and which sensors to use."""

    ticks: TickSettings = field(factory=_ticks)
    noise: Noise = field(factory=Noise)
    creep: Creep = field(factory=Creep)
    use_power: bool = True
    use_imu: bool = True
    odom_frame: str = "odom"
    base_frame: str = "base_link"
    publish_tf: bool = False
    publish_floor: bool = False
    hardware_id: str = NAMELESS

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Settings from checked parameters."""
        return cls(
            ticks=tick_settings(values),
            creep=Creep.of(values),
            use_power=bool(values["use_power"]),
            use_imu=bool(values["use_imu"]),
            odom_frame=str(values["odom_frame"]),
            base_frame=str(values["base_frame"]),
            publish_tf=bool(values["publish_tf"]),
            publish_floor=bool(values["publish_floor"]),
            hardware_id=str(values["hardware_id"]) or NAMELESS,
        )

    @classmethod
    def given(cls, values: Mapping[str, object], place: str) -> Self:
        """Settings from some parameters by name. Raises InputError."""
        known = [spec.name for spec in PARAMETERS]
        unknown = [name for name in values if name not in known]
        if unknown:
            raise InputError(f"{place}: {unknown[0]} is unknown: give {', '.join(known)}")
        return cls.of(cast(Mapping[str, object], check_all(PARAMETERS, values, place)))
