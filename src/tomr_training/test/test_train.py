"""The command `tomr_train`; the fit, which needs torch, is replaced."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest

from tomr_training.train import Trained, main


@pytest.fixture(autouse=True)
def fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit that is done at once."""
    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(__version__="none"))
    monkeypatch.setattr("tomr_training.planar.generate.generate", lambda seeds: ())
    found = Trained({"bias": np.ones(3)}, {"epochs": 1}, np.eye(7, dtype=np.int64))
    monkeypatch.setitem(vars(sys.modules[main.__module__])["_KINDS"], "window", lambda *_: found)


def test_weights_and_their_provenance_are_written_together(tmp_path: Path) -> None:
    weights = tmp_path / "new" / "window.npz"
    assert main(["--out", str(weights)]) == 0
    with np.load(weights) as held:
        assert held["bias"].dtype == np.float32
    written = json.loads(weights.with_suffix(".json").read_text())
    assert written["validation"]["accuracy"] == 1.0
    drives = written["drives"]
    assert drives["training_seeds"] == [
        [10_000_000, 10_007_199],
        [40_000_000, 40_007_199],
        [50_000_000, 50_007_199],
    ]
    assert drives["validation_seeds"] == [50_007_200, 50_007_399]


def test_of_weights_and_provenance_both_are_new_or_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    weights = tmp_path / "window.npz"
    weights.write_bytes(b"older")
    weights.with_suffix(".json").mkdir()
    assert main(["--out", str(weights)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert weights.read_bytes() == b"older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["window.json", "window.npz"]


@pytest.mark.parametrize("out", ["window.json", "window"])
def test_bad_name_is_refused_before_hours_of_training(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], out: str
) -> None:
    with patch("tomr_training.planar.generate.generate") as generate:
        assert main(["--out", str(tmp_path / out)]) == 2
    assert not generate.called
    assert "ends in .npz" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "part"),
    [
        (["--classifier", "wang2024", "--first-seed", "1", "9000"], "one network"),
        (["--first-seed", "9000", "1700"], "overlap"),
    ],
)
def test_networks_have_drives_of_their_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], part: str
) -> None:
    assert main(["--out", str(tmp_path / "window.npz"), *more]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert part in line
