"""What a family of unnamed terms is: what it acts on, and the variables that it depends on."""

from collections.abc import Callable, Iterator, Mapping
from typing import ClassVar, Literal

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.unmodelled.motion import Motion

Array = NDArray[np.float64]
Acts = Literal["torque", "force", "driver", "supply"]
UNITS: Mapping[Acts, str] = {"torque": "N m", "force": "N", "driver": "W", "supply": "W"}


@frozen
class Axis:
    """One variable of a table."""

    name: str
    unit: str
    knots: int  # along it
    of: Callable[[Motion], Array]  # each period and place, (n, places): wheels, or one
    is_periodic: bool = False  # an angle
    spacing: float = 0.0  # between knots at most, in the unit; 0: as many as `knots` says

    @property
    def title(self) -> str:
        """E.g. `wheel speed [rad/s]`."""
        return f"{self.name} [{self.unit}]"


class Family:
    """Terms that act on one thing and depend on the same variables, smoothly."""

    family_id: ClassVar[str]
    acts: ClassVar[Acts]
    axes: ClassVar[tuple[Axis, ...]]
    words: ClassVar[str]  # what it is, for a person
    look: ClassVar[str]  # what to look at first
    is_strange: ClassVar[bool] = False  # whether no effect of the vocabulary depends on the like
    is_event: ClassVar[bool] = False  # whether it says when, not why: no other drive repeats it
    is_shared: ClassVar[bool] = False  # whether one table holds for all wheels
    is_coupled: ClassVar[bool] = False  # whether it changes the speeds or currents it depends on
    holds: ClassVar[str] = ""  # the family whose terms are all among its own

    @classmethod
    def coordinates(cls, motion: Motion) -> Array:
        """Of each period and place, (n, places, axes)."""
        return np.stack([axis.of(motion) for axis in cls.axes], axis=-1)

    @staticmethod
    def factor(motion: Motion) -> Array:
        """What the table's value is multiplied by, (n, places) or (1, 1)."""
        return np.ones((1, 1))


class Resistance(Family):
    """Torques against a wheel's motion, either way."""

    acts = "torque"

    @staticmethod
    def factor(motion: Motion) -> Array:
        return motion.sign


class _Registry(Mapping[str, type[Family]]):
    def __init__(self) -> None:
        self._known: dict[str, type[Family]] = {}

    def register(self, cls: type[Family]) -> type[Family]:
        """Add a family."""
        self._known = dict(sorted({**self._known, cls.family_id: cls}.items()))
        return cls

    def __getitem__(self, family_id: str) -> type[Family]:
        return self._known[family_id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


FAMILIES = _Registry()
family = FAMILIES.register
