"""Finding a topic of the contract in a recording, with or without a namespace."""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

from tomr_power_model.errors import InputError

# `odom` must never find `ground_truth/odom`, nor `joint_states` the model's own prediction.
NOT_A_NAMESPACE = frozenset({"ground_truth", "predicted"})


class HasTopics(Protocol):
    """Anything that names its source and its topics."""

    @property
    def name(self) -> str: ...
    @property
    def topics(self) -> Collection[str]: ...


def absolute_topic(topic: str, namespace: str = "") -> str:
    """Return the topic with its leading slash: ("power", "robot1") -> "/robot1/power"."""
    parts = [part for part in f"{namespace}/{topic}".split("/") if part]
    return "/" + "/".join(parts)


def resolve_topic(recording: HasTopics, topic: str, namespace: str | None = None) -> str | None:
    """Return the full name under which a recording holds `topic`, or None.

    "wheel_1/power" finds "/wheel_1/power", else the only "/<namespace>/wheel_1/power" there is.
    With a `namespace` (may be "" or "/") only that name counts.

    Raises:
        InputError: several namespaces hold the topic and none was asked for.
    """
    exact = absolute_topic(topic, namespace or "")
    if exact in recording.topics:
        return exact
    if namespace is not None:
        return None
    found = [
        name
        for name in recording.topics
        if name.endswith(exact) and not NOT_A_NAMESPACE.intersection(name[: -len(exact)].split("/"))
    ]
    if len(found) > 1:
        raise InputError(
            f"{recording.name}: {topic} is there {len(found)} times ({', '.join(sorted(found))}); "
            "say which namespace is meant"
        )
    return found[0] if found else None


def require_topic(recording: HasTopics, topic: str, namespace: str | None = None) -> str:
    """Return the full name of a topic that must be there.

    Raises:
        InputError: absent or ambiguous, with what the recording holds.
    """
    found = resolve_topic(recording, topic, namespace)
    if found is None:
        raise InputError(
            f"{recording.name}: no topic {absolute_topic(topic, namespace or '')}; the recording "
            f"holds {', '.join(sorted(recording.topics))}; give the name it was recorded under"
        )
    return found
