"""Window networks of different drives that decide together (Lakshminarayanan 2017).

What one of them has from chance the others have not.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from tomr_fault_diag.classifier.window_network import WindowNetwork


def mean_of(networks: Sequence[WindowNetwork]) -> WindowNetwork:
    """One network whose scores are the mean of several's: their hidden units side by side."""
    share = 1.0 / len(networks)
    return WindowNetwork(
        np.concatenate([one.weight_1 for one in networks]),
        np.concatenate([one.bias_1 for one in networks]),
        block_diag(*[one.weight_2 for one in networks]),
        np.concatenate([one.bias_2 for one in networks]),
        np.concatenate([share * one.weight_3 for one in networks], axis=1),
        np.mean([one.bias_3 for one in networks], axis=0),
        np.exp(np.mean([np.log(one.prior) for one in networks], axis=0)),
    )
