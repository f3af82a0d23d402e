"""The offline diagnosis of all drives, scored by the set's own program."""

import json
import subprocess
import sys
from pathlib import Path

from faults.play import play_all
from faults.recordings import Recordings
from tomr_power_model.errors import InputError

SCORE = "score.json"


def diagnose(recordings: Recordings, robot: Path, out: Path) -> str:
    """Diagnose faulty drives and the long healthy one; the score's table.

    Writes out/<robot id>/<drive>.json and the score as numbers.
    """
    drives = (*recordings.drives("drives"), *recordings.drives("healthy_long"))
    played = play_all([drive.bag for drive in drives], robot)
    folder = out / recordings.robot
    folder.mkdir(parents=True, exist_ok=True)
    for drive in drives:
        text = json.dumps(played[drive.bag].changes)
        (folder / f"{drive.identity}.json").write_text(text + "\n", encoding="utf-8")
    paths = [recordings.scorer, out, recordings.truth]
    command = [sys.executable, *map(str, paths), "--json", str(out / SCORE)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["it said nothing"]
        raise InputError(f"{recordings.scorer} ended with {done.returncode}: {lines[-1]}")
    return done.stdout
