"""A small campaign of hostile input: see bench/attack.py."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_hostile_input_is_answered_as_promised(tmp_path: Path) -> None:
    run = subprocess.run(
        [
            *(sys.executable, ROOT / "bench" / "attack.py", "--out", tmp_path),
            *("--seconds", "30", "--tries", "60", "--seed", "7"),
        ],
        capture_output=True,
        text=True,
        timeout=170,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "| all |" in run.stdout
