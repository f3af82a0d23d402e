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
from tomr_reality_gap.fit.remainder import Remainder, inflations

Array = NDArray[np.float64]

_SHARE = 0.5  # of what the term adds to the total
_SURELY = 1.0  # standard deviations of the share that shows


def is_supplied(rest: Remainder, columns: Sequence[Matrix]) -> bool:
    """Whether the total shows what a term adds to it, or cannot tell.

    Args:
        rest: what is left of the recordings without the term.
        columns: of the term, whitened, (n, p) each.
    """
    channels = rest.dataset.channels
    is_total = [channel.kind == "total" for channel in channels]
    elsewhere = np.ones(len(rest.residual))
    for rows, is_one in zip(rows_of(channels), is_total, strict=True):
        elsewhere[rows] = float(not is_one)
    joined, q = rest.beside(columns), rest.base.shape[1]
    mean = solve(Gram.of(joined, rest.residual, elsewhere), range(joined.shape[1])).mean
    change = product(joined[:, q:], mean[q:])
    left = rest.residual - product(joined[:, :q], mean[:q])
    shown, information, variance = 0.0, 0.0, 0.0
    for (rows, inflation), is_one in zip(inflations(rest.dataset, left), is_total, strict=True):
        if is_one:
            own = float(change[rows] @ change[rows])
            shown += float(change[rows] @ left[rows])
            information += own
            variance += own * inflation
    if information <= 0.0:
        return True
    return bool(shown + _SURELY * np.sqrt(variance) > _SHARE * information)
