"""Messages for recordings, built without ROS: the standard types of Jazzy as rosbags knows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np
from attrs import frozen
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from tomr_power_model.messages.plain import Plain, build, header

_NUMBERS = frozenset(f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64))
_NUMBERS |= {"float32", "float64", "bool"}
# rosbags reads and writes these three as plain numbers of one byte.
_BYTE_NAMES = {"byte": "uint8", "octet": "uint8", "char": "uint8"}


@cache
def jazzy_typestore() -> Typestore:
    """Return the message definitions of ROS 2 Jazzy, read once per process."""
    return get_typestore(Stores.ROS2_JAZZY)


@frozen
class _Blueprint:
    """How to build one message type."""

    build: Callable[..., Any]
    defaults: tuple[tuple[str, Callable[[], Any]], ...]
    casts: Mapping[str, Callable[[Any], Any]]  # only the fields whose values need one


def bag_message(type_name: str, **fields: object) -> Any:
    """Return a message that the recording writer can serialise.

    Fields that are not named get their zero: 0, 0.0, False, "", an empty or zero-filled array, a
    nested message of zeros. Sequences of numbers are cast to the array type of the field, and
    bytes of one byte (rclpy's form of ``DiagnosticStatus.level``) to a number.

    Args:
        type_name: full name, e.g. "sensor_msgs/msg/BatteryState".
        fields: values by field name, in the units of the message definition.

    Raises:
        TypeError: unknown message type or field, named in the message.
        ValueError: an array of the wrong length for a fixed-size field.
    """
    plan = _blueprint(type_name)
    for name, cast in plan.casts.items():
        if name in fields:
            fields[name] = cast(fields[name])
    for name, default in plan.defaults:
        if name not in fields:
            fields[name] = default()
    try:
        return plan.build(**fields)
    except TypeError:
        known = [name for name, _ in plan.defaults]
        unknown = ", ".join(sorted(set(fields) - set(known)))
        raise TypeError(
            f"{type_name} has no field {unknown}; its fields are {', '.join(known)}"
        ) from None


def to_bag(plain: Plain) -> Any:
    """Return a plain message in the form that a recording takes."""
    return build(plain, bag_message)


def bag_header(stamp_ns: int, frame_id: str = "") -> Any:
    """Return a std_msgs/msg/Header with a stamp of `stamp_ns` [ns]."""
    return to_bag(header(int(stamp_ns), frame_id))


@cache
def _blueprint(type_name: str) -> _Blueprint:
    store = jazzy_typestore()
    if type_name not in store.fielddefs:
        raise TypeError(f"no message type {type_name!r} in ROS 2 Jazzy")
    defaults: list[tuple[str, Callable[[], Any]]] = []
    casts: dict[str, Callable[[Any], Any]] = {}
    for name, description in store.fielddefs[type_name][1]:
        default, cast = _field(name, description)
        defaults.append((name, default))
        if cast is not None:
            casts[name] = cast
    return _Blueprint(build=store.types[type_name], defaults=tuple(defaults), casts=casts)


def _field(name: str, description: Any) -> tuple[Callable[[], Any], Callable[[Any], Any] | None]:
    """Return the default of a field and, where its values need one, the cast."""
    node, detail = description
    if node == Nodetype.NAME:
        return partial(bag_message, detail), None
    if node == Nodetype.BASE:
        return _scalar(detail[0])
    (element_node, element), length = detail
    base = element[0] if element_node == Nodetype.BASE else ""
    base = _BYTE_NAMES.get(base, base)
    if base not in _NUMBERS:
        item = partial(bag_message, element) if element_node == Nodetype.NAME else str
        fixed = length if node == Nodetype.ARRAY else 0
        return (lambda: [item() for _ in range(fixed)]), list
    dtype = np.dtype(base)
    size = length if node == Nodetype.ARRAY else 0
    expected = length if node == Nodetype.ARRAY else None
    return partial(np.zeros, size, dtype), partial(_array, name, dtype, expected)


def _scalar(base: str) -> tuple[Callable[[], Any], Callable[[Any], Any] | None]:
    if base in _BYTE_NAMES:
        return int, _byte
    if base == "bool":
        return bool, None
    if base in ("string", "wstring"):
        return str, None
    return (float if base.startswith("float") else int), None


def _byte(value: Any) -> int:
    return value[0] if isinstance(value, bytes) else int(value)


def _array(name: str, dtype: np.dtype[Any], length: int | None, value: Any) -> Any:
    array = np.asarray(value, dtype=dtype).reshape(-1)
    if length is not None and array.size != length:
        raise ValueError(f"field {name} takes {length} numbers, got {array.size}")
    return array
