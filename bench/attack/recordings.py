"""Attacks on recordings: their bytes, their messages, their time."""

import math
import random
import shutil
import struct
from collections.abc import Callable, Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve

from attack.case import POWER, Attack, Base, Raw, attack, reading
from tomr_fault_diag.classifier.states import DISOBEYS
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings import RecordingWriter

Raws = Iterable[Raw]
_STAMP, _HEAD = struct.Struct("<iI"), 4  # the stamp comes after what states the encoding
SECOND = 1_000_000_000
_DEAD_S = 2.0  # as the classifier has it
EXTREMES = (math.nan, math.inf, -math.inf, 1e308, -1e308, 1e30, -1e30, 1e6, 0.0, 5e-324)
_SENSORS = ("/joint_states", "/wheel_1/power", "/wheel_2/power", "/wheel_3/power")


def write(path: Path, raws: Raws, storage: str = "mcap") -> Path:
    """Write messages in the order of their receive stamps."""
    with RecordingWriter(path, storage) as writer:
        for raw in sorted(raws, key=lambda item: item.stamp_ns):
            writer.write_raw(raw.topic, raw.type_name, raw.data, max(0, raw.stamp_ns))
    return path


def changed(raw: Raw, change: Callable[[Any], None]) -> Raw:
    """A message decoded, changed and encoded again; as it was where it cannot be encoded."""
    store = jazzy_typestore()
    message = store.deserialize_cdr(raw.data, raw.type_name)
    change(message)
    try:
        return evolve(raw, data=bytes(store.serialize_cdr(message, raw.type_name)))
    except Exception:  # noqa: BLE001 rosbags' serialisers raise what struct and numpy do
        return raw


def restamped(raw: Raw, stamp_ns: int) -> Raw:
    """A message with another stamp in its header, with which each of the base begins."""
    seconds, rest = divmod(max(-(2**31) * SECOND, stamp_ns), SECOND)
    data = bytearray(raw.data)
    _STAMP.pack_into(data, _HEAD, min(seconds, 2**31 - 1), rest)
    return evolve(raw, data=bytes(data))


