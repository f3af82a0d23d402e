"""Parameters of the residual stage, shared by the node and the offline tools."""

from collections.abc import Mapping
from typing import Self, cast

from attrs import field, frozen

from tomr_fault_diag.residuals.frame import SPEEDS, TOTAL, Unit
from tomr_fault_diag.residuals.widths import Band
from tomr_power_model.model.settings import TICK_PARAMETERS, tick_settings
from tomr_power_model.model.ticks import TickSettings, to_ns
from tomr_power_model.robot.parameters import HARDWARE_ID, NAMELESS, ParameterSpec

LEAST_BAND = 1e-4  # W, A, rad/s: residuals are divided by their bands
LEAST_FACTOR = 0.01


def _live(
    name: str, description: str, default: float, unit: str = "", lowest: float = 0.0
) -> ParameterSpec:
    return ParameterSpec(name, description, "float", default, unit, lowest, 1e3, read_only=False)


RESIDUAL_PARAMETERS: tuple[ParameterSpec, ...] = (
    *TICK_PARAMETERS,
    HARDWARE_ID,
    ParameterSpec("watch_gyro", "compare the yaw rate of imu/data with the wheels'", "bool", True),
    ParameterSpec(
        "watch_accelerometer", "compare the forces of imu/data with the wheels'", "bool", True
    ),
    ParameterSpec("encoder_window", "span of the fit to the encoders", "float", 0.07, "s", 0.01, 1),
    _live("band.relative", "of the modelled power or current of a motor", 0.6),
    _live("band.power", "least band of a motor's power", 1.1, "W", LEAST_BAND),
    _live("band.current", "least band of a motor's current", 0.15, "A", LEAST_BAND),
    _live("band.transient", "part of the model's change over the last ticks", 0.32),
    _live("band.total_factor", "least band of the total, in motors'", 1.0, "", LEAST_FACTOR),
    _live("band.total_relative", "of the modelled total", 0.12),
    _live("band.speed", "least band of a wheel speed", 0.1, "rad/s", LEAST_BAND),
    _live("band.speed_relative", "of the expected wheel speed", 0.01),
    _live("band.speed_transient", "part of the expected speed's change over the last ticks", 0.1),
    _live(
        "band.yaw", "least band of a gyro's yaw rate against the wheels'", 0.1, "rad/s", LEAST_BAND
    ),
    _live("band.yaw_relative", "of the yaw rate that the wheels show", 0.1),
    _live("band.yaw_transient", "part of that yaw rate's change over the last ticks", 1.0),
    _live(
        "band.along",
        "least band of an accelerometer's force against the wheels' acceleration",
        0.3,
        "m/s^2",
        LEAST_BAND,
    ),
    _live("band.along_relative", "of the acceleration that the wheels show", 0.15),
    _live("band.along_transient", "part of that acceleration's change over the last ticks", 0.3),
    _live("band.voltage", "least band of a driver's voltage", 0.3, "V", LEAST_BAND),
    _live("band.voltage_relative", "of the simulated voltage", 0.1),
    _live("band.voltage_transient", "part of that voltage's change over the last ticks", 0.1),
)


@frozen
class BandSettings:
    """How far a residual may stray before it counts as one.

    The defaults hold 99.9 % of the residuals of healthy simulated robots that are up to 5 % off
    their description (`residuals.calibrated`), those of speed and voltage with a margin: the loop
    of a real driver is not known as well.
    """

    relative: float = 0.6
    power: float = 1.1  # W
    current: float = 0.15  # A
    transient: float = 0.32
    total_factor: float = 1.0
    total_relative: float = 0.12
    speed: float = 0.1  # rad/s
    speed_relative: float = 0.01
    speed_transient: float = 0.1
    yaw: float = 0.1  # rad/s
    yaw_relative: float = 0.1
    yaw_transient: float = 1.0
    along: float = 0.3  # m/s^2
    along_relative: float = 0.15
    along_transient: float = 0.3
    voltage: float = 0.3  # V
    voltage_relative: float = 0.1
    voltage_transient: float = 0.1

    def of_residual(self, place: int, unit: Unit) -> Band:
        """Of one of a frame's residuals; `unit` of what motors draw."""
        if place in SPEEDS:
            return self.of_speed
        return self.of_total(unit) if place == TOTAL else self.of_motor(unit)

    def least(self, unit: Unit) -> float:
        """Least band of what a motor draws."""
        return self.power if unit == "W" else self.current

    def of_motor(self, unit: Unit) -> Band:
        """Of what a motor draws."""
        return Band(self.least(unit), self.relative, self.transient)

    def of_total(self, unit: Unit) -> Band:
        """Of what all draw."""
        return Band(self.total_factor * self.least(unit), self.total_relative, self.transient)

    @property
    def of_speed(self) -> Band:
        """Of a wheel's speed [rad/s]."""
        return Band(self.speed, self.speed_relative, self.speed_transient)

    @property
    def of_yaw(self) -> Band:
        """Of a gyro's yaw rate [rad/s]."""
        return Band(self.yaw, self.yaw_relative, self.yaw_transient)

    @property
    def of_force(self) -> Band:
        """Of an accelerometer's force along an axis [m/s^2]."""
        return Band(self.along, self.along_relative, self.along_transient)

    @property
    def of_voltage(self) -> Band:
        """Of a driver's voltage [V]."""
        return Band(self.voltage, self.voltage_relative, self.voltage_transient)

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Bands from checked parameters."""
        start = "band."
        return cls(
            **{
                name.removeprefix(start): cast(float, value)
                for name, value in values.items()
                if name.startswith(start)
            }
        )


# Wang 2024, Eqs 19-20: 5 %, with the least that noise and transients ask for.
PAPER_BANDS = BandSettings(
    relative=0.05,
    power=1.0,
    transient=0.5,
    total_factor=1.7,
    total_relative=0.05,
    speed=0.5,
    speed_relative=0.05,
    speed_transient=0.5,
)


@frozen
class ResidualSettings:
    """Settings of the residual stage; times in nanoseconds."""

    ticks: TickSettings = field(factory=TickSettings)
    stale: int = to_ns(0.5)
    encoder_window: int = to_ns(0.07)
    bands: BandSettings = field(factory=BandSettings)
    hardware_id: str = NAMELESS
    watch_gyro: bool = True
    watch_accelerometer: bool = True

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Settings from checked parameters."""
        return cls(
            ticks=tick_settings(values),
            stale=to_ns(cast(float, values["stale_after"])),
            encoder_window=to_ns(cast(float, values["encoder_window"])),
            bands=BandSettings.of(values),
            hardware_id=str(values["hardware_id"]) or NAMELESS,
            watch_gyro=bool(values["watch_gyro"]),
            watch_accelerometer=bool(values["watch_accelerometer"]),
        )
