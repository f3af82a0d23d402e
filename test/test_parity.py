"""One recording through the three nodes over DDS, through the one node that holds all three stages,
and through `tomr_diagnose`: the same messages."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from replays import TIMING, is_heard_reliably, listening, playing

from tomr_fault_diag.classifier.messages import NAME, SILENCE
from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.messages.bag import jazzy_typestore, to_bag
from tomr_power_model.messages.outgoing import TYPES, DiagnosticMessage
from tomr_power_model.nodes.stage_node import STAGE_QOS, message_class
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.predictions import prediction_topics

BAG = Path(__file__).parents[1] / "bags" / "circle_encoder_lost"
SENSORS = ("cmd_vel", "joint_states", "wheel_1/power")

Key = tuple[str, int, str]


def _types() -> dict[str, str]:
    predicted = prediction_topics(shipped_robot("reference")).items()
    topics = {topic: TYPES[kind] for topic, kind in predicted}
    return {**topics, **dict.fromkeys(("residuals", DIAGNOSTICS), TYPES[DiagnosticMessage])}


def _key(topic: str, stamp_ns: int, message: Any) -> Key:
    """Several nodes publish on /diagnostics: their statuses have other names."""
    statuses = getattr(message, "status", None)
    return topic, stamp_ns, statuses[0].name if statuses else ""


def _offline() -> dict[Key, Any]:
    pipeline = Pipeline(shipped_robot("reference"), DiagnosisSettings.of(TIMING, "test"))
    store = jazzy_typestore()
    found: dict[Key, Any] = {}
    with open_recording(BAG) as recording:
        for _, step in diagnose(recording, pipeline):
            for message in pipeline.messages(step):
                name = TYPES[type(message)]
                data = bytes(store.serialize_cdr(to_bag(message.plain), name))
                read = store.deserialize_cdr(data, name)
                found[_key(message.topic, message.stamp_ns, read)] = read
    return found


@contextmanager
def _listener() -> Iterator[tuple[Node, SingleThreadedExecutor]]:
    rclpy.init()
    node, executor = Node("listener"), SingleThreadedExecutor()
    executor.add_node(node)
    try:
        yield node, executor
    finally:
        node.destroy_node()
        rclpy.shutdown()


def _plain(value: Any) -> Any:
    """A message as nested tuples; NaN equal to NaN."""
    if isinstance(value, np.ndarray):
        return tuple(_plain(item) for item in value.tolist())
    if isinstance(value, list):
        return tuple(_plain(item) for item in value)
    if isinstance(value, float) and value != value:
        return "nan"
    if hasattr(value, "__dataclass_fields__"):
        return tuple((name, _plain(getattr(value, name))) for name in value.__dataclass_fields__)
    return value


@pytest.mark.serial  # beside other tests commands may come too late
@pytest.mark.parametrize(
    ("commands", "readers"),
    [(("power_model", "power_residuals", "fault_classifier"), 2), (("tomr_diagnosis",), 1)],
    ids=["three nodes", "one process"],
)
def test_nodes_and_offline_tool_publish_the_same(
    commands: tuple[str, ...],
    readers: int,  # of what the stages hand on
    spawn: Callable[..., Any],
    wait_until: Callable[..., Any],
) -> None:
    if not BAG.exists():
        pytest.fail(f"{BAG} is missing: make bags")
    types, store = _types(), jazzy_typestore()
    online: dict[Key, Any] = {}
    with _listener() as (node, executor):
        for topic, name in types.items():

            def keep(data: bytes, topic: str = topic, name: str = name) -> None:
                message = store.deserialize_cdr(data, name)
                if topic == DIAGNOSTICS and SILENCE in message.status[0].message:
                    return  # before the recording begins, and after its end
                stamp = message.header.stamp
                stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
                online[_key(topic, stamp_ns, message)] = message

            node.create_subscription(message_class(name), topic, keep, STAGE_QOS, raw=True)
        for command in commands:
            spawn([command, *listening(BAG)])

        def connected() -> bool:
            executor.spin_once(0.01)
            published = all(
                node.count_publishers(topic) == (len(commands) if topic == DIAGNOSTICS else 1)
                for topic in types
            )
            heard = all(node.count_subscribers(t) == readers for t in types if t != DIAGNOSTICS)
            return published and heard and is_heard_reliably(node, SENSORS)

        wait_until(connected, "nodes that found each other")
        replay = spawn(playing(BAG))
        while replay.popen.poll() is None:
            executor.spin_once(0.05)
        assert replay.popen.returncode == 0
        offline = _offline()

        def complete() -> bool:
            executor.spin_once(0.05)
            return len(online) >= len(offline)

        wait_until(complete, f"{len(offline)} messages, as the offline tool gives")
    assert set(online) == set(offline)
    different = [key for key, message in online.items() if _plain(message) != _plain(offline[key])]
    assert not different, (_plain(online[different[0]]), _plain(offline[different[0]]))
    said = {(key[2], message.status[0].message) for key, message in online.items() if key[2]}
    assert {(NAME, "normal"), (NAME, "motor system fault 3 (wheel_3_joint)")} <= said
    assert {
        ("inputs: cmd_vel", "as it should be"),
        ("inputs: joint_states", "as it should be"),
    } <= said
