"""What healthy driving shows: peaks of evidence, and whether it looks like a small fault.

Small faults that last are found by what a robot's residuals gather within its own bands, which
takes residuals that scatter around nothing. Those of a robot whose description lacks too much, as
of rollers that drag on one floor more than on another, gather as well: there only the network is
asked, with narrower bands.
"""

from collections.abc import Sequence

from attrs import evolve, frozen

from tomr_commission.alarm import block_peaks
from tomr_commission.evidence import witnessed
from tomr_commission.observed import Observed, frames_of
from tomr_fault_diag.classifier.judges import GATHERED
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.robot import Robot

MOST_GATHERED = 0.5 * GATHERED  # nats, in healthy driving


@frozen
class Healthy:
    """Of healthy driving."""

    settings: ClassifierSettings  # with which it was judged: small faults looked for, or not
    peaks: tuple[float, ...]  # of evidence, block by block [decades]
    hours: float
    gathered: float  # most that small faults did where they were looked for [nats]


def healthy(
    drives: Sequence[Observed],
    bands: BandSettings,
    settings: ClassifierSettings,
    robot: Robot,
    block: float,
) -> Healthy:
    """Judge healthy drives; small faults are looked for if that shows none.

    `block`: length of a block [s].
    """
    hours = sum(drive.hours for drive in drives)

    def judged(small_faults: bool) -> Healthy:
        chosen = evolve(settings, small_faults=small_faults)
        peaks: list[float] = []
        most = 0.0
        for drive in drives:
            evidence, gathered = witnessed(frames_of(drive, bands), chosen, robot)
            peaks += block_peaks(evidence, drive.seconds, block)
            most = max(most, gathered)
        return Healthy(chosen, tuple(peaks), hours, most)

    looking = judged(small_faults=True)
    if looking.gathered <= MOST_GATHERED:
        return looking
    return evolve(judged(small_faults=False), gathered=looking.gathered)
