"""The benchmark on robots with and without faults: regimes, means over ticks, states, truth."""
# ruff: noqa: E402 (bench/ is no package)

import json
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "bench"))

from faults.cli import _SENSORS, main
from faults.closed_loop import MotorPower, Prediction, closed_loop
from faults.diagnose import diagnose
from faults.explain import Run, measured
from faults.play import Played, changes_of, play, scored_name
from faults.power import PATHS, compared
from faults.recordings import Recordings
from faults.regimes import AT_REST, noise_of, regimes_of, rms, tick_means, tick_speeds, undisturbed
from faults.sensors import record
from faults.spoilt import Spoilt, faulty_drives, reasons_of
from faults.truth import missed, ratios, true_value
from other_sensors import SENSORS

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import (
    DISOBEYS,
    NOT_OBSERVABLE,
    STALE,
    STATES,
    WAITING,
    State,
)
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_power_model.cli import EXIT_BAD_INPUT, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.recordings import open_recording
from tomr_power_model.robot import load_robot

PERIOD = 0.05
PERIOD_NS = 50_000_000
WHEELS = ["a", "b", "c"]
REAL: dict[str, Any] = {
    "nominal": {
        "robot": {"wheel_names": WHEELS, "mass": 10.0},
        "motor": {"resistance": 2.0},
        "physics": {"friction.coulomb": {"torque": 0.4}},
    },
    "deviations": {
        "robot.mass": 1.02,
        "motor.resistance": [0.9, 1.0, 1.2],
        "physics.friction.coulomb.torque": [1.0, 1.1, 1.0],
    },
    "effects": [
        {"effect": "friction.stribeck", "where": ["a"], "parameters": {"torque": 0.1}},
        {"effect": "friction.stribeck", "where": ["b"], "parameters": {"torque": 0.2}},
        {"effect": "contact.slip", "where": ["all_wheels"], "parameters": {"friction": 0.6}},
    ],
    "heating": [6.0, 250.0],
}


def regimes(*speeds: float) -> list[str]:
    """Regime of each tick of one wheel; the other two stand."""
    column = np.array(speeds)
    masks = regimes_of(np.stack([column, 0 * column, 0 * column], axis=1), PERIOD)
    assert np.all(sum(mask.astype(int) for mask in masks.values()) == 1)
    return [next(name for name, mask in masks.items() if mask[k, 0]) for k in range(len(speeds))]


def test_a_wheel_that_starts_runs_and_stops_passes_through_the_regimes() -> None:
    found = regimes(*[0.0] * 5, 2.0, 4.0, *[5.0] * 10, 2.0, *[0.0] * 25)
    assert found[:5] == ["at rest"] * 5  # never moved before: this is no stop
    assert found[5:8] == ["accelerating"] * 3
    assert found[8:16] == ["steady"] * 8
    assert found[16:18] == ["accelerating"] * 2
    assert found[18:38] == ["within 1 s after stops"] * 20
    assert found[38:] == ["at rest"] * 5


def test_a_change_of_sign_is_a_reversal_unless_the_wheel_stands_between() -> None:
    swift = regimes(*[3.0] * 10, *[0.0] * 2, *[-3.0] * 10)
    assert swift == ["steady"] * 5 + ["in reversals"] * 12 + ["steady"] * 5
    slow = regimes(*[3.0] * 10, *[0.0] * 8, *[-3.0] * 10)
    assert "in reversals" not in slow
    assert slow[10:18] == ["within 1 s after stops"] * 8
    assert "in reversals" not in regimes(*[3.0] * 10, *[0.0] * 2, *[3.0] * 10)


def test_samples_belong_to_the_tick_that_ends_after_them() -> None:
    stamps = np.array([100, 150, 300], dtype=np.int64)  # a tick is missing before the last
    times = np.array([50, 51, 100, 101, 150, 240, 251, 299, 301], dtype=np.int64)
    values = np.array([9.0, 1.0, 3.0, 4.0, 6.0, 9.0, 7.0, 8.0, 9.0])
    assert tick_means(times, values, stamps, 50).tolist() == [2.0, 5.0, 7.5]
    assert np.isnan(tick_means(times[:3], values[:3], stamps, 50)).tolist() == [False, True, True]


