"""`tomr_diagnose` distinguishes good recordings from bad; these get one line and exit code 2."""

import json
import shutil
import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from attrs import evolve, frozen

from tomr_fault_diag.cli.diagnose import main
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message, jazzy_typestore
from tomr_power_model.recordings import RecordingWriter, open_recording

BAGS = Path(__file__).parents[1] / "bags"
JOINTS = "sensor_msgs/msg/JointState"
SECONDS = 1.0  # of the square, for the recordings that are made bad
POWER = ("/battery_state", "/wheel_1/power", "/wheel_2/power", "/wheel_3/power")


@frozen
class Raw:
    """A message of a recording."""

    topic: str
    type_name: str
    data: bytes
    stamp_ns: int


Change = Callable[[list[Raw]], Iterable[Raw]]


@pytest.fixture(scope="module")
def drive() -> list[Raw]:
    """The first moments of a healthy drive."""
    with open_recording(BAGS / "square") as recording:
        end = recording.start_ns + SECONDS * 1e9
        messages = (Raw(*message) for message in recording.raw_messages())
        return [message for message in messages if message.stamp_ns <= end]


def _write(path: Path, messages: Iterable[Raw], storage: str = "mcap") -> Path:
    with RecordingWriter(path, storage) as writer:
        for message in messages:
            writer.write_raw(message.topic, message.type_name, message.data, message.stamp_ns)
    return path


def _without(*topics: str) -> Change:
    return lambda drive: [message for message in drive if message.topic not in topics]


def _renamed(ending: str, new: str) -> Change:
    return lambda drive: [evolve(m, topic=m.topic.replace(ending, new)) for m in drive]


def _wheels_called(*names: str) -> Change:
    def change(message: Raw) -> Raw:
        if message.type_name != JOINTS:
            return message
        state = jazzy_typestore().deserialize_cdr(message.data, JOINTS)
        state.name = list(names)
        return evolve(message, data=bytes(jazzy_typestore().serialize_cdr(state, JOINTS)))

    return lambda drive: map(change, drive)


def _power_as(type_name: str) -> Change:
    def change(message: Raw) -> Raw:
        if message.topic != "/wheel_2/power":
            return message
        other = bag_message(type_name, header=bag_header(message.stamp_ns))
        data = bytes(jazzy_typestore().serialize_cdr(other, type_name))
        return evolve(message, type_name=type_name, data=data)

    return lambda drive: map(change, drive)


def _unclosed_sqlite(drive: list[Raw], folder: Path) -> Path:
    """What a killed recorder leaves: the tables, but no message and no metadata."""
    with RecordingWriter(folder / "recorder", "sqlite3") as writer:
        for m in drive[:100]:
            writer.write_raw(m.topic, m.type_name, m.data, m.stamp_ns)
        left = folder / "killed"
        left.mkdir()
        (making,) = folder.glob(".recorder.*.part/recorder")
        for file in making.iterdir():
            shutil.copy(file, left / file.name)
    return left


def _sqlite_with(statement: str) -> Callable[[list[Raw], Path], Path]:
    """A recording in whose tables something was changed: sqlite3 takes any value anywhere."""

    def make(drive: list[Raw], folder: Path) -> Path:
        with RecordingWriter(folder / "tables", "sqlite3") as writer:
            for m in drive[:600]:
                writer.write_raw(m.topic, m.type_name, m.data, m.stamp_ns)
        with closing(sqlite3.connect(folder / "tables" / "tables.db3")) as store:
            store.execute(statement)
            store.commit()
        return folder / "tables"

    return make


def _cut_to(share: float) -> Callable[[list[Raw], Path], Path]:
    def make(_: list[Raw], folder: Path) -> Path:
        whole = (BAGS / "square" / "square.mcap").read_bytes()
        path = folder / "cut.mcap"
        path.write_bytes(whole[: round(share * len(whole))])
        return path

    return make


def _of(change: Change) -> Callable[[list[Raw], Path], Path]:
    return lambda drive, folder: _write(folder / "changed", change(drive))


def _file(name: str, content: bytes) -> Callable[[list[Raw], Path], Path]:
    def make(_: list[Raw], folder: Path) -> Path:
        path = folder / name
        path.write_bytes(content)
        return path

    return make


