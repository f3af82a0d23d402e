"""What healthy driving shows: peaks of evidence, and whether it looks like a small fault.

Small faults that last are found by what a robot's residuals gather within its own bands, which
takes residuals that scatter around nothing. Those of a robot whose description lacks too much, as
of rollers that drag on one floor more than on another, gather as well: there only the network is
asked, with narrower bands.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_commission.alarm import block_peaks
from tomr_commission.evidence import Decided, decisions, witnessed
from tomr_commission.observed import Observed, frames_of
from tomr_commission.parallel import on_all_cores
from tomr_commission.rehearsal import robot_of
from tomr_fault_diag.classifier.judges import GATHERED
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.settings import BandSettings

Array = NDArray[np.float64]

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
    robot: str,
    block: float,
) -> Healthy:
    """Judge healthy drives, on all cores; small faults are looked for if that shows none.

    `robot`: where it is described; `block`: length of a block [s].
    """
    hours = sum(drive.hours for drive in drives)

    def judged(small_faults: bool) -> Healthy:
        chosen = evolve(settings, small_faults=small_faults)
        peaks: list[float] = []
        most = 0.0
        seen = on_all_cores(_witnessed, [(drive, bands, chosen, robot) for drive in drives])
        for drive, (evidence, gathered) in zip(drives, seen, strict=True):
            peaks += block_peaks(evidence, drive.seconds, block)
            most = max(most, gathered)
        return Healthy(chosen, tuple(peaks), hours, most)

    looking = judged(small_faults=True)
    if looking.gathered <= MOST_GATHERED:
        return looking
    return evolve(judged(small_faults=False), gathered=looking.gathered)


def decided(
    drives: Sequence[Observed], bands: BandSettings, settings: ClassifierSettings, robot: str
) -> tuple[Decided, ...]:
    """What a diagnosis says of each drive of a described robot, on all cores."""
    return tuple(on_all_cores(_decided, [(drive, bands, settings, robot) for drive in drives]))


_Job = tuple[Observed, BandSettings, ClassifierSettings, str]


def _decided(job: _Job) -> Decided:
    drive, bands, settings, robot = job
    return decisions(frames_of(drive, bands), settings, robot_of(robot))


def _witnessed(job: _Job) -> tuple[Array, float]:
    drive, bands, settings, robot = job
    return witnessed(frames_of(drive, bands), settings, robot_of(robot))
