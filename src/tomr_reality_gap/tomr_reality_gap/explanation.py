"""What the tool found, as plain records: made by `explain`, shown by `report`."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_power_model.unmodelled import LearntTerm
from tomr_reality_gap.alignment.channels import Channel

Array = NDArray[np.float64]


@frozen
class Estimate:
    """One parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str
    described: float | None = None  # what the description has for a value that is wrong


@frozen
class Located:
    """Where a finding shows."""

    share: float  # of the energy of the mismatch that it explains, 0..1
    regime: str  # in words: "|omega| < 2 rad/s", "first 40 s", ...
    intervals: tuple[tuple[float, float], ...]  # s since the recording's start
    channels: Mapping[str, float]  # share of what it explains, by channel


@frozen
class Rival:
    """Another explanation that the data cannot separate from the finding."""

    effect: str
    where: tuple[str, ...]
    log_odds: float  # against the finding, <= 0: worse
    experiment: str  # the drive that would separate them


@frozen
class Score:
    """Errors on held-out data; NRMSE as in the contract.

    Of power, or of current where a robot measures no more: `quantity` says which, with its unit.
    """

    nrmse_before: float
    nrmse_after: float
    accuracy_before: float  # 1 - sum|P - P_model| / sum|P|
    accuracy_after: float
    quantity: str = "power [W]"


@frozen
class Shape:
    """What an unknown effect looks like: a resisting torque over a variable, with its interval."""

    variable: str  # "wheel speed [rad/s]", ...
    wheel: str
    at: Array  # (k,)
    value: Array  # N m, (k,)
    low: Array
    high: Array
    unit: str = "N m"  # of the value


@frozen
class FittedLaw:
    """A short law that explains about as much as a learnt table."""

    name: str
    words: str  # with the parameters by name
    parameters: Mapping[str, Estimate]
    share: float  # of what the table explains


@frozen
class Learnt:
    """A term without a name, as it was learnt."""

    term: LearntTerm
    sigma: Array  # standard deviations of its values, like them
    share: float  # of what named findings leave that it predicts where it was not fitted; or NaN
    is_repeatable: bool  # whether another drive would show it again
    laws: tuple[FittedLaw, ...] = ()  # simplest first


@frozen
class Finding:
    """One thing in which reality differs."""

    effect: str
    where: tuple[str, ...]
    parameters: Mapping[str, Estimate]
    located: Located
    rivals: tuple[Rival, ...]
    confidence: float
    evidence: float  # log Bayes factor against leaving it out, all else fitted anew
    shape: Shape | None = None  # of `unknown`
    learnt: Learnt | None = None  # of `unknown`


@frozen
class Comparison:
    """One recording, measured and simulated before and after, channel by channel."""

    name: str
    held_out: bool
    channels: tuple[Channel, ...]
    before: tuple[Array, ...]  # simulated as described, at each channel's times
    after: tuple[Array, ...]  # simulated as explained
    sigma: tuple[float, ...]  # standard deviation of each channel's noise
    speed: Array  # simulated wheel speeds [rad/s] of the explained robot, (t, 3)
    time: Array  # s, (t,)


@frozen
class Map:
    """Mismatch energy over one variable: share per bin before and after."""

    variable: str  # "wheel speed [rad/s]", "heading [deg]", "time [s]", ...
    edges: Array  # (k + 1,)
    channels: tuple[str, ...]
    before: Array  # mean square of residual / sigma, (channels, k), NaN where there is no data
    after: Array


@frozen
class Explanation:
    """The verdict and all that supports it."""

    verdict: str  # "match" or "mismatch"
    sentence: str  # the verdict in one sentence
    findings: tuple[Finding, ...]
    unexplained_share: float
    comparisons: tuple[Comparison, ...]
    maps: tuple[Map, ...]
    alignment: Mapping[str, str]  # what was aligned, in words
    detection_limits: tuple[tuple[str, str, str], ...]  # effect, place, size
    whiteness: Mapping[str, tuple[float, float]]  # lag-1 autocorrelation before, after by channel
    score: Score | None  # of everything together on held-out data
    explained: str  # text of robot_explained.yaml; empty where nothing changed
    suggested: str = ""  # drive that would separate the rivals, as a mission file; empty: none
    notes: tuple[str, ...] = ()
    recordings: tuple[Path, ...] = field(factory=tuple)