BAD: dict[str, tuple[Callable[[list[Raw], Path], Path], list[str]]] = {
    "missing": (lambda _, folder: folder / "nowhere", ["nowhere", "does not exist", "give"]),
    "no recording": (_file("notes.txt", b"hello"), ["notes.txt", "no recording", "give"]),
    "zero bytes": (_file("zero.mcap", b""), ["zero.mcap", "cannot be read", "record it again"]),
    "cut early": (_cut_to(0.01), ["cut.mcap", "cut off", "another copy"]),
    "no messages": (_of(lambda _: []), ["no messages", "record again"]),
    "sqlite never closed": (_unclosed_sqlite, ["killed", "never closed", "to mcap"]),
    "sqlite topic that is no text": (
        _sqlite_with("UPDATE topics SET name = x'00' WHERE id % 3 = 0"),
        ["tables", "no text", "record it again"],
    ),
    "sqlite stamp that is a text": (
        _sqlite_with("UPDATE messages SET timestamp = 'x' WHERE id % 50 = 0"),
        ["tables", "damaged", "record it again"],
    ),
    "sqlite message that is a text": (
        _sqlite_with("UPDATE messages SET data = 'x' WHERE id % 50 < 9"),
        ["tables", "damaged", "record it again"],
    ),
    "no joint_states": (_of(_without("/joint_states")), ["no joint_states", "holds /battery"]),
    "no power": (_of(_without(*POWER)), ["none of wheel_1/power", "robot.yaml"]),
    "power elsewhere": (
        _of(lambda drive: _without("/battery_state")(list(_renamed("wheel_", "motor_")(drive)))),
        ["wheel_1/power", "/motor_1/power", "robot.yaml"],
    ),
    "other wheel names": (
        _of(_wheels_called("left", "right", "back")),
        ["/joint_states has left, right, back", "set robot.wheel_names"],
    ),
    "wrong type": (
        _of(_power_as("sensor_msgs/msg/Temperature")),
        ["/wheel_2/power is a sensor_msgs/msg/Temperature", "BatteryState", "measurement.source"],
    ),
}


def _error(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line that bad input must get."""
    assert main([str(argument) for argument in arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1, printed.err
    assert printed.err.startswith("error: ")
    return printed.err


@pytest.mark.parametrize("case", BAD)
def test_a_bad_recording_gets_one_line(
    case: str, drive: list[Raw], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make, words = BAD[case]
    bag = make(drive, tmp_path)
    line = _error(capsys, bag)
    assert str(bag) in line
    for word in words:
        assert word in line


def test_what_is_no_message_is_not_passed_on_as_bytes(drive: list[Raw], tmp_path: Path) -> None:
    bag = _sqlite_with("UPDATE messages SET data = 5")(drive, tmp_path)
    with open_recording(bag) as recording, pytest.raises(InputError, match="damaged"):
        list(recording.raw_messages())


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("band.powr=2.0", ["band.powr is unknown", "did you mean band.power"]),
        ("band.power", ["band.power", "write name=value"]),
        ("band.power=wide", ["band.power", "wide", "number"]),
        ("decision_rate=0", ["decision_rate", "0", "at least 5"]),
        ("confirm_time=.nan", ["confirm_time", "nan", "finite"]),
    ],
)
def test_a_bad_parameter_gets_one_line(
    assignment: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    line = _error(capsys, BAGS / "square", "--set", assignment)
    for word in words:
        assert word in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, ["robot.yaml", "reference"]),
        ("robot: [", ["robot.yaml", "line"]),
        ("", ["robot.yaml"]),
        ("/**: {ros__parameters: {robot: {mass: 15.0}}}", ["robot.yaml", "missing"]),
        ("power_residuals: {ros__parameters: {band.powr: 1.0}}", ["band.powr", "band.power"]),
    ],
)
def test_a_bad_robot_file_gets_one_line(
    text: str | None, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = tmp_path / "robot.yaml"
    if text is not None:
        robot.write_text(text)
    line = _error(capsys, BAGS / "square", "--robot", robot)
    for word in words:
        assert word in line


def test_a_cut_recording_is_read_as_far_as_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(_cut_to(0.7)([], tmp_path)), "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["ticks"] > 50
    assert "cut off" in printed.err


def test_an_output_that_exists_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = _error(capsys, BAGS / "square", "--out", tmp_path)
    assert str(tmp_path) in line
    assert "not overwritten" in line


def test_a_healthy_drive_exits_with_0(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(BAGS / "square"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["shares"]) == {"normal", "not observable in this motion"}
    assert found["stale_shares"] == [0.0] * 10


def test_a_faulty_drive_exits_with_1_and_a_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([str(BAGS / "circle_encoder_lost"), "--json", "--out", str(out)]) == 1
    found = json.loads(capsys.readouterr().out)
    assert "motor system fault 3" in found["shares"]
    with open_recording(out) as recording:
        counts: dict[str, int] = {}
        headlines = []
        for topic, _, message, _ in recording.messages():
            counts[topic] = counts.get(topic, 0) + 1
            if topic == "/diagnostics":
                headlines.append(_headline(message))
    wheels = [f"/wheel_{number}/power" for number in (1, 2, 3)]
    per_tick = {
        "/predicted/joint_states",
        "/battery_state/predicted",
        "/motor_voltage/predicted",
        "/motor_voltage/from_encoders",
        "/residuals",
        *(f"{wheel}/{kind}" for wheel in wheels for kind in ("predicted", "from_encoders")),
    }
    assert set(counts) == {*per_tick, "/diagnostics"}
    assert {counts[topic] for topic in per_tick} == {found["ticks"]}
    assert "motor system fault 3 (wheel_3_joint)" in headlines


def _headline(message: Any) -> str:
    return str(message.status[0].message)
