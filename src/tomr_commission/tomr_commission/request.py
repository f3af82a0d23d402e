"""What is to be commissioned, and how."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from attrs import field, frozen

from tomr_fault_diag.residuals.calibrated import MARGIN, SPEED_FACTOR, WITHIN

DEFAULT_RATE = 0.05  # false alarms per hour: one in 20 h
DEFAULT_TOLERANCE = 0.05


@frozen
class BandChoice:
    """How wide bands are made."""

    within: float = WITHIN  # share of the healthy residuals of the fitting drives inside
    margin: float = MARGIN
    speed_factor: float = SPEED_FACTOR
    wider: float = 1.7  # times as wide, again and again, while alarms by shoves are too many
    widest: float = 8.0  # margin
    most_caution: float = 25.0  # decades that may be needed before bands are made wider


@frozen
class AlarmChoice:
    """How the alarm level is chosen."""

    block: float = 10.0  # s: peaks of evidence farther apart count as independent
    kept: float = 0.25  # share of the blocks, those with the highest peaks, that make the tail
    least_peaks: int = 8  # in the tail
    confidence: float = 0.8  # that the rate is as low as wanted


@frozen
class Limits:
    """What makes a no-go."""

    level: float = 3.0  # RMS of what is left over the sensors' noise, drawn power, held-out drive
    unexplained: float = 0.3  # share of the mismatch
    nrmse: float = 0.15  # of power on the held-out drive
    drives_apart: float = 2.0  # band that one drive needs over that of the others
    drag_apart: float = 0.15  # share of the usual torque by which drives may differ
    many_drives: int = 8  # of so many one is apart that also lies far out of their scatter
    far_out: float = 4.0  # standard deviations
    outside: float = 0.02  # share of held-out residuals outside of the bands
    minutes: float = 2.5  # of driving to fit to, at least
    held_minutes: float = 0.8


@frozen
class CommissionRequest:
    """One robot, its healthy recordings, where the results go, and the choices."""

    robot: str  # robot.yaml, or the name of a shipped one
    bags: tuple[Path, ...]
    out: Path
    false_alarms_per_hour: float = DEFAULT_RATE
    tolerance: float = DEFAULT_TOLERANCE
    skips: Mapping[str, Sequence[tuple[float, float]]] = field(factory=dict)  # s, by recording
    bands: BandChoice = field(factory=BandChoice)
    alarm: AlarmChoice = field(factory=AlarmChoice)
    limits: Limits = field(factory=Limits)
