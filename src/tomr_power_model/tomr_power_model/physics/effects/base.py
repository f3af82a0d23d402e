"""What an effect may change, and the registry that finds it by its name in the vocabulary.

An effect is one frozen class. Its fields are named as its parameters in the vocabulary and hold
one number per wheel, shape (3,). It overrides the hooks that it acts on; all others are neutral.
"""

from collections.abc import Callable, Sequence
from typing import ClassVar, TypeVar

import numpy as np
from attrs import fields, frozen
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot

Array = NDArray[np.float64]


@frozen
class WheelState:
    """What friction may depend on: shape (n, 3) for what moves, (3,) for what does not."""

    speed: Array  # wheel speed [rad/s], (n, 3)
    normal: Array  # wheel load [N], (n, 3) or (3,)
    transmitted: Array  # torque carried by the gear [N m], (n, 3)
    wheel_radius: Array  # m, (3,)
    gear_ratio: Array  # motor turns per wheel turn, (3,)
    angle: Array | None = None  # as joint_states count it [rad], (n, 3); None: not known


@frozen
class Effect:
    """One named piece of physics; every hook is neutral unless overridden."""

    effect_id: ClassVar[str] = ""
    # Whether its torque changes with speed or load: what does not is worked out only once.
    varies: ClassVar[bool] = False
    # Whether it grows with a wheel's load, which moves when the robot speeds up.
    needs_load: ClassVar[bool] = False

    def changed(self, robot: Robot) -> Robot:
        """The robot with this effect on its body (mass, mass centre)."""
        return robot

    def dry_torque(self, state: WheelState) -> Array | float:
        """Torque against the sign of the motion, holding at standstill [N m], >= 0."""
        return 0.0

    def moving_torque(self, state: WheelState) -> Array | float:
        """Torque that resists positive motion, vanishing at standstill [N m]."""
        return 0.0

    def viscous(self, gear_ratio: Array) -> Array | float:
        """The part of resistance linear in wheel speed [N m s/rad]."""
        return 0.0

    def axle_drag(self, normal: Array) -> Array | float:
        """Force against the contact's sliding along the axle [N], >= 0, shape (n, 3)."""
        return 0.0

    def axle_slip(self) -> Array | float:
        """Sliding of the contact in the direction of rolling, per rolling speed [-]."""
        return 0.0

    def grip(self) -> Array | float:
        """Friction of the contacts: a wheel slides where it would take more [-]."""
        return np.inf

    def driver_power(self, current: Array) -> Array | float:
        """Power lost in the driver on top of the motor's [W], from motor current [A]."""
        return 0.0

    def floor_force(self, mass: Array, heading: Array) -> Array | float:
        """Force of a tilted floor on the body, in base_link [N], shape (..., 2)."""
        return 0.0

    def voltage_drop(self) -> Array | float:
        """Fall of the supply voltage per ampere of total current [ohm]."""
        return 0.0

    def supplied(self, power: Array) -> Array:
        """Power at the supply [W] from power at the motor terminals [W]."""
        return power

    def reported(self, power: Array) -> Array:
        """Power that a wheel's monitor reports [W]."""
        return power

    def lag(self) -> Array | float:
        """Time constant with which a wheel's monitor follows [s]."""
        return 0.0

    def delayed(self) -> Array | float:
        """Age of what a wheel's monitor reports, by its stamp [s]."""
        return 0.0


_REGISTRY: dict[str, type[Effect]] = {}
E = TypeVar("E", bound=Effect)


def effect(effect_id: str) -> Callable[[type[E]], type[E]]:
    """Register a class as the model of one effect of the vocabulary."""

    def register(cls: type[E]) -> type[E]:
        cls.effect_id = effect_id
        _REGISTRY[effect_id] = cls
        return cls

    return register


def modelled_effects() -> list[str]:
    """Ids of the effects that the model can include."""
    return sorted(_REGISTRY)


_HOOKS = (
    "dry_torque",
    "moving_torque",
    "driver_power",
    "supplied",
    "floor_force",
    "reported",
    "lag",
    "delayed",
    "grip",
)


def acting(effects: Sequence[Effect]) -> dict[str, tuple[Effect, ...]]:
    """Effects by the hook that they override: the others would add zeros."""
    return {
        hook: tuple(e for e in effects if getattr(type(e), hook) != getattr(Effect, hook))
        for hook in _HOOKS
    }


def stacked_effects(robots: Sequence[Robot]) -> tuple[Effect, ...]:
    """The effects that any of v robots has, fields of shape (v, 1, 3): neutral where absent."""
    found = dict.fromkeys(effect_id for robot in robots for effect_id in robot.physics)
    return tuple(_stack([_make(effect_id, robot) for robot in robots]) for effect_id in found)


def _stack(effects: Sequence[Effect]) -> Effect:
    cls = type(effects[0])
    return cls(
        **{
            field.name: np.stack([getattr(item, field.name) for item in effects])[:, None, :]
            for field in fields(cls)
        }
    )


def effects_of(robot: Robot) -> tuple[Effect, ...]:
    """The effects that this robot's description switches on.

    A wheel without the effect gets zeros: every parameter is chosen so that zero is neutral,
    but for those listed in `_NEUTRAL`. Raises InputError for an effect that has no model.
    """
    return tuple(_make(effect_id, robot) for effect_id in robot.physics)


GRIPS = 1e3  # friction of a contact that never slides

# Parameters whose neutral value is not zero: a speed divides, an efficiency or a scale multiplies.
_NEUTRAL = {"speed": 1.0, "efficiency": 1.0, "scale": 1.0, "time_constant": 0.0, "friction": GRIPS}


def _make(effect_id: str, robot: Robot) -> Effect:
    if effect_id not in _REGISTRY:
        known = ", ".join(modelled_effects())
        raise InputError(
            f"robot description: physics.{effect_id} is not in the power model: "
            f"remove it, it knows {known}"
        )
    cls = _REGISTRY[effect_id]
    names = [field.name for field in fields(cls)]
    values = {
        name: np.array(robot.everywhere(effect_id, name, _NEUTRAL.get(name, 0.0))) for name in names
    }
    return cls(**values)
