"""Many cases at a time: which they are, one report each, one overview, on Dask if it is there."""

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path

import pytest
from attrs import evolve

from tomr_power_model.errors import InputError
from tomr_reality_gap.cli import main
from tomr_reality_gap.explanation import Explanation, Score
from tomr_reality_gap.fleet import scheduler
from tomr_reality_gap.fleet.cases import Case, Defaults, cases_of
from tomr_reality_gap.fleet.outcome import BAD_INPUT, FAILED, Outcome, outcome_of
from tomr_reality_gap.fleet.overview import in_order, overview_page

ALIKE = Defaults(robot=None, tolerance=0.02, tolerances={})


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    """Three cases; `b` has nothing but what is needed, `c` a second recording."""
    for name in ("a", "b", "c"):
        (tmp_path / name / "real").mkdir(parents=True)
        (tmp_path / name / "robot.yaml").touch()
    for name in ("a/sim", "a/real_holdout", "c/real_2"):
        (tmp_path / name).mkdir()
    (tmp_path / "truth").mkdir()
    return tmp_path


def test_cases_are_the_folders_with_a_recording(cases: Path) -> None:
    a, b, c = cases_of([cases], ALIKE)
    assert [case.name for case in (a, b, c)] == ["a", "b", "c"]
    assert a.inputs.robot == str(cases / "a" / "robot.yaml")
    assert a.inputs.real == (cases / "a" / "real",)
    assert a.inputs.sim == cases / "a" / "sim"
    assert a.inputs.holdout == (cases / "a" / "real_holdout",)
    assert (b.inputs.sim, b.inputs.holdout) == (None, ())
    assert c.inputs.real == (cases / "c" / "real", cases / "c" / "real_2")


def test_cases_may_be_given_one_by_one_and_share_a_description(cases: Path) -> None:
    (cases / "b" / "robot.yaml").unlink()
    found = cases_of([cases / "b", cases / "c"], evolve(ALIKE, robot="shared.yaml"))
    assert [case.inputs.robot for case in found] == ["shared.yaml", str(cases / "c/robot.yaml")]


def test_cases_of_one_name_are_distinguished_by_their_folder(cases: Path, tmp_path: Path) -> None:
    (tmp_path / "monday" / "a" / "real").mkdir(parents=True)
    found = cases_of([cases / "a", tmp_path / "monday"], evolve(ALIKE, robot="shared.yaml"))
    assert [case.name for case in found] == [f"{tmp_path.name}_a", "monday_a"]
    with pytest.raises(InputError, match="two cases have this name"):
        cases_of([cases / "a", cases / "a"], ALIKE)


def test_folder_without_cases_is_refused(cases: Path) -> None:
    with pytest.raises(InputError, match="no case in it"):
        cases_of([cases / "truth"], ALIKE)
    with pytest.raises(InputError, match="no such folder"):
        cases_of([cases / "none"], ALIKE)
    (cases / "b" / "robot.yaml").unlink()
    with pytest.raises(InputError, match="give --robot for all"):
        cases_of([cases], ALIKE)


@pytest.fixture
def results(mismatch: Explanation, match: Explanation) -> list[Outcome]:
    """One of each kind, the best first."""
    texts = {"report.json": "{}", "report.html": "<p>", "robot_explained.yaml": "x"}
    worse = evolve(mismatch, score=Score(0.9, 0.1, 0.3, 0.9))
    return [
        outcome_of("c", match, {"report.json": "{}", "report.html": "<p>"}, 3.0),
        outcome_of("b", mismatch, texts, 2.0),
        outcome_of("a", worse, texts, 1.0),
        Outcome("d", BAD_INPUT, "d/real: 4 s of motion", 0.1),
        Outcome("e", FAILED, "MemoryError: <none> left", 0.0),
    ]


