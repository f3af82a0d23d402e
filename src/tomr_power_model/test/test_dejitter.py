"""Stamps that jitter although the samples do not, and stamps that are to be trusted."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from tomr_power_model.drive.dejitter import dejitter, even, grid_of, is_jitter
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow
from tomr_power_model.model.stamps import RecentStamps

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NOTHING = (0.0, 0.0, 0.0)
SPEED = np.array([6.0, -3.0, -3.0])  # rad/s, mean


def _angles(seconds: np.ndarray) -> np.ndarray:
    """Wheels that speed up and slow down, (n, 3) [rad]."""
    return np.outer(seconds + 0.1 * np.sin(2.0 * seconds), SPEED)


def _speeds(seconds: float) -> np.ndarray:
    return SPEED * (1.0 + 0.2 * np.cos(2.0 * seconds))


def _jitter(count: int) -> np.ndarray:
    return np.round(np.random.default_rng(4).normal(0.0, 0.5 * MS, count)).astype(np.int64)


def _window(stamps: np.ndarray, angles: np.ndarray) -> EncoderWindow:
    window = EncoderWindow(70 * MS, 50 * MS, 200 * MS)
    for stamp, angle in zip(stamps.tolist(), angles.tolist(), strict=True):
        window.add(EncoderSample(BASE + stamp, tuple(angle), NOTHING))
    return window


def _error(stamps: np.ndarray, angles: np.ndarray, known: int = 300) -> float:
    """Largest error of the speeds in the last half second, as a share, from so many samples."""
    errors = []
    for tick in range(2500, 3000, 50):
        kept = np.flatnonzero(stamps <= tick * MS)[-known:]
        found = _window(stamps[kept], angles[kept]).at(BASE + tick * MS).speed
        errors.append(np.abs(found / _speeds(1e-3 * (tick - 25)) - 1.0).max())
    return float(max(errors))


def test_jitter_of_stamps_does_not_pass_for_motion() -> None:
    """Half a millisecond at 100 Hz: 1 to 2 % of the speed, a few thousandths without."""
    even = np.arange(300, dtype=np.int64) * 10 * MS
    angles = _angles(1e-9 * even)
    stamps = even + _jitter(300)
    assert _error(stamps, angles) < 0.004
    assert _error(stamps, angles, known=30) > 0.01  # too few to detect jitter


def test_samples_that_are_really_uneven_keep_their_stamps() -> None:
    stamps = np.arange(300, dtype=np.int64) * 10 * MS + _jitter(300)
    noise = np.random.default_rng(5).normal(0.0, 5e-4, (300, 3))  # rad
    angles = _angles(1e-9 * stamps) + noise
    assert _error(stamps, angles) < 0.01
    watched = RecentStamps()
    for stamp, angle in zip(stamps.tolist(), angles.tolist(), strict=True):
        watched.add(stamp, tuple(angle))
    assert watched.times(stamps[-8:].tolist()) == stamps[-8:].tolist()


@pytest.mark.parametrize("speed", [0.4, 1.0, 2.5, 13.0])
@pytest.mark.parametrize("is_even", [True, False])
def test_coarse_encoders_are_not_taken_for_the_other(speed: float, is_even: bool) -> None:
    """64 counts a motor turn: rounding hides the jitter at any moment, and never turns it round.

    At a steady speed the counts beat with the samples, which looks like noise of two values.
    """
    random, count = np.random.default_rng(7), 2.0 * np.pi / (64 * 15)
    even = 0.01 * np.arange(2000)
    stamps = even + np.clip(random.normal(0.0, 7e-4, len(even)), -3e-3, 3e-3)
    turned = np.outer(even if is_even else stamps, speed * np.array([1.0, -0.37, 0.61]))
    angles = count * np.floor(turned / count)
    said = []
    for first in range(0, 1800, 200):
        part = slice(first, first + 200)
        grid = grid_of(stamps[part])
        assert grid is not None
        said.append(is_jitter(stamps[part], grid, angles[part]))
    assert (not is_even) not in said
    if speed >= 2.5:
        assert said.count(is_even) >= 8  # of nine: soon detected


def test_wheels_that_come_to_rest_are_not_taken_for_uneven_samples() -> None:
    """Their last counts come one by one, wherever they happen to fall."""
    even, count, wrong = 0.01 * np.arange(2000), 2.0 * np.pi / (64 * 15), 0
    since = np.maximum(even % 4.0 - 2.0, 0.0)
    way = np.outer(even // 4.0 + 1.0 - np.exp(-4.0 * since), [0.25, -0.09, 0.15])
    angles = count * np.floor(way / count)
    for seed in range(6):
        random = np.random.default_rng(seed)
        stamps = even + np.clip(random.normal(0.0, 7e-4, len(even)), -3e-3, 3e-3)
        for first in range(0, 1800, 25):
            part = slice(first, first + 200)
            grid = grid_of(stamps[part])
            wrong += grid is not None and is_jitter(stamps[part], grid, angles[part]) is False
    assert wrong == 0


@pytest.mark.parametrize("speed", [0.5, 6.7])
def test_the_resolution_of_angles_shows_in_their_steps(speed: float) -> None:
    """Of steps of ten counts and eleven one is found; before anything turned, none."""
    count, watched = 2.0 * np.pi / (64 * 15), RecentStamps()
    stamps = np.arange(300, dtype=np.int64) * 10 * MS + _jitter(300)
    for number, stamp in enumerate(stamps.tolist()):
        if number == 250:
            continue  # lost
        turned = max(0.01 * number - 1.0, 0.0) * speed
        watched.add(stamp, (count * (turned // count), 0.0, -count * (turned // count)))
        if number == 99:
            assert watched.resolution == 0.0
    assert watched.resolution == pytest.approx(count)


def test_a_wheel_that_says_nothing_hides_no_jitter() -> None:
    even = 0.01 * np.arange(200)
    stamps = even + 1e-9 * _jitter(200)
    angles = _angles(even)
    angles[:, 1] = np.nan
    grid = grid_of(stamps)
    assert grid is not None
    assert is_jitter(stamps, grid, angles) is True
    assert is_jitter(stamps, grid, _angles(stamps) + 0.0 * angles) is False
    assert is_jitter(stamps, grid, np.full((200, 3), np.nan)) is None


@pytest.mark.parametrize("missing", [0, 7])
def test_even_stamps_stay_bit_by_bit(missing: int) -> None:
    stamps = np.arange(300, dtype=np.int64) * 10 * MS
    if missing:
        stamps = np.delete(stamps, np.arange(100, 300, missing))
    watched = RecentStamps()
    for stamp, angle in zip(stamps.tolist(), _angles(1e-9 * stamps).tolist(), strict=True):
        watched.add(stamp, tuple(angle))
    assert watched.times(stamps[-8:].tolist()) == stamps[-8:].tolist()


def _watched() -> tuple[RecentStamps, np.ndarray]:
    """What has seen 1.2 s of jittered stamps, and the last of them."""
    even = np.arange(120, dtype=np.int64) * 10 * MS
    stamps = even + _jitter(120)
    watched = RecentStamps()
    for stamp, angle in zip(stamps.tolist(), _angles(1e-9 * even).tolist(), strict=True):
        watched.add(stamp, tuple(angle))
    return watched, stamps[-8:]


def test_times_lie_on_the_grid_and_what_is_missing_leaves_a_hole() -> None:
    watched, stamps = _watched()
    times = watched.times(np.delete(stamps, 3).tolist())
    np.testing.assert_allclose(np.diff(times), [10 * MS] * 2 + [20 * MS] + [10 * MS] * 3, atol=5e3)
    assert np.abs(np.delete(stamps, 3) - times).max() > 0.3 * MS


def test_a_driver_that_starts_afresh_is_believed_at_once() -> None:
    watched, _ = _watched()
    stamps = [(1204 + 10 * number) * MS for number in range(8)]
    for stamp in stamps:
        watched.add(stamp, tuple(_angles(np.array([1e-9 * stamp]))[0].tolist()))
    np.testing.assert_allclose(watched.times(stamps), stamps, rtol=0.0, atol=0.02 * MS)


def test_at_rest_nothing_is_reported_and_what_was_known_stays() -> None:
    watched, stamps = _watched()
    still = tuple(_angles(np.array([1.19]))[0].tolist())
    for number, off in enumerate(_jitter(300).tolist()):
        stamp = (1200 + 10 * number) * MS + off
        watched.add(stamp, still)
        stamps = np.append(stamps[1:], stamp)
    times = watched.times(stamps.tolist())
    np.testing.assert_allclose(np.diff(times), 10 * MS, atol=5e3)


def test_jitter_is_taken_off_and_gaps_are_kept() -> None:
    grid = np.delete(np.arange(500) * 0.01, np.arange(200, 230))
    noisy = grid + np.random.default_rng(1).normal(0.0, 5e-4, len(grid))
    assert np.abs(even(noisy) - grid).max() < 1e-4
    assert np.diff(even(noisy)).max() == pytest.approx(0.31, abs=1e-3)


def test_stamps_without_a_grid_are_left_alone() -> None:
    time = np.sort(np.random.default_rng(2).uniform(0.0, 5.0, 300))
    np.testing.assert_array_equal(even(time), time)


@pytest.mark.parametrize("rate", [30.0, 100.0])
def test_twenty_pieces_have_a_grid_each(rate: float) -> None:
    """A driver that starts afresh after every gap starts anywhere in its period."""
    random = np.random.default_rng(3)
    pieces = [
        5.0 * number + random.uniform(0.0, 1.0 / rate) + np.arange(round(4.0 * rate)) / rate
        for number in range(20)
    ]
    taken = np.concatenate(pieces)
    stamped = taken + random.normal(0.0, 5e-4, len(taken))
    times, jitters = dejitter(stamped, _angles(taken))
    assert jitters
    assert np.abs(times - taken).max() < 3e-4
    assert np.abs(np.diff(times) - np.diff(taken)).max() < 5e-4


Motion = Callable[[np.ndarray], np.ndarray]  # angles (n, 3) [rad] at times [s]


def _swinging(seconds: np.ndarray) -> np.ndarray:
    """Wheels that speed up and slow down by up to 20 rad/s^2."""
    return np.outer(seconds + 0.2 * np.sin(4.0 * seconds), SPEED)


def _stamps(taken: np.ndarray, late: np.ndarray) -> np.ndarray:
    """Of samples, jittered by 0.5 ms [ns]."""
    return np.round(1e9 * (taken + late)).astype(np.int64) + _jitter(len(taken))


def _live(taken: np.ndarray, late: np.ndarray, motion: Motion = _angles) -> float:
    """Errors of speeds while samples come in [rad/s]: 99 % are less."""
    stamps, angles = _stamps(taken, late), motion(taken)
    window, errors, fed = _window(stamps[:0], angles[:0]), [], 0
    for tick in range(2500, int(1e3 * taken[-1]), 50):
        while stamps[fed] <= tick * MS:
            window.add(EncoderSample(BASE + int(stamps[fed]), tuple(angles[fed]), NOTHING))
            fed += 1
        moved = motion(1e-3 * np.array([tick - 26.0, tick - 24.0]))
        found = window.at(BASE + tick * MS).speed
        errors.append(np.abs(found - (moved[1] - moved[0]) / 2e-3).max())
    return float(np.quantile(errors, 0.99))


def _recorded(taken: np.ndarray, late: np.ndarray, motion: Motion = _angles) -> float:
    """Errors of times in a recording [s]: 99 % are less."""
    times, jitters = dejitter(1e-9 * _stamps(taken, late), motion(taken))
    assert jitters
    return float(np.quantile(np.abs(times - taken), 0.99))


@pytest.mark.parametrize(
    ("rate", "motion", "most"),
    [(33.0, _angles, 0.35), (33.0, _swinging, 0.8), (100.0, _angles, 0.35)],
)
def test_a_loop_that_was_late_goes_on_with_another_phase(
    rate: float, motion: Motion, most: float
) -> None:
    """One that sleeps for its period: all samples that follow are taken later by as much."""
    count = round(24.0 * rate)
    shifts = np.zeros(count)
    shifts[round(3.3 * rate) :: round(0.9 * rate)] = 0.37 / rate
    taken = np.arange(count) / rate + np.cumsum(shifts)
    # Where the phase is taken for jitter, a third of 6 or 11 rad/s.
    assert _live(taken, np.zeros(count), motion) < most
    assert _recorded(taken, np.zeros(count), motion) < 5e-4


@pytest.mark.parametrize("apart", [1, 3])
def test_two_shifts_may_be_close_together(apart: int) -> None:
    shifts = np.zeros(800)
    shifts[[400, 400 + apart]] = 0.01
    taken = 0.03 * np.arange(800) + np.cumsum(shifts)
    stamps = taken + 1e-9 * _jitter(800)
    assert np.abs(even(stamps) - taken)[400 - 20 : 400 + 20].max() < 2e-3


@pytest.mark.parametrize(("late", "row"), [(0.35, 1), (0.35, 2), (0.7, 1)])
def test_stamps_that_come_late_shift_no_phase(late: float, row: int) -> None:
    """A busy driver's: by so much of a period, one or two in a row."""
    taken, behind = 0.01 * np.arange(1200), np.zeros(1200)
    for first in range(260, 260 + row):
        behind[first::37] = late * 0.01
    assert _live(taken, behind) < 0.2
    assert _recorded(taken, behind) < 4e-4


