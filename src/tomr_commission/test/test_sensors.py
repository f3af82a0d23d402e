"""Robots that report currents, or their total power alone."""

import dataclasses
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock, patch

import numpy as np
import pytest
import yaml
from attrs import evolve

from tomr_commission.alarm import Tail, alarm_level
from tomr_commission.cli import main
from tomr_commission.injected import kinds_for
from tomr_commission.observed import Observed
from tomr_commission.rehearsal import Shoved
from tomr_commission.report.plain import lines
from tomr_commission.request import AlarmChoice
from tomr_commission.trials import Trial
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import read_sections

BAGS = Path(__file__).resolve().parents[3] / "bags"
HERE = "tomr_commission.commission"
REPORT = {"sentence": "", "findings": [], "unexplained_share": 0.0, "holdout": None}
SILENT = (*MOTORS, *ENCODERS)
SIMULATED = "wheel stuck (simulated)"
TAILS = {"driving": 50, "simulated shoves": 0}  # peaks of each


@pytest.fixture
def rehearse() -> Iterator[Mock]:
    """The long steps done at once; the simulated shoves."""
    explained = {"report": REPORT, "explained": "", "files": {}, "levels": []}
    with (
        patch.dict(os.environ, OMP_NUM_THREADS="1"),
        patch("tomr_fault_diag.residuals.calibrated._LEAST", 100),
        patch(f"{HERE}.explain_drives", return_value=explained),
        patch(f"{HERE}.try_simulated", return_value=[Trial(SIMULATED, 1.0, "", 0, 0.3, "x")]),
        patch(f"{HERE}.rehearse", return_value=Shoved((0.0,) * 60, 0.1)) as rehearse,
    ):
        yield rehearse


def derived(path: Path, change: Callable[[str, Any], Any]) -> Path:
    """The healthy recording with other messages; None drops one."""
    with open_recording(BAGS / "square") as recording, RecordingWriter(path) as writer:
        for topic, kind, message, received_ns in recording.messages():
            changed = change(topic, message)
            if changed is not None:
                writer.write(topic, kind, changed, received_ns)
    return path


def commissioned(bag: Path, robot: str, out: Path) -> dict[str, Any]:
    assert main([str(bag), "--robot", robot, "--out", str(out), "--quiet"]) == 1  # it is short
    found: dict[str, Any] = json.loads((out / "commission.json").read_text())
    assert [reason["remedy"] for reason in found["reasons"]] == [
        "record the drive of tomr_commission plan, and give it as well"
    ]
    return found


def test_currents_leave_the_alarm_level_where_it_is(tmp_path: Path, rehearse: Mock) -> None:
    def without_voltage(topic: str, message: Any) -> Any:
        is_motor = topic.endswith("/power")
        return dataclasses.replace(message, voltage=np.nan) if is_motor else message

    found = commissioned(derived(tmp_path / "bag", without_voltage), "reference", tmp_path / "out")
    assert not rehearse.called
    assert SIMULATED in [floor["kind"] for floor in found["floors"]]
    assert found["alarm"]["caution"] >= ClassifierSettings().caution
    assert found["alarm"]["expected_per_hour"] is found["alarm"]["ci95_per_hour"] is None
    assert "expected_false_alarms" not in (tmp_path / "out" / "commissioned.yaml").read_text()
    assert any("the robot reports currents, not powers" in note for note in found["notes"])
    assert 0.0 < found["bands"]["current"] < 0.15  # A, the default
    floors = {floor["kind"]: floor for floor in found["floors"]}
    assert floors["power sensor biased"]["unit"] == "A"
    assert floors["power sensor biased"]["everywhere"] <= 0.5
    assert "motor draws more" not in floors
    page = (tmp_path / "out" / "commission.html").read_text()
    assert "<b>not known</b>" in page
    unfound = [kind for kind, floor in floors.items() if floor["everywhere"] is None]
    assert unfound
    assert f"Not found at every wheel: {', '.join(unfound)}. " in page


def test_total_alone_is_all_that_is_rehearsed(tmp_path: Path, rehearse: Mock) -> None:
    bag = derived(
        tmp_path / "bag", lambda topic, message: None if topic.endswith("/power") else message
    )
    # Distinguished from sensors that were forgotten: in one line.
    assert main([str(bag), "--robot", "reference", "--out", str(tmp_path / "no")]) == 2
    sections = {name: {**flat} for name, flat in read_sections("reference").items()}
    sections["/**"]["measurement.source"] = "total_only"
    robot = tmp_path / "robot.yaml"
    robot.write_text(
        yaml.safe_dump({name: {"ros__parameters": flat} for name, flat in sections.items()})
    )
    found = commissioned(bag, str(robot), tmp_path / "out")
    assert all(call.args[4].silent == SILENT for call in rehearse.call_args_list)
    assert [trial["kind"] for trial in found["trials"]] == [SIMULATED]  # no motor's sensor to fail
    kinds = {line["kind"] for line in found["regimes"]}
    assert kinds == {"total power", "wheel speed", "driver's voltage"}


@pytest.mark.parametrize("is_known", [True, False])
def test_a_rate_that_is_not_known_is_not_stated(is_known: bool) -> None:
    tails = [Tail.of(name, [0.0] * count, 30.0, AlarmChoice()) for name, count in TAILS.items()]
    level = alarm_level(tails[: 1 + (not is_known)], 0.05, 11.0, AlarmChoice())
    said = SimpleNamespace(alarms=(), undecided=0, ticks=1)
    outcome = SimpleNamespace(
        level=level,
        explained={"report": REPORT},
        held_name="tour",
        held_hours=0.1,
        held_together=said,
    )
    request = SimpleNamespace(false_alarms_per_hour=0.05)
    found = SimpleNamespace(
        outcome=outcome, is_go=True, verdict="go", reasons=(), floors=(), request=request
    )
    said_first, *_, alarms, _, _ = lines(found)  # type: ignore[arg-type]
    assert said_first.startswith(f"go: commissioned{' for 0.05 false' if is_known else ';'}")
    assert ("expected 0 false alarms per hour" in alarms) is is_known
    assert ("not known" in alarms, "not known" in said_first) == (not is_known, not is_known)


def test_silenced_residuals_are_unknown(healthy: Observed) -> None:
    assert healthy.silent == ()
    quiet = healthy.silenced(SILENT)
    assert quiet.silent == SILENT
    assert (quiet.missing[:, SILENT] == "not measured on this robot").all()
    assert np.array_equal(quiet.residual[:, 0], healthy.residual[:, 0])
    assert kinds_for(quiet) == ()


def test_more_current_is_put_into_motors_whose_total_is_not_reported(healthy: Observed) -> None:
    units = healthy.units.copy()
    units[list(SILENT)] = "A"
    amperes = evolve(healthy, units=units)
    assert not any(kind.in_total for kind in kinds_for(amperes))
    assert any(kind.in_total for kind in kinds_for(amperes.silenced([0])))
