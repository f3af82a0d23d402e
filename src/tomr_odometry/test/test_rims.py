"""How exactly encoders measure ways: their quantum, their times, and whether they stand still."""

import numpy as np
import pytest

from tomr_odometry.rims import Rims

RADIUS, COUNT, MS = np.full(3, 0.05), 1e-3, 1_000_000
BRAKED = [0.0, 3.0, 5.0, *(5 + 20.0 * k - k * k for k in range(11))]  # down to nothing
FROZEN = [0.0, 3.0, 5.0, *(5 + 20.0 * k for k in range(11))]  # at speed, and no further


def taken(counts: list[float], period_ms: int = 10, start: float = 0.0) -> tuple[Rims, np.ndarray]:
    """Rims after some samples, in counts, and the variance of the last way [m^2]."""
    rims, found = Rims(RADIUS), np.zeros((2, 3))
    for k, count in enumerate(counts):
        found = rims.take(MS * period_ms * (k + 1), np.full(3, start + COUNT * count), 1e-4)
    return rims, found[1]


@pytest.mark.parametrize("start", [0.0, 1e3])
def test_a_quantum_is_what_ways_and_their_differences_are_multiples_of(start: float) -> None:
    _, variance = taken([0, 3, 5, 7, 7, 7], start=start)
    assert variance == pytest.approx((COUNT * RADIUS) ** 2 / 12.0, rel=1e-3)


def test_a_way_is_known_as_exactly_as_its_time() -> None:
    _, variance = taken([0, 3, 5, 1005])
    speed = COUNT * 1000.0 * RADIUS / 0.01
    assert variance == pytest.approx((1e-4 * speed) ** 2 + (COUNT * RADIUS) ** 2 / 12.0, rel=1e-6)


def test_slow_samples_whose_times_are_uneven_show_less() -> None:
    uneven = [100.0 * k + 20.0 * (k % 2) for k in range(1, 40)]
    counts = [0.0, 3.0, 5.0, *uneven, uneven[-1]]
    quick, slow = (taken(counts, period)[1] for period in (10, 50))
    assert quick == pytest.approx((COUNT * RADIUS) ** 2 / 12.0, rel=1e-3)
    assert (slow > 10.0 * quick).all()


def test_encoders_that_repeat_themselves_are_waited_for_a_second() -> None:
    rims, _ = taken([20.0 * k for k in range(12)])
    last, angle = 120 * MS, np.full(3, COUNT * 220)
    assert rims.is_frozen(last + 100 * MS, angle)
    assert not rims.is_frozen(last + 100 * MS, angle + COUNT)
    assert not rims.is_frozen(last + 1100 * MS, angle)


def test_a_wheel_rests_while_it_turns_by_no_more_than_a_count() -> None:
    assert taken([0, 3, 5, 5, 6, 5, 5])[0].rest == pytest.approx(0.04)
    assert taken([0, 3, 5, 5, 6, 7, 7])[0].rest == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("counts", "after"),
    [
        (BRAKED, 0.3),
        (FROZEN, 1.0),
        ([*FROZEN, 205.0, 205.0, *(300.0 + count for count in BRAKED)], 0.3),
    ],
    ids=["braked", "frozen", "frozen before"],
)
def test_wheels_stand_after_a_while_and_where_they_stopped_abruptly_later(
    counts: list[float], after: float
) -> None:
    for rest in (0.1, 0.25, 0.35, 0.95, 1.05):
        rims, _ = taken([*counts, *[counts[-1]] * round(100 * rest)])
        assert rims.stands == (rest > after), rest


def test_a_rim_that_turns_as_the_ground_goes_by_does_not_slide() -> None:
    rims = Rims(RADIUS)
    for k in range(40):
        time, speed = 0.01 * k, np.array([0.5, -0.2, 1.0]) * 0.01 * k
        rims.take(MS * 10 * (k + 1), 0.5 * speed * time / RADIUS, 1e-4)
        rims.passes(speed)  # it speeds up: means over different times would differ by 2.5 cm/s
    assert rims.sliding == pytest.approx(np.zeros(3), abs=6e-3)
    rims.passes(np.array([0.0, 0.0, 1.0]))
    for k in range(40, 60):
        rims.take(MS * 10 * (k + 1), np.array([0.4, 0.0, 0.0]) * 0.01 * k / RADIUS, 1e-4)
        rims.passes(np.array([0.1, 0.0, -0.2]))
    assert rims.sliding == pytest.approx([0.3, 0.0, 0.2], abs=1e-6)
    assert rims.blur == pytest.approx(rims._quantum * RADIUS / 0.05)


def test_encoders_that_are_silent_leave_no_heap_of_samples() -> None:
    rims, _ = taken([0.0, 3.0, 5.0, 25.0])
    for _ in range(1000):  # the IMU goes on
        rims.passes(np.zeros(3))
    assert len(rims._passed) < 10
