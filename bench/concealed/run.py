"""Run the tool over a folder of cases, each in a process of its own, as a user would."""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from attrs import frozen
from tqdm import tqdm

from tomr_power_model.errors import InputError

TIMES_FILE = "seconds.json"  # in the folder of reports
_REPORT = "report.json"
_DECIDED = (0, 1)  # exit codes of a tool that came to a verdict: match, mismatch
_TIMEOUT = 1800.0  # s


@frozen
class Run:
    """One case explained, or the line that says why not."""

    identity: str
    seconds: float
    error: str | None


def tool(command: str | None) -> list[str]:
    """The command to run: as given, or the `tomr_gap` beside this Python or on the path."""
    if command is not None:
        return command.split()
    beside = Path(sys.executable).with_name("tomr_gap")
    found = str(beside) if beside.exists() else shutil.which("tomr_gap")
    if found is None:
        raise InputError("tomr_gap is not installed: run make setup, or name it with --tool")
    return [found]


def explain(
    command: Sequence[str], case: Path, reports: Path, out: Path, *, with_sim: bool = True
) -> Run:
    """Run the tool on one case; its report goes to REPORTS/<id>.json."""
    target = out / case.name
    arguments = [
        "explain",
        *("--robot", str(case / "robot.yaml")),
        *("--real", str(case / "real")),
        *(("--sim", str(case / "sim")) if with_sim else ()),
        *("--holdout", str(case / "real_holdout")),
        *("--out", str(target)),
    ]
    begin = time.perf_counter()
    try:
        done = subprocess.run(
            [*command, *arguments], capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Run(case.name, time.perf_counter() - begin, str(error))
    seconds = time.perf_counter() - begin
    written = target / _REPORT
    if done.returncode not in _DECIDED or not written.exists():
        lines = (done.stderr or done.stdout).strip().splitlines() or ["said nothing"]
        return Run(case.name, seconds, f"exit code {done.returncode}: {lines[-1]}")
    shutil.copyfile(written, reports / f"{case.name}.json")
    return Run(case.name, seconds, None)


def run_all(
    command: Sequence[str],
    cases: Path,
    reports: Path,
    only: Sequence[str] = (),
    *,
    jobs: int = 1,
    with_sim: bool = True,
) -> list[Run]:
    """Explain every case that has no report yet; as a user who did not simulate without `with_sim`.

    Raises InputError for a folder without cases, or a case that is not there.
    """
    found = sorted(path.parent for path in cases.glob("*/robot.yaml"))
    if not found:
        raise InputError(f"{cases}: holds no cases: give the folder of <id>/robot.yaml")
    missing = set(only) - {case.name for case in found}
    if missing:
        raise InputError(f"{cases}: holds no case {min(missing)}: see its folders")
    reports.mkdir(parents=True, exist_ok=True)
    times_file = reports / TIMES_FILE
    times = read_times(reports)
    todo = [
        case
        for case in found
        if (case.name in only or not only) and not (reports / f"{case.name}.json").exists()
    ]
    runs = []
    with ThreadPoolExecutor(jobs) as pool:
        running = [
            pool.submit(explain, command, case, reports, reports / "details", with_sim=with_sim)
            for case in todo
        ]
        for done in tqdm(as_completed(running), total=len(todo), desc="explaining", unit="case"):
            run = done.result()
            runs.append(run)
            times[run.identity] = round(run.seconds, 2)
            times_file.write_text(json.dumps(times, indent=1) + "\n", encoding="utf-8")
    return runs


def read_times(reports: Path) -> dict[str, float]:
    """Seconds by case, as far as known."""
    path = reports / TIMES_FILE
    if not path.exists():
        return {}
    times: dict[str, float] = json.loads(path.read_text(encoding="utf-8"))
    return times
