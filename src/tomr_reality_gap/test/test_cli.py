"""tomr_gap from the outside: exit codes, files, errors of one line. The core is a stand-in."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from attrs import asdict, evolve

from tomr_power_model.errors import InputError
from tomr_reality_gap.cli import main
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.request import Request

Requests = list[Request]
Answer = Callable[[Explanation | InputError], Requests]


@pytest.fixture
def answer(monkeypatch: pytest.MonkeyPatch) -> Answer:
    """`answer(explanation or error)`: what the core says; returns what it was asked."""

    def stand_in(result: Explanation | InputError) -> Requests:
        asked: Requests = []

        def explain(request: Request, progress: Callable[[str, float], None]) -> Explanation:
            asked.append(request)
            for part in (0.0, 0.5, 1.0):
                progress("fitting", part)
            if isinstance(result, InputError):
                raise result
            return result

        core = ModuleType("tomr_reality_gap.explain")
        core.__dict__.update(explain=explain)
        monkeypatch.setitem(sys.modules, "tomr_reality_gap.explain", core)
        return asked

    return stand_in


@pytest.fixture
def bags(tmp_path: Path) -> Path:
    """A folder with recordings to be named."""
    for name in ("tour1", "tour2", "tour3", "simulated"):
        (tmp_path / name).mkdir()
    return tmp_path


def bare(explanation: Explanation) -> Explanation:
    """Without what takes time to draw."""
    return evolve(explanation, comparisons=(), maps=())


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    """What was printed: one line of error and nothing else."""
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("error: ")
    assert said.err.count("\n") == 1
    return said.err


def test_explain_writes_the_three_files(
    bags: Path, mismatch: Explanation, answer: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = answer(bare(mismatch))
    out = bags / "results" / "gap"
    arguments = ["explain", "--robot", "my.yaml", "--real", f"{bags}/tour1", f"{bags}/tour3"]
    arguments += ["--holdout", f"{bags}/tour2", "--sim", f"{bags}/simulated"]
    arguments += ["--tolerance", "0.01", "--tolerance", "robot.mass=0.05"]
    arguments += ["--skip", "tour2=8:14.5"]
    assert main([*arguments, "--out", str(out)]) == 0
    assert asdict(asked[0]) == {
        "robot": "my.yaml",
        "real": (bags / "tour1", bags / "tour3"),
        "sim": bags / "simulated",
        "holdout": (bags / "tour2",),
        "tolerance": 0.01,
        "tolerances": {"robot.mass": 0.05},
        "skips": {"tour2": [(8.0, 14.5)]},
    }
    assert {path.name for path in out.iterdir()} == {
        "report.json",
        "report.html",
        "robot_explained.yaml",
    }
    assert json.loads((out / "report.json").read_text())["verdict"] == "mismatch"
    assert (out / "robot_explained.yaml").read_text() == mismatch.explained
    said = capsys.readouterr()
    assert mismatch.sentence in said.out
    assert "0.0410 ± 0.0039 N m" in said.out
    assert "friction.coulomb" in said.out
    assert "note: the gyro" in said.out
    assert said.err == ""


def test_explained_description_of_an_earlier_run_does_not_stay(
    bags: Path, mismatch: Explanation, match: Explanation, answer: Answer
) -> None:
    arguments = ["explain", "--robot", "my.yaml", "--real", f"{bags}/tour1", "--out", f"{bags}/gap"]
    answer(bare(mismatch))
    main(arguments)
    answer(bare(match))
    assert main(arguments) == 0
    assert not (bags / "gap" / "robot_explained.yaml").exists()


def test_suggested_drive_is_written_if_there_is_one(
    bags: Path, mismatch: Explanation, answer: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["explain", "--robot", "my.yaml", "--real", f"{bags}/tour1", "--out", f"{bags}/gap"]
    arguments += ["--suggest", f"{bags}/next.yaml"]
    answer(evolve(bare(mismatch), suggested=""))
    assert main(arguments) == 0
    assert not (bags / "next.yaml").exists()
    assert "next.yaml is not written" in capsys.readouterr().out
    answer(bare(mismatch))
    assert main(arguments) == 0
    assert (bags / "next.yaml").read_text() == mismatch.suggested


@pytest.mark.parametrize(("verdict", "code"), [("match", 0), ("mismatch", 1)])
def test_check_answers_by_its_exit_code(
    verdict: str,
    code: int,
    bags: Path,
    request: pytest.FixtureRequest,
    answer: Answer,
    capsys: pytest.CaptureFixture[str],
) -> None:
    explanation = request.getfixturevalue(verdict)
    answer(explanation)
    arguments = ["check", "--robot", "my.yaml", "--real", f"{bags}/tour1"]
    assert main(arguments) == code
    assert capsys.readouterr().out.startswith(f"{verdict}: {explanation.sentence}")
    assert main([*arguments, "--quiet"]) == code
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["explain", "check"])
def test_bad_recording_is_one_line_and_exit_code_2(
    command: str, bags: Path, answer: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(InputError("tour1: 4 s of motion: record a minute at least"))
    arguments = [command, "--robot", "my.yaml", "--real", f"{bags}/tour1"]
    assert main(arguments + ["--out", f"{bags}/gap"] * (command == "explain")) == 2
    assert "4 s of motion" in one_line(capsys)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--real", "tour9"], "--real tour9: no such recording"),
        (["--real", "tour1", "--sim", "sim9"], "--sim sim9: no such recording"),
        (["--real", "tour1", "--holdout", "tour2/../tour1"], "given as --real, too"),
        (["--real", "tour1", "--tolerance", "much"], "--tolerance much: give REL or KEY=REL"),
        (["--real", "tour1", "--tolerance", "-0.1"], "a share from 0"),
        (["--real", "tour1", "--tolerance", "robot.mass=2"], "a share from 0"),
        (["--real", "tour1", "--tolerance", "0.1", "--tolerance", "0.2"], "given twice"),
        (["--real", "tour1", "--skip", "tour9=1:2"], "no recording tour9: tour1 are given"),
        (["--real", "tour1", "--skip", "tour1=late"], "give BAG=FROM:TO in seconds"),
    ],
)
def test_what_cannot_be_meant_is_one_line_and_exit_code_2(
    arguments: list[str],
    said: str,
    bags: Path,
    answer: Answer,
    match: Explanation,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(bags)
    asked = answer(match)
    assert main(["check", "--robot", "my.yaml", *arguments]) == 2
    assert said in one_line(capsys)
    assert asked == []


def test_results_that_cannot_be_written_are_reported(
    bags: Path, match: Explanation, answer: Answer, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(match)
    (bags / "file").write_text("")
    given = ["explain", "--robot", "my.yaml", "--real", f"{bags}/tour1", "--out", f"{bags}/file"]
    assert main(given) == 2
    assert "no folder can be made there" in one_line(capsys)
    given[-1] = f"{bags}/gap"
    assert main([*given, "--suggest", f"{bags}/no/next.yaml"]) == 2
    assert "make it first" in one_line(capsys)


@pytest.mark.parametrize("command", ["explain", "check", "fleet"])
def test_help_teaches_by_examples(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    assert f"tomr_gap {command} " in said
    assert "exit codes:" in said
