"""What is the matter, given all that was seen so far: a hidden Markov model over the states.

    predicted_k = sum_j belief_j P(j -> k);   belief_k ~ predicted_k exp(weight l_k)

with l_k the log-likelihood of the newest window if k holds, relative to the likeliest. Windows
overlap and so say the same several times over: `weight` < 1. That a fault comes on within a tick is
10^-caution likely: so many decades of evidence must speak for it before it is believed. What cannot
be told apart from normal in this motion has l = 0 and leaves the belief as it is.
"""

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import NORMAL, SLIP

Array = NDArray[np.float64]

# What the window network tells apart: normal, slip, lost signal of wheels 1-3, of encoders 1-3.
HYPOTHESES = 8
CONTROLS = slice(2, 5)
ENCODERS = slice(5, 8)
_CLIP = 24.0  # no window says more than so much against anything
_ENDING = 1e-4  # likelihood that a fault ends within a tick ...
_SLIP_ENDING = 5e-3  # ... and that a slippery place is left
_OTHER = 1e-6  # and that one fault becomes another
_LEAST = 1e-30


class Belief:
    """Probabilities of the hypotheses, tick by tick."""

    def __init__(self, weight: float, caution: float) -> None:
        """`weight` of the evidence of one window, `caution` in decades."""
        self._weight = weight
        self._moves = _transitions(10.0**-caution)
        self.clear()

    def clear(self) -> None:
        """Start afresh, believing that all is well."""
        self.shares: Array = np.zeros(HYPOTHESES)
        self.shares[NORMAL] = 1.0

    def update(self, likelihoods: Array) -> Array:
        """Take the log-likelihoods (8,) of a window; returns the probabilities (8,)."""
        relative = np.maximum(likelihoods - likelihoods.max(), -_CLIP)
        shares = (self.shares @ self._moves) * np.exp(self._weight * relative)
        self.shares = np.asarray(np.maximum(shares / shares.sum(), _LEAST))
        return self.shares


def _transitions(onset: float) -> Array:
    """P(j -> k), (8, 8)."""
    moves = np.full((HYPOTHESES, HYPOTHESES), _OTHER)
    moves[NORMAL] = onset
    moves[:, NORMAL] = _ENDING
    moves[SLIP, NORMAL] = _SLIP_ENDING
    np.fill_diagonal(moves, 0.0)
    np.fill_diagonal(moves, 1.0 - moves.sum(axis=1))
    return moves


def six_of(shares: Array) -> Array:
    """Probabilities of the six states (..., 6): of a lost signal the wheel does not matter."""
    control = shares[..., CONTROLS].sum(axis=-1, keepdims=True)
    return np.concatenate([shares[..., :2], control, shares[..., 5:]], axis=-1)
