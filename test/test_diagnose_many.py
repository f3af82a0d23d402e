"""`tomr_diagnose` on many recordings, in several phases, with labels and pages."""

import json
import re
import shutil
from collections.abc import Callable, Iterable
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest
from attrs import frozen

from tomr_fault_diag.cli.diagnose import main
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot.files import robot_file

BAGS = Path(__file__).parents[1] / "bags"
FAULTY, HEALTHY = BAGS / "circle_encoder_lost", BAGS / "square"


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict, str]:  # type: ignore[type-arg]
    """Exit code, JSON and stderr."""
    code = main([*(str(argument) for argument in arguments), "--json"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out), printed.err


def test_episodes_do_not_overlap_and_state_since_when(capsys: pytest.CaptureFixture[str]) -> None:
    code, found, _ = run(capsys, FAULTY, "--phases", 2)
    assert code == 1
    episodes = found["episodes"]
    for before, after in pairwise(episodes):
        assert before["end_ns"] < after["start_ns"]
    (fault,) = [item for item in episodes if item["state"] == "motor system fault 3"]
    assert fault["since_ns"] <= fault["start_ns"] < fault["end_ns"]
    assert fault["wheel"] == 3
    assert len(found["phases"]) == 2
    assert found["phases"][0]["faults"] == [fault]
    starts = [phase["faults"][0]["start_ns"] for phase in found["phases"]]
    period = 50_000_000
    assert (starts[0] - starts[1]) % period == period // 2  # the grid is shifted by half of it


def test_a_name_with_line_breaks_stays_in_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = tmp_path / "a\nb \x1b[31m"
    named.mkdir()
    (named / "bag").symlink_to(HEALTHY)
    assert main([str(named / "bag"), str(named / "absent")]) == 2
    printed = capsys.readouterr()
    assert "\x1b" not in printed.out + printed.err
    assert len(printed.err.splitlines()) == 1
    assert "a b" in printed.out.splitlines()[0]


def test_a_folder_is_all_its_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "bad.mcap").write_bytes(b"no recording")
    (tmp_path / ".half.part").mkdir()
    (tmp_path / ".half.part" / "half.mcap").write_bytes(b"")
    (tmp_path / "good").symlink_to(HEALTHY)
    code, found, err = run(capsys, tmp_path, FAULTY, "--jobs", 2)
    assert code == 2
    assert [Path(item["bag"]).name for item in found["recordings"]] == ["good", FAULTY.name]
    assert [Path(item["bag"]).name for item in found["failed"]] == ["bad"]
    assert err.count("error: ") == 1
    assert str(tmp_path / "bad") in err


def test_a_folder_without_recordings_is_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path)]) == 2
    assert "holds no recording" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--phases", "0"], ["--phases", "51"], ["--jobs", "-1"]])
def test_bad_counts_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(HEALTHY), *arguments]) == 2
    assert arguments[0] in capsys.readouterr().err


def test_one_output_is_for_one_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(HEALTHY), str(FAULTY), "--out", str(tmp_path / "out")]) == 2
    assert "give one recording" in capsys.readouterr().err


def test_labels_score_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "labels.csv"
    path.write_text(
        "bag,state,wheel,onset,end\n"
        f"{FAULTY.name},motor system fault,3,8.0,14.0\n{HEALTHY.name},,,,\nnosuchbag,,,,\n"
    )
    code, found, notes = run(capsys, FAULTY, HEALTHY, "--labels", path)
    assert code == 1
    assert "none of the recordings is nosuchbag" in notes
    scores = found["scores"]
    assert scores["false_alarms"]["count_by_phase"] == [0]
    motor = scores["faults"]["motor system fault"]
    assert motor["found"]["share"] == 1.0
    assert motor["delay_s"]["median"] == pytest.approx(0.15, abs=0.051)
    assert motor["time"]["right"] == 1.0
    _, recorded, _ = run(capsys, FAULTY, "--labels", "recorded")
    encoder = recorded["scores"]["faults"]["encoder_lost"]
    assert encoder["time"]["right"] == 1.0
    assert encoder["delay_s"]["median"] == pytest.approx(motor["delay_s"]["median"], abs=0.011)


