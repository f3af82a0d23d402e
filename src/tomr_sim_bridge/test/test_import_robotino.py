"""tomr_import_robotino: hand-worked numbers, honest errors, and the real files where they are."""

import contextlib
import csv
import math
import os
import tarfile
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomr_power_model.cli import run_main
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.limits import limits
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.cli.import_robotino import import_robotino
from tomr_sim_bridge.importers.archive import unpack
from tomr_sim_bridge.importers.dataset import open_dataset
from tomr_sim_bridge.importers.robotino import EPOCH_NS, body_twist, camera_pose

FLOOR = (
    "t;xsetspeed;ysetspeed;setvel;m1setvel;m2setvel;m3setvel;m1pos;m2pos;m3pos;"
    "m1vel;m2vel;m3vel;m1cur;m2cur;m3cur;xpos;ypos;ang;"
)
FLOOR_UNITS = (
    "ms;m/s;m/s;rad/s;rad/s;rad/s;rad/s;ticks;ticks;ticks;rad/s;rad/s;rad/s;A;A;A;pix;pix;deg;"
)
BENCH = "t;m1setvel;m2setvel;m3setvel;m1pos;m2pos;m3pos;m1vel;m2vel;m3vel;m1cur;m2cur;m3cur;"
BENCH_UNITS = "ms;rad/s;rad/s;rad/s;ticks;ticks;ticks;rad/s;rad/s;rad/s;A;A;A;"

# Forward at 0.3 m/s: wheel 1 at 60 degrees turns by -sin 60 * 0.3 / 0.04 * 16 at its motor.
ROWS = [
    "0.25;0.3;0;0;-103.923;0;103.923;0;0;0;0;0;0;0;0;0;800;900;359;",
    "31.5;0.3;0;0;-103.923;0;103.923;-1000;0;500;-96;0;48;1.5;0.1;0.75;800;890;1;",
]
BENCH_ROWS = ["0;25;25;25;0;0;8;0;0;0;0;0;0;", "40;25;-32;25;0;0;0;16;-32;0;0.5;0.1;0;"]


def write_csv(path: Path, names: str, units: str, rows: list[str]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([names.replace(";", " long;"), units, names, *rows]) + "\n")
    return path


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    root = tmp_path / "datasets"
    drives = root / "for_research_movement_direction" / "one_surface_type"
    write_csv(drives / "gray_surface" / "exp07.csv", FLOOR, FLOOR_UNITS, ROWS)
    write_csv(drives / "green_surface" / "exp07.csv", FLOOR, FLOOR_UNITS, ROWS)
    bench = root / "dc_motor_model_identification" / "validation_data.csv"
    write_csv(bench, BENCH, BENCH_UNITS, BENCH_ROWS)
    return root


