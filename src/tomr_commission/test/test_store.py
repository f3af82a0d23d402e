"""Results of steps are kept whole, and taken again for the same inputs only."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tomr_commission.observed import Observed
from tomr_commission.store import Store, digest, fingerprint


def test_same_inputs_are_not_made_again(tmp_path: Path) -> None:
    store, made = Store(tmp_path), []

    def make() -> list[float]:
        made.append(1)
        return [1.5, 2.5]

    assert [store.values("step", key, make) for key in ("a", "a", "b", "b")] == [[1.5, 2.5]] * 4
    assert len(made) == 2


def test_file_cut_off_is_made_again(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.values("step", "a", lambda: 1)
    path = tmp_path / "step.json"
    path.write_text(path.read_text()[:-5])
    assert store.values("step", "a", lambda: 2) == 2


def test_drive_comes_back_as_it_was(tmp_path: Path, steady: Callable[..., Observed]) -> None:
    store, drive = Store(tmp_path), steady(ticks=50)
    store.keep("drive", "a", drive)
    held = store.observed("drive", "a")
    assert held is not None
    assert held.name == drive.name
    assert np.array_equal(held.residual, drive.residual)
    assert store.observed("drive", "b") is None
    whole = (tmp_path / "drive.npz").read_bytes()
    for damaged in (b"PK", whole[:-40], whole[:300] + b"\xff" * 50 + whole[350:]):
        (tmp_path / "drive.npz").write_bytes(damaged)
        assert store.observed("drive", "a") is None


def test_digest_and_fingerprint_distinguish_inputs(tmp_path: Path) -> None:
    assert digest(["ab", "c"]) != digest(["a", "bc"])
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "data").write_bytes(b"1")
    before = fingerprint(bag)
    (bag / "data").write_bytes(b"2")
    assert fingerprint(bag) != before
