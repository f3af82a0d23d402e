"""Where the recordings of `faults_practice` lie, and what is true of each."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from attrs import frozen

from tomr_power_model.errors import InputError

_SET = "faults_practice"


@frozen
class Drive:
    """One recording and the part of its truth that is needed here."""

    identity: str
    bag: Path
    is_normal: bool  # nothing goes wrong in it, from start to end
    bumps_ns: tuple[int, ...]  # stamps at which something pushes it
    severity: tuple[str, float] | None = None  # quantity and value, where it is a number


@frozen
class Recordings:
    """The recordings of one robot."""

    folder: Path  # of the whole set
    robot: str  # id of the robot

    @classmethod
    def find(cls, robot: str = "practice") -> Self:
        """The set under TOMR_RECORDINGS. Raises InputError if it is absent."""
        folder = Path(os.environ.get("TOMR_RECORDINGS", "../shared/recordings")) / _SET
        if not (folder / "faults" / robot).is_dir():
            raise InputError(
                f"{folder / 'faults' / robot} is absent: set TOMR_RECORDINGS to the folder that "
                f"holds {_SET}"
            )
        return cls(folder, robot)

    @property
    def description(self) -> Path:
        """What the robot's owner believes."""
        return self.folder / "faults" / self.robot / "robot.yaml"

    @property
    def truth(self) -> Path:
        """Folder of <robot>/<id>.json."""
        return self.folder / "faults_truth"

    @property
    def scorer(self) -> Path:
        """The program that scores a diagnosis."""
        return self.folder / "score_faults.py"

    def drives(self, kind: str) -> tuple[Drive, ...]:
        """All of a kind (`healthy`, `healthy_long`, `drives`) in the order of their ids."""
        found = []
        for bag in sorted((self.folder / "faults" / self.robot / kind).iterdir()):
            truth = _json(self.truth / self.robot / f"{bag.name}.json")
            is_normal = truth["onset"] is None and truth["extended"] == "none"
            start = int(truth["t0_ns"])
            bumps = [start + round(1e9 * bump["t"]) for bump in truth.get("bumps") or ()]
            size = truth.get("severity") or {}
            has_size = isinstance(size.get("value"), float)
            severity = (size["quantity"], size["value"]) if has_size else None
            found.append(Drive(bag.name, bag, is_normal, tuple(bumps), severity))
        return tuple(found)

    def fault(self, identity: str) -> tuple[str, int | None]:
        """What is wrong in a drive, and with which wheel (1 to 3; None: no single one)."""
        truth = _json(self.truth / self.robot / f"{identity}.json")
        extended = truth["extended"]
        return truth["state"] if extended == "none" else extended, truth["wheel"]

    def real(self) -> Mapping[str, Any]:
        """The robot as it is: `nominal`, `deviations`, `effects`, `heating`, `sensors`."""
        return _json(self.truth / self.robot / "robot" / "real.json")


def _json(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}): copy the set anew") from None
    return found