def read_bag(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with open_recording(path) as recording:
        for topic, _, message, receive_ns in recording.messages():
            assert header_stamp_ns(message) == receive_ns
            found.setdefault(topic, []).append(message)
    return found


def run(*arguments: object) -> int:
    return run_main(import_robotino, [str(argument) for argument in arguments])


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_drive_by_hand(dataset: Path, tmp_path: Path, storage: str) -> None:
    out = tmp_path / "out"
    assert run(dataset, "--out", out, "--storage", storage) == 0
    bag = read_bag(out / "gray" / "exp07")
    assert set(bag) == {
        "/cmd_vel",
        "/joint_states",
        "/wheel_1/power",
        "/wheel_2/power",
        "/wheel_3/power",
        "/ground_truth/odom",
    }
    assert all(len(messages) == 2 for messages in bag.values())
    stamps = [header_stamp_ns(message) for message in bag["/joint_states"]]
    assert stamps == [EPOCH_NS + 250_000, EPOCH_NS + 31_500_000]
    state = bag["/joint_states"][1]
    assert state.name == ["wheel_1_joint", "wheel_2_joint", "wheel_3_joint"]
    # 1000 ticks are half a motor turn, 1/32 of a wheel turn; the contract turns the other way.
    assert state.position == pytest.approx([math.pi / 16, 0.0, -math.pi / 32])
    assert state.velocity == pytest.approx([6.0, 0.0, -3.0])
    power = [bag[f"/wheel_{wheel}/power"][1] for wheel in (1, 2, 3)]
    assert [message.current for message in power] == pytest.approx([-1.5, -0.1, -0.75])
    assert all(math.isnan(message.voltage) and message.present for message in power)
    assert {message.power_supply_status for message in power} == {2}  # discharging
    twist = bag["/cmd_vel"][1].twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.3, 0.0, 0.0)
    odometry = bag["/ground_truth/odom"][1]
    assert odometry.child_frame_id == "base_link"
    # Ten pixels up the image at a mean angle of 0 degrees is straight ahead.
    assert odometry.pose.pose.position.x == pytest.approx(-890 * 1.83716e-3)
    assert odometry.pose.pose.position.y == pytest.approx(-800 * 1.84046e-3)
    assert odometry.twist.twist.linear.x == pytest.approx(10 * 1.83716e-3 / 0.03125)
    assert odometry.twist.twist.linear.y == pytest.approx(0.0, abs=1e-12)
    assert odometry.twist.twist.angular.z == pytest.approx(math.radians(2.0) / 0.03125)
    assert 2 * math.atan2(odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w) % (
        2 * math.pi
    ) == pytest.approx(math.radians(1.0))


def test_a_bench_run_carries_no_command_of_the_body_and_no_positions(
    dataset: Path, tmp_path: Path
) -> None:
    assert run(dataset, "--out", tmp_path / "out", "--surface", "bench") == 0
    bag = read_bag(tmp_path / "out" / "bench" / "validation_data")
    assert set(bag) == {
        "/wheel_command",
        "/joint_states",
        "/wheel_1/power",
        "/wheel_2/power",
        "/wheel_3/power",
    }
    assert bag["/joint_states"][1].velocity == pytest.approx([-1.0, 2.0, 0.0])
    assert len(bag["/joint_states"][0].position) == 0
    assert bag["/wheel_command"][1].velocity == pytest.approx([-25 / 16, 2.0, -25 / 16])
    assert not (tmp_path / "out" / "gray").exists()


