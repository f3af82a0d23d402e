"""Hostile input for every command: what it answers, how long it takes, what it names.

    python bench/attack.py --tries 20000 --out attack     the whole campaign, resumed where it was
    python bench/attack.py --seconds 45 --out attack      as much as fits
    python bench/attack.py --only stamps --tries 300 --out attack
    python bench/attack.py --again 1234 --out attack      one try again, its files kept

Try n of seed s is always the same, whatever ran before. Each runs in a process of its own; it must
end within 60 s and 2 GB, with the code and the one line that its help promises, name no fault that
the recording does not hold, and leave whole files or none.

Exit codes: 0 all tries did; 1 some did not, the table says which; 2 bad input.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from compileall import compile_dir
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "OFF"  # nodes of tries are alone
sys.path.insert(0, str(ROOT / "test"))  # mcap_records

from attack import live, recordings, stores, texts  # noqa: E402 the package beside this file
from attack.case import GENERATORS, HEALTHY, Base, read_base  # noqa: E402
from attack.judge import load_tools, run  # noqa: E402

from tomr_power_model.cli import EXIT_MISMATCH, EXIT_OK, run_main  # noqa: E402
from tomr_power_model.errors import InputError, one_line  # noqa: E402
from tomr_power_model.files import make_folder  # noqa: E402

KINDS = (live, recordings, stores, texts)  # they register their attacks


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--tries", type=int, default=1_000_000, help="up to this number")
    add("--seconds", type=float, default=1e9, help="stop after these")
    add("--seed", type=int, default=1)
    add("--part", default="0/1", metavar="I/N", help="only every N-th try, for several processes")
    add("--only", default="", metavar="KIND", help="attacks whose name holds this")
    add("--again", type=int, metavar="N", help="run one try and keep its files")
    add("--out", type=Path, required=True, metavar="DIR", help="tries.jsonl goes here")
    return parser


@cache
def _tree() -> str:
    """The commit that is attacked."""
    command = ("git", "-C", str(ROOT), "describe", "--always", "--dirty", "--exclude=*")
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):  # an unpacked archive
        return "unknown"


def _once(number: int, seed: int, only: str, base: Base, folder: Path) -> dict[str, Any]:
    dice = random.Random(f"{seed}:{number}:{only}")
    kind = dice.choice([name for name in sorted(GENERATORS) if only in name])
    given, outcome = run(lambda: GENERATORS[kind](dice, folder, base), folder)
    return {
        "number": number,
        "seed": seed,
        "tree": _tree(),
        "kind": kind,
        "tool": given.tool if given else "",
        "what": one_line(given.what) if given else "",
        "code": outcome.code,
        "seconds": round(outcome.seconds, 2),
        "cpu": round(outcome.cpu, 3),
        "memory": outcome.memory,
        "problem": outcome.problem,
        "line": one_line(outcome.line),
    }


def _table(rows: Sequence[dict[str, Any]]) -> str:
    lines = [
        "| attack | tries | answered | refused | ended | problems | CPU of one, s | longest, s "
        "| most, MB |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    kinds = [*sorted({row["kind"] for row in rows}), ""]
    for kind in kinds:
        mine = [row for row in rows if kind in ("", row["kind"])]
        problems = Counter(row["problem"].partition(" (")[0] for row in mine if row["problem"])
        lines.append(
            f"| {kind or 'all'} | {len(mine)} | {sum(row['code'] in (0, 1) for row in mine)} "
            f"| {sum(row['code'] in (2, 3) for row in mine)} "
            f"| {sum(row['code'] not in (0, 1, 2, 3) for row in mine)} "
            f"| {', '.join(f'{count} {name}' for name, count in problems.most_common()) or '-'} "
            f"| {sum(row['cpu'] for row in mine) / len(mine):.2f} "
            f"| {max(row['seconds'] for row in mine):.0f} "
            f"| {max(row['memory'] for row in mine) // 1000} |"
        )
    return "\n".join(lines)


def _main(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    part, _, parts = options.part.partition("/")
    if not (part.isdigit() and parts.isdigit() and int(part) < int(parts)):
        raise InputError(f"--part {options.part}: give I/N, e.g. 0/2")
    if not any(options.only in name for name in GENERATORS):
        raise InputError(f"--only {options.only}: the attacks are {', '.join(sorted(GENERATORS))}")
    make_folder(options.out)
    compile_dir(ROOT / "src", quiet=1)  # a full disk is to cut short what commands write
    base = read_base()
    load_tools(HEALTHY)
    if options.again is not None:
        folder = options.out.resolve() / f"try_{options.again}"  # tries run elsewhere
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        print(json.dumps(_once(options.again, options.seed, options.only, base, folder), indent=1))
        print((folder / "stderr").read_text("utf-8", "replace"), end="")
        return EXIT_OK
    log = options.out / "tries.jsonl"
    rows = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    done = {row["number"] for row in rows if row["seed"] == options.seed}
    begun = time.monotonic()
    with log.open("a", buffering=1) as file:
        for number in range(int(part), options.tries, int(parts)):
            if time.monotonic() - begun > options.seconds:
                break
            if number in done:
                continue
            with TemporaryDirectory(prefix="attack-") as folder:
                row = _once(number, options.seed, options.only, base, Path(folder))
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            if row["problem"]:
                print(f"{number}: {row['kind']}: {row['what']}: {row['tool']}: {row['problem']}")
                print(f"    {row['line']}", flush=True)
    print(_table(rows))
    return EXIT_MISMATCH if any(row["problem"] for row in rows) else EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
