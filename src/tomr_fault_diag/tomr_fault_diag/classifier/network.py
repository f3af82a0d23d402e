"""The paper's network: ten inputs, thirty ReLU, six softmax outputs (Wang 2024, Fig. 11)."""

from pathlib import Path
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.classifier.stored import Stored
from tomr_fault_diag.residuals.frame import RESIDUALS

Array = NDArray[np.float64]

_SHAPES = {
    "hidden_weight": (30, RESIDUALS),
    "hidden_bias": (30,),
    "output_weight": (len(STATES), 30),
    "output_bias": (len(STATES),),
}
_STORED = Stored("wang2024", "a network", tuple(_SHAPES), lambda found: _SHAPES)


@frozen
class Network:
    """softmax(W2 relu(W1 x + b1) + b2)."""

    hidden_weight: Array  # (30, 10)
    hidden_bias: Array  # (30,)
    output_weight: Array  # (6, 30)
    output_bias: Array  # (6,)

    @classmethod
    def load(cls, path: Path | str | None = None) -> Self:
        """Weights of a file, or the shipped ones; raises InputError if they do not fit."""
        return cls(**_STORED.load(path))

    def probabilities(self, inputs: Array) -> Array:
        """Probabilities of the states (..., 6) from inputs (..., 10)."""
        hidden = np.maximum(inputs @ self.hidden_weight.T + self.hidden_bias, 0.0)
        scores = hidden @ self.output_weight.T + self.output_bias
        raised = np.exp(scores - scores.max(axis=-1, keepdims=True))
        return np.asarray(raised / raised.sum(axis=-1, keepdims=True))
