"""What is read stays within limits, and what exceeds them gets one line."""

import os
import resource
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from attrs import frozen
from mcap_records import MEGA, channel, chunk, closing, header, indexed, message, zeros
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from tomr_power_model.errors import InputError, one_line
from tomr_power_model.files import load_yaml, read_arrays, read_text
from tomr_power_model.limits import Limits, limits
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings import open_recording
from tomr_power_model.topics.flow import Flow
from tomr_power_model.topics.inputs import Thinning

JOINTS = "sensor_msgs/msg/JointState"
HEAD = header() + channel("/joint_states", JOINTS)


@pytest.fixture(autouse=True)
def _fresh_limits() -> object:
    limits.cache_clear()
    yield
    limits.cache_clear()


def read_all(path: Path) -> int:
    with open_recording(path) as recording:
        return len(list(recording.messages()))


def refused(path: Path) -> str:
    with pytest.raises(InputError) as failure:
        read_all(path)
    line = str(failure.value)
    assert str(path) in line
    assert "\n" not in line
    return line


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("stated", [200 * MEGA, 1000], ids=["stated", "concealed"])
@pytest.mark.parametrize("index", [True, False])
def test_a_chunk_that_unpacks_to_too_much(
    tmp_path: Path, compression: str, stated: int, index: bool
) -> None:
    bomb = chunk(compression, zeros(compression, 200 * MEGA), stated)
    path = tmp_path / "bomb.mcap"
    rows = [(bomb, stated, 0, 9)]
    path.write_bytes(indexed(HEAD, rows, compression) if index else HEAD + bomb + closing())
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    line = refused(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150_000  # kB
    assert ("TOMR_LIMIT_CHUNK_BYTES" if stated > 1000 else "damaged" if index else "chunk") in (
        line.lower() if stated == 1000 else line
    )


def test_chunks_of_one_time_are_not_held_together(tmp_path: Path) -> None:
    packed = zeros("zstd", 50 * MEGA)
    bombs = [(chunk("zstd", packed, 50 * MEGA), 50 * MEGA, 0, 9) for _ in range(40)]
    path = tmp_path / "bomb.mcap"
    path.write_bytes(indexed(HEAD, bombs, "zstd"))
    assert "TOMR_LIMIT_CHUNK_BYTES" in refused(path)


def test_all_chunks_together_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOMR_LIMIT_UNPACKED_BYTES", str(20 * MEGA))
    packed = zeros("zstd", 9 * MEGA)
    path = tmp_path / "bomb.mcap"
    path.write_bytes(HEAD + 4 * chunk("zstd", packed, 9 * MEGA) + closing())
    assert "TOMR_LIMIT_UNPACKED_BYTES" in refused(path)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_compressed_recordings_are_read(tmp_path: Path, mode: CompressionMode) -> None:
    assert read_all(compressed(tmp_path / "bag", mode, 100)) == 3


def compressed(path: Path, mode: CompressionMode, size: int) -> Path:
    """Three messages, each with a frame of that many letters."""
    store = jazzy_typestore()
    kind = "std_msgs/msg/String"
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/text", kind, typestore=store)
        for stamp in (1, 2, 3):
            text = store.types[kind](data="a" * size)
            writer.write(connection, stamp, store.serialize_cdr(text, kind))
    return path


@pytest.mark.parametrize(
    ("mode", "limit"),
    [(CompressionMode.FILE, "UNPACKED_FILE_BYTES"), (CompressionMode.MESSAGE, "MESSAGE_BYTES")],
)
def test_compressed_recordings_that_unpack_to_too_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: CompressionMode, limit: str
) -> None:
    monkeypatch.setenv(f"TOMR_LIMIT_{limit}", "1e6")
    assert f"TOMR_LIMIT_{limit}" in refused(compressed(tmp_path / "bag", mode, 2_000_000))


def test_a_text_that_claims_gigabytes(tmp_path: Path) -> None:
    claim = b"\0\1\0\0" + bytes(8) + (1 << 31).to_bytes(4, "little") + b"a\0"
    path = tmp_path / "claim.mcap"
    path.write_bytes(HEAD + message(claim, 1) + closing())
    assert "message 1 on /joint_states cannot be read" in refused(path)


