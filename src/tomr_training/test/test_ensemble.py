"""Networks that decide together."""

import json
import sys
from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import frozen

from tomr_fault_diag.classifier.belief import HYPOTHESES
from tomr_fault_diag.classifier.features import CHANNELS, INPUTS, WINDOW
from tomr_fault_diag.classifier.window_network import VIEWS, WindowNetwork
from tomr_training import train
from tomr_training.ensemble import mean_of


def _network(random: np.random.Generator, first: int, second: int) -> WindowNetwork:
    shapes = (first, INPUTS), first, (second, first), second, (VIEWS, second), VIEWS
    prior = random.random(HYPOTHESES)
    return WindowNetwork(*(random.normal(size=shape) for shape in shapes), prior / prior.sum())


def test_scores_and_likelihoods_are_the_mean_of_what_each_says() -> None:
    random = np.random.default_rng(0)
    members = [_network(random, 4, 3), _network(random, 2, 5), _network(random, 3, 2)]
    together, windows = mean_of(members), random.normal(size=(7, WINDOW, CHANNELS))
    each = [one.scores_of(windows) for one in members]
    np.testing.assert_allclose(together.scores_of(windows), np.mean(each, axis=0))
    over_prior = [scores - np.log(one.prior) for scores, one in zip(each, members, strict=True)]
    found = together.scores_of(windows) - np.log(together.prior)
    np.testing.assert_allclose(found, np.mean(over_prior, axis=0))


def test_one_network_alone_is_itself() -> None:
    network = _network(np.random.default_rng(1), 4, 3)
    windows = np.random.default_rng(2).normal(size=(2, WINDOW, CHANNELS))
    np.testing.assert_allclose(mean_of([network]).scores_of(windows), network.scores_of(windows))


@frozen
class Recipe:
    """As much of it as is asked for."""

    epochs: int = 1
    healthy: float = 1.0
    faulty: float = 1.0


class Examples:
    """One window of one drive."""

    def __init__(self, drives: str, _: Recipe) -> None:
        self.drives, self.label = drives, np.zeros(1, dtype=np.int64)

    def __len__(self) -> int:
        return 1

    def windows(self, rows: np.ndarray) -> np.ndarray:
        return np.zeros((len(rows), WINDOW, CHANNELS))


def test_each_network_has_drives_of_its_own_and_their_mean_is_stored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    random = np.random.default_rng(3)
    fitted = {drives: _network(random, 4, 3) for drives in ("one", "another")}
    stub = SimpleNamespace(
        WindowRecipe=Recipe,
        examples_of=Examples,
        fit_window=lambda examples, recipe, progress: fitted[examples.drives],
        check_windows=lambda examples: examples.windows(np.arange(1)),
        torch_scores=lambda network, windows: network.scores_of(windows),
    )
    monkeypatch.setitem(sys.modules, "tomr_training.fit_window", stub)
    trained = train._window(SimpleNamespace(epochs=None), iter(fitted), "unseen")  # type: ignore[arg-type]
    for name, array in trained.arrays.items():
        np.testing.assert_array_equal(array, getattr(mean_of([*fitted.values()]), name))
    assert trained.provenance["training_ticks"] == [1, 1]


def test_the_shipped_networks_are_those_of_the_default_seeds() -> None:
    shipped = files("tomr_fault_diag").joinpath("weights").joinpath("window.json")
    written = json.loads(shipped.read_text())
    seeds = written["drives"]["training_seeds"]
    assert tuple(first for first, _ in seeds) == train._FIRST_SEEDS["window"]
    first, second = written["recipe"]["hidden"]
    shapes = WindowNetwork.load().weight_1.shape, WindowNetwork.load().weight_2.shape
    assert shapes == ((len(seeds) * first, INPUTS), (len(seeds) * second, len(seeds) * first))
