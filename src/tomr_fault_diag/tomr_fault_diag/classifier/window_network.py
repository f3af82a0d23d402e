"""The window network: continuous residuals of the last 0.4 s, one wheel's view at a time.

    h = relu(W2 relu(W1 x_w + b1) + b2),  (n, s, x, o, c, e, d, r, p)_w = W3 h + b3

for the view x_w of each wheel w; softmax over the means of n, s, x and o (normal, slip, a force
from outside, anything else) and over those of each wheel: signal lost, encoder lost, axle dragging,
motor weak, power sensor wrong. The same network serves the three wheels, so what it has learned of
one holds for all.
"""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import CONTROLS, ENCODERS, EXTERNAL, HYPOTHESES, OTHER
from tomr_fault_diag.classifier.features import INPUTS, band_ratios, by_wheel
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_fault_diag.classifier.stored import Shapes, Stored
from tomr_fault_diag.residuals.frame import BAND_SIGMAS

Array = NDArray[np.float64]

COMMON = 4  # outputs of a view that are no single wheel's
VIEWS = 9  # outputs of one view
# Not so what shows slightly and for long: an axle that drags, a weak motor, a wrong power sensor.
_SHOWN = [SLIP, *range(CONTROLS.start, ENCODERS.stop), EXTERNAL, OTHER]
_NAMES = ("weight_1", "bias_1", "weight_2", "bias_2", "weight_3", "bias_3", "prior")


def _shapes(found: Mapping[str, Array]) -> Shapes:
    """Layers that fit onto each other."""
    first, second = found["bias_1"].size, found["bias_2"].size
    return {
        "weight_1": (first, INPUTS), "bias_1": (first,), "weight_2": (second, first),
        "bias_2": (second,), "weight_3": (VIEWS, second), "bias_3": (VIEWS,),
        "prior": (HYPOTHESES,),
    }  # fmt: skip


_STORED = Stored(
    "window",
    "the window network",
    _NAMES,
    _shapes,
    "train it again, or set classifier to the kind that they were trained for",
)


@frozen
class WindowNetwork:
    """Three layers, and how often each hypothesis came in training."""

    weight_1: Array  # (h1, INPUTS)
    bias_1: Array  # (h1,)
    weight_2: Array  # (h2, h1)
    bias_2: Array  # (h2,)
    weight_3: Array  # (9, h2)
    bias_3: Array  # (9,)
    prior: Array  # (19,)

    @classmethod
    def load(cls, path: Path | str | None = None) -> Self:
        """Weights of a file, or the shipped ones; raises InputError if they do not fit."""
        return cls(**_STORED.load(path))

    def scores(self, views: Array) -> Array:
        """Logits (..., 19) of views (..., 3, INPUTS)."""
        hidden = np.maximum(views @ self.weight_1.T + self.bias_1, 0.0)
        hidden = np.maximum(hidden @ self.weight_2.T + self.bias_2, 0.0)
        out = hidden @ self.weight_3.T + self.bias_3
        common = out[..., :COMMON].mean(axis=-2)
        wheels = np.swapaxes(out[..., COMMON:], -1, -2).reshape(*common.shape[:-1], -1)
        return np.concatenate([common[..., :2], wheels, common[..., 2:]], axis=-1)

    def scores_of(self, windows: Array) -> Array:
        """Logits (..., 19) of windows (..., WINDOW, 20)."""
        return self.scores(by_wheel(windows))

    def log_likelihoods(self, window: Array) -> Array:
        """Log-likelihoods (19,) of a window (WINDOW, 20), over that of a robot that is well.

        Where something leads that shows while it lasts, they say at most what the newest tick
        allows: the best of all hypotheses over noise alone, sum (r / sigma)^2 / 2. Else a wheel
        that catches up after a shove, within a fraction of its band, goes on to look like a lost
        signal: the network knows how residuals of faults come about, not how small they are.
        """
        found = np.asarray(self.scores_of(window) - self._log_prior)
        with np.errstate(over="ignore"):
            most = 0.5 * BAND_SIGMAS**2 * float(np.square(band_ratios(window[-1])).sum())
        over = np.asarray(found - found[NORMAL])
        leading = int(np.argmax(over))
        if leading in _SHOWN and over[leading] > most:
            over *= most / over[leading]
        return over

    @cached_property
    def _log_prior(self) -> Array:
        return np.asarray(np.log(self.prior))
