"""Faults put into real recordings, where that is honest: what a power sensor or a motor would show.

Powers are put off as the sensor would report them, tick by tick; motion, commands and everything
else stay as recorded. What a fault does to the motion is not in it: such faults are simulated.
"""

from collections.abc import Callable, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_commission.evidence import first_alarm
from tomr_commission.observed import Observed, frames_of, reports_currents
from tomr_commission.parallel import on_all_cores
from tomr_commission.rehearsal import robot_of
from tomr_commission.trials import Trial, smallest_found
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, TOTAL
from tomr_fault_diag.residuals.settings import BandSettings

Array = NDArray[np.float64]

_HEALTHY = 100  # ticks before the fault
_SHOWN = 900  # ticks: what is not found in 40 s is not found


@frozen
class InjectedKind:
    """One kind of fault: what becomes of the power of a motor, and whether the total shows it."""

    name: str
    sizes: tuple[float, ...]  # to try, the largest first; in the unit
    unit: str
    change: Callable[[Array, float], Array]  # measured power (n,), size -> what is reported (n,)
    in_total: bool = False


def _scaled(power: Array, size: float) -> Array:
    return power * (1.0 + size)


def _dead(power: Array, size: float) -> Array:
    return np.zeros_like(power)


def _raised(power: Array, size: float) -> Array:
    return power + size


def _held(power: Array, size: float) -> Array:
    return np.full_like(power, power[0])


KINDS: tuple[InjectedKind, ...] = (
    InjectedKind("power sensor dead", (1.0,), "", _dead),
    InjectedKind("power sensor frozen", (1.0,), "", _held),
    InjectedKind("power sensor scaled", (1.0, 0.5, 0.3, 0.2, 0.1, 0.05), "of the power", _scaled),
    InjectedKind(
        "power sensor biased",
        (20.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5),
        "W",
        _raised,
    ),
    InjectedKind(
        "motor draws more", (1.0, 0.5, 0.3, 0.2, 0.1, 0.05), "of its power", _scaled, in_total=True
    ),
)


_AMPERES = (2.0, 1.0, 0.5, 0.3, 0.2, 0.1, 0.05)


def kinds_for(drive: Observed) -> tuple[InjectedKind, ...]:
    """What can honestly be put into a drive: nothing into motors without sensors of their own."""
    if set(MOTORS) <= set(drive.silent):
        return ()
    if not reports_currents(drive):
        return KINDS
    # What a motor draws more of the whole robot's watts is not known in amperes.
    return tuple(
        evolve(kind, sizes=_AMPERES, unit="A") if kind.unit == "W" else kind
        for kind in KINDS
        if not kind.in_total or TOTAL in drive.silent
    )


def injected(drive: Observed, kind: InjectedKind, size: float, wheel: int) -> Observed:
    """A drive in which a fault begins after some healthy seconds."""
    residual = drive.residual.copy()
    channel = MOTORS[wheel]
    rows = slice(_HEALTHY, None)
    measured = (drive.residual + drive.modelled)[rows, channel]
    known = np.isfinite(measured)
    reported = measured.copy()
    reported[known] = kind.change(measured[known], size) if known.any() else measured[known]
    added = np.where(known, reported - measured, 0.0)
    residual[rows, channel] += added
    residual[rows, ENCODERS[wheel]] += added
    if kind.in_total:
        residual[rows, TOTAL] += added
    return evolve(drive, residual=residual)


def try_injected(
    drive: Observed,
    bands: BandSettings,
    settings: ClassifierSettings,
    kinds: Sequence[InjectedKind],
    robot: str,
) -> list[Trial]:
    """Each kind at each wheel, down to the smallest size that is found, on all cores.

    `robot`: where it is described.
    """
    shown = drive.part(slice(0, _SHOWN), drive.name)
    jobs = [
        (shown, bands, settings, kind, robot, wheel)
        for kind in kinds
        for wheel in range(len(MOTORS))
    ]
    return [trial for trials in on_all_cores(_tried, jobs) for trial in trials]


_Job = tuple[Observed, BandSettings, ClassifierSettings, InjectedKind, str, int]


def _tried(job: _Job) -> list[Trial]:
    shown, bands, settings, kind, robot, wheel = job

    def attempt(size: float) -> Trial:
        frames = frames_of(injected(shown, kind, size, wheel), bands)
        begin = float(shown.seconds[min(_HEALTHY, len(frames) - 1)])
        alarm = first_alarm(frames, settings, robot_of(robot), begin)
        return Trial.of(kind.name, size, kind.unit, wheel=wheel, begin=begin, alarm=alarm)

    return smallest_found(kind.sizes, attempt)