@pytest.mark.parametrize(("rate", "most"), [(100.0, 1.5), (33.0, 4.0)])
def test_a_stamp_that_is_a_period_late_leaves_speeds_known(rate: float, most: float) -> None:
    """It falls on the next one's place: none of both is moved there."""
    behind = np.zeros(1200)
    behind[260::37] = 0.98 / rate
    assert _live(np.arange(1200) / rate, behind) < most


def test_the_last_stamp_may_be_late() -> None:
    grid = 0.01 * np.arange(300)
    noisy = grid + 1e-9 * _jitter(300)
    noisy[-1] += 0.004
    assert np.abs(even(noisy) - grid).max() < 2e-4


def test_stamps_that_do_not_scatter_reach_a_fiftieth_of_their_period() -> None:
    grid = grid_of(0.01 * np.arange(300))
    assert grid is not None
    assert grid.reach == pytest.approx(2e-4)


def test_three_late_stamps_in_a_row_are_another_phase() -> None:
    watched, _ = _watched()
    stamps = [(10 * number + 4) * MS for number in range(120, 124)]
    for number, stamp in enumerate(stamps, start=120):
        watched.add(stamp, tuple(_angles(np.array([0.01 * number]))[0].tolist()))
    np.testing.assert_allclose(watched.times(stamps), stamps, rtol=0.0, atol=0.2 * MS)


