"""The command as a whole: files, verdicts, exit codes, resuming. The long steps are replaced."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock, patch

import pytest
import yaml

from tomr_commission.cli import main
from tomr_commission.commission import _observe
from tomr_commission.explained import Split
from tomr_commission.healthy import MOST_GATHERED
from tomr_commission.observed import Observed
from tomr_commission.rehearsal import Shoved
from tomr_commission.report.figures import end_to_end
from tomr_commission.trials import Trial
from tomr_fault_diag.classifier.commissioned import commissioned_words, stamp_of
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.cli.diagnose import main as diagnose
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_power_model.errors import InputError
from tomr_power_model.robot import load_robot, read_node_sections, shipped_robot
from tomr_sim_bridge.missions import load_mission

BAGS = Path(__file__).resolve().parents[3] / "bags"
HERE = "tomr_commission.commission"
FOUND = Trial("power sensor scaled", 0.2, "of the power", 0, 0.5, "motor system fault 1")
NODES = ("power_model", "power_residuals", "fault_classifier")


def explained(**changes: object) -> dict[str, Any]:
    report = {
        "sentence": "It matches.",
        "findings": [],
        "unexplained_share": 0.0,
        "holdout": None,
        **changes,
    }
    level = {
        "recording": "square",
        "held_out": False,
        "channel": "wheel_1/power",
        "unit": "W",
        "rms": 0.1,
        "level": 1.0,
        "level_before": 1.0,
    }
    return {"report": report, "explained": "", "files": {"report.html": ""}, "levels": [level]}


@pytest.fixture(scope="module")
def steps() -> Iterator[dict[str, Mock]]:
    """The long steps, done at once, and bands from drives as short as those of the repository."""
    with (
        patch.dict(os.environ, OMP_NUM_THREADS="1"),  # nor do processes have to be started
        patch("tomr_fault_diag.residuals.calibrated._LEAST", 100),
        patch(f"{HERE}.explain_drives", return_value=explained()) as explain,
        patch(f"{HERE}.rehearse", return_value=Shoved((0.0,) * 60, 0.1)) as rehearse,
        patch(f"{HERE}.try_simulated", side_effect=InputError("no rollers")) as simulate,
        patch(f"{HERE}.try_injected", return_value=[FOUND]) as inject,
    ):
        yield {"inject": inject, "explain": explain, "rehearse": rehearse, "simulate": simulate}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory, steps: dict[str, Mock]) -> Path:
    """Results of a commissioning on one short drive."""
    out = tmp_path_factory.mktemp("done")
    assert run(out) == 1
    return out


def run(out: Path, *arguments: str) -> int:
    bag = str(BAGS / "square")
    return main([bag, "--robot", "reference", "--out", str(out), "--quiet", *arguments])


def report(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "commission.json").read_text())
    return found


def test_short_drive_is_a_no_go_that_says_what_to_record(done: Path) -> None:
    found = report(done)
    assert found["verdict"] == "no-go"
    assert [reason["remedy"] for reason in found["reasons"]] == [
        "record the drive of tomr_commission plan, and give it as well"
    ]
    assert found["notes"] == ["no faults were simulated: no rollers"]
    page = (done / "commission.html").read_text()
    assert "NO-GO" in page
    assert page.count("data:image/png") == 2


def test_a_sure_no_go_is_said_before_the_long_steps(
    tmp_path: Path, steps: dict[str, Mock], capsys: pytest.CaptureFixture[str]
) -> None:
    bag = str(BAGS / "square")
    with patch(f"{HERE}.rehearse", side_effect=InputError("the shoves begin")):
        assert main([bag, "--robot", "reference", "--out", str(tmp_path)]) == 2
        assert capsys.readouterr().err.splitlines() == [
            "no-go: 0.2 minutes to fit to and 0.1 held out are too few: 2.5 and 0.8 are needed",
            "  -> record the drive of tomr_commission plan, and give it as well",
            "the rest is measured for the report; Ctrl-C ends it",
            "error: the shoves begin",
        ]
        assert run(tmp_path) == 2
        assert capsys.readouterr().err == "error: the shoves begin\n"  # --quiet


def test_simulated_motors_are_as_near_to_their_values_as_voltages_say(
    done: Path, steps: dict[str, Mock]
) -> None:
    """The recorded robot equals its description."""
    assert (done / "commission.json").exists()
    plans = [call.args[-1] for call in steps["rehearse"].call_args_list]
    assert plans
    assert all(plan.electrical < 0.5 * plan.off for plan in plans)


def test_small_faults_are_looked_for_from_then_on(done: Path, steps: dict[str, Mock]) -> None:
    """In simulated hours and in trials as well, as a robot will be judged."""
    written = done / "commissioned.yaml"
    settings = DiagnosisSettings.of(read_node_sections(written, NODES), str(written)).classifier
    assert settings.small_faults
    assert report(done)["small_faults"]["looked_for"]
    assert 0.0 <= report(done)["small_faults"]["gathered_in_healthy_driving"] <= MOST_GATHERED
    assert steps["rehearse"].call_args.args[2].small_faults
    assert steps["inject"].call_args.args[2].small_faults


def test_where_healthy_driving_looks_like_a_small_fault_a_note_says_so(
    tmp_path: Path, steps: dict[str, Mock]
) -> None:
    with patch("tomr_commission.healthy.MOST_GATHERED", -1.0):
        assert run(tmp_path) == 1
    written = tmp_path / "commissioned.yaml"
    settings = DiagnosisSettings.of(read_node_sections(written, NODES), str(written)).classifier
    assert not settings.small_faults
    assert not report(tmp_path)["small_faults"]["looked_for"]
    assert any("small faults that last are not" in note for note in report(tmp_path)["notes"])
    assert not steps["rehearse"].call_args.args[2].small_faults


def test_drives_that_are_held_out_are_drawn_one_after_the_other(
    steady: Callable[..., Observed],
) -> None:
    first, second = end_to_end([steady(ticks=200), steady(ticks=400)])
    assert first[[0, -1]] == pytest.approx([0.0, 9.95])
    assert second[[0, -1]] == pytest.approx([10.95, 30.9])


def test_written_description_is_loaded_everywhere(done: Path) -> None:
    written = done / "commissioned.yaml"
    assert load_robot(written) == shipped_robot("reference")
    settings = DiagnosisSettings.of(read_node_sections(written, NODES), str(written))
    bands = report(done)["bands"]
    assert settings.residuals.bands.power == pytest.approx(bands["power"])
    assert settings.classifier.caution == report(done)["alarm"]["caution"]
    # A no-go is no commissioning.
    assert commissioned_words(settings.classifier, load_robot(written)) == "no: run tomr_commission"
    assert settings.classifier.hardware_id == ClassifierSettings().hardware_id


def test_values_changed_afterwards_are_refused(done: Path, tmp_path: Path) -> None:
    text = (done / "commissioned.yaml").read_text()
    written = tmp_path / "heavier.yaml"
    written.write_text(text.replace("mass: 15.0", "mass: 16.0"))
    with pytest.raises(InputError, match=r"commissioned on .*run tomr_commission again"):
        load_robot(written)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass: 15.0", "mass: 16.0"),
        ("wheel_1_joint, wheel_2_joint", "wheel_2_joint, wheel_1_joint"),
        ("robot_radius: 0.2", "robot_radius: 0.25"),
    ],
)
def test_file_of_another_robot_is_refused_by_all(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    text = (done / "commissioned.yaml").read_text()
    assert old in text
    written = tmp_path / "another.yaml"
    written.write_text(text.replace(old, new))
    bag, robot = str(BAGS / "square"), str(written)
    for command in (diagnose, lambda given: main([*given, "--out", str(tmp_path / "out")])):
        assert command([bag, "--robot", robot]) == 2
        error = capsys.readouterr().err
        assert "not those that were commissioned on" in error
        assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("part", "said"),
    [
        (None, ""),
        (1, "commissioned: no: with another classifier on 2026-03-01"),
        (2, "commissioned: no: another robot, or this one before"),
        (3, "commissioned: no: with version x of the suite, this is"),
    ],
)
def test_file_of_another_time_is_reported_in_a_line(
    done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], part: int | None, said: str
) -> None:
    robot = load_robot(done / "commissioned.yaml")
    stamp = stamp_of("2026-03-01", ClassifierSettings(), robot).split(" ")
    if part is not None:
        stamp[part] = "x"
    document = yaml.safe_load((done / "commissioned.yaml").read_text())
    document["fault_classifier"]["ros__parameters"]["commissioned"] = " ".join(stamp)
    written = tmp_path / "then.yaml"
    written.write_text(yaml.safe_dump(document))
    assert diagnose([str(BAGS / "square"), "--robot", str(written)]) == 0
    warned = [line for line in capsys.readouterr().err.splitlines() if "commissioned" in line]
    assert len(warned) == (part is not None)
    assert all(said in line for line in warned)


def test_commissioned_file_is_commissioned_again_from_its_description(
    tmp_path: Path, done: Path
) -> None:
    bag, first = str(BAGS / "square"), done / "commissioned.yaml"
    main([bag, "--robot", str(first), "--out", str(tmp_path), "--quiet"])
    one, other = (
        yaml.safe_load((folder / "commissioned.yaml").read_text()) for folder in (done, tmp_path)
    )
    assert one["/**"] == other["/**"]
    assert one["power_residuals"] == other["power_residuals"]


def test_rerun_does_nothing_twice(tmp_path: Path, steps: dict[str, Mock]) -> None:
    # All shoves are simulated after the first few.
    long = [steps[name] for name in ("explain", "rehearse", "simulate")]
    before = [step.call_count for step in long]
    with patch(f"{HERE}._observe", side_effect=_observe) as observe:
        run(tmp_path)
        texts = (tmp_path / "commissioned.yaml").read_text()
        run(tmp_path)
    assert observe.call_count == 1
    assert [step.call_count - count for step, count in zip(long, before, strict=True)] == [1, 2, 1]
    assert (tmp_path / "commissioned.yaml").read_text() == texts
    run(tmp_path, "--tolerance", "0.02")
    assert steps["explain"].call_count == before[0] + 2
    effects = tmp_path / "effects"
    effects.mkdir()
    for text in ("x = 1", "x = 2"):  # other effects may explain more
        (effects / "own.py").write_text(text)
        with patch.dict(os.environ, TOMR_EFFECTS=str(effects)):
            run(tmp_path)
    assert steps["explain"].call_count == before[0] + 4


def test_what_is_left_far_above_the_noise_is_a_no_go(
    tmp_path: Path, steps: dict[str, Mock]
) -> None:
    left = explained(unexplained_share=0.5)
    left["levels"][0]["level"] = 12.0
    with patch(f"{HERE}.explain_drives", return_value=left):
        assert run(tmp_path) == 1
    said = " ".join(reason["what"] for reason in report(tmp_path)["reasons"])
    assert "12.0 times the sensors' noise" in said
    assert "50 % of the mismatch" in said


def test_fault_among_what_is_taken_for_healthy_is_named(
    tmp_path: Path, steps: dict[str, Mock]
) -> None:
    bags = [str(BAGS / name) for name in ("square", "circle_encoder_lost")]
    main([*bags, "--robot", "reference", "--out", str(tmp_path), "--quiet"])
    said = [reason["what"] for reason in report(tmp_path)["reasons"]]
    assert any("motor system fault 3 is named from 8." in what for what in said)
    # Left out, it is not named any more.
    skip = ("--skip", "circle_encoder_lost=7.5:16.0")
    main([*bags, "--robot", "reference", "--out", str(tmp_path), "--quiet", *skip])
    said = [reason["what"] for reason in report(tmp_path)["reasons"]]
    assert not any("is named" in what for what in said)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere", "--robot", "reference"], "nowhere: no such recording"),
        ([str(BAGS / "square"), "--robot", "none.yaml"], "none.yaml: cannot be read"),
        (
            [str(BAGS / "square"), "--robot", "reference", "--false-alarms-per-hour", "0"],
            "--false-alarms-per-hour 0: give 0.0001 to 100",
        ),
        ([str(BAGS / "square"), "--robot", "reference", "--tolerance", "2"], "--tolerance 2"),
        ([str(BAGS / "square"), "--robot", "reference", "--skip", "x"], "--skip x"),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert main([*arguments, "--out", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_plan_is_a_mission_of_some_minutes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mission = tmp_path / "mission.yaml"
    assert main(["plan", "--robot", "reference", "--out", str(mission), "--speed", "0.3"]) == 0
    plan = load_mission(str(mission)).plan(shipped_robot("reference"))
    assert 120.0 < plan.duration < 240.0
    assert str(mission) in capsys.readouterr().out
    assert main(["plan", "--robot", "reference", "--out", str(mission), "--speed", "50"]) == 2


@pytest.mark.parametrize(
    ("durations", "fitted"),
    [
        ((600.0, 200.0), 1),
        ((200.0, 200.0, 60.0), 2),
        ((200.0, 200.0, 30.0, 25.0), 2),  # 55 s of the last two
        ((200.0, 20.0, 20.0, 20.0), 1),
        ((20.0, 20.0), 1),  # one is needed to fit to
    ],
)
def test_as_many_of_the_last_drives_are_held_out_as_last_a_minute(
    durations: tuple[float, ...], fitted: int
) -> None:
    bags = [Path(f"tour{k}") for k in range(len(durations))]
    split = Split.of(bags, durations, 52.8)
    assert split.fitted == tuple(bags[:fitted])
    assert split.held == tuple(bags[fitted:])
    assert split.cut is None


def test_of_a_single_drive_the_last_third_is_held_out() -> None:
    split = Split.of([Path("tour")], [300.0], 52.8)
    assert (split.fitted, split.held, split.cut) == ((Path("tour"),), (Path("tour"),), 200.0)


def test_after_an_interruption_it_says_where_to_go_on(
    steps: dict[str, Mock], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with patch(f"{HERE}.rehearse", side_effect=KeyboardInterrupt):
        code = main([str(BAGS / "square"), "--robot", "reference", "--out", str(out)])
    assert code == 130
    said = capsys.readouterr().err.splitlines()
    assert said[-2:] == [f"{out}: the same command goes on from here", "interrupted"]
