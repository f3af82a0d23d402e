"""Fit of the window network: Adam, one cycle of the learning rate, cross-entropy."""

from collections.abc import Callable, Iterable

import numpy as np
import torch
from attrs import frozen
from numpy.typing import NDArray
from torch import nn

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    HYPOTHESES,
    METERS,
    WEAKS,
)
from tomr_fault_diag.classifier.features import (
    BLIND,
    CHANNELS,
    INPUTS,
    WINDOW,
    by_wheel,
    channels,
)
from tomr_fault_diag.classifier.states import NORMAL
from tomr_fault_diag.classifier.window_network import COMMON, VIEWS, WindowNetwork
from tomr_training.fit import begin, epoch, weights_of
from tomr_training.planar.generate import IGNORED, LabelledTicks

Floats = NDArray[np.float32]

_CHUNK = 8192


@frozen
class WindowRecipe:
    """Size of the network and how it is trained."""

    hidden: tuple[int, int] = (128, 64)
    learning_rate: float = 6e-3
    batch: int = 1024
    epochs: int = 5
    seed: int = 1
    # Shares of the ticks that are kept: windows overlap, and most healthy ones teach nothing new.
    healthy: float = 0.2
    faulty: float = 0.35
    blinded: float = 0.1  # share of the examples that lack a sensor


@frozen
class Examples:
    """Drives as the network sees them, (n, WINDOW - 1 + ticks, 20), and what to learn of them."""

    seen: Floats
    drive: NDArray[np.int64]  # of each example, (m,)
    tick: NDArray[np.int64]
    label: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.label)

    def windows(self, rows: NDArray[np.int64]) -> Floats:
        """Windows of some examples, (rows, WINDOW, 20), the newest tick last."""
        ticks = self.tick[rows, None] + np.arange(WINDOW)
        return np.asarray(self.seen[self.drive[rows, None], ticks])


def examples_of(drives: Iterable[LabelledTicks], recipe: WindowRecipe) -> Examples:
    """Ticks with a label, as many as the recipe keeps."""
    random = np.random.default_rng(recipe.seed)
    parts = [(channels_of_drive(drive), drive.labels) for drive in drives]
    longest = max(len(labels) for _, labels in parts)
    seen = np.zeros((len(parts), WINDOW - 1 + longest, CHANNELS), dtype=np.float32)
    labels = np.full((len(parts), longest), IGNORED, dtype=np.int8)
    for place, (values, own) in enumerate(parts):
        seen[place, WINDOW - 1 : WINDOW - 1 + len(own)] = values
        labels[place, : len(own)] = own
    kept = np.where(labels == NORMAL, recipe.healthy, recipe.faulty)
    labels[random.random(labels.shape) >= kept] = IGNORED
    row, tick = np.nonzero(labels != IGNORED)
    return Examples(seen, row, tick, labels[row, tick].astype(np.int64))


def channels_of_drive(drive: LabelledTicks) -> Floats:
    """Channels of a drive, (ticks, 20)."""
    residual, band = drive.compared.residuals(drive.bands)
    return channels(residual, band, drive.compared.modelled).astype(np.float32)


class WindowModule(nn.Module):
    """The network of `classifier.window_network` in torch."""

    def __init__(self, hidden: tuple[int, int]) -> None:
        super().__init__()
        first, second = hidden
        self.layers = nn.Sequential(
            nn.Linear(INPUTS, first),
            nn.ReLU(),
            nn.Linear(first, second),
            nn.ReLU(),
            nn.Linear(second, VIEWS),
        )

    def forward(self, views: torch.Tensor) -> torch.Tensor:
        """Logits (m, 19) of views (m, 3, INPUTS)."""
        out = self.layers(views)
        common = out[..., :COMMON].mean(dim=1)
        wheels = out[..., COMMON:].transpose(1, 2).reshape(len(out), -1)
        return torch.cat([common[:, :2], wheels, common[:, 2:]], dim=1)


def fit_window(
    examples: Examples, recipe: WindowRecipe, progress: Callable[[float], None]
) -> WindowNetwork:
    """Train; the same examples and recipe give the same weights."""
    begin(recipe.seed)
    module = WindowModule(recipe.hidden)
    optimiser = torch.optim.Adam(module.parameters(), lr=recipe.learning_rate)
    per_epoch = -(-len(examples) // recipe.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, max_lr=recipe.learning_rate, total_steps=recipe.epochs * per_epoch
    )
    random = np.random.default_rng(recipe.seed)
    trained = views_of(examples, recipe, random), torch.from_numpy(examples.label)
    for _ in range(recipe.epochs):
        batches = torch.split(torch.from_numpy(random.permutation(len(examples))), recipe.batch)
        progress(epoch(module, trained, batches, optimiser.step, schedule.step))
    arrays = [*weights_of(module), prior_of(examples.label)]
    return WindowNetwork(*arrays)


def views_of(examples: Examples, recipe: WindowRecipe, random: np.random.Generator) -> torch.Tensor:
    """All examples as the wheels see them, (m, 3, INPUTS): 1.5 kB each."""
    views = torch.empty((len(examples), 3, INPUTS))
    for start in range(0, len(examples), _CHUNK):
        rows = np.arange(start, min(start + _CHUNK, len(examples)))
        windows = blinded(examples.windows(rows), recipe.blinded, random)
        views[start : start + _CHUNK] = torch.from_numpy(by_wheel(windows))
    return views


def blinded(windows: Floats, share: float, random: np.random.Generator) -> Floats:
    """Some of the windows as a robot sees them that lacks a sensor."""
    some = np.flatnonzero(random.random(len(windows)) < share)
    kinds = random.integers(0, len(BLIND), len(some))
    for kind, blind in enumerate(BLIND):
        rows = some[kinds == kind]
        windows[rows] = blind(windows[rows])
    return windows


def prior_of(labels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Share of each hypothesis among the examples; the wheels are alike."""
    share = np.bincount(labels, minlength=HYPOTHESES) / len(labels)
    for kind in (CONTROLS, ENCODERS, DRAGS, WEAKS, METERS):
        share[kind] = share[kind].mean()
    return np.maximum(share, 1.0 / len(labels))


def check_windows(examples: Examples) -> NDArray[np.float64]:
    """Twenty windows (20, WINDOW, 20) from all over the drives, as they are stored: rounded, since
    rounding may turn the direction of a wheel that hardly moves."""
    rows = np.arange(0, len(examples), max(1, len(examples) // 20))[:20]
    return np.asarray(examples.windows(rows).astype(np.float64).round(4))


def torch_scores(network: WindowNetwork, windows: NDArray[np.float64]) -> NDArray[np.float64]:
    """What torch itself makes of windows (k, WINDOW, 20) with a network's weights, (k, 19)."""
    # In double precision, as the robot computes it: the trained weights are exact there.
    module = WindowModule((len(network.bias_1), len(network.bias_2))).double()
    names = ("weight_1", "bias_1", "weight_2", "bias_2", "weight_3", "bias_3")
    with torch.no_grad():
        for parameter, name in zip(module.parameters(), names, strict=True):
            parameter.copy_(torch.from_numpy(getattr(network, name)))
        return np.asarray(module(torch.from_numpy(by_wheel(windows))).numpy())
