"""Whether the supply gives what a term without a name says that drivers draw.

Slow noise of three power sensors looks like three drivers that draw now more and now less. But what
a driver draws comes from the supply: where the total is measured as well, a term that is fitted to
all else predicts it, and what sensors make up does not.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.estimation.linear_gaussian import Gram, Matrix, product, solve
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.statistics import autocorrelation_time
from tomr_reality_gap.fit.remainder import Remainder

Array = NDArray[np.float64]

_SHARE = 0.5  # of what the term adds to the total
_SURELY = 1.0  # standard deviations of the share that shows
_LAGS = 80


def is_supplied(rest: Remainder, columns: Sequence[Matrix]) -> bool:
    """Whether the total shows what a term adds to it, or cannot tell.

    Args:
        rest: what is left of the recordings without the term.
        columns: of the term, whitened, (n, p) each.
    """
    channels = rest.dataset.channels
    totals = [
        rows
        for channel, rows in zip(channels, rows_of(channels), strict=True)
        if channel.kind == "total"
    ]
    elsewhere = np.ones(len(rest.residual))
    for rows in totals:
        elsewhere[rows] = 0.0
    joined, q = rest.beside(columns), rest.base.shape[1]
    mean = solve(Gram.of(joined, rest.residual, elsewhere), range(joined.shape[1])).mean
    shown, information, variance = 0.0, 0.0, 0.0
    for rows in totals:
        added = product(joined[rows, q:], mean[q:])
        left = rest.residual[rows] - product(joined[rows, :q], mean[:q])
        lags = min(_LAGS, len(left) // 4 + 1)
        scatter = max(float(np.mean(left**2)), 1.0) * autocorrelation_time([left], lags, 0.03)
        own = float(added @ added)
        shown, information = shown + float(added @ left), information + own
        variance += own * scatter
    if information <= 0.0:
        return True
    return bool(shown + _SURELY * np.sqrt(variance) > _SHARE * information)
