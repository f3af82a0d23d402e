"""Go or no-go, and why."""

from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_commission.alarm import AlarmLevel
from tomr_commission.bands import needed, outside, steady_drag
from tomr_commission.evidence import MOST_CAUTION, Decided, together
from tomr_commission.observed import Observed
from tomr_commission.request import CommissionRequest, Limits
from tomr_fault_diag.residuals.settings import BandSettings

Array = NDArray[np.float64]

DRAWN = ("W", "A")
_WITHIN = 0.999
_NEXT_TO_NONE = 1e-9  # bands


@frozen
class Reason:
    """One thing that speaks against switching the diagnosis on, and what to do."""

    what: str
    remedy: str


@frozen
class Recorded:
    """What the recordings show before any band or level is chosen."""

    request: CommissionRequest
    explained: Any  # of `explain_drives`
    fitted: tuple[Observed, ...]
    held: tuple[Observed, ...]

    @property
    def held_name(self) -> str:
        """Of all drives held out."""
        return ", ".join(drive.name for drive in self.held)

    @property
    def held_hours(self) -> float:
        """Of all drives held out."""
        return sum(drive.hours for drive in self.held)


@frozen
class Outcome(Recorded):
    """All that the verdict rests on."""

    bands: BandSettings
    level: AlarmLevel
    held_said: tuple[Decided, ...]
    fitted_said: tuple[Decided, ...]

    @property
    def held_together(self) -> Decided:
        """What is said of all drives held out."""
        return together(self.held_said)


def early_reasons(recorded: Recorded) -> list[Reason]:
    """What makes a no-go whatever the rest shows: known before the shoves are simulated."""
    limits = recorded.request.limits
    # A drive with a fault in it first: the rest may come of it.
    return [
        *_floors(recorded, limits),
        *_too_short(recorded, limits),
        *_left_over(recorded, limits),
    ]


def reasons(outcome: Outcome) -> list[Reason]:
    """Everything that makes a no-go; empty: go."""
    limits = outcome.request.limits
    return [
        *early_reasons(outcome),
        *_apart(outcome, limits),
        *_held_out(outcome, limits),
        *_alarm_rate(outcome),
    ]


def _too_short(recorded: Recorded, limits: Limits) -> list[Reason]:
    minutes = 60.0 * sum(drive.hours for drive in recorded.fitted)
    held = 60.0 * recorded.held_hours
    if minutes >= limits.minutes and held >= limits.held_minutes:
        return []
    return [
        Reason(
            f"{minutes:.1f} minutes to fit to and {held:.1f} held out are too few: "
            f"{limits.minutes:g} and {limits.held_minutes:g} are needed",
            "record the drive of tomr_commission plan, and give it as well",
        )
    ]


def _left_over(recorded: Recorded, limits: Limits) -> list[Reason]:
    found = []
    report = recorded.explained["report"]
    levels = [line for line in recorded.explained["levels"] if line["unit"] in DRAWN]
    shown = [line for line in levels if line["held_out"]] or levels
    worst = max(shown, key=lambda line: line["level"] or 0.0) if shown else {"level": 0.0}
    score = report["holdout"]
    nrmse = None if score is None else score["nrmse_after"]
    is_far = (worst["level"] or 0.0) > limits.level
    if is_far and (nrmse is None or nrmse > limits.nrmse):
        found.append(
            Reason(
                f"what the explained robot leaves of {worst['channel']} is {worst['level']:.1f} "
                f"times the sensors' noise ({worst['rms']:.3g} {worst['unit']} RMS)",
                "read gap/report.html: it says what was not explained; mend the description or "
                "run tomr_gap explain with a larger --tolerance and all drives",
            )
        )
    # Most of a mismatch that hardly exceeds the noise may well stay unexplained.
    if is_far and report["unexplained_share"] > limits.unexplained:
        found.append(
            Reason(
                f"{100 * report['unexplained_share']:.0f} % of the mismatch of robot.yaml is not "
                "explained",
                "read gap/report.html, record the drive that it suggests, and commission again",
            )
        )
    return found


def _apart(outcome: Outcome, limits: Limits) -> list[Reason]:
    """A drive among the fitted ones that scatters otherwise than the rest."""
    drives = outcome.fitted
    if len(drives) < 2:
        return []
    wide = np.array([max(needed(drive, outcome.bands, _WITHIN).values()) for drive in drives])
    beyond = _beyond(
        np.log(np.maximum(wide, _NEXT_TO_NONE))[:, None], float(np.log(limits.drives_apart)), limits
    )[:, 0]
    return [
        Reason(
            f"{drive.name} needs bands {np.exp(size):.1f} times as wide as the "
            "other drives: a fault, another floor or another load in it",
            "look at it with tomr_diagnose and leave it out, or record it again",
        )
        for drive, size, needs in zip(drives, beyond, wide, strict=True)
        if size > 0.0 and needs > 1.0
    ]


