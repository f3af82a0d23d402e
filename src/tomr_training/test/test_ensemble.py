"""Networks that decide together."""

import numpy as np

from tomr_fault_diag.classifier.belief import HYPOTHESES
from tomr_fault_diag.classifier.features import CHANNELS, INPUTS, WINDOW
from tomr_fault_diag.classifier.window_network import VIEWS, WindowNetwork
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
