"""The largest of everything that is read: one record, reported when exceeded, settable.

A limit is changed by an environment variable, e.g. TOMR_LIMIT_CHUNK_BYTES=1e9. They keep one bad
or hostile input from taking the memory, the disk or the time of the machine; robots' own data
stay far below.
"""

import math
import os
from collections.abc import Mapping
from functools import cache
from typing import Any, NoReturn, Self

from attrs import field, fields, frozen

from tomr_power_model.errors import InputError

PREFIX = "TOMR_LIMIT_"
_KILO, _MEGA, _GIGA = 1 << 10, 1 << 20, 1 << 30


def _limit(default: int, meaning: str) -> Any:
    return field(default=default, metadata={"meaning": meaning})


@frozen
class Limits:
    """Whole numbers; bytes where the name says so, seconds where it does."""

    text_bytes: int = _limit(512 * _KILO, "a description, mission or metadata file")
    yaml_values: int = _limit(50_000, "values of a YAML file, aliases written out")
    yaml_depth: int = _limit(30, "nesting of a YAML file")
    table_bytes: int = _limit(64 * _MEGA, "a csv file of the importer")
    arrays_bytes: int = _limit(64 * _MEGA, "the unpacked arrays of a weights file")
    archive_bytes: int = _limit(512 * _MEGA, "an unpacked archive of the importer")
    archive_files: int = _limit(10_000, "files of an archive of the importer")
    recording_bytes: int = _limit(64 * _GIGA, "a recording on disk")
    recording_files: int = _limit(1_000, "storage files of a recording")
    unpacked_file_bytes: int = _limit(_GIGA, "a compressed recording, unpacked on disk")
    unpacked_bytes: int = _limit(16 * _GIGA, "a recording with its chunks unpacked")
    chunk_bytes: int = _limit(64 * _MEGA, "unpacked chunks of a recording that are read at once")
    message_bytes: int = _limit(64 * _MEGA, "a message of a recording")
    messages: int = _limit(20_000_000, "messages of a recording that are read")
    topic_rate: int = _limit(1_200, "messages a second of a topic that a node takes")
    topic_message_bytes: int = _limit(_MEGA, "a message that a node takes")
    samples: int = _limit(2_000_000, "samples of one topic that a fit holds")
    mission_phases: int = _limit(100_000, "phases of a mission, repeats counted")
    mission_seconds: int = _limit(86_400, "a mission")
    drive_seconds: int = _limit(3_600, "a recording that is fitted as a whole")
    stamp_jump_seconds: int = _limit(30, "a step between the stamps of a topic, in a fit")

    @classmethod
    def of_environment(cls, environment: Mapping[str, str]) -> Self:
        """The defaults, changed by TOMR_LIMIT_* variables. Raises InputError for a bad one."""
        known = {PREFIX + key.name.upper(): key.name for key in fields(cls)}
        given: dict[str, int] = {}
        for variable, text in environment.items():
            if not variable.startswith(PREFIX):
                continue
            if variable not in known:
                raise InputError(f"{variable} is no limit: give one of {', '.join(sorted(known))}")
            given[known[variable]] = _whole(variable, text)
        return cls(**given)


def _whole(variable: str, text: str) -> int:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 1.0 <= number <= 2.0**60:
        raise InputError(f"{variable} = {text!r}: give a number from 1 to 1e18")
    return int(number)


@cache
def limits() -> Limits:
    """The limits in force, read from the environment once per process. Raises InputError."""
    return Limits.of_environment(os.environ)


def too_large(place: str, what: str, name: str) -> NoReturn:
    """Raise InputError for what exceeds the limit `name`; `what` says what was found."""
    limit = getattr(limits(), name)
    raise InputError(
        f"{place}: {what}; the limit is {limit:,}, set {PREFIX}{name.upper()} to allow more"
    )
