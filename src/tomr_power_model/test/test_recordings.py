"""Recordings: what is written comes back, and damage gets one clear line."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap_records import chunk, header, indexed, message
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message, jazzy_typestore
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.recordings import (
    RecordingWriter,
    open_recording,
    require_topic,
    resolve_topic,
)

START_NS = 1_700_000_000_123_456_789
STEP_NS = 10_000_000
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
STORAGES = ("mcap", "sqlite3")


def joint_states(stamp_ns: int, position: float) -> Any:
    return bag_message(
        "sensor_msgs/msg/JointState",
        header=bag_header(stamp_ns, "base_link"),
        name=["wheel_1_joint"],
        position=[position],
        velocity=[-2.5],
    )


def write_recording(path: Path, storage: str = "mcap", count: int = 20, pad: int = 0) -> Path:
    """Write `count` samples of joint states and power; `pad` numbers fatten each sample."""
    noise = np.random.default_rng(1)
    with RecordingWriter(path, storage) as writer:
        for index in range(count):
            stamp_ns = START_NS + index * STEP_NS
            message = joint_states(stamp_ns, 0.1 * index)
            message.effort = noise.random(pad)
            writer.write("joint_states", "sensor_msgs/msg/JointState", message, stamp_ns)
            power = bag_message(
                "sensor_msgs/msg/BatteryState",
                header=bag_header(stamp_ns),
                voltage=float("nan"),
                current=-0.5 * index,
            )
            writer.write("/wheel_1/power", "sensor_msgs/msg/BatteryState", power, stamp_ns)
    return path


def storage_file(path: Path) -> Path:
    return next(item for item in path.iterdir() if item.suffix in (".mcap", ".db3"))


def clear_line(failure: pytest.ExceptionInfo[InputError], *parts: str) -> None:
    text = str(failure.value)
    assert "\n" not in text
    for part in parts:
        assert part in text


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("bare", [False, True], ids=["folder", "bare_file"])
def test_what_is_written_is_read_back(tmp_path: Path, storage: str, bare: bool) -> None:
    path = write_recording(tmp_path / "bag", storage)
    with open_recording(storage_file(path) if bare else path) as recording:
        assert recording.topics == {
            "/joint_states": "sensor_msgs/msg/JointState",
            "/wheel_1/power": "sensor_msgs/msg/BatteryState",
        }
        assert (recording.start_ns, recording.end_ns) == (START_NS, START_NS + 19 * STEP_NS)
        assert recording.message_count == 40
        assert recording.warning is None
        read = list(recording.messages())
        power = list(recording.messages(["wheel_1/power"]))
        tail = list(recording.raw_messages(start_ns=START_NS + 19 * STEP_NS))
    assert [topic for topic, *_ in read] == ["/joint_states", "/wheel_1/power"] * 20
    topic, type_name, message, receive_ns = read[6]
    assert (topic, type_name) == ("/joint_states", "sensor_msgs/msg/JointState")
    assert receive_ns == header_stamp_ns(message) == START_NS + 3 * STEP_NS
    assert (message.name, list(message.position)) == (["wheel_1_joint"], [0.1 * 3])
    assert [message.current for *_, message, _ in power] == [-0.5 * index for index in range(20)]
    assert np.isnan(power[0][2].voltage)
    store = jazzy_typestore()
    last = joint_states(START_NS + 19 * STEP_NS, 0.1 * 19)
    assert tail[0][2] == store.serialize_cdr(last, type_name)
    assert len(tail) == 2


def test_unnamed_fields_are_zero_and_lists_become_arrays() -> None:
    message = bag_message("nav_msgs/msg/Odometry", child_frame_id="base_link")
    assert header_stamp_ns(message) == 0
    assert message.pose.covariance.dtype == np.float64
    assert message.pose.covariance.shape == (36,)
    other = bag_message("nav_msgs/msg/Odometry")
    other.pose.pose.position.x = 3.0
    assert message.pose.pose.position.x == 0.0
    clock = bag_message("rosgraph_msgs/msg/Clock")
    assert header_stamp_ns(clock) is None
    status = bag_message("diagnostic_msgs/msg/DiagnosticStatus", level=b"\x02")
    assert status.level == status.ERROR
    with pytest.raises(TypeError, match="no field volts; its fields are header, voltage"):
        bag_message("sensor_msgs/msg/BatteryState", volts=3.0)
    with pytest.raises(ValueError, match="covariance takes 36 numbers, got 2"):
        bag_message("geometry_msgs/msg/PoseWithCovariance", covariance=[1, 2])


def test_every_standard_type_can_be_built() -> None:
    store = jazzy_typestore()
    for type_name in store.fielddefs:
        assert store.serialize_cdr(bag_message(type_name), type_name)


def test_an_existing_path_is_not_overwritten(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "bag")
    with pytest.raises(InputError) as failure:
        RecordingWriter(path)
    clear_line(failure, str(path), "exists already")
    with pytest.raises(InputError, match="choose mcap or sqlite3"):
        RecordingWriter(tmp_path / "new", "rosbag1")
    with (
        pytest.raises(InputError, match=r"on power has the stamp -1 ns"),
        RecordingWriter(tmp_path / "new") as writer,
    ):
        writer.write("power", "std_msgs/msg/Header", bag_header(0), -1)


@pytest.mark.parametrize("storage", STORAGES)
def test_an_interrupted_recording_keeps_what_was_written(tmp_path: Path, storage: str) -> None:
    path = tmp_path / "bag"

    def record() -> None:
        with RecordingWriter(path, storage) as writer:
            writer.write("joint_states", "sensor_msgs/msg/JointState", joint_states(5, 1.0), 5)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record()
    with open_recording(path) as recording:
        assert [message.position[0] for *_, message, _ in recording.messages()] == [1.0]
    assert "incomplete: KeyboardInterrupt" in (path / "metadata.yaml").read_text()


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("absent", ("does not exist",)),
        ("absent.mcap", ("does not exist",)),
        ("notes.txt", ("is no recording", ".mcap")),
        ("folder", ("neither metadata.yaml nor",)),
        ("empty.mcap", ("cannot be read as a recording",)),
        ("empty.db3", ("cannot be read as a recording",)),
        ("text.mcap", ("cannot be read as a recording", "magic")),
        ("text.db3", ("cannot be read as a recording",)),
    ],
)
def test_what_is_no_recording(tmp_path: Path, name: str, parts: tuple[str, ...]) -> None:
    path = tmp_path / name
    if name == "folder":
        path.mkdir()
    elif not name.startswith("absent"):
        path.write_text("" if name.startswith("empty") else "this is no recording at all" * 9)
    with pytest.raises(InputError) as failure, open_recording(path):
        pass
    clear_line(failure, str(path), *parts)


@pytest.mark.parametrize("storage", STORAGES)
def test_a_recording_without_messages(tmp_path: Path, storage: str) -> None:
    with RecordingWriter(tmp_path / "bag", storage):
        pass
    with pytest.raises(InputError) as failure, open_recording(tmp_path / "bag"):
        pass
    clear_line(failure, str(tmp_path / "bag"), "holds no messages")


@pytest.mark.parametrize("metadata", ["present", "absent"])
def test_a_truncated_mcap_is_read_as_far_as_it_goes(tmp_path: Path, metadata: str) -> None:
    path = write_recording(tmp_path / "bag", count=400, pad=1000)
    file = storage_file(path)
    with file.open("r+b") as stream:
        stream.truncate(int(file.stat().st_size * 0.7))
    if metadata == "absent":
        (path / "metadata.yaml").unlink()
    before = file.read_bytes()
    with open_recording(path) as recording:
        read = list(recording.messages())
        assert recording.warning is not None
        assert "cut off" in recording.warning
        assert str(recording.message_count) in recording.warning
        assert len(read) == recording.message_count
        assert recording.start_ns == START_NS
    assert 400 <= len(read) < 800
    assert [item[3] for item in read[::2]] == [
        START_NS + index * STEP_NS for index in range((len(read) + 1) // 2)
    ]
    assert file.read_bytes() == before


@pytest.mark.parametrize("keep", [3, 60, 200])
def test_an_mcap_cut_before_its_first_chunk_ends(tmp_path: Path, keep: int) -> None:
    file = storage_file(write_recording(tmp_path / "bag"))
    with file.open("r+b") as stream:
        stream.truncate(keep)
    for path in (file, file.parent):
        with pytest.raises(InputError) as failure, open_recording(path):
            pass
        clear_line(failure, str(path), "make another copy")


def test_a_truncated_sqlite3_recording(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "bag", "sqlite3", count=200, pad=100)
    file = storage_file(path)
    with file.open("r+b") as stream:
        stream.truncate(file.stat().st_size // 2)
    with pytest.raises(InputError) as failure, open_recording(path) as recording:
        list(recording.messages())
    clear_line(failure, str(path), "make another copy")


@pytest.mark.parametrize("storage", STORAGES)
def test_a_folder_without_metadata_is_read_from_its_file(tmp_path: Path, storage: str) -> None:
    path = write_recording(tmp_path / "bag", storage)
    (path / "metadata.yaml").unlink()
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == 40
        assert recording.warning is not None
        assert "no metadata.yaml" in recording.warning


@pytest.mark.parametrize("damage", ["not yaml: [", "rosbag2_bagfile_information: {}", "5"])
def test_broken_metadata(tmp_path: Path, damage: str) -> None:
    path = write_recording(tmp_path / "bag")
    (path / "metadata.yaml").write_text(damage)
    with pytest.raises(InputError) as failure, open_recording(path):
        pass
    clear_line(failure, str(path), "cannot be read as a recording")


def test_a_folder_whose_storage_file_is_gone(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "bag")
    storage_file(path).unlink()
    with pytest.raises(InputError) as failure, open_recording(path):
        pass
    clear_line(failure, str(path), "missing")


def test_a_chunk_that_cannot_be_decompressed(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "bag", count=400, pad=1000)
    file = storage_file(path)
    data = file.read_bytes()
    second_chunk = data.index(ZSTD_MAGIC, data.index(ZSTD_MAGIC) + 1)
    file.write_bytes(data[:second_chunk] + bytes(4) + data[second_chunk + 4 :])
    read: list[object] = []
    with pytest.raises(InputError) as failure, open_recording(path) as recording:
        read.extend(recording.messages())
    clear_line(failure, str(path), f"message {len(read) + 1}", "damaged")


@pytest.mark.parametrize("storage", STORAGES)
def test_a_message_that_cannot_be_decoded(tmp_path: Path, storage: str) -> None:
    path = tmp_path / "bag"
    good = jazzy_typestore().serialize_cdr(joint_states(1, 0.0), "sensor_msgs/msg/JointState")
    with RecordingWriter(path, storage) as writer:
        writer.write_raw("joint_states", "sensor_msgs/msg/JointState", good, 1)
        writer.write_raw("joint_states", "sensor_msgs/msg/JointState", good[:-9], 2)
    with open_recording(path) as recording:
        reading = recording.messages()
        assert next(reading)[3] == 1
        with pytest.raises(InputError) as failure:
            next(reading)
    clear_line(failure, str(path), "message 2 on /joint_states cannot be read")


def test_an_exception_of_the_caller_is_not_taken_for_damage(tmp_path: Path) -> None:
    def read() -> None:
        with open_recording(write_recording(tmp_path / "bag")) as recording:
            for _ in recording.messages():
                raise KeyError("the caller's own")

    with pytest.raises(KeyError):
        read()


@pytest.mark.parametrize(
    ("type_name", "definition", "words"),
    [
        ("robot_msgs/msg/Load", "float64 watts\n", "no standard message"),
        ("std_msgs/msg/Float64", "float32 data\n", "otherwise than ROS 2 Jazzy"),
        ("std_msgs/msg/Float64", "float64 data\nfloat64 more\n", "otherwise than ROS 2 Jazzy"),
    ],
)
def test_types_that_are_not_the_standard_s(
    tmp_path: Path, type_name: str, definition: str, words: str
) -> None:
    own = get_typestore(Stores.EMPTY)
    own.register(get_types_from_msg(definition, type_name))
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/load", type_name, typestore=own)
        writer.write(connection, 7, bytes(24))
    with open_recording(tmp_path / "bag") as recording:
        assert len(list(recording.raw_messages())) == 1
        with pytest.raises(InputError) as failure:
            recording.messages()
    clear_line(failure, "/load", words)


def topics_recording(path: Path, *topics: str) -> Path:
    with RecordingWriter(path) as writer:
        for topic in topics:
            writer.write(topic, "std_msgs/msg/Header", bag_header(1), 1)
    return path


def test_topics_are_found_with_and_without_a_namespace(tmp_path: Path) -> None:
    path = topics_recording(
        tmp_path / "one",
        "robot1/wheel_1/power",
        "robot1/predicted/joint_states",
        "robot1/ground_truth/odom",
    )
    with open_recording(path) as recording:
        assert resolve_topic(recording, "wheel_1/power") == "/robot1/wheel_1/power"
        assert resolve_topic(recording, "/wheel_1/power", "robot1") == "/robot1/wheel_1/power"
        assert resolve_topic(recording, "wheel_1/power", "robot2") is None
        assert resolve_topic(recording, "wheel_1/power", "/") is None
        assert resolve_topic(recording, "1/power") is None
        assert resolve_topic(recording, "joint_states") is None
        assert resolve_topic(recording, "odom") is None
        assert resolve_topic(recording, "ground_truth/odom") == "/robot1/ground_truth/odom"
        with pytest.raises(InputError) as failure:
            require_topic(recording, "cmd_vel")
        clear_line(failure, str(path), "/cmd_vel", "/robot1/wheel_1/power")
        with pytest.raises(InputError, match="no topic /cmd_vel"):
            next(recording.messages(["cmd_vel"]))


def test_two_robots_in_one_recording_need_a_namespace(tmp_path: Path) -> None:
    path = topics_recording(
        tmp_path / "two", "robot1/odom", "robot2/odom", "imu/data", "b/imu/data"
    )
    with open_recording(path) as recording:
        with pytest.raises(InputError) as failure:
            resolve_topic(recording, "odom")
        clear_line(failure, "/robot1/odom, /robot2/odom", "which namespace")
        assert resolve_topic(recording, "odom", "robot2") == "/robot2/odom"
        assert resolve_topic(recording, "imu/data") == "/imu/data"


def test_a_recording_split_over_files_without_metadata(tmp_path: Path) -> None:
    folder = tmp_path / "split"
    folder.mkdir()
    for number, first in enumerate((5, 1)):
        with RecordingWriter(tmp_path / f"part_{number}") as writer:
            for stamp_ns in (first, first + 1):
                writer.write("header", "std_msgs/msg/Header", bag_header(stamp_ns), stamp_ns)
        shutil.copy(storage_file(tmp_path / f"part_{number}"), folder)
    with open_recording(folder) as recording:
        assert [stamp_ns for *_, stamp_ns in recording.messages()] == [1, 2, 5, 6]


@pytest.mark.parametrize("storage", STORAGES)
def test_of_two_recordings_to_one_place_the_first_that_is_complete_stays(
    tmp_path: Path, storage: str
) -> None:
    path = tmp_path / "bag"
    kind = "std_msgs/msg/Header"

    def record_twice() -> None:
        with RecordingWriter(path, storage) as late:
            late.write("late", kind, bag_header(1), 1)
            with RecordingWriter(path, storage) as early:
                early.write("early", kind, bag_header(1), 1)
            assert path.is_dir()
            late.write("late", kind, bag_header(2), 2)

    with pytest.raises(InputError, match="exists already"):
        record_twice()
    with open_recording(path) as recording:
        assert list(recording.topics) == ["/early"]
    assert [item.name for item in tmp_path.iterdir()] == ["bag"]


def test_messages_whose_topics_are_lost(tmp_path: Path) -> None:
    path = tmp_path / "lost.mcap"
    head = header()
    data = chunk("", message(bytes(8), 1), 39)
    path.write_bytes(indexed(head, [(data, 39, 1, 1)], ""))
    with pytest.raises(InputError) as failure, open_recording(path):
        pass
    clear_line(failure, str(path), "no topic that they belong to")


@pytest.mark.parametrize("part", ["__init__", "messages"])
def test_memory_that_does_not_suffice_has_words(
    part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A MemoryError has none of its own, and the libraries that read a recording raise it."""
    bag = write_recording(tmp_path / "bag")

    def fails(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr(Reader, part, fails)
    with (
        pytest.raises(InputError, match=r"cannot be read .*\(the memory does not suffice\)"),
        open_recording(bag) as recording,
    ):
        list(recording.messages())
