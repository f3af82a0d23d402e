"""The command line of the comparison."""

import argparse
import json
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path

import attrs
from concealed.claims import Truth, read_truths
from concealed.run import run_all, tool
from rich.console import Console
from tqdm import tqdm

from others import tables
from others.case import read_case
from others.compare import Row, row_of
from others.refit import Fit, Refit, refit
from others.sparse import Equation, Sparse, pysindy, regress
from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK
from tomr_power_model.errors import InputError

_DESCRIPTION = """\
A plain refit (the way of MuJoCo sysid), sparse regression (PySINDy) and tomr_gap on the same
recordings with concealed physics: what each reports, its error on a drive of another regime, and
what of its claims is not so. Needs bench/others/requirements.txt. Works on the recordings
`concealed` (the default, under $TOMR_RECORDINGS) and on what bench/concealed.py makes."""
_EPILOG = """\
Some two minutes per case and core. What OUT holds already is kept, so an interrupted run goes on.
Exit codes: 0 done, 1 a case failed, 2 bad input."""


def _parser() -> argparse.ArgumentParser:
    root = Path(os.environ.get("TOMR_RECORDINGS", "../shared/recordings")) / "concealed"
    parser = argparse.ArgumentParser(
        prog="others.py",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    text = "folder of <id>/robot.yaml, sim, real, real_holdout"
    add("cases", type=Path, nargs="?", default=root / "cases", metavar="CASES", help=text)
    text = "folder of <id>.json"
    add("truth", type=Path, nargs="?", default=root / "truth", metavar="TRUTH", help=text)
    text = "reports <id>.json of tomr_gap; it runs where one is missing (default OUT/reports)"
    add("--reports", type=Path, metavar="DIR", help=text)
    add("--out", type=Path, required=True, help="answers, others.json and others.png go here")
    add("--only", nargs="+", default=[], metavar="ID", help="these cases")
    add("--jobs", type=int, default=1, help="cases at a time (default 1)")
    return parser


def main(arguments: Sequence[str] | None) -> int:
    """Compare the methods on a folder of cases."""
    options = _parser().parse_args(arguments)
    pysindy()
    truths = _chosen(options)
    names = [truth.identity for truth in truths]
    reports = options.reports or options.out / "reports"
    failed = []
    if any(not (reports / f"{name}.json").exists() for name in names):
        runs = run_all(tool(None), options.cases, reports, names, jobs=options.jobs)
        failed = [f"{run.identity}: tomr_gap: {run.error}" for run in runs if run.error]
    failed += _answer_all([options.cases / name for name in names], options.out, options.jobs)
    for line in failed:
        print(f"failed: {line}")
    answered = [truth for truth in truths if _file(options.out, truth.identity).exists()]
    rows = [_row(truth, options.out, reports) for truth in answered]
    if rows:
        tables.show(Console(width=200, highlight=False), rows)
        tables.draw(rows, options.out / "others.png")
        document = {"totals": tables.totals(rows), "cases": [attrs.asdict(row) for row in rows]}
        (options.out / "others.json").write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    return EXIT_MISMATCH if failed else EXIT_OK


def _chosen(options: argparse.Namespace) -> list[Truth]:
    if not options.cases.is_dir():
        raise InputError(f"{options.cases} is absent: set TOMR_RECORDINGS, or give CASES TRUTH")
    present = {path.parent.name for path in options.cases.glob("*/robot.yaml")}
    truths = [truth for truth in read_truths(options.truth) if truth.identity in present]
    missing = set(options.only) - {truth.identity for truth in truths}
    if missing or not truths:
        wanted = min(missing, default="that has a truth")
        raise InputError(f"{options.cases}: holds no case {wanted}: see its folders")
    return [truth for truth in truths if truth.identity in options.only or not options.only]


def _file(out: Path, identity: str) -> Path:
    return out / "answers" / f"{identity}.json"


def _answer_all(cases: Sequence[Path], out: Path, jobs: int) -> list[str]:
    """Let the other methods answer what has no answer yet; returns what failed."""
    (out / "answers").mkdir(parents=True, exist_ok=True)
    todo = [case for case in cases if not _file(out, case.name).exists()]
    failed = []
    with ProcessPoolExecutor(jobs) as pool:
        running = {pool.submit(partial(_answer, out=out), case): case for case in todo}
        bar = tqdm(as_completed(running), total=len(todo), desc="refit, PySINDy", unit="case")
        for done in bar:
            try:
                done.result()
            except InputError as error:
                failed.append(f"{running[done].name}: {error}")
    return failed


def _answer(folder: Path, out: Path) -> None:
    case = read_case(folder)
    document = {"refit": attrs.asdict(refit(case)), "sparse": attrs.asdict(regress(case))}
    _file(out, folder.name).write_text(json.dumps(document, indent=1) + "\n", "utf-8")


def _row(truth: Truth, out: Path, reports: Path) -> Row:
    answer = json.loads(_file(out, truth.identity).read_text("utf-8"))
    fits = tuple(Fit(**item) for item in answer["refit"].pop("fits"))
    equations = tuple(Equation(**item) for item in answer["sparse"].pop("equations"))
    refitted, regressed = Refit(fits, **answer["refit"]), Sparse(equations, **answer["sparse"])
    return row_of(truth, refitted, regressed, reports)