def _beyond(values: Array, least: float, limits: Limits) -> Array:
    """By how much values of drives, (n, k), differ from the others' median; 0: not noteworthy.

    By more than `least`, and of many drives, which show how far they scatter, far out of that.
    """
    others = [_median(np.delete(values, row, axis=0)) for row in range(len(values))]
    apart = np.nan_to_num(values - others)
    most = np.full(values.shape[1], least)
    if len(values) >= limits.many_drives:
        scatter = 1.4826 * _median(np.abs(values - _median(values)))
        most = np.maximum(most, limits.far_out * np.nan_to_num(scatter))
    return np.where(np.abs(apart) > most, apart, 0.0)


def _median(values: Array) -> Array:
    """Of the rows that are known, (k,); NaN where none is."""
    known = [column[np.isfinite(column)] for column in values.T]
    return np.array([np.median(column) if len(column) else np.nan for column in known])


def _floors(recorded: Recorded, limits: Limits) -> list[Reason]:
    """A drive in which the wheels need another torque than in the rest."""
    drives = (*recorded.fitted, *recorded.held)
    if len(drives) < 2:
        return []
    drags = [steady_drag(drive) for drive in drives]
    # A wheel that idles in one drive is measured by what it usually does.
    usual = _median(np.array([drag.usual for drag in drags]))
    shares = np.array([drag.added / usual for drag in drags])
    return [
        _another_floor(drive.name, row)
        for drive, row in zip(drives, _beyond(shares, limits.drag_apart, limits), strict=True)
        if row.any()
    ]


def _another_floor(drive: str, share: Array) -> Reason:
    """`share` by which the torque at each wheel differs from the usual, (3,); 0: as usual."""
    alike = np.ptp(share) < 0.5 * np.abs(share).max()
    wheel = int(np.argmax(np.abs(share)))
    what = "every wheel needs" if alike else f"wheel {wheel + 1} needs"
    size = float(np.mean(share)) if alike else float(share[wheel])
    remedy = "look after that wheel and its power sensor, and leave the drive out"
    if alike:
        like = "another floor or load"
        remedy = "commission each floor by itself, or give drives of both to fit"
    elif size > 0.0:
        like = "a wheel that drags, or a power sensor that shows too much"
    else:
        like = "a power sensor that shows too little, or a wheel that slips"
    return Reason(
        f"{drive}: {what} {100 * size:+.0f} % of the usual torque beside the other drives: {like}",
        remedy,
    )


def _held_out(outcome: Outcome, limits: Limits) -> list[Reason]:
    found = []
    for said, drive in zip(
        (*outcome.held_said, *outcome.fitted_said), (*outcome.held, *outcome.fitted), strict=True
    ):
        if said.alarms:
            alarm = said.alarms[0]
            found.append(
                Reason(
                    f"{drive.name}: {alarm.state} is named from {alarm.begin:.1f} s to "
                    f"{alarm.end:.1f} s ({len(said.alarms)} in all) in a drive taken for healthy",
                    "if something was wrong there, leave it out with --skip or record it again; "
                    "else the bands do not fit: give more drives",
                )
            )
    shares = outside(outcome.held, outcome.bands)
    kind = max(shares, key=shares.__getitem__, default="")
    if kind and shares[kind] > limits.outside:
        found.append(
            Reason(
                f"{100 * shares[kind]:.1f} % of the held-out residuals of {kind} lie outside of "
                f"their bands, {100 * limits.outside:g} % may",
                "the held-out drive is of another kind (floor, load, heat): give all kinds",
            )
        )
    return found


def _alarm_rate(outcome: Outcome) -> list[Reason]:
    level = outcome.level
    if level.is_enough:
        return []
    return [
        Reason(
            f"even with the most caution there is ({MOST_CAUTION:g} decades) "
            f"{level.expected:.2g} false alarms per hour are expected "
            f"(95 %: {level.low:.2g} to {level.high:.2g}), {level.wanted:g} were asked for",
            f"ask for --false-alarms-per-hour {_rounded_up(level.high)}, or see commission.html "
            "for where they come from",
        )
    ]


def _rounded_up(value: float) -> str:
    return f"{float(f'{1.05 * value:.1g}'):g}"