def test_labels_of_other_recordings_are_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "labels.yaml"
    path.write_text("- {bag: other}\n")
    assert main([str(HEALTHY), "--labels", str(path)]) == 2
    assert "nothing is said of any of the recordings" in capsys.readouterr().err


class _Page(HTMLParser):
    """Counts elements, and notes what a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.counts: dict[str, int] = {}
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.fetched += [value or "" for key, value in attrs if key in ("src", "href")]


def test_pages_need_nothing_beside_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pages = tmp_path / "pages"
    run(capsys, FAULTY, HEALTHY, "--html", pages, "--phases", 2, "--labels", "recorded")
    page = _Page()
    text = (pages / f"{FAULTY.name}.html").read_text()
    page.feed(text)
    assert page.fetched == []
    assert "url(" not in text
    # Truth, two phases; eight inputs; probability, total, and for each wheel five panels.
    assert page.counts["svg"] == 3 + 8 + 2 + 3 * 5
    assert "motor system fault 3 (wheel_3_joint) at" in text
    values = json.loads(re.findall(r'id="data">(.*?)</script>', text)[0])
    assert len(values["values"]) == 17
    assert all(
        len(series) == len(values["ms"]) for panel in values["values"] for _, series in panel
    )
    index = _Page()
    index.feed((pages / "index.html").read_text())
    assert index.fetched == [f"{FAULTY.name}.html", f"{HEALTHY.name}.html"]


@frozen
class _Raw:
    topic: str
    type_name: str
    data: bytes
    stamp_ns: int


def _drive(seconds: float = 3.0) -> list[_Raw]:
    """A start: rest, and after a second motion."""
    with open_recording(HEALTHY) as recording:
        messages = [_Raw(*message) for message in recording.raw_messages()]
    begin = messages[0].stamp_ns
    return [m for m in messages if m.stamp_ns < begin + round(1e9 * seconds)]


def _restamped(change: Callable[[int], int], *topics: str) -> Iterable[_Raw]:
    store = jazzy_typestore()
    for raw in _drive():
        message = store.deserialize_cdr(raw.data, raw.type_name)
        data = raw.data
        if hasattr(message, "header") and (not topics or raw.topic in topics):
            stamp = message.header.stamp
            changed = change(stamp.sec * 1_000_000_000 + stamp.nanosec)
            stamp.sec, stamp.nanosec = divmod(changed, 1_000_000_000)
            data = bytes(store.serialize_cdr(message, raw.type_name))
        yield _Raw(raw.topic, raw.type_name, data, raw.stamp_ns)


UNDECIDED: dict[str, tuple[Callable[[], Iterable[_Raw]], str]] = {
    "no commands": (
        lambda: (raw for raw in _drive() if raw.topic != "/cmd_vel"),
        "no cmd_vel in the recording",
    ),
    "reversed": (
        lambda: _restamped(lambda stamp: 3_400_000_000_000_000_000 - stamp),
        "the stamps of battery_state, cmd_vel, imu/data, joint_states, wheel_1/power, "
        "wheel_2/power, wheel_3/power run backwards",
    ),
    "other epochs": (
        lambda: _restamped(lambda stamp: stamp - 10**18, "/joint_states"),
        "stamped by different clocks",
    ),
    "no stamps": (lambda: _restamped(lambda stamp: 0), "has no stamp"),
    "too short": (lambda: _drive()[:20], "ends before the first decision"),
    "at rest": (
        lambda: _drive(0.9),
        "the robot stands still throughout",
    ),
    "commands with a clock that is behind": (
        lambda: _restamped(lambda stamp: stamp - 200_000_000, "/cmd_vel"),
        "cmd_vel comes 0.20 s later after its stamps than joint_states",
    ),
}


def test_commands_that_act_as_late_as_described_are_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, robot = tmp_path / "bag", tmp_path / "robot.yaml"
    with RecordingWriter(bag) as writer:
        for raw in _restamped(lambda stamp: stamp - 200_000_000, "/cmd_vel"):
            writer.write_raw(raw.topic, raw.type_name, raw.data, raw.stamp_ns)
    text = robot_file("reference").read_text()
    robot.write_text(text.replace("    controller:\n", "    controller:\n      delay: 0.2\n"))
    code, found, notes = run(capsys, bag, "--robot", robot)
    assert code == 0
    assert found["shares"]["normal"] > 0.7
    assert "cmd_vel comes 0.20 s later" in notes


def test_a_radius_that_the_drivers_do_not_share_is_noted_with_the_one_they_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, text = tmp_path / "robot.yaml", robot_file("reference").read_text()
    robot.write_text(re.sub(r"wheel_radius: \S+", "wheel_radius: 0.0515", text))
    notes = run(capsys, HEALTHY, "--robot", robot)[2]
    assert "they turn 1.030 times as fast as described: write robot.wheel_radius: 0.05," in notes
    assert "wheels and commands" not in run(capsys, HEALTHY)[2]


def test_to_wait_for_late_commands_most_of_the_time_is_to_decide_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tomr_fault_diag.diagnosis.summary._LEAST_NS", 1)
    for late, code in ((200_000_000, 3), (0, 0)):
        bag = tmp_path / str(late)
        with RecordingWriter(bag) as writer:
            for raw in _restamped(lambda stamp, late=late: stamp - late, "/cmd_vel"):  # type: ignore[misc]
                writer.write_raw(raw.topic, raw.type_name, raw.data, raw.stamp_ns)
        found = run(capsys, bag)
        assert found[0] == code
        assert found[1]["shares"]["normal"] > 0.1


def test_power_topics_that_are_called_otherwise_are_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    with RecordingWriter(bag) as writer:
        for raw in _drive():
            topic = raw.topic.replace("/wheel_", "/motor_")
            writer.write_raw(topic, raw.type_name, raw.data, raw.stamp_ns)
    assert main([str(bag)]) == 2
    line = capsys.readouterr().err
    assert "none of wheel_1/power, wheel_2/power, wheel_3/power" in line
    assert "set measurement.source: total_only" in line
    assert "/motor_1/power" in line


@pytest.mark.parametrize("case", UNDECIDED)
def test_where_nothing_can_be_decided_one_line_says_why(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make, words = UNDECIDED[case]
    bag = tmp_path / "bag"
    with RecordingWriter(bag) as writer:
        for raw in make():
            writer.write_raw(raw.topic, raw.type_name, raw.data, raw.stamp_ns)
    assert main([str(bag)]) == 3
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note: ")]
    assert len(lines) == 1
    assert lines[0].startswith(f"{bag}: nothing could be decided: ")
    assert words in lines[0]


def test_a_fault_outweighs_what_is_undecided(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    with RecordingWriter(bag) as writer:
        for raw in _drive()[:20]:
            writer.write_raw(raw.topic, raw.type_name, raw.data, raw.stamp_ns)
    assert run(capsys, bag, HEALTHY)[0] == 3
    assert run(capsys, bag, FAULTY)[0] == 1
    shutil.rmtree(bag)
    assert run(capsys, bag, FAULTY)[0] == 2


def test_what_a_recording_is_called_is_escaped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = [tmp_path / name for name in ("<script>a", "<script>b")]
    code, _, _ = run(capsys, *missing, "--html", tmp_path / "pages")
    assert code == 2
    index = (tmp_path / "pages" / "index.html").read_text()
    assert "<script>a" not in index
    assert "&lt;script&gt;a" in index