def test_speeds_of_ticks_are_differences_of_angles() -> None:
    times = np.arange(0, 11, dtype=np.int64) * 10_000_000 + 10**18
    angle = np.outer(1e-9 * (times - times[0]), [2.0, -3.0, 0.0])
    angle[4, 0] = np.nan  # a lost sample between others
    stamps = times[0] + np.array([20_000_000, 70_000_000, 120_000_000])
    speed = tick_speeds(times, angle, stamps, PERIOD_NS)
    np.testing.assert_allclose(speed[1], [2.0, -3.0, 0.0], atol=1e-9)
    assert np.isnan(speed[[0, 2]]).all()  # begin before, or end after, the encoders


def test_noise_is_of_neighbours_and_no_jump() -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.1, 4000)
    noise[2000:] += 50.0
    assert noise_of(noise) == pytest.approx(0.1, rel=0.05)
    assert rms(np.array([3.0, np.nan, -3.0])) == 3.0
    assert np.isnan(noise_of(np.zeros(1)))


def test_a_recording_is_played_up_to_its_end_or_an_earlier_one() -> None:
    played = play(ROOT / "bags" / "circle_encoder_lost", Path("reference"), 3.0)
    assert np.diff(played.stamp_ns).tolist() == [played.period_ns] * 58
    assert played.changes[-1][1] == "normal"
    standing = played.stamp_ns - played.stamp_ns[0] < 8e8
    assert played.measured[standing].mean() == pytest.approx(1.2, abs=0.05)  # W of standby
    # Both are off by the sensor's noise, and the wheels turn nearly as expected.
    command, encoder = (path[~standing] for path in (played.command_path, played.encoder_path))
    assert max(rms(command), rms(encoder)) < 0.11
    assert 0.0 < rms(encoder - command) < 0.2 * rms(command)


def test_three_predictions_are_compared_on_the_same_ticks() -> None:
    stamps = 10**18 + PERIOD_NS * np.arange(1, 101, dtype=np.int64)
    times = 10**18 + PERIOD_NS // 2 * np.arange(1, 201, dtype=np.int64)
    ones = np.ones((100, 3))
    command = 0.3 * ones
    command[:10] = np.nan  # the nodes' first ticks: of no prediction's count
    measured = 2.0 + np.tile([0.05, -0.05], 100)
    measured[:18] += np.tile([0.1, -0.1], 9)  # rougher, in ticks that do not count
    power = MotorPower(times, measured, measured + 0.1 * np.tile([1.0, -3.0], 100))
    encoders = np.arange(10**18, 10**18 + 101 * PERIOD_NS, PERIOD_NS, dtype=np.int64)
    predicted = Prediction((power,) * 3, encoders, np.zeros((101, 3)))
    played = Played((), stamps, PERIOD_NS, 2.0 * ones, command, -0.2 * ones)
    found = compared(played, predicted)
    assert found.residual.shape == (len(PATHS), 90, 3)
    assert [rms(part) for part in found.residual] == pytest.approx([0.3, 0.2, 0.1])
    assert found.sampled == pytest.approx(0.1 * np.sqrt(5.0))
    assert found.rate == pytest.approx(40.0)
    assert found.regimes[AT_REST].all()
    assert found.sample_noise == pytest.approx([0.1 / np.sqrt(2.0)] * 3)
    bumped = compared(played, predicted, [10**18 + 2 * 10**9])  # leaves out ticks 39 to 79
    assert bumped.residual.shape[1] == 90 - 41


def test_two_seconds_after_a_bump_are_left_out() -> None:
    stamps = 10**18 + 500_000_000 * np.arange(10, dtype=np.int64)
    found = undisturbed(stamps, [10**18 + 1_050_000_000])
    assert found.tolist() == [True, True, False, False, False, False, False, True, True, True]
    assert undisturbed(stamps, []).all()


def test_states_are_scored_by_their_names_and_first_stamps() -> None:
    names = [scored_name(state) for state in (*STATES, NOT_OBSERVABLE, STALE, DISOBEYS, WAITING)]
    assert names == [
        *("normal", "slip", "control_system"),
        *("motor_system_1", "motor_system_2", "motor_system_3", "not_observable", "stale"),
        *("unknown", "stale"),
    ]

    def said(seconds: int, state: State, wheel: int | None) -> Diagnosis:
        stamp = seconds * 10**9
        frame = ResidualFrame(stamp, ())
        # Named now, though it began two seconds ago.
        return Diagnosis(stamp, state, stamp - 2 * 10**9, (), frame, False, wheel)

    decided = [(3, STATES[0], None), (4, STATES[0], None), (5, STATES[2], 1), (6, STATES[2], 0)]
    assert changes_of(said(*item) for item in decided) == (
        (3.0, "normal", None),
        (5.0, "control_system", 2),
        (6.0, "control_system", 1),
    )


