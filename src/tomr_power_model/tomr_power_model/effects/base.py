"""What an effect of the vocabulary is: one class that holds its law and every fact about it.

A class names its parameters with units, bounds, neutral values and priors, says in words what it is
and what shows it, and overrides what it acts on:

- `configure` writes what does not change with the motion into the numbers of a plant;
- `dry_torque`, `moving_torque`, `supplied` and `driver_power` are laws, called in every step.

Laws are plain scalar functions of the parameters, in the order of `parameters`, and of the state:
numba compiles them as they stand. They must not use anything but arithmetic and `math`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Literal, NamedTuple

from attrs import define, frozen

from tomr_power_model.effects.scales import Scales

Place = Literal["wheel", "body", "supply"]
Size = Callable[[Scales], float]
Phase = Mapping[str, object]

NEVER_SLIDES = 1e3  # friction coefficient of a contact that never slides


class Wheel(NamedTuple):
    """What friction may depend on, of one wheel at one moment."""

    speed: float  # rad/s
    load: float  # N
    transmitted: float  # torque carried by the gear [N m]
    angle: float  # as joint_states count it [rad]
    radius: float  # m
    gear_ratio: float  # motor turns per wheel turn


@frozen
class EffectParameter:
    """One number of an effect, within what a robot on wheels can have."""

    unit: str
    minimum: float = 0.0
    maximum: float = 1e3
    default: float | None = None  # where a description leaves it out; None: must be given
    neutral: float = 0.0  # with which the effect does nothing, where that is its doing
    start: float = 0.0  # of a fit to a description without the effect
    prior_std: float = 1.0  # of such a fit, in the unit

    @property
    def is_ratio(self) -> bool:
        """Whether it is a share of what would be without it, which may be more as well as less."""
        return not self.unit and self.minimum < self.neutral < self.maximum


def _no_shape(scales: Scales) -> Sequence[Mapping[str, float]]:
    return ({},)


@frozen
class HypothesisPrior:
    """How an effect is tried on a robot that may have it."""

    sizes: Mapping[str, Size]  # prior_std of each parameter that starts from its neutral value
    # Starts of the parameters that shape it; their prior_std is relative to them.
    shapes: Callable[[Scales], Sequence[Mapping[str, float]]] = _no_shape
    sign: int = 1  # of the permitted side of the sizes; 0: both
    least: Size = lambda scales: 0.0  # size below which sampling cannot distinguish it from none
    # Effects whose work it does alone: it must bring the evidence of as many.
    stands_for: tuple[str, ...] = ()
    log_prior: float = 0.0  # against the usual effects


@define
class PlantNumbers:
    """Numbers of a robot that `configure` may change, before the dynamics are made of them.

    Lists have one number per wheel.
    """

    mass: float  # kg
    mass_center: list[float]  # m in base_link, x and y
    radius: list[float]  # of the wheels, effective [m]
    gear_ratio: list[float]
    viscous: list[float]  # N m s/rad at the wheel
    axle_drag: list[float]  # drag of the rollers over the wheel's load [-]
    roller_slip: list[float]  # sliding in the rolling direction per rolling speed [-]
    grip: list[float]  # friction coefficient of traction [-]
    floor_force: list[float]  # over the weight, in the world's x and y [-]
    voltage_drop: float  # of the supply [ohm]
    thermal_resistance: list[float]  # K/W
    thermal_time: list[float]  # s
    initial_rise: list[float]  # of the windings above 25 C [K]
    power_scale: list[float]
    power_bias: list[float]  # W
    power_lag: list[float]  # s
    power_delay: list[float]  # s
    encoder_scale: list[float]  # angle shown per angle turned
    encoder_eccentricity: list[tuple[float, float]]  # of the discs, see sensor.encoder_eccentricity
    supply_scale: float  # of the supply's own sensor


class Effect:
    """One named piece of physics; whatever is not overridden does nothing."""

    effect_id: ClassVar[str]
    place: ClassVar[Place] = "wheel"
    label: ClassVar[str]  # headline of a finding: "Braking energy is lost"
    parameters: ClassVar[Mapping[str, EffectParameter]]
    prior: ClassVar[HypothesisPrior | None] = None  # None: its hypotheses are made elsewhere
    shown_by: ClassVar[str] = "a longer drive with more headings, speeds and accelerations"
    mission: ClassVar[Sequence[Phase]] = ()  # phases of a drive that shows it
    # Whether the motors' currents show it; else electrical power alone does.
    in_currents: ClassVar[bool] = True
    needs_load: ClassVar[bool] = False  # whether it grows with the load of its wheel

    @staticmethod
    def configure(numbers: PlantNumbers, wheel: int, *parameters: float) -> None:
        """Write what does not change with the motion; `wheel` is 0 for body and supply."""

    # Laws; those that a class does not define are not called. Signatures:
    #   dry_torque(*parameters, wheel: Wheel) -> limit of what holds or opposes the motion [N m]
    #   moving_torque(*parameters, wheel: Wheel) -> what resists positive motion [N m]
    #   supplied(*parameters, power) -> power at the supply [W] from that at the terminals [W]
    #   driver_power(*parameters, current) -> lost in the driver besides [W]
    dry_torque: ClassVar[Any] = None
    moving_torque: ClassVar[Any] = None
    supplied: ClassVar[Any] = None
    driver_power: ClassVar[Any] = None


LAWS = ("dry_torque", "moving_torque", "supplied", "driver_power")


class Registry(Mapping[str, type[Effect]]):
    """Effects by id, in the order of their ids; a class joins by its decorator."""

    def __init__(self) -> None:
        self._effects: dict[str, type[Effect]] = {}

    def register(self, cls: type[Effect]) -> type[Effect]:
        """Add an effect; its module is found by being in this folder."""
        self._effects = dict(sorted({**self._effects, cls.effect_id: cls}.items()))
        return cls

    def remove(self, effect_id: str) -> None:
        """Take an effect out again."""
        del self._effects[effect_id]

    def __getitem__(self, effect_id: str) -> type[Effect]:
        return self._effects[effect_id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._effects)

    def __len__(self) -> int:
        return len(self._effects)


EFFECTS = Registry()
effect = EFFECTS.register
