"""What a try is: a command with files that were made for it, and what it may answer."""

import random
from collections.abc import Callable
from pathlib import Path

from attrs import field, frozen

from tomr_power_model.recordings import open_recording

ROOT = Path(__file__).resolve().parents[2]
HEALTHY, FAULTY = ROOT / "bags" / "square", ROOT / "bags" / "circle_encoder_lost"
FAULT = "motor system fault 3"  # in the faulty one
POWER = {f"/wheel_{number}/power": f"power sensor fault {number}" for number in (1, 2, 3)}


@frozen
class Attack:
    """One try. `names`: faults that may be named, None where nothing is known of the data."""

    tool: str
    arguments: tuple[str, ...]
    what: str  # in words
    names: frozenset[str] | None = None
    outputs: tuple[Path, ...] = ()  # must be whole or absent
    largest_file: int | None = None  # bytes that may be written to a file: a full disk
    signal_after: float | None = None  # s, SIGTERM
    environment: dict[str, str] = field(factory=dict)


@frozen
class Raw:
    """A message of a recording, as bytes."""

    topic: str
    type_name: str
    data: bytes
    stamp_ns: int


@frozen
class Base:
    """Recordings to start from, read once."""

    healthy: tuple[Raw, ...]
    faulty: tuple[Raw, ...]

    def some(self, dice: random.Random) -> tuple[tuple[Raw, ...], frozenset[str]]:
        """A recording or a part of it, and the faults that may be named."""
        chosen, names = dice.choice(
            ((self.healthy, frozenset[str]()), (self.faulty, frozenset({FAULT})))
        )
        seconds = dice.choices((3.0, 6.0, 60.0), (6, 2, 1))[0]  # most of them short: cheap
        first = chosen[0].stamp_ns + round(dice.uniform(0.0, 8.0) * 1e9 * (seconds < 60.0))
        last = first + round(seconds * 1e9)
        return tuple(raw for raw in chosen if first <= raw.stamp_ns <= last), names


Generator = Callable[[random.Random, Path, Base], Attack]
GENERATORS: dict[str, Generator] = {}


def attack(name: str) -> Callable[[Generator], Generator]:
    """Register a kind of attack under its name."""

    def register(function: Generator) -> Generator:
        GENERATORS[name] = function
        return function

    return register


def read_base() -> Base:
    """The small recordings that come with the repository."""
    return Base(_read(HEALTHY), _read(FAULTY))


def _read(path: Path) -> tuple[Raw, ...]:
    with open_recording(path) as recording:
        return tuple(Raw(*item) for item in recording.raw_messages())


def reading(dice: random.Random, path: Path) -> tuple[str, tuple[str, ...]]:
    """A command that reads a recording; those that fit take long, and are tried more rarely."""
    tool = dice.choices(("tomr_diagnose", "tomr_calibrate", "tomr_gap"), (16, 2, 1))[0]
    if tool == "tomr_diagnose":
        return tool, (str(path), "--json")
    if tool == "tomr_calibrate":
        return tool, (str(path), "--robot", "reference", "--fit", "robot.mass")
    return tool, ("check", "--robot", "reference", "--real", str(path), "--quiet")


NUMBERS = (
    *("0", "-0.0", "1", "-1", "1e30", "-1e30", "1e-30", "1e308", "1e309", "-1e308", "5e-324"),
    *(".nan", ".inf", "-.inf", "nan", "inf", "0x10", "1_000", "1:30", "9" * 30, "9" * 5000),
)
VALUES = (
    *NUMBERS,
    *("~", "true", "no", "''", '"x"', "[]", "{}", "[1, 2]", "[a, [b]]", "{a: 1}", "*a", "&a 1"),
    *("!!int abc", "!!float x", "!!bool x", "!!timestamp x", "!!binary x", "!!set {a}", "!!str 1"),
    *("!!python/object:os.system x", "2001-02-30", "&a [*a]", "|\n  text", '"\\x00\\ud800"'),
    *("[" * 60, "{a: " * 60, "- - -", "? x", "%YAML 9", "\t", "\x00", "\x1b[31m", "x" * 100_000),
)