def test_of_slow_wheels_two_samples_never_fall_on_one_place() -> None:
    watched, _ = _watched()
    still = tuple(_angles(np.array([1.19]))[0].tolist())
    stamps = [1200 * MS, 1210 * MS, int(1229.8 * MS), 1230 * MS]
    for stamp in stamps:
        watched.add(stamp, still)
    times = watched.times(stamps)
    assert all(later > earlier for earlier, later in itertools.pairwise(times))


def test_lost_messages_of_slow_coarse_encoders_move_none() -> None:
    """Angles of few counts do not say that what follows is late."""
    count, random = 2.0 * np.pi / (64 * 15), np.random.default_rng(9)
    taken = 0.01 * np.flatnonzero(random.random(2000) > 0.1)
    stamps = _stamps(taken, np.zeros(len(taken)))
    turned = np.outer(taken, [0.6, -0.2, -0.4])
    watched, off = RecentStamps(), []
    moved = np.floor(_angles(taken[:300]) / count), np.floor(turned[300:] / count)
    for stamp, angle in zip(stamps.tolist(), count * np.concatenate(moved), strict=True):
        watched.add(stamp, tuple(angle.tolist()))
        off.append(watched.times([stamp])[0])
    error = 1e-9 * np.array(off) - taken
    assert np.abs(error[400:]).max() < 0.005


