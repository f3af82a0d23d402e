"""Results of steps, kept so that a rerun with the same inputs skips what is done."""

import hashlib
import json
from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from attrs import fields, frozen

from tomr_commission.observed import Observed
from tomr_power_model.errors import InputError
from tomr_power_model.files.arrays import DAMAGED
from tomr_power_model.files.write import make_folder, write_bytes, write_text

_FORMAT = 3  # of the kept files: a change makes all of them anew


def digest(parts: Iterable[str]) -> str:
    """A short name of some inputs: equal if and only if they are."""
    made = hashlib.sha256(str(_FORMAT).encode())
    for part in parts:
        made.update(b"\0" + part.encode())
    return made.hexdigest()[:16]


def fingerprint(bag: Path) -> str:
    """A short name of what a recording holds. Raises InputError where it cannot be read."""
    if not bag.exists():
        raise InputError(f"{bag}: no such recording: give a folder or file of a bag")
    made = hashlib.sha256()
    try:
        for path in sorted(bag.rglob("*")) if bag.is_dir() else [bag]:
            if path.is_file():
                made.update(path.name.encode())
                made.update(path.read_bytes())
    except OSError as error:
        raise InputError(f"{bag}: cannot be read ({error.strerror}): mend its rights") from None
    return made.hexdigest()[:16]


@frozen
class Store:
    """A folder of results, each with the digest of what it was made of."""

    folder: Path

    def values(self, name: str, key: str, make: Callable[[], Any]) -> Any:
        """A JSON value: that of an earlier run on the same inputs, else made and kept."""
        path = self.folder / f"{name}.json"
        try:
            held = json.loads(path.read_text(encoding="utf-8"))
            if held["key"] == key:
                return held["value"]
        except (OSError, ValueError, KeyError, TypeError):
            pass  # absent, of another format or cut off: make it
        value = make()
        make_folder(self.folder)
        write_text(path, json.dumps({"key": key, "value": value}, indent=1))
        return json.loads(json.dumps(value))

    def observed(self, name: str, key: str) -> Observed | None:
        """A drive of an earlier run on the same inputs, if there is one."""
        try:
            with np.load(self._drive(name), allow_pickle=False) as held:
                if str(held["key"]) != key:
                    return None
                rest = {item.name: held[item.name] for item in fields(Observed)[1:]}
                return Observed(str(held["name"]), **rest)
        except DAMAGED:
            return None

    def keep(self, name: str, key: str, drive: Observed) -> None:
        """Keep a drive."""
        values = {item.name: getattr(drive, item.name) for item in fields(Observed)}
        data = BytesIO()
        np.savez_compressed(data, key=key, **values)
        make_folder(self.folder)
        write_bytes(self._drive(name), data.getvalue())

    def _drive(self, name: str) -> Path:
        return self.folder / f"{name}.npz"