@pytest.mark.parametrize(
    ("effect", "where", "parameter", "value"),
    [
        ("friction.stribeck", ["b"], "torque", 0.2),
        ("friction.stribeck", ["a", "b"], "torque", 0.15),
        ("friction.stribeck", ["c"], "torque", None),
        ("contact.slip", ["all_wheels"], "friction", 0.6),
        ("electrical.winding_heating", ["all_wheels"], "time_constant", 250.0),
        ("parameter.robot.mass", ["body"], "value", 10.2),
        ("parameter.motor.resistance", ["c"], "value", 2.4),
        ("friction.coulomb", ["b"], "torque", 0.44),
        ("parameter.physics.friction.coulomb.torque", ["b"], "value", 0.44),
        ("electrical.iron_loss", ["all_wheels"], "eddy", None),
    ],
)
def test_findings_are_held_against_the_real_robot(
    effect: str, where: list[str], parameter: str, value: float | None
) -> None:
    found = true_value(REAL, effect, where, parameter)
    assert found is None if value is None else found == pytest.approx(value)


def test_what_was_not_named_is_listed() -> None:
    assert missed(REAL, ["contact.slip", "unknown"]) == [
        "electrical.winding_heating",
        "friction.stribeck",
    ]


def test_a_description_is_held_against_the_truth() -> None:
    values = {
        "robot.mass": 9.69,
        "motor.resistance": 2.0,
        "motor.c.resistance": 2.4,
        "physics.friction.coulomb.torque": 0.44,
    }
    found = ratios(REAL, values)
    assert found["robot.mass"] == pytest.approx([0.95])
    assert found["motor.resistance"] == pytest.approx([1 / 0.9, 1.0, 1.0])
    assert found["physics.friction.coulomb.torque"] == pytest.approx([1.1, 1.0, 1.1])


def test_the_cost_of_a_command_is_its_own(tmp_path: Path) -> None:
    code = "b = bytearray(80_000_000); print('no'); print('luck'); exit(3)"
    run = measured([sys.executable, "-c", code], tmp_path / "log")
    assert (run.code, run.last) == (3, "luck")
    assert 80.0 < run.memory < 400.0
    assert 0.0 < run.cpu < 60.0


def _set_of(folder: Path, truths: dict[str, dict[str, Any]]) -> Recordings:
    """A set of faulty drives of which only the truth is there."""
    for identity, truth in truths.items():
        (folder / "faults" / "r" / "drives" / identity).mkdir(parents=True)
        written = folder / "faults_truth" / "r" / f"{identity}.json"
        written.parent.mkdir(parents=True, exist_ok=True)
        written.write_text(json.dumps({"t0_ns": 0, "severity": None, **truth}))
    return Recordings(folder, "r")


def test_only_drives_with_a_fault_are_put_among_healthy_ones(tmp_path: Path) -> None:
    slip = {"state": "slip", "extended": "none", "wheel": None, "onset": 9.0}
    drag = {"state": "motor_system_2", "extended": "bearing_drag", "wheel": 2, "onset": 9.0}
    normal = {"state": "normal", "extended": "none", "wheel": None, "onset": None}
    found = _set_of(tmp_path, {"aa": slip, "bb": normal, "cc": drag})
    assert [drive.identity for drive in faulty_drives(found, [])] == ["aa", "cc"]
    assert [drive.identity for drive in faulty_drives(found, ["cc"])] == ["cc"]
    assert [found.fault(name) for name in ("aa", "cc")] == [("slip", None), ("bearing_drag", 2)]
    with pytest.raises(InputError, match="--only bb: give ids of faulty drives: aa, cc"):
        faulty_drives(found, ["bb"])


def _spoilt(code: int, wheel: int | None, *reasons: str) -> Spoilt:
    return Spoilt("cc", "bearing_drag", wheel, Run(code, "", 1.0, 1.0, 1.0), reasons)


def test_a_refusal_may_name_the_drive_and_the_wheel() -> None:
    good = _spoilt(
        1, 2, "bands are wide: mend", "cc: wheel 2 needs +30 % of the usual torque: look"
    )
    assert (good.is_go, good.names_drive, good.names_wheel) == (False, True, True)
    other = _spoilt(1, 2, "cc: wheel 22 needs more: look", "aa: wheel 2 needs more")
    assert (other.names_drive, other.names_wheel) == (True, False)
    assert _spoilt(2, 3, "cc: motor_3_joint stands: look").names_wheel
    assert _spoilt(0, None, "written: commissioned.yaml").is_go
    assert _spoilt(1, None, "cc: slip is named").names_wheel is None