@pytest.mark.parametrize("rate", [5_000, 500_000_000, 1_000_000_000])
def test_encoders_may_be_fast(rate: int) -> None:
    watched, step = RecentStamps(), 1_000_000_000 // rate
    dice = np.random.default_rng(5).integers(0, max(step // 2, 1), 400)
    for number in range(400):
        turned = 6.0 * number / rate
        late = step if number % 50 == 49 else 0
        watched.add(2 * number * step + int(dice[number]) + late, (turned, -turned, 0.0))
    assert len(watched.times([798 * step, 799 * step])) == 2


def test_a_wheel_that_says_nothing_hides_no_late_stamp() -> None:
    watched, _ = _watched()
    angles = _angles(1e-2 * np.arange(130.0))
    angles[:, 1] = np.nan
    for number in range(120, 124):
        late = 4 * MS if number == 123 else 0
        watched.add(10 * number * MS + late, tuple(angles[number].tolist()))
    assert watched.times([1234 * MS]) == pytest.approx([1230 * MS], abs=0.2 * MS)


def test_a_stray_stamp_does_not_tilt_the_grid() -> None:
    grid = np.append(np.arange(300) * 0.01, 3600.0)
    noisy = grid + np.random.default_rng(6).normal(0.0, 5e-4, len(grid))
    assert np.abs(even(noisy)[:-1] - grid[:-1]).max() < 1e-4


def test_a_recording_and_a_live_stream_are_dejittered_alike() -> None:
    taken = np.arange(200, dtype=np.int64) * 10 * MS
    stamps = taken + _jitter(200)
    watched = RecentStamps()
    for stamp, angle in zip(stamps.tolist(), _angles(1e-9 * taken).tolist(), strict=True):
        watched.add(stamp, tuple(angle))
    times, jitters = dejitter(1e-9 * (stamps - stamps[0]), _angles(1e-9 * taken))
    assert jitters
    live = np.array(watched.times(stamps[-20:].tolist())) - stamps[0]
    np.testing.assert_allclose(1e-9 * live, times[-20:], atol=2e-9)


def test_at_rest_stamps_are_believed() -> None:
    stamps = 0.01 * np.arange(300) + 1e-9 * _jitter(300)
    times, jitters = dejitter(stamps, np.zeros((300, 3)))
    assert not jitters
    np.testing.assert_array_equal(times, stamps)