def test_the_index_describes_each_recording(dataset: Path, tmp_path: Path) -> None:
    assert run(dataset, "--out", tmp_path / "out") == 0
    with (tmp_path / "out" / "index.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["bag"] for row in rows] == ["bench/validation_data", "gray/exp07", "green/exp07"]
    assert rows[0]["heading_deg"] == rows[0]["speed_m_s"] == ""
    assert rows[1] == {
        "bag": "gray/exp07",
        "surface": "gray",
        "heading_deg": "0.0",
        "speed_m_s": "0.300",
        "duration_s": "0.031",
        "samples": "2",
        "largest_gap_s": "0.031",
    }


def test_the_archive_serves_as_well_as_the_folder(dataset: Path, tmp_path: Path) -> None:
    home = tmp_path / "download"
    home.mkdir()
    with tarfile.open(home / "datasets.tar.gz", "w:gz") as tar:
        tar.add(dataset, "datasets")
    for number, source in enumerate((home / "datasets.tar.gz", home)):
        out = tmp_path / f"out_{number}"
        assert run(source, "--out", out, "--surface", "green", "bench") == 0
        assert sorted(path.name for path in out.iterdir()) == ["bench", "green", "index.csv"]


def test_names_that_repeat_keep_their_folders(dataset: Path, tmp_path: Path) -> None:
    other = dataset / "another_study" / "gray_surface" / "exp07.csv"
    write_csv(other, FLOOR, FLOOR_UNITS, ROWS)
    assert run(dataset, "--out", tmp_path / "out", "--surface", "gray") == 0
    with (tmp_path / "out" / "index.csv").open() as stream:
        bags = [row["bag"] for row in csv.DictReader(stream)]
    assert bags == [
        "another_study/gray_surface/exp07",
        "for_research_movement_direction/one_surface_type/gray_surface/exp07",
    ]
    for bag in bags:
        assert read_bag(tmp_path / "out" / bag)


def test_a_turn_of_the_image_does_not_change_the_body_twist() -> None:
    time = np.linspace(0.0, 1.0, 5)
    pose = camera_pose(np.linspace(0, 40, 5), np.linspace(0, -70, 5), np.linspace(350, 370, 5))
    assert pose[:, 2] == pytest.approx(np.radians([350, 355, 360, 365, 370]))
    angle = 0.7
    cos, sin = math.cos(angle), math.sin(angle)
    turned = pose @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + [0, 0, angle]
    assert body_twist(turned, time) == pytest.approx(body_twist(pose, time))


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("-96;", "fast;", ("line 5", "'m1vel'", "'fast'")),
        ("-96;", "nan;", ("line 5", "'m1vel'", "not a finite number")),
        ("-96;", "-96;7;", ("line 5", "20 cells", "19")),
        ("31.5;", "0.25;", ("time does not increase", "0.25")),
        ("m2cur;m3cur", "m2cur;m4cur", ("line 3", "'m3cur'")),
        ("ms;m/s", "s;m/s", ("line 2", "'t'", "'ms'")),
        ("\n".join(ROWS), "", ("no samples",)),
    ],
)
def test_a_malformed_file_is_named_and_the_others_are_done(
    dataset: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    old: str,
    new: str,
    parts: tuple[str, ...],
) -> None:
    bad = next(dataset.rglob("gray_surface/*.csv"))
    text = bad.read_text()
    assert old in text
    bad.write_text(text.replace(old, new))
    assert run(dataset, "--out", tmp_path / "out") == 2
    answer = capsys.readouterr()
    lines = [line for line in answer.err.splitlines() if "error:" in line]
    assert len(lines) == 1
    for part in (str(bad), *parts):
        assert part in lines[0]
    assert "2 recordings" in answer.out
    assert "1 failed" in answer.out
    assert read_bag(tmp_path / "out" / "green" / "exp07")
    assert not (tmp_path / "out" / "gray").exists()


