"""Faults put into real recordings, where that is honest: what a power sensor or a motor would show.

Powers are put off as the sensor would tell them, tick by tick; motion, commands and everything else
stay as recorded. What a fault does to the motion is not in it: such faults are simulated.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_commission.evidence import Episode, decisions
from tomr_commission.observed import Observed, frames_of
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, TOTAL
from tomr_fault_diag.residuals.settings import BandSettings

Array = NDArray[np.float64]

_HEALTHY = 100  # ticks before the fault


@frozen
class InjectedKind:
    """One kind of fault: what becomes of the power of a motor, and whether the total shows it."""

    name: str
    sizes: tuple[float, ...]  # to try, the largest first; in the unit
    unit: str
    change: Callable[[Array, float], Array]  # measured power (n,), size -> what is told (n,)
    in_total: bool = False


def _scaled(power: Array, size: float) -> Array:
    return power * (1.0 + size)


def _held(power: Array, size: float) -> Array:
    return np.full_like(power, power[0])


KINDS: tuple[InjectedKind, ...] = (
    InjectedKind("power sensor dead", (1.0,), "", lambda power, size: np.zeros_like(power)),
    InjectedKind("power sensor frozen", (1.0,), "", _held),
    InjectedKind("power sensor scaled", (1.0, 0.5, 0.3, 0.2, 0.1, 0.05), "of the power", _scaled),
    InjectedKind(
        "power sensor biased",
        (20.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5),
        "W",
        lambda power, size: power + size,
    ),
    InjectedKind(
        "motor draws more", (1.0, 0.5, 0.3, 0.2, 0.1, 0.05), "of its power", _scaled, in_total=True
    ),
)


def injected(drive: Observed, kind: InjectedKind, size: float, wheel: int) -> Observed:
    """A drive in which a fault begins after some healthy seconds."""
    residual = drive.residual.copy()
    channel = MOTORS[wheel]
    rows = slice(_HEALTHY, None)
    measured = (drive.residual + drive.modelled)[rows, channel]
    known = np.isfinite(measured)
    told = measured.copy()
    told[known] = kind.change(measured[known], size) if known.any() else measured[known]
    added = np.where(known, told - measured, 0.0)
    residual[rows, channel] += added
    residual[rows, ENCODERS[wheel]] += added
    if kind.in_total:
        residual[rows, TOTAL] += added
    return evolve(drive, residual=residual)


@frozen
class Trial:
    """One fault of a size at a wheel, and what was said of it."""

    kind: str
    size: float
    unit: str
    wheel: int
    delay: float | None  # s from its beginning to the first alarm; None: not found
    called: str  # what it was called, empty where it was not found


def try_injected(
    drives: Sequence[Observed],
    bands: BandSettings,
    settings: ClassifierSettings,
    kinds: Sequence[InjectedKind] = KINDS,
) -> list[Trial]:
    """Each kind and size at each wheel, downwards until it is not found."""
    trials = []
    for kind in kinds:
        for wheel in range(len(MOTORS)):
            for size in kind.sizes:
                trial = _trial(drives, bands, settings, kind, (size, wheel))
                trials.append(trial)
                if trial.delay is None:
                    break
    return trials


def _trial(
    drives: Sequence[Observed],
    bands: BandSettings,
    settings: ClassifierSettings,
    kind: InjectedKind,
    case: tuple[float, int],
) -> Trial:
    """Found if it is in every one of the drives; the delay is the longest."""
    size, wheel = case
    delays, names = [], []
    for drive in drives:
        frames = frames_of(injected(drive, kind, size, wheel), bands)
        begin = float(drive.seconds[min(_HEALTHY, len(frames) - 1)])
        found = first_alarm(decisions(frames, settings).alarms, begin)
        if found is None:
            return Trial(kind.name, size, kind.unit, wheel, None, "")
        delays.append(found.begin - begin)
        names.append(called(found))
    return Trial(kind.name, size, kind.unit, wheel, max(delays), ", ".join(dict.fromkeys(names)))


def first_alarm(alarms: Sequence[Episode], begin: float) -> Episode | None:
    """The first alarm from a time on."""
    return next((alarm for alarm in alarms if alarm.begin >= begin), None)


def called(alarm: Episode) -> str:
    """An alarm in words."""
    return alarm.state


@frozen
class Floor:
    """The smallest size of a kind of fault that was found at every wheel, and at some."""

    kind: str
    unit: str
    everywhere: float | None
    somewhere: float | None
    delay: float | None  # s, median of all that were found
    called: str


def floors_of(trials: Sequence[Trial]) -> list[Floor]:
    """Detection floors by kind."""
    by_kind: Mapping[str, list[Trial]] = {}
    for trial in trials:
        by_kind.setdefault(trial.kind, []).append(trial)  # type: ignore[attr-defined]
    return [_floor(kind, rows) for kind, rows in by_kind.items()]


def _floor(kind: str, rows: Sequence[Trial]) -> Floor:
    smallest = []
    for wheel in sorted({row.wheel for row in rows}):
        found = [row.size for row in rows if row.wheel == wheel and row.delay is not None]
        smallest.append(min(found) if found else None)
    known = [size for size in smallest if size is not None]
    delays = [row.delay for row in rows if row.delay is not None]
    names = [name for row in rows for name in row.called.split(", ") if name]
    return Floor(
        kind,
        rows[0].unit,
        max(known) if len(known) == len(smallest) else None,
        min(known) if known else None,
        float(np.median(delays)) if delays else None,
        ", ".join(dict.fromkeys(sorted(names, key=lambda name: -names.count(name)))),
    )