def test_why_a_commissioning_is_no_go_is_read_from_its_report_or_its_last_line(
    tmp_path: Path,
) -> None:
    run = Run(2, "cc: wheel 2 stands: look", 1.0, 1.0, 1.0)
    assert list(reasons_of(tmp_path, run)) == ["cc: wheel 2 stands: look"]
    written = {"reasons": [{"what": "too short", "remedy": "record more"}]}
    (tmp_path / "commission.json").write_text(json.dumps(written))
    assert list(reasons_of(tmp_path, run)) == ["too short: record more"]
    assert list(reasons_of(tmp_path, evolve(run, code=0, last="go"))) == ["go"]


def test_the_closed_loop_predicts_the_power_of_a_recording() -> None:
    robot = Path(str(files("tomr_power_model") / "robots" / "reference.yaml"))
    found = closed_loop(ROOT / "bags" / "square", robot, 14.0)
    assert len(found.motors) == 3
    for motor in found.motors:
        assert motor.time_ns[-1] - motor.time_ns[0] == pytest.approx(14e9, abs=1e8)
        assert motor.measured[:20].mean() == pytest.approx(1.2, abs=0.1)  # W of standby
        assert rms(motor.residual) < 0.1 * rms(motor.measured)


def _set(folder: Path) -> Recordings:
    """Of a single drive."""
    drives, truth = folder / "faults" / "practice" / "drives", folder / "faults_truth"
    kinds = drives.parent / "healthy", drives.parent / "healthy_long"
    for each in (drives, *kinds, truth / "practice"):
        each.mkdir(parents=True)
    (drives / "one").symlink_to(ROOT / "bags" / "square")
    labels = {"onset": None, "extended": "battery", "t0_ns": 7 * 10**9, "bumps": [{"t": 0.5}]}
    (truth / "practice" / "one.json").write_text(json.dumps(labels))
    (folder / "score_faults.py").write_text("import sys; print(*sys.argv[1:])")
    return Recordings(folder, "practice")


def test_a_set_of_recordings_is_diagnosed_and_scored_by_its_own_program(tmp_path: Path) -> None:
    recordings, truth = _set(tmp_path), tmp_path / "faults_truth"
    (drive,) = recordings.drives("drives")
    assert (drive.identity, drive.is_normal) == ("one", False)  # something else goes wrong in it
    assert drive.bumps_ns == (7_500_000_000,)
    out = tmp_path / "out"
    printed = diagnose(recordings, Path("reference"), out)
    assert printed.split() == [str(out), str(truth), "--json", str(out / "score.json")]
    changes = json.loads((out / "practice" / "one.json").read_text())
    assert changes[0][1:] == ["normal", None]


@pytest.mark.parametrize("command", ["explain", "calibrate", "diagnose", "power"])
def test_absent_recordings_are_one_line(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("TOMR_RECORDINGS", str(tmp_path))
    assert run_main(main, [command]) == EXIT_BAD_INPUT
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1
    assert "is absent: set TOMR_RECORDINGS" in printed


def test_the_kinds_of_sensors_are_those_that_there_are() -> None:
    """They are listed where --help does without what takes seconds to import."""
    assert tuple(SENSORS) == _SENSORS


def _currents(bag: Path) -> list[float]:
    with open_recording(bag) as recording:
        return [item.current for _, _, item, _ in recording.messages(["wheel_1/power"])]


def test_a_set_as_other_sensors_record_it_is_a_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recordings = _set(tmp_path / "faults_practice")
    description = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
    recordings.description.write_text(description.read_text())
    monkeypatch.setenv("TOMR_RECORDINGS", str(record(recordings, "magnitudes", tmp_path / "new")))
    found = Recordings.find()
    assert not load_robot(found.description).measurement.signed
    assert found.scorer.exists()
    (drive,) = found.drives("drives")
    (before,) = recordings.drives("drives")
    (slow,) = Recordings(
        record(recordings, "slow", tmp_path / "slow") / "faults_practice", "practice"
    ).drives("drives")
    assert _currents(slow.bag) == _currents(before.bag)[::5]
    signed, magnitudes = _currents(before.bag), _currents(drive.bag)
    assert min(signed) < 0.0
    assert magnitudes == [abs(current) for current in signed]
