"""The experiments of bench/: what their figures are made of, and their command."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

BENCH = Path(__file__).resolve().parents[1] / "bench"
sys.path.append(str(BENCH))

import experiments  # noqa: E402
from figures import harmonics as symmetry  # noqa: E402
from figures import heading, mass_center, real, simulated, tables  # noqa: E402
from figures.page import page  # noqa: E402
from figures.result import Missing, Result  # noqa: E402

from tomr_fault_diag.diagnosis.pipeline import Step  # noqa: E402
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame  # noqa: E402
from tomr_power_model.cli import run_main  # noqa: E402
from tomr_power_model.dynamics.drives import InverseDynamics  # noqa: E402
from tomr_sim_bridge.missions import parse_mission  # noqa: E402

THETA = np.radians(heading.HEADINGS)


def test_harmonics_of_a_known_curve() -> None:
    power = 10.0 + 0.5 * np.cos(6.0 * (THETA - np.radians(25.0))) + 0.3 * np.cos(THETA)
    found = symmetry.harmonics(power, standing=4.0)
    assert found.mean == pytest.approx(6.0)
    assert found.sixth == pytest.approx(0.5 / 6.0)
    assert found.most == pytest.approx(25.0)
    assert found.amplitudes[0] == pytest.approx(0.3 / 6.0)
    assert found.remainder == pytest.approx(0.3 / np.sqrt(2.0) / 6.0)
    assert found.interval == pytest.approx(0.0, abs=1e-9)


def test_interval_of_the_harmonics_holds_what_noise_does_to_them() -> None:
    random = np.random.default_rng(2)
    clean = 10.0 + 0.5 * np.cos(6.0 * THETA)
    found = [symmetry.harmonics(clean + random.normal(0.0, 0.3, len(THETA))) for _ in range(400)]
    inside = [abs(item.sixth - 0.05) < item.interval for item in found]
    assert 0.92 < np.mean(inside) < 0.98


def test_harmonics_need_whole_sectors() -> None:
    with pytest.raises(ValueError, match="70 headings"):
        symmetry.harmonics(np.ones(70))


def test_speed_is_measured_against_the_direction_of_the_model() -> None:
    def frame(speed: float, residual: float) -> ResidualFrame:
        power, turning = Residual(1.0, 0.5, 4.0), Residual(residual, 0.5, speed, "rad/s")
        return ResidualFrame(2_000_000_000, (*(power,) * 4, *(turning,) * 3, *(power,) * 3))

    for modelled, measured in ((-9.0, -7.0), (9.0, 7.0)):  # slower than commanded by 2 rad/s
        found = simulated.gathered([Step(frames=(frame(modelled, -2.0),))], 1_000_000_000)
        assert found.time == pytest.approx([1.0])
        assert found.speed[0] == pytest.approx([measured] * 3)
        assert found.measured[0] == pytest.approx([5.0, 5.0, 5.0, 15.0, 5.0])


def test_both_power_models_follow_a_short_drive() -> None:
    text = "name: short\nphases: [{pause: 0.5}, {twist: [0.0, 0.4, 0.0], duration: 1.5}]"
    robot = simulated.exact(simulated.reference())
    heard = simulated.driven(parse_mission(text, "short"), robot, 1)
    found = simulated.played(heard, robot)
    assert simulated.scores(found.measured, found.modelled)["motors"]["accuracy"] > 0.97
    time, true = simulated.true_speed(heard)
    assert true[time > 1.5] == pytest.approx(0.4, abs=0.02)
    assert simulated.of_robot(robot, found.speed)[-1] == pytest.approx(0.4, abs=0.02)


def test_change_by_distance_distinguishes_line_from_parabola() -> None:
    distance = np.repeat([0.0, *mass_center.DISTANCES], [1, 12, 12, 12, 12])
    line = mass_center.figures_of(10.0 + 10.0 * distance, 10.0 + 10.0 * distance)
    parabola = mass_center.figures_of(10.0 + 10.0 * distance**2, 10.0 + 10.0 * distance)
    assert line["change_at_8_cm_over_4_cm"] == pytest.approx(2.0)
    assert line["most_change"][-1] == pytest.approx(0.08)
    assert line["accuracy"] == 1.0
    assert parabola["change_at_8_cm_over_4_cm"] == pytest.approx(4.0)


def test_steady_power_does_not_depend_on_the_mass_centre_without_drag() -> None:
    robot = simulated.reference()
    light = evolve(robot, physics={})
    middle, aside = mass_center.Position(0.0, 0.0), mass_center.Position(0.06, 1.0)
    make = InverseDynamics.of
    straight, _ = mass_center._steady(make, middle.of(light))
    assert mass_center._steady(make, aside.of(light))[0] == pytest.approx(straight)


def test_table_2_as_printed_and_the_network_name_the_same_states() -> None:
    pytest.importorskip("torch")
    assert (tables.PRINTED.argmax(axis=1) == tables.TARGETS).all()
    assert tables.PRINTED.sum(axis=1) == pytest.approx(np.ones(6), abs=0.012)
    first, again = (tables.outputs(tables.trained(3), tables.INPUTS) for _ in range(2))
    assert (first.argmax(axis=1) == tables.TARGETS).all()
    assert first.tolist() == again.tolist()


def test_without_torch_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(Missing, match=r"torch is missing: pip install -r requirements-train\.txt"):
        tables.trained(1)


def test_without_recordings_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TOMR_RECORDINGS", str(tmp_path))
    with pytest.raises(Missing, match="robotino is absent: set TOMR_RECORDINGS"):
        real.drives("gray", tmp_path)


def _small(scratch: Path) -> Result:
    """A figure for this test."""
    rows = [("row", "1.0")]
    return Result("small", ("", "W"), rows, {"power_W": [1.0, float("nan")]}, page(1.0, 1.0))


def _missing(scratch: Path) -> Result:
    raise Missing("torch is missing")


def test_command_writes_picture_and_numbers_and_skips_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(experiments, "EXPERIMENTS", {"small": _small, "other": _missing})
    assert run_main(experiments._main, ["all", "--out", str(tmp_path)]) == 0
    assert "other skipped: torch is missing" in capsys.readouterr().out
    assert json.loads((tmp_path / "small.json").read_text())["power_W"] == [1.0, None]
    assert (tmp_path / "small.png").read_bytes().startswith(b"\x89PNG")
    assert run_main(experiments._main, ["other", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "error: torch is missing\n"


def test_command_refuses_an_unknown_figure(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_main(experiments._main, ["fig12", "--out", "."]) == 2
    assert "fig12 is no figure: give some of fig3" in capsys.readouterr().err


def test_every_picture_of_the_document_is_there_and_small() -> None:
    folder = BENCH.parent / "docs"
    text = (folder / "experiments.md").read_text(encoding="utf-8")
    for name in experiments.EXPERIMENTS:
        picture = folder / "figures" / f"{name}.png"
        assert f"figures/{name}.png" in text
        assert picture.stat().st_size < 100_000