@attack("bytes of a file")
def damaged_file(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    storage = dice.choice(("mcap", "sqlite3"))
    bag = write(folder / "bag", raws, storage)
    victims = sorted(bag.iterdir(), key=lambda item: item.name == "metadata.yaml")
    victim = dice.choices(victims, (4, 1))[0]
    data = bytearray(victim.read_bytes())
    kind = dice.choice(("flip", "flip", "cut", "zeros", "splice", "insert", "repeat", "random"))
    at, length = dice.randrange(len(data)), dice.choice((1, 8, 64, 1000, 30_000))
    if kind == "flip":
        for _ in range(dice.choice((1, 1, 3, 30, 300))):
            data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    elif kind == "cut":
        del data[at:]
    elif kind == "zeros":
        data[at : at + length] = bytes(len(data[at : at + length]))
    elif kind == "random":
        data[at : at + length] = dice.randbytes(len(data[at : at + length]))
    else:
        piece = data[(start := dice.randrange(len(data))) : start + length]
        data[at : at + (length if kind == "splice" else 0)] = piece * (5 if kind == "repeat" else 1)
    victim.write_bytes(data)
    if dice.random() < 0.3:
        (bag / "metadata.yaml").unlink()
    tool, arguments = reading(dice, bag)
    # A flipped bit of sqlite3 may be a plausible value: there is nothing to know it by.
    known = None if storage == "sqlite3" or victim.name == "metadata.yaml" else names
    return Attack(tool, arguments, f"{kind} in {victim.suffix} of {storage}", known)


def _numbers(message: Any, dice: random.Random) -> str:
    """Set one number of a message to something no sensor gives."""
    holders = [message]
    for name in ("twist", "linear", "angular", "angular_velocity", "linear_acceleration"):
        holders += [getattr(item, name) for item in holders if hasattr(item, name)]
    holder = dice.choice(holders)
    fields = [
        name
        for name in holder.__dataclass_fields__
        if isinstance(getattr(holder, name), float | np.ndarray)
    ]
    if not fields:
        return "nothing"
    name, value = dice.choice(fields), dice.choice(EXTREMES)
    old = getattr(holder, name)
    if isinstance(old, float):
        setattr(holder, name, value)
    elif len(old):
        new = np.array(old)
        new[dice.randrange(len(new))] = value
        setattr(holder, name, new)
    return f"{name} = {value}"


def _shapes(message: Any, dice: random.Random) -> str:
    """Give a message wrong lengths or names."""
    if not hasattr(message, "name"):
        return _numbers(message, dice)
    kind = dice.choice(("shorter", "longer", "names", "twice", "odd names", "empty"))
    if kind in ("shorter", "longer"):
        name = dice.choice(("position", "velocity", "effort"))
        setattr(message, name, np.zeros(dice.choice((0, 1, 2, 4, 5000))))
    elif kind == "names":
        message.name = message.name[:-1]
    elif kind == "twice":
        message.name = [message.name[0]] * len(message.name)
    elif kind == "odd names":
        message.name = [dice.choice(("\x00", "a\nb", "{}", "x" * 70_000)) for _ in message.name]
    else:
        message.name = []
    return kind


@attack("fields of messages")
def odd_messages(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    topics = sorted({raw.topic for raw in raws})
    topic, share = dice.choice(topics), dice.choice((0.002, 0.02, 0.2, 1.0))
    change = dice.choice((_numbers, _numbers, _shapes))
    said: set[str] = set()

    def made(raw: Raw) -> Raw:
        if raw.topic != topic or dice.random() > share:
            return raw
        return changed(raw, lambda message: said.add(change(message, dice)))

    bag = write(folder / "bag", [made(raw) for raw in raws])
    tool, arguments = reading(dice, bag)
    what = f"{topic}: {', '.join(sorted(said)[:3])} in {share:.1%}"
    # What a sensor could have measured is data: zeros and a million are.
    plausible = any(text.endswith(("= 0.0", "= 5e-324", "= 1000000.0")) for text in said)
    return Attack(tool, arguments, what, None if plausible else names)


@attack("encoded messages")
def odd_encodings(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    topic, kind = dice.choice(_SENSORS), dice.choice(("flip", "cut", "claim", "type", "append"))
    share = dice.choice((0.01, 0.3))

    def made(raw: Raw) -> Raw:
        if raw.topic != topic or dice.random() > share:
            return raw
        data = bytearray(raw.data)
        at = dice.randrange(len(data))
        if kind == "flip":
            data[at] ^= 1 << dice.randrange(8)
        elif kind == "cut":
            del data[at:]
        elif kind == "claim":
            at = 4 * (at // 4)
            data[at : at + 4] = dice.choice((2**31 - 1, 2**32 - 1, 2**20)).to_bytes(4, "little")
        elif kind == "append":
            data += bytes(dice.choice((1, 8, 100_000)))
        else:
            return evolve(
                raw, type_name=dice.choice(("std_msgs/msg/String", "sensor_msgs/msg/Imu"))
            )
        return evolve(raw, data=bytes(data))

    bag = write(folder / "bag", [made(raw) for raw in raws], dice.choice(("mcap", "sqlite3")))
    tool, arguments = reading(dice, bag)
    # A flipped bit and what is claimed may stand where a plausible value does.
    known = None if kind in ("flip", "claim") else names
    return Attack(tool, arguments, f"{kind} on {topic} in {share:.0%}", known)


_CLOCKS = ("stamped", "received", "both")  # times of a message that are not true
_MOTION = {"/joint_states", "/cmd_vel"}


@attack("stamps")
def odd_stamps(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    topics = {raw.topic for raw in raws}
    chosen = topics if dice.random() < 0.5 else {dice.choice(sorted(topics))}
    middle = raws[dice.randrange(len(raws))].stamp_ns
    kind = dice.choice(("jump", "stray", "reverse", "zero", "epoch", "repeat", "shuffle", "far"))
    by = round(dice.choice((-1, 1)) * dice.choice((0.3, 1.5, 20.0, 3600.0, 3.2e7)) * SECOND)
    clock = dice.choice(_CLOCKS)

    def made(raw: Raw) -> Raw:
        if raw.topic not in chosen:
            return raw
        stamp = _moved(kind, raw.stamp_ns, (raws[0].stamp_ns, middle, by), dice)
        if clock == "received":  # which is never before it was sent
            return evolve(raw, stamp_ns=max(raw.stamp_ns, stamp))
        return restamped(raw if clock == "stamped" else evolve(raw, stamp_ns=stamp), stamp)

    bag = write(folder / "bag", [made(raw) for raw in raws])
    tool, arguments = reading(dice, bag)
    where = next(iter(chosen)) if len(chosen) == 1 else "all topics"
    what = f"{kind} by {by / SECOND:g} s on {where}, {clock}"
    return Attack(tool, arguments, what, _known_of_stamps(kind, clock, chosen, names))


def _moved(kind: str, stamp: int, moves: tuple[int, int, int], dice: random.Random) -> int:
    """A stamp that is not true [ns]; `moves`: the first, one in the middle, by how much."""
    first, middle, by = moves
    if (kind == "jump" and stamp > middle) or (kind == "stray" and dice.random() < 0.01):
        return stamp + by
    if kind == "far" and dice.random() < 0.02:
        return dice.choice((2**31 * SECOND - 1, 1, -5 * SECOND))
    moved = {
        "reverse": 2 * middle - stamp,
        "epoch": stamp - first,
        "shuffle": stamp + round(dice.gauss(0.0, 0.2) * SECOND),
        "zero": dice.choice((0, stamp)),
        "repeat": dice.choice((middle, stamp)),
    }
    return moved.get(kind, stamp)


def _known_of_stamps(
    kind: str, clock: str, chosen: set[str], names: frozenset[str]
) -> frozenset[str] | None:
    """Faults that may be named where a part of a recording comes at another time than it was."""
    alone = len(chosen) == 1
    if clock == "both" and kind == "reverse" and "/joint_states" in chosen:
        return None  # a well-formed recording of a motion that no robot makes
    if clock != "stamped" and alone and kind in ("jump", "reverse", "shuffle"):
        names |= {POWER[topic] for topic in chosen if topic in POWER}  # no power of this motion
    # It moves before or long after its command.
    if clock == "both" and alone and kind in ("jump", "reverse") and chosen & _MOTION:
        names |= {DISOBEYS.name}
    return names


@attack("gaps and losses")
def missing(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    topics = {raw.topic for raw in raws}
    chosen = topics if dice.random() < 0.5 else {dice.choice(sorted(topics))}
    kind = dice.choice(("gap", "gap", "loss", "bursts", "late", "all"))
    begin = raws[dice.randrange(len(raws))].stamp_ns
    length = dice.choice((0.05, 0.2, 0.3, 0.5, 0.9, 2.0)) * SECOND
    share = dice.choice((0.05, 0.3, 0.5, 0.67, 0.9, 0.99))

    def lost(raw: Raw) -> bool:
        if raw.topic not in chosen:
            return False
        if kind == "gap":
            return begin < raw.stamp_ns < begin + length
        if kind == "loss":
            return dice.random() < share
        if kind == "bursts":
            return (raw.stamp_ns // 200_000_000) % 3 == 0
        return kind == "all" or raw.stamp_ns < begin

    kept = [raw for raw in raws if not lost(raw)]
    bag = write(folder / "bag", kept)
    tool, arguments = reading(dice, bag)
    what = f"{kind} of {length / SECOND:g} s, {share:.0%} on {len(chosen)} topics"
    if kind in ("late", "all"):
        names |= {POWER[topic] for topic in chosen if topic in POWER}
    edges = raws[0].stamp_ns, raws[-1].stamp_ns
    names |= {POWER[topic] for topic in chosen if topic in POWER and _is_dead(topic, kept, edges)}
    return Attack(tool, arguments, what, names)


def _is_dead(topic: str, kept: Raws, edges: tuple[int, int]) -> bool:
    """Whether a sensor is silent for so long that it may be called faulty."""
    stamps = sorted((*edges, *(raw.stamp_ns for raw in kept if raw.topic == topic)))
    return any(after - before > _DEAD_S * SECOND for before, after in pairwise(stamps))


@attack("several recordings")
def folders(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws, names = base.some(dice)
    kind = dice.choice(("name", "link loop", "device", "empty", "mixed", "twice", "nested"))
    bag = write(folder / "bag", raws)
    if kind == "name":
        name = dice.choice(
            ("a\nb", "\x1b[31m", "$x_$", "<script>", "-x", "#: {", "ü" * 60, "a?b%41")
        )
        bag = bag.rename(folder / name)
    elif kind == "link loop":
        (bag / "loop.mcap").symlink_to(bag / "loop.mcap")
    elif kind == "device":
        (bag / "bag.mcap").unlink()
        (bag / "bag.mcap").symlink_to(dice.choice(("/dev/zero", "/dev/full", "/dev/tty", "/")))
    elif kind == "empty":
        (bag / "bag.mcap").write_bytes(b"")
    elif kind == "mixed":
        write(folder / "other", raws, "sqlite3")
        shutil.copy(folder / "other" / "other.db3", bag)
        (bag / "metadata.yaml").unlink()
    elif kind == "twice":
        shutil.copy(bag / "bag.mcap", bag / "copy.mcap")
        (bag / "metadata.yaml").unlink()
    else:
        shutil.copytree(bag, bag / "bag.db3")
    tool, arguments = reading(dice, bag)
    return Attack(tool, arguments, kind, names)


@attack("a recorder that is killed")
def unclosed(dice: random.Random, folder: Path, base: Base) -> Attack:
    raws = base.healthy if dice.random() < 0.1 else base.healthy[: dice.choice((1200, 2400))]
    data = (write(folder / "bag", raws) / "bag.mcap").read_bytes()
    path = folder / "cut.mcap"
    path.write_bytes(data[: dice.randrange(len(data))])
    tool, arguments = reading(dice, path)
    return Attack(tool, arguments, "cut", frozenset())