def test_input_that_is_no_data_set(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    (tmp_path / "broken.tar.gz").write_bytes(b"\x1f\x8b not an archive")
    (tmp_path / "notes.txt").write_text("hello")
    occupied = tmp_path / "occupied"
    occupied.mkdir()
    (occupied / "file").write_text("mine")
    out = tmp_path / "out"
    for arguments, part in (
        ((tmp_path / "absent", "--out", out), "does not exist"),
        ((empty, "--out", out), "no csv files"),
        ((tmp_path / "broken.tar.gz", "--out", out), "cannot be unpacked"),
        ((tmp_path / "notes.txt", "--out", out), "neither a folder nor"),
        ((dataset, "--out", out, "--surface", "sand"), "bench, gray, green"),
        ((dataset, "--out", occupied), "not an empty folder"),
    ):
        assert run(*arguments) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("error: ")
        assert part in line
    assert (occupied / "file").read_text() == "mine"
    assert not out.exists()


def real_archive() -> Path:
    default = Path(__file__).parents[3].parent / "shared" / "recordings"
    root = Path(os.environ.get("TOMR_RECORDINGS", default))
    return root / "robotino" / "datasets.tar.gz"


@pytest.mark.skipif(
    not real_archive().exists(), reason="no robotino/datasets.tar.gz under TOMR_RECORDINGS"
)
def test_the_real_drives_agree_with_the_contract(tmp_path: Path) -> None:
    folder = tmp_path / "real"
    with tarfile.open(real_archive()) as tar:
        for name in ("gray_surface/exp05.csv", "gray_surface/exp144.csv"):
            member = f"datasets/for_research_movement_direction/one_surface_type/{name}"
            source = tar.extractfile(member)
            assert source is not None
            (folder / member).parent.mkdir(parents=True, exist_ok=True)
            (folder / member).write_bytes(source.read())
    assert run(folder, "--out", tmp_path / "out") == 0
    robot = shipped_robot("robotino_v2")
    for name in ("exp05", "exp144"):
        bag = read_bag(tmp_path / "out" / "gray" / name)
        command = bag["/cmd_vel"][0].twist
        expected = twist_to_wheels(robot) @ [command.linear.x, command.linear.y, command.angular.z]
        states = bag["/joint_states"]
        seen = np.median([state.velocity for state in states[30:]], axis=0)
        # A proportional-only loop: slower than commanded, in the direction commanded.
        for wheel in np.flatnonzero(np.abs(expected) > 0.5):
            assert 0.4 < seen[wheel] / expected[wheel] < 1.0
        turned = states[-1].position - states[0].position
        stamps = np.array([header_stamp_ns(state) for state in states])
        speeds = np.array([state.velocity for state in states])
        integral = np.sum(speeds[1:] * np.diff(stamps)[:, None] * 1e-9, axis=0)
        assert turned == pytest.approx(integral, rel=0.03, abs=0.2)
        # The camera sees the robot move where it was commanded to, at some slip.
        twists = np.array(
            [
                [odometry.twist.twist.linear.x, odometry.twist.twist.linear.y]
                for odometry in bag["/ground_truth/odom"]
            ]
        )
        moved = twists[30:].mean(axis=0)
        asked = np.array([command.linear.x, command.linear.y])
        cosine = moved @ asked / np.linalg.norm(moved) / np.linalg.norm(asked)
        assert cosine > math.cos(math.radians(10.0))
        assert 0.4 < np.linalg.norm(moved) / np.linalg.norm(asked) < 1.0


@pytest.mark.parametrize("attack", ["zeros", "header", "outside", "members", "cut", "device"])
def test_archives_that_are_none(
    attack: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TOMR_LIMIT_ARCHIVE_BYTES", "2e6")
    monkeypatch.setenv("TOMR_LIMIT_ARCHIVE_FILES", "5")
    limits.cache_clear()
    archive = tmp_path / "data.tar.gz"
    if attack == "device":
        archive.symlink_to("/dev/zero")
    else:
        with tarfile.open(archive, "w:gz", format=tarfile.PAX_FORMAT) as tar:
            for number in range(9 if attack == "members" else 1):
                name = "../out.csv" if attack == "outside" else f"gray/{number}.csv"
                member = tarfile.TarInfo(name)
                member.size = 3_000_000 if attack == "zeros" else 100
                if attack == "header":
                    member.pax_headers = {"comment": "x" * 2_000_000}
                tar.addfile(member, BytesIO(bytes(member.size)))
    if attack == "cut":
        archive.write_bytes(archive.read_bytes()[:-20])
    words = {
        "zeros": "TOMR_LIMIT_ARCHIVE_BYTES",
        "header": "a header of",
        "outside": "leads out of it",
        "members": "TOMR_LIMIT_ARCHIVE_FILES",
        "cut": "cannot be unpacked",
        "device": "neither a folder nor",
    }
    try:
        with pytest.raises(InputError, match=words[attack]), open_dataset(archive):
            pass
    finally:
        limits.cache_clear()
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize("mode", ["w:gz", "w:bz2", "w:xz"])
def test_an_archive_that_ends_anywhere_is_refused_in_one_line(tmp_path: Path, mode: str) -> None:
    (tmp_path / "a.csv").write_text("x")
    whole = tmp_path / "whole"
    with tarfile.open(whole, mode) as tar:  # type: ignore[call-overload]
        tar.add(tmp_path / "a.csv", "a.csv")
    data, cut = whole.read_bytes(), tmp_path / "cut"
    for length in (*range(40), len(data) // 2, len(data) - 1):
        cut.write_bytes(data[:length])
        with contextlib.suppress(InputError):  # or what is lost is padding alone
            unpack(cut, tmp_path / "out")
    named = bytearray(data[:12])
    if mode == "w:gz":
        named[3] |= 8  # a name that never ends
        cut.write_bytes(named)
        with pytest.raises(InputError, match="cannot be unpacked"):
            unpack(cut, tmp_path / "out")
