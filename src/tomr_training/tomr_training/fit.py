"""What both fits share: training in torch that gives the same weights for the same examples."""

from collections.abc import Callable, Iterable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn


def begin(seed: int) -> None:
    """Make what follows depend on a seed alone."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)  # faster for so small a network, and the sums keep their order


def epoch(
    module: nn.Module,
    examples: tuple[torch.Tensor, torch.Tensor],
    batches: Iterable[torch.Tensor],
    *steps: Callable[[], object],
) -> float:
    """Mean loss of one pass over examples: cross-entropy, one step after each batch.

    Args:
        module: what is trained.
        examples: inputs and states.
        batches: rows of the examples.
        steps: of the optimiser, and of the schedule of its rate if it has one.
    """
    inputs, states = examples
    loss, total = nn.CrossEntropyLoss(), 0.0
    for rows in batches:
        module.zero_grad()
        cost = loss(module(inputs[rows]), states[rows])
        cost.backward()
        for step in steps:
            step()
        total += float(cost.detach()) * len(rows)
    return total / len(states)


def weights_of(module: nn.Module) -> list[NDArray[np.float64]]:
    """Weights and biases, layer by layer."""
    return [parameter.detach().numpy().astype(np.float64) for parameter in module.parameters()]
