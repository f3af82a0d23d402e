"""What types the messages of a recording are, by the standard and by the recording's own word."""

from __future__ import annotations

from functools import lru_cache

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import get_types_from_idl, get_types_from_msg

from tomr_power_model.errors import InputError
from tomr_power_model.limits import limits
from tomr_power_model.messages.bag import jazzy_typestore

_RULE = "=" * 80 + "\n"
_HEAD = "IDL: "


def check_definition(connection: Connection, place: str) -> None:
    """Raise InputError unless a topic's type is a standard one, defined as in ROS 2 Jazzy.

    Where a recording defines its types itself, its bytes follow that definition: read by another,
    they would give wrong numbers without a word.
    """
    kind, topic = connection.msgtype, connection.topic
    standard = jazzy_typestore().fielddefs
    if kind not in standard:
        raise InputError(
            f"{place}: {topic} is a {kind}, which is no standard message of ROS 2 Jazzy: leave "
            "the topic out, or record another"
        )
    form, text = connection.msgdef.format, connection.msgdef.data
    if form == MessageDefinitionFormat.NONE or not text:
        return
    # As in Recording._read: only library code runs in the block, and its errors have no base.
    try:
        own = _defined(kind, form, text)
    except Exception as error:
        raise InputError(
            f"{place}: the definition of {kind} ({topic}) cannot be read ({type(error).__name__}); "
            "make another copy of the recording, or record it again"
        ) from error
    for name, (_, fields) in own.items():
        if name in standard and list(fields) != list(standard[name][1]):
            raise InputError(
                f"{place}: {topic}: the recording defines {name} otherwise than ROS 2 Jazzy: "
                "record it with the standard messages"
            )


@lru_cache(maxsize=64)  # recordings repeat the same few, and parsing one takes milliseconds
def _defined(kind: str, form: MessageDefinitionFormat, text: str) -> Typesdict:
    if len(text) > limits().text_bytes:
        raise ValueError("too large")
    if form == MessageDefinitionFormat.MSG:
        return get_types_from_msg(text, kind)
    if not text.startswith(_RULE + _HEAD):
        return get_types_from_idl(text)
    found: Typesdict = {}
    for part in text.split(_RULE)[1:]:
        found.update(get_types_from_idl(part.partition("\n")[2]))
    return found