def test_a_database_column_that_is_computed(tmp_path: Path) -> None:
    import sqlite3

    path = tmp_path / "computed.db3"
    base = sqlite3.connect(path)
    base.executescript(
        """
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,
            serialization_format TEXT, offered_qos_profiles TEXT);
        INSERT INTO topics VALUES(1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '');
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
            data BLOB GENERATED ALWAYS AS (zeroblob(900000000)) VIRTUAL);
        INSERT INTO messages(topic_id, timestamp) VALUES(1, 1), (1, 2);
        """
    )
    base.commit()
    base.close()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert "cannot be read" in refused(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150_000  # kB


def test_storage_that_is_no_ordinary_file(tmp_path: Path) -> None:
    for name, target in (("zero.mcap", "/dev/zero"), ("pipe.db3", None)):
        path = tmp_path / name
        if target is None:
            os.mkfifo(path)
        else:
            path.symlink_to(target)
        assert "no ordinary file" in refused(path)


@pytest.mark.parametrize(
    "name", ["../other/other.mcap", "/etc/passwd", "..", "", "a/b/c.mcap", 5, "nul\0.mcap"]
)
def test_metadata_that_leads_out_of_its_folder(tmp_path: Path, name: object) -> None:
    for place in ("bag", "other"):
        compressed(tmp_path / place, CompressionMode.NONE, 10)
    path = tmp_path / "bag" / "metadata.yaml"
    document = load_yaml(path.read_text(), "")
    document["rosbag2_bagfile_information"]["relative_file_paths"] = [name]
    import yaml

    path.write_text(yaml.safe_dump(document))
    assert "is no file of its folder" in refused(tmp_path / "bag")


def test_a_topic_of_two_types(tmp_path: Path) -> None:
    store = jazzy_typestore()
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for kind in ("std_msgs/msg/Float64", "std_msgs/msg/Int64"):
            connection = writer.add_connection("/odd", kind, typestore=store)
            writer.write(connection, 1, store.serialize_cdr(store.types[kind](data=1), kind))
    with (
        open_recording(tmp_path / "bag") as recording,
        pytest.raises(InputError, match="2 types"),
    ):
        recording.messages(["odd"])


def test_too_many_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOMR_LIMIT_MESSAGES", "2")
    path = compressed(tmp_path / "bag", CompressionMode.NONE, 10)
    assert "TOMR_LIMIT_MESSAGES" in refused(path)


BOMB = "a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" + "".join(
    f"{b}: &{b} [{', '.join(8 * ['*' + a])}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: !!int abc", "line 1: no int"),
        ("a: !!float x", "line 1: no float"),
        ("a: !!timestamp x", "no timestamp"),
        ("a: !!bool x", "no bool"),
        ("a: 2001-02-30", "no timestamp"),
        ("x: 1\na: &a {b: *a}", "line 2: an alias in what it names"),
        (f"a: {'9' * 5000}", "a number of 5000 characters"),
        ("[" * 100, "TOMR_LIMIT_YAML_DEPTH"),
        (BOMB, "TOMR_LIMIT_YAML_VALUES"),
        ("a: 1\nb: 2\na: 3", "line 3: 'a' stands twice"),
        ("a: !!python/object/apply:os.system [id]", "constructor"),
        ("a: \x00", "special characters"),
    ],
)
def test_yaml_that_is_none(text: str, words: str) -> None:
    with pytest.raises(InputError) as failure:
        load_yaml(text, "place")
    assert str(failure.value).startswith("place:")
    assert words in str(failure.value)


def test_aliases_and_merges_are_read() -> None:
    assert load_yaml("a: &a {x: 1}\nb: {<<: *a, x: 2}\nc: [*a, *a]", "") == {
        "a": {"x": 1},
        "b": {"x": 2},
        "c": [{"x": 1}, {"x": 1}],
    }


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full", "/dev/stdin", "."])
def test_texts_that_are_no_files(device: str) -> None:
    with pytest.raises(InputError, match=r"no ordinary file|is a folder"):
        read_text(Path(device))


def test_texts_that_are_too_large_or_none(tmp_path: Path) -> None:
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(100 << 30)
    with pytest.raises(InputError, match="TOMR_LIMIT_TEXT_BYTES"):
        read_text(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="as text"):
        read_text(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_text(Path("zero\0byte"))


@frozen
class _Pickled:
    made: Path  # by whoever unpickles it

    def __reduce__(self) -> tuple[Callable[[Path], None], tuple[Path]]:
        return Path.touch, (self.made,)


def test_arrays_are_read_without_pickle_and_within_limits(tmp_path: Path) -> None:
    good = tmp_path / "good.npz"
    np.savez(good, a=np.ones(3))
    assert read_arrays(good, ["a"])["a"].tolist() == [1.0, 1.0, 1.0]
    names = ("cut", "bare", "pickled", "bomb", "text", "words", "complex", "flags", "open")
    bad = {name: tmp_path / name for name in names}
    bad["cut"].write_bytes(good.read_bytes()[:-30])
    with bad["bare"].open("wb") as file:
        np.save(file, np.ones(3))
    for name, arrays in (
        ("pickled", np.array([_Pickled(tmp_path / "made")], dtype=object)),
        ("complex", np.array([1j])),
        ("flags", np.array([True])),
        ("words", np.array(["one"])),
        ("bomb", np.zeros(30_000_000)),
    ):
        with bad[name].open("wb") as file:
            np.savez_compressed(file, a=arrays)
    bad["text"].write_text("no arrays")
    with bad["open"].open("wb") as file:
        np.savez(file, a=np.ones(3000))  # so long that its check sum is not seen at once
    bad["open"].write_bytes(bad["open"].read_bytes().replace(b"(3000,)", b"(3000, "))
    for name, path in bad.items():
        with pytest.raises(InputError) as failure:
            read_arrays(path, ["a"])
        assert str(path) in str(failure.value)
        assert ("TOMR_LIMIT_ARRAYS_BYTES" in str(failure.value)) == (name == "bomb")
    assert not (tmp_path / "made").exists()  # nothing of a file is executed


def test_limits_are_set_by_the_environment() -> None:
    assert Limits.of_environment({"TOMR_LIMIT_MESSAGES": "1e3", "HOME": "x"}).messages == 1000
    for variable, text in (("TOMR_LIMIT_MESAGES", "5"), ("TOMR_LIMIT_MESSAGES", "many")):
        with pytest.raises(InputError, match=variable):
            Limits.of_environment({variable: text})


def test_an_error_is_one_line_that_can_be_printed() -> None:
    assert one_line("a\nb\x1b[31m\ud800") == "a b\\x1b[31m\\ud800"
    assert len(one_line("x" * 100_000)) < 2_000


def test_the_rate_of_a_topic_limits_what_nodes_take_and_what_encoders_are_thinned_to(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("TOMR_LIMIT_TOPIC_RATE", "100")
    flow, thinning = Flow(has_header=False), Thinning()
    stamps = range(10**9, 3 * 10**9, 10**6)  # 1 kHz for 2 s
    taken = [stamp for stamp in stamps if flow.refuses(b"", stamp) is None]
    assert len(taken) == pytest.approx(300, abs=2)  # with one burst
    assert sum(not thinning.is_too_close(stamp) for stamp in stamps) == 200
