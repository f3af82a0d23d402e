"""Typed, bounded, described parameters: one table serves YAML files and ROS nodes alike."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

from attrs import frozen

from tomr_power_model.errors import InputError, one_line
from tomr_power_model.files import load_yaml

Value = float | int | bool | str | tuple[float, ...] | tuple[str, ...]
Kind = Literal["float", "int", "bool", "str", "floats", "strs"]
_MISTYPED = 0.8  # how much a key has to look like the one that is missing


@frozen
class ParameterSpec:
    """One parameter: its dotted name, type, unit, bounds and what it means."""

    name: str
    description: str
    kind: Kind = "float"
    default: Value | None = None  # None: the parameter must be given
    unit: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    above: float = -math.inf  # exclusive lower bound
    choices: tuple[str, ...] = ()
    length: int | None = None  # of a list; None: any
    read_only: bool = True

    @property
    def required(self) -> bool:
        return self.default is None

    @property
    def bounds(self) -> str:
        """The permitted values in words, empty if there is no bound."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        low = f"above {self.above:g}" if math.isfinite(self.above) else ""
        if math.isfinite(self.minimum):
            low = f"at least {self.minimum:g}"
        high = f"at most {self.maximum:g}" if math.isfinite(self.maximum) else ""
        return ", ".join(part for part in (low, high) if part)

    @property
    def summary(self) -> str:
        """One line: default, unit, meaning, bounds."""
        default = "" if self.required else f" = {self.default!r}"
        unit = f" [{self.unit}]" if self.unit else ""
        bounds = f"; {self.bounds}" if self.bounds else ""
        live = "" if self.read_only else " (may change while running)"
        return f"{self.name}{default}{unit}: {self.description}{bounds}{live}"

    def check(self, value: object, place: str) -> Value:
        """Return the value in its type, or raise InputError naming the key and the remedy."""
        try:
            typed = _typed(self.kind, value)
        except (TypeError, OverflowError) as error:
            shown = one_line(repr(value))
            raise InputError(f"{place}: {self.name} = {shown}: {error}") from None
        if self.length is not None and isinstance(typed, tuple) and len(typed) != self.length:
            raise InputError(
                f"{place}: {self.name} = {value!r}: needs {self.length} values, has {len(typed)}"
            )
        self._check_bounds(typed, place)
        return typed

    def _check_bounds(self, value: Value, place: str) -> None:
        unit = f" {self.unit}" if self.unit else ""
        if self.choices and value not in self.choices:
            raise InputError(f"{place}: {self.name} = {value!r}: give {self.bounds}")
        numbers = value if isinstance(value, tuple) else (value,)
        for number in numbers:
            if isinstance(number, str | bool):
                continue
            if not math.isfinite(number):
                raise InputError(f"{place}: {self.name} = {number}: give a finite number{unit}")
            if number < self.minimum or number > self.maximum or number <= self.above:
                raise InputError(
                    f"{place}: {self.name} = {number:g}{unit}: out of range, give {self.bounds}"
                )


def _typed(kind: Kind, value: object) -> Value:
    if kind == "floats":
        return tuple(_number(item) for item in _sequence(value))
    if kind == "strs":
        return tuple(_text(item) for item in _sequence(value))
    if kind == "bool":
        if isinstance(value, bool):
            return value
        raise TypeError("give true or false")
    if kind == "str":
        return _text(value)
    if kind == "int":
        if isinstance(value, int) and not isinstance(value, bool):
            return value
        raise TypeError("give a whole number")
    return _number(value)


def _sequence(value: object) -> Sequence[object]:
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise TypeError("give a list")
    return list(value)


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError("give a number")
    return float(value)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("give a text")
    return value


NAMELESS = "tomr"  # the robot outside of any namespace
HARDWARE_ID = ParameterSpec(
    "hardware_id",
    f"of this robot, in every status; empty: its namespace, else {NAMELESS}",
    "str",
    "",
)
CMD_VEL_TYPE = ParameterSpec(
    "cmd_vel_type",
    "message type of cmd_vel, auto: that of its publishers; a Twist counts from when it arrives",
    "str",
    "auto",
    choices=("auto", "twist_stamped", "twist"),
)
USE_SIM_TIME = ParameterSpec("use_sim_time", "time comes from /clock", "bool", False)
# What a description may hold for all nodes besides the robot, in its /** section.
SHARED_PARAMETERS = (CMD_VEL_TYPE, HARDWARE_ID, USE_SIM_TIME)


def check_all(
    specs: Iterable[ParameterSpec], values: Mapping[str, object], place: str
) -> dict[str, Value]:
    """Check flat dotted values against a table; absent ones take their default.

    Raises InputError for a missing required key, a wrong type or a value out of range. Keys that
    the table does not know are left to the caller.
    """
    checked: dict[str, Value] = {}
    specs = tuple(specs)
    for spec in specs:
        if spec.name in values:
            checked[spec.name] = spec.check(values[spec.name], place)
        elif spec.default is None:
            unit = f" [{spec.unit}]" if spec.unit else ""
            unknown = values.keys() - {spec.name for spec in specs}
            meant = nearest(spec.name, sorted(unknown), _MISTYPED)
            raise InputError(
                f"{place}: {spec.name} is missing: add it ({spec.description}{unit})"
                + (f"; is {meant} meant to be it?" if meant else "")
            )
        else:
            checked[spec.name] = spec.default
    return checked


def nearest(word: str, others: Sequence[str], alike: float = 0.6) -> str:
    """Which of some words it looks like, by `alike` at least (0 to 1); empty: none."""
    import difflib

    return next(iter(difflib.get_close_matches(word, others, n=1, cutoff=alike)), "")


def parse_assignments(assignments: Iterable[str]) -> dict[str, object]:
    """`name=value` pairs from a command line, values read as YAML."""
    values: dict[str, object] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise InputError(f"--set {assignment}: write name=value, as in {assignment}=2.0")
        values[name.strip()] = load_yaml(text, f"--set {assignment}")
    return values
