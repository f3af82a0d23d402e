"""Half widths of the bands around modelled values: of a tick, and of whole drives at once."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.model.ticks import to_ns

Array = NDArray[np.float64]

# The model's change over so long, in ticks, widens the band: where power jumps, a lag of a few
# milliseconds between the streams is a large residual.
_TRANSIENT = to_ns(0.15)
_FEWEST = 2  # ticks, of slow decisions


class Band(NamedTuple):
    """max(least, relative |model|) + transient * how far the model moved over the last ticks."""

    least: float
    relative: float
    transient: float


def transient_ticks(period_ns: int) -> int:
    """Ticks over which the model's change counts."""
    return max(_FEWEST, round(_TRANSIENT / period_ns))


def width(models: Sequence[float], band: Band) -> float:
    """Around the newest of some modelled values; what is not known moves nothing."""
    return max(band.least, band.relative * abs(models[-1])) + band.transient * _spread(models)


def _spread(models: Sequence[float]) -> float:
    known = [model for model in models if model == model]
    return max(known) - min(known) if known else 0.0


def widths(modelled: Array, bands: Sequence[Band], ticks: int) -> Array:
    """Around the modelled values of a drive, (n, m), by the band of each column."""
    least, relative, transient = np.array(bands).T
    at_rest = np.maximum(least, relative * np.abs(np.nan_to_num(modelled)))
    return np.asarray(at_rest + transient * moved(modelled, ticks))


def moved(values: Array, ticks: int) -> Array:
    """How far each column moved over so many ticks, (n, m); 0 where that is not known."""
    low, high = values.copy(), values.copy()
    for back in range(1, ticks):
        low[back:] = np.fmin(low[back:], values[:-back])
        high[back:] = np.fmax(high[back:], values[:-back])
    return np.nan_to_num(high - low)
