"""How much a force changes from sample to sample."""

from collections import deque

_SHARE, _ROUGHEST = 0.04, 60.0  # of a new sample in the mean; N


class Roughness:
    """Variance of what changes from sample to sample [N^2]: a driver that sees coarse counts shakes
    its motor."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, ...]] = deque(maxlen=3)
        self._variance = 0.0

    def take(self, *forces: float) -> float:
        """The variance with another sample; of several forces, one of which is the contact's, that
        of the smoothest."""
        self._seen.append(forces)
        if len(self._seen) == self._seen.maxlen:
            samples = zip(*self._seen, strict=True)
            change = min(abs(older - 2.0 * before + new) for older, before, new in samples)
            new_one = min(change, _ROUGHEST) ** 2 / 6.0
            self._variance += _SHARE * (new_one - self._variance)
        return self._variance
