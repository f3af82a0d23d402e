"""Fit of the paper's network: Adam, lr 0.01, cross-entropy, batch 32, 100 epochs (Wang 2024, 4)."""

from collections.abc import Callable, Iterable

import numpy as np
import torch
from attrs import frozen
from numpy.typing import NDArray
from torch import nn

from tomr_fault_diag.classifier.belief import DRAGS, EXTERNAL
from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.states import NORMAL, STATES
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, RESIDUALS, SPEEDS, TOTAL
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_training.fit import begin, epoch, weights_of
from tomr_training.planar.generate import PAPER_OF, LabelledTicks

Array = NDArray[np.float64]
Codes = NDArray[np.int8]


@frozen
class Recipe:
    """The paper's hyperparameters, and how many ticks of silence to keep."""

    hidden: int = 30
    learning_rate: float = 0.01
    batch: int = 32
    epochs: int = 100
    seed: int = 1
    examples: int = 60_000
    # Most ticks are healthy with all codes zero and teach nothing new: that many are kept.
    silent: int = 10_000
    # Share of examples repeated with an input group missing, for robots that lack a sensor.
    blinded: float = 0.1


_GROUPS = ([TOTAL], [*MOTORS, *ENCODERS], [*SPEEDS, *ENCODERS])


@frozen
class Examples:
    """Ticks with a label: codes (n, 10) and true states (n,)."""

    codes: Codes
    labels: Codes


def examples_of(drives: Iterable[LabelledTicks], bands: BandSettings) -> Examples:
    """Ticks of the paper's states; those of a fault only where some residual leaves its band."""
    codes, labels = [], []
    for drive in drives:
        residual, band = drive.compared.residuals(bands)
        code = (residual > band).astype(np.int8) - (-residual > band).astype(np.int8)
        kept = (drive.labels >= NORMAL) & (drive.labels < DRAGS.start)
        kept |= drive.labels == EXTERNAL
        kept &= (drive.labels == NORMAL) | code.any(axis=1)
        codes.append(code[kept])
        labels.append(PAPER_OF[drive.labels[kept]])
    return Examples(np.concatenate(codes), np.concatenate(labels))


def prepared(examples: Examples, recipe: Recipe) -> tuple[Array, NDArray[np.int64]]:
    """Inputs (n, 10) and states (n,) to train on."""
    random = np.random.default_rng(recipe.seed)
    silent = np.flatnonzero(~examples.codes.any(axis=1))
    speaking = np.flatnonzero(examples.codes.any(axis=1))
    some = random.permutation(silent)[: recipe.silent]
    chosen = random.permutation(np.concatenate([speaking, some]))[: recipe.examples]
    codes = examples.codes[chosen].astype(np.float64)
    labels = examples.labels[chosen].astype(np.int64)
    some = random.permutation(len(chosen))[: int(recipe.blinded * len(chosen))]
    blind = codes[some].copy()
    for row in range(len(blind)):
        blind[row, _GROUPS[row % len(_GROUPS)]] = 0.0
    kept = blind.any(axis=1) | (labels[some] == 0)
    return np.concatenate([codes, blind[kept]]), np.concatenate([labels, labels[some][kept]])


def module_of(recipe: Recipe) -> nn.Sequential:
    """The untrained network; softmax is part of the loss."""
    return nn.Sequential(
        nn.Linear(RESIDUALS, recipe.hidden), nn.ReLU(), nn.Linear(recipe.hidden, len(STATES))
    )


@frozen
class Fitted:
    """Trained weights, and what torch itself answers to some inputs."""

    network: Network
    check_inputs: Array  # (n, 10)
    check_probabilities: Array  # (n, 6)


def fit(examples: Examples, recipe: Recipe, progress: Callable[[float], None]) -> Fitted:
    """Train; the same examples and recipe give the same weights."""
    begin(recipe.seed)
    inputs, labels = prepared(examples, recipe)
    x = torch.tensor(inputs, dtype=torch.float32)
    y = torch.tensor(labels)
    module = module_of(recipe)
    optimiser = torch.optim.Adam(module.parameters(), lr=recipe.learning_rate)
    for _ in range(recipe.epochs):
        batches = torch.split(torch.randperm(len(x)), recipe.batch)
        progress(epoch(module, (x, y), batches, optimiser.step))
    weights = weights_of(module)
    # In double precision, as the robot computes it: the trained weights are exact there.
    check = torch.randint(-1, 2, (40, RESIDUALS), dtype=torch.float64)
    answers = torch.softmax(module.double()(check), dim=1).detach().numpy()
    return Fitted(Network(*weights), check.numpy(), answers)