class Links(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.rows: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append("")
        self.links += [value or "" for key, value in attrs if key in ("href", "src")]

    def handle_data(self, data: str) -> None:
        if self.rows:
            self.rows[-1] += " ".join(data.replace("\N{NO-BREAK SPACE}", " ").split()) + " "


def test_overview_begins_with_what_needs_to_be_seen(results: list[Outcome]) -> None:
    assert [item.name for item in in_order(results)] == ["e", "d", "a", "b", "c"]
    page = Links(overview_page(results))
    assert page.links == [f"{name}/report.html" for name in ("a", "b", "c", "a", "b")]
    assert "MemoryError: <none> left" in page.rows[1]
    assert "4 s of motion" in page.rows[2]
    assert "Stribeck friction, wheel_2_joint" in page.rows[3]
    assert "0.9 → 0.1" in page.rows[3]
    assert "agree within noise" in page.rows[5]
    assert "friction.stribeck 2 a , b" in page.rows[-1]


def test_effects_are_ordered_by_how_many_robots_have_them(results: list[Outcome]) -> None:
    """One has a payload besides, which comes first by its name; the friction does by its number."""
    (found,) = results[2].findings
    results[2] = evolve(results[2], findings=(evolve(found, effect="body.payload_mass"), found))
    rows = Links(overview_page(results)).rows
    assert [row.split()[-3:] for row in rows[-1:]] == [["body.payload_mass", "1", "a"]]
    assert "friction.stribeck 2 a , b" in rows[-2]


def test_fleet_writes_reports_and_overview_and_reports_bad_input(
    cases: Path,
    results: list[Outcome],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def outcomes(
        work: Callable[[Case], Outcome], given: Sequence[Case], address: str
    ) -> Iterator[Outcome]:
        assert [case.name for case in given] == ["a", "b", "c"]
        assert address == "tcp://cluster:8786"
        yield from results

    monkeypatch.setattr(scheduler, "outcomes", outcomes)
    out = cases / "gaps"
    given = ["fleet", str(cases), "--out", str(out), "--scheduler", "tcp://cluster:8786"]
    assert main(given) == 2
    assert (out / "a" / "robot_explained.yaml").read_text() == "x"
    assert {path.name for path in (out / "c").iterdir()} == {"report.json", "report.html"}
    overview = json.loads((out / "overview.json").read_text())
    assert overview["a"]["holdout"] == {"nrmse_before": 0.9, "nrmse_after": 0.1}
    assert overview["a"]["unexplained_share"] == 0.06
    assert overview["a"]["findings"][0]["where"] == ["wheel_2_joint"]
    assert overview["d"]["verdict"] == "bad input"
    said = capsys.readouterr()
    assert said.out.startswith("5 cases: 1 failed, 1 bad input, 2 mismatch, 1 match\n")
    assert "error: d: d/real: 4 s of motion\n" in said.err
    del results[3:]
    assert main([*given, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_missing_dask_is_one_line(
    cases: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["fleet", str(cases), "--out", str(cases / "gaps")]) == 2
    said = capsys.readouterr()
    assert said.err == (
        "error: tomr_gap fleet needs Dask: pip install distributed, or -r requirements-fleet.txt\n"
    )


def test_cases_run_on_dask_and_one_that_fails_stops_no_other(cases: Path) -> None:
    pytest.importorskip("distributed")
    from distributed import LocalCluster

    def work(case: Case) -> Outcome:  # a nested function travels to the workers by value
        if case.name == "b":
            raise MemoryError("none\nleft")
        return Outcome(case.name, "match", case.inputs.real[0].name, 1.0)

    with LocalCluster(n_workers=1, processes=False, dashboard_address=None) as cluster:
        found = {
            item.name: item
            for item in scheduler.outcomes(
                work, cases_of([cases], ALIKE), cluster.scheduler_address
            )
        }
    assert set(found) == {"a", "b", "c"}
    assert (found["a"].verdict, found["a"].sentence) == ("match", "real")
    assert found["b"].verdict == FAILED
    assert found["b"].sentence.startswith("MemoryError: none left (test_fleet.py:")


def test_scheduler_that_does_not_answer_is_one_line(
    cases: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(scheduler, "_ANSWERS_WITHIN", "0.2 s")
    given = ["fleet", str(cases), "--out", str(cases / "gaps"), "--scheduler", "tcp://127.0.0.1:9"]
    assert main(given) == 2
    assert "no Dask scheduler answers there" in capsys.readouterr().err
