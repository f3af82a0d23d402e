"""Go or no-go: each thing that speaks against it is named with its drive and a remedy."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from tomr_commission.alarm import AlarmLevel
from tomr_commission.bands import bands_of
from tomr_commission.evidence import Decided, Episode
from tomr_commission.observed import Observed
from tomr_commission.request import BandChoice, CommissionRequest
from tomr_commission.verdict import Outcome, early_reasons, reasons

Steady = Callable[..., Observed]
QUIET = Decided(1000, 0, ())
LEVEL = AlarmLevel(11.0, 0.05, 9.0, 0.02, 0.01, 0.04, ())


@pytest.fixture
def outcome(steady: Steady) -> Outcome:
    """A robot about which all is well."""
    fitted = tuple(steady(f"tour{k}", seed=k) for k in (1, 2, 3))
    report = {"holdout": {"nrmse_after": 0.02}, "unexplained_share": 0.0}
    levels = [{"channel": "wheel_1/power", "unit": "W", "held_out": True, "rms": 0.1, "level": 1.1}]
    return Outcome(
        CommissionRequest("reference", (), Path()),
        {"report": report, "levels": levels},
        fitted,
        (steady("held", seed=4),),
        bands_of(fitted, BandChoice()),
        LEVEL,
        (QUIET,),
        (QUIET,) * 3,
    )


def said(outcome: Outcome) -> list[str]:
    return [reason.what for reason in reasons(outcome)]


def added(drive: Observed, channel: int, power: float) -> Observed:
    residual = drive.residual.copy()
    residual[:, channel] += power
    return evolve(drive, residual=residual)


def test_nothing_speaks_against_a_good_commissioning(outcome: Outcome) -> None:
    assert said(outcome) == []


def test_what_no_band_changes_is_known_early(outcome: Outcome, steady: Steady) -> None:
    first, second, third = outcome.fitted
    for channel in (1, 2, 3):
        second = added(second, channel, 0.8)
    # Another floor, and a drive held out that is named in: that takes bands.
    alarm = Decided(1000, 0, (Episode("slip", None, 1.0, 2.0),))
    found = evolve(outcome, fitted=(first, second, third), held_said=(alarm,))
    early = [reason.what for reason in early_reasons(found)]
    assert [line.split(":")[0] for line in early] == ["tour2"]
    assert said(found)[0] == early[0]
    assert any("slip is named" in line for line in said(found)[1:])


def test_another_floor_in_one_drive(outcome: Outcome) -> None:
    """0.8 W more at 5 rad/s and 4 W: a fifth of the usual torque at every wheel."""
    first, second, third = outcome.fitted
    for channel in (1, 2, 3):
        second = added(second, channel, 0.8)
    found = said(evolve(outcome, fitted=(first, second, third)))
    assert any(
        line.startswith("tour2: every wheel needs +20 % of the usual torque") for line in found
    )


@pytest.mark.parametrize(
    ("power", "size", "like"),
    [(1.2, "+30", "a wheel that drags"), (-1.2, "-30", "a power sensor that shows too little")],
)
def test_one_wheel_that_needs_another_torque_in_one_drive(
    outcome: Outcome, power: float, size: str, like: str
) -> None:
    first, second, third = outcome.fitted
    found = said(evolve(outcome, fitted=(added(first, 3, power), second, third)))
    told = [line for line in found if line.startswith(f"tour1: wheel 3 needs {size} %")]
    assert len(told) == 1
    assert like in told[0]


def test_drive_that_scatters_more_than_the_rest(outcome: Outcome, steady: Steady) -> None:
    first, second, _ = outcome.fitted
    wild = evolve(outcome, fitted=(first, second, steady("tour3", sigma=0.5)))
    assert any("tour3 needs bands" in line for line in said(wild))


def idle(drive: Observed, wheel: int) -> Observed:
    """A drive in which a wheel stands and its motor draws next to nothing."""
    modelled, residual = drive.modelled.copy(), drive.residual.copy()
    modelled[:, [1 + wheel, 4 + wheel, 7 + wheel]] = 1e-9
    residual[:, 4 + wheel] = 0.0
    return evolve(drive, modelled=modelled, residual=residual)


@pytest.mark.filterwarnings("error")
def test_a_wheel_that_idles_in_a_drive_does_not_drag_there(outcome: Outcome) -> None:
    first, second, third = outcome.fitted
    assert said(evolve(outcome, fitted=(idle(first, 2), idle(second, 1), third))) == []
    everywhere = tuple(idle(drive, 2) for drive in (first, second, third))
    held = tuple(idle(drive, 2) for drive in outcome.held)
    assert said(evolve(outcome, fitted=everywhere, held=held)) == []


def test_a_wheel_that_has_little_to_do_in_a_drive_is_measured_by_the_others(
    outcome: Outcome,
) -> None:
    """0.3 W more are three quarters of its 0.4 W there, and a fourteenth of its usual torque."""
    first, second, third = outcome.fitted
    modelled = first.modelled.copy()
    modelled[:, 2] = 0.4
    little = added(evolve(first, modelled=modelled), 2, 0.3)
    found = said(evolve(outcome, fitted=(little, second, third)))
    assert not any("of the usual torque" in line for line in found)


def among_many(outcome: Outcome, steady: Steady, apart: float) -> list[str]:
    """Of ten drives that scatter by a fifth of the usual torque each way, and one of its own."""
    drives = [steady(f"tour{k}", seed=k) for k in range(11)]
    for k, drive in enumerate(drives):
        power = 0.8 * (-1.0) ** k if k < 10 else apart
        for channel in (1, 2, 3):
            drive = added(drive, channel, power)
        drives[k] = drive
    found = said(
        evolve(
            outcome,
            fitted=tuple(drives),
            fitted_said=(QUIET,) * 11,
            bands=bands_of(drives, BandChoice()),
        )
    )
    return [line for line in found if "of the usual torque" in line]


def test_of_many_drives_one_is_apart_that_lies_out_of_their_scatter(
    outcome: Outcome, steady: Steady
) -> None:
    assert among_many(outcome, steady, 1.6) == []
    (line,) = among_many(outcome, steady, 7.2)
    assert line.startswith("tour10: every wheel needs +1")


def test_of_many_drives_some_need_wider_bands(outcome: Outcome, steady: Steady) -> None:
    def wider(sigmas: list[float]) -> list[str]:
        drives = tuple(steady(f"tour{k}", sigma=s, seed=k) for k, s in enumerate(sigmas))
        quiet = (QUIET,) * len(drives)
        found = said(evolve(outcome, fitted=drives, fitted_said=quiet))
        return [line.partition(" needs bands")[0] for line in found if "needs bands" in line]

    even = [0.1 * 1.25**k for k in range(9)]
    assert wider(even) == []
    assert wider([*[0.1] * 8, 0.6]) == ["tour8"]
    # A few do not show how far drives scatter.
    assert wider([0.1, 0.15, 0.2, 0.6]) == ["tour3"]
    # Within the bands nothing is amiss.
    assert wider([0.01, 0.01, 0.01, 0.05]) == []


def test_a_short_drive_that_starts_late_is_not_apart(outcome: Outcome, steady: Steady) -> None:
    def short(ticks: int) -> list[str]:
        drive = steady("tour4", ticks=120)
        drive.residual[5 : 5 + ticks, 0] = 2.0
        fitted, said_ = (*outcome.fitted, drive), (QUIET,) * 4
        found = said(evolve(outcome, fitted=fitted, fitted_said=said_))
        return [line.partition(" needs bands")[0] for line in found if "needs bands" in line]

    assert short(2) == []
    assert short(6) == ["tour4"]


def test_alarm_in_a_healthy_drive(outcome: Outcome) -> None:
    alarmed = Decided(1000, 0, (Episode("slip", None, 12.0, 13.5),))
    found = said(evolve(outcome, fitted_said=(QUIET, alarmed, QUIET)))
    assert found == [
        "tour2: slip is named from 12.0 s to 13.5 s (1 in all) in a drive taken for healthy"
    ]


def test_alarm_in_a_drive_held_out(outcome: Outcome) -> None:
    alarmed = Decided(1000, 0, (Episode("slip", None, 12.0, 13.5),))
    found = said(evolve(outcome, held_said=(alarmed,)))
    assert found == [
        "held: slip is named from 12.0 s to 13.5 s (1 in all) in a drive taken for healthy"
    ]


def test_held_out_drive_outside_of_the_bands(outcome: Outcome, steady: Steady) -> None:
    wild = evolve(outcome, held=(steady("held", sigma=0.25, seed=9),))
    assert any("of the held-out residuals of" in line for line in said(wild))


@pytest.mark.parametrize(
    ("level", "nrmse", "is_named"), [(1.5, 0.02, False), (9.0, 0.4, True), (9.0, 0.05, False)]
)
def test_what_is_left_over(outcome: Outcome, level: float, nrmse: float, is_named: bool) -> None:
    """Far above the noise and far off: either alone may be a very quiet sensor, or a rough one."""
    explained: dict[str, Any] = {
        "report": {**outcome.explained["report"], "holdout": {"nrmse_after": nrmse}},
        "levels": [{**outcome.explained["levels"][0], "level": level}],
    }
    found = said(evolve(outcome, explained=explained))
    assert bool(found) == is_named
    assert not found or "9.0 times the sensors' noise" in found[0]


@pytest.mark.parametrize(("level", "is_named"), [(1.6, False), (3.4, True)])
def test_what_is_not_explained_counts_where_it_exceeds_the_noise(
    outcome: Outcome, level: float, is_named: bool
) -> None:
    explained: dict[str, Any] = {
        "report": {"holdout": {"nrmse_after": 0.02}, "unexplained_share": 0.6},
        "levels": [{**outcome.explained["levels"][0], "level": level}],
    }
    found = said(evolve(outcome, explained=explained))
    assert found == (["60 % of the mismatch of robot.yaml is not explained"] if is_named else [])


def test_rate_that_no_caution_reaches(outcome: Outcome) -> None:
    level = evolve(LEVEL, needed=44.0, caution=30.0, expected=0.4, low=0.2, high=0.8)
    (reason,) = reasons(evolve(outcome, level=level))
    assert "0.4 false alarms per hour are expected" in reason.what
    assert "--false-alarms-per-hour 0.8" in reason.remedy


def test_too_little_driving(outcome: Outcome) -> None:
    short = tuple(drive.part(slice(0, 200), drive.name) for drive in outcome.fitted)
    (reason,) = reasons(evolve(outcome, fitted=short))
    assert "minutes to fit to" in reason.what
    assert np.isclose(60.0 * sum(drive.hours for drive in short), 0.5, atol=0.01)
