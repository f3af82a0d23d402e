"""What the motion of the last moments could show: which wheels turn, by whom, and how steadily."""

import math
from collections.abc import Sequence

import pytest

from tomr_fault_diag.classifier.observability import MotionWatch, Unseen
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame

Wheel = tuple[float, float]  # expected speed, and how much faster it turns that way [rad/s]
UNKNOWN = math.nan
STILL: Wheel = (0.0, 0.0)


def seen(*ticks: Sequence[Wheel]) -> Unseen:
    """After ticks of 50 ms; the first one's wheels stand for the half second before as well."""
    watch, found = MotionWatch(), Unseen()
    none = Residual(0.0, 2.0, 2.0)
    for number, wheels in enumerate([*[ticks[0]] * 12, *ticks[1:]]):
        speeds = [Residual(off, 0.2, wanted, "rad/s") for wanted, off in wheels]
        residuals = (*[none] * 4, *speeds, *[none] * 3)
        found = watch.take(ResidualFrame((number + 1) * 50_000_000, residuals))
    return found


@pytest.mark.parametrize(
    ("wheel", "idle", "moved"),
    [
        (STILL, (0,), ()),
        ((0.0, 2.0), (), (0,)),
        ((-0.4, -0.8), (0,), ()),  # it turns by 0.4 rad/s, the other way
        ((5.0, -5.0), (), ()),
        ((-5.0, -5.0), (), ()),
        ((UNKNOWN, UNKNOWN), (), ()),  # it may be commanded to turn
        ((0.0, UNKNOWN), (), ()),  # it may turn, or not
    ],
)
def test_a_wheel_is_idle_that_need_not_turn_and_does_not(
    wheel: Wheel, idle: tuple[int, ...], moved: tuple[int, ...]
) -> None:
    found = seen([wheel, (8.0, 0.0), (-8.0, 0.0)])
    assert (found.wheels, found.moved) == (idle, moved)


def test_what_was_a_moment_ago_counts() -> None:
    turning, standing = [(5.0, 0.0)] * 3, [STILL] * 3
    assert seen(turning, standing).wheels == ()
    assert not seen(turning, standing).slip
    assert seen(turning, *[standing] * 11).everything
    assert seen(standing, [(0.0, 2.0)] * 3, standing).moved == (0, 1, 2)


def test_a_wheel_that_coasts_is_moved_by_nobody() -> None:
    """One without its signal turns on as it was asked to, for as long as it likes."""
    coasting = [(0.0, 6.0), (0.0, 0.0), (8.0, 0.0)]
    asked = [(6.0, 0.0), (0.0, 0.0), (8.0, 0.0)]
    assert seen(asked, *[coasting] * 30).moved == ()
    stood = [*[coasting] * 30, [(0.0, 0.0)] * 3]
    assert seen(asked, *stood).moved == ()
    assert seen(asked, *stood, coasting).moved == (0,)  # but who stood and turns is
    assert seen(asked, *stood, asked, *[coasting] * 30).moved == ()


@pytest.mark.parametrize(("off", "moved"), [(0.15, ()), (0.25, (0,)), (-0.25, (0,))])
def test_a_wheel_that_stirs_is_moved_where_none_is_to_turn(
    off: float, moved: tuple[int, ...]
) -> None:
    """0.2 rad/s is the band."""
    stirs: Wheel = (0.0, off)
    assert seen([STILL] * 3, [stirs, STILL, STILL]).moved == moved
    assert seen([STILL, STILL, (8.0, 0.0)], [stirs, STILL, (8.0, 0.0)]).moved == ()
    assert seen([STILL] * 3, [(0.2, off), STILL, STILL]).moved == ()  # it may be asked to creep
    assert seen([STILL] * 3, [(0.2, 0.4), STILL, STILL]).moved == (0,)  # but not so fast


def test_a_wheel_that_comes_to_rest_is_moved_by_nobody() -> None:
    slow: Wheel = (0.0, 0.3)
    stops = [(6.0, 0.0)] * 3, *[[slow] * 3] * 20
    assert seen(*stops).moved == ()
    assert seen(*stops, [STILL] * 3, [slow] * 3).moved == (0, 1, 2)


def test_a_robot_is_driven_that_was_asked_to_turn_some_wheel() -> None:
    assert seen([(0.0, 2.0), STILL, (8.0, 0.0)]).driven
    assert not seen([(0.0, 2.0), STILL, STILL]).driven
    assert seen([(8.0, 0.0)] * 3, [STILL] * 3).driven


def test_slip_is_not_seen_where_nothing_asks_for_traction() -> None:
    assert seen([(5.0, 0.0)] * 3).slip
    assert not seen([(5.0, 0.0)] * 3, [(5.4, 0.0)] * 3).slip
