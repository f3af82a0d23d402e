"""The rules of a verdict, as functions of numbers."""

import math
from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.discrepancy import SIMULATOR
from tomr_power_model.estimation.statistics import robust_scale
from tomr_reality_gap.explanation import Estimate

Array = NDArray[np.float64]

_RIVAL = 5.0  # log odds within which data do not separate two explanations
_UNMODELLED_COST = 60.0  # log evidence that an effect without a name must bring
HALF_WIDTH = 1.96  # standard deviations of half a 95 % interval
_MUCH = 0.3  # of the mismatch left: what was named is not the whole story
_GROSS = 10.0  # times the noise: no match, even if nothing is named; slow noise reaches 1
_SURE = 0.97
DOUBTED = 0.45  # confidence of a finding that leaves much at most
# Fixed, and no posterior: the evidence leaves no doubt that something is there (e^-20 at least, as
# odds are tempered), but how likely it is that no name fits it cannot be had from the names.
NAMELESS = 0.9


@frozen
class Residuals:
    """What a channel is off before and after, by its own noise."""

    before: Array  # measured - simulated as described, (n,)
    after: Array  # measured - simulated as explained, (n,)
    std: float  # of what was measured
    is_drawn: bool  # power or current drawn, not a speed
    quantum: float = 0.0
    rounding: float = 0.0  # mean square by which a coarse sensor's levels are off


def estimate_of(
    value: float,
    sigma: float,
    *,
    offset: float,
    baseline: float = 0.0,
    shift: float = 0.0,
    unit: str = "",
    bounds: tuple[float, float] = (-math.inf, math.inf),
) -> Estimate:
    """A value with its 95 % interval.

    The simulator is not exact either: a part of the offset from the description is never known, nor
    all of what the user's simulation shows of it (`baseline`). `shift`: how far what shows and has
    no name may move it.
    """
    known = HALF_WIDTH * math.hypot(sigma, SIMULATOR.parameter * offset, 0.5 * baseline)
    half = math.hypot(known, shift)
    if unit == "rad":
        value = math.remainder(value, 2.0 * math.pi)
    return Estimate(value, max(value - half, bounds[0]), min(value + half, bounds[1]), unit)


def is_rival(log_odds: float) -> bool:
    """Whether the data do not separate it from the finding."""
    return log_odds > -_RIVAL


def confidence_of(log_odds: Sequence[float]) -> float:
    """Posterior probability of a finding and its rivals together, from all others' log odds."""
    weights = [math.exp(max(min(odds, 0.0), -600.0) / SIMULATOR.temper) for odds in log_odds]
    near = 1.0 + sum(w for w, odds in zip(weights, log_odds, strict=True) if is_rival(odds))
    return _SURE * near / (1.0 + sum(weights))


def is_unmodelled(evidence: float, named: float, cost: float) -> bool:
    """Whether an effect without a name is there, from its log evidence and that of all named ones.

    `cost` is the log evidence that any finding must bring.
    """
    return evidence > max(_UNMODELLED_COST, cost, SIMULATOR.unmodelled * named)


def leaves_much(share: float) -> bool:
    """Whether what was named is not the whole story, from the share that is left."""
    return share > _MUCH


def is_doubted(share: float, size: float, has_findings: bool) -> bool:
    """Whether too much is left (see `unexplained`) for what was named, or for a match."""
    return leaves_much(share) and size > (1.0 if has_findings else _GROSS)


def energy_shares(lost: Sequence[float], left: float) -> list[float]:
    """Part of the mismatch that each finding explains, by leaving it out.

    Args:
        lost: sum of squared whitened residuals that leaving out each of them adds.
        left: part of the mismatch that none explains (`unexplained`).
    """
    energies = [max(item, 0.0) for item in lost]
    return [(1.0 - left) * energy / max(sum(energies), 1e-9) for energy in energies]


def _share(part: float, whole: float) -> float:
    return max(0.0, min(1.0, part / max(whole, 1e-9)))


def unexplained(channels: Sequence[Residuals]) -> tuple[float, float]:
    """Part of the mismatch that is left, beyond noise and what the simulator is unsure of; and how
    much that is in what is drawn, noise being 1.

    Noise is what differs from one sample to the next: unlike the noise of the fit it knows nothing
    of slow mismatches that no hypothesis explains.
    """
    first, left, drawn = 0.0, 0.0, []
    for item in channels:
        steps = np.abs(np.diff(item.after))
        # Most steps of a coarse sensor may be none at all, the others one of its quanta.
        usual = max(float(np.median(steps)), 0.5 * item.quantum)
        noise = max(
            0.5 * robust_scale(steps) ** 2,
            0.5 * float(np.mean(np.minimum(steps, 5.0 * usual) ** 2)),
            item.rounding,
        )
        known = noise + (SIMULATOR.power * item.std) ** 2
        first += max(float(np.mean(item.before**2)) - known, 0.0) / known
        rest = max(float(np.mean(item.after**2)) - known, 0.0) / known
        left += rest
        if item.is_drawn:
            drawn.append(rest)
    return _share(left, first) if first > 0.0 else 0.0, sum(drawn) / max(len(drawn), 1)
