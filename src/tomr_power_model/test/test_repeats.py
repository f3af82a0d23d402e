"""Sensors that are frozen, and those that merely repeat themselves."""

import numpy as np
import pytest

from tomr_power_model.model.repeats import RepeatWatch, Work

TURNS = Work(turns=True, follows=True, power=5.0, band=1.0)
MS = 1_000_000


def _frozen(readings: list[float], works: list[Work] | Work) -> list[int]:
    """Ticks of 50 ms at which a sensor of 100 Hz counts as frozen."""
    watch, found = RepeatWatch(), []
    for index, value in enumerate(readings):
        watch.take(index * 10 * MS, (24.0, value))
        if index % 5 == 4:
            work = works[index // 5] if isinstance(works, list) else works
            if watch.is_frozen(index * 10 * MS, work):
                found.append(index // 5)
    return found


def _noisy(count: int, seed: int = 0) -> list[float]:
    return np.random.default_rng(seed).normal(0.2, 0.01, count).tolist()


def test_a_noisy_sensor_that_repeats_itself_is_frozen_at_once() -> None:
    found = _frozen([*_noisy(300), *[0.2] * 100, *_noisy(100, 1)], TURNS)
    assert found[0] <= 62  # 0.15 s
    assert found[-1] == 79  # and is believed again with the first other reading


def test_at_rest_any_sensor_may_repeat_itself() -> None:
    rest = Work(turns=False, follows=True, power=1.2, band=1.0)
    assert not _frozen([*_noisy(300), *[0.2] * 300], [TURNS] * 60 + [rest] * 60)


def test_a_coarse_sensor_is_frozen_if_its_motor_should_draw_another_power() -> None:
    random = np.random.default_rng(2)
    coarse = np.repeat(random.integers(0, 4, 40), 10).astype(float).tolist()  # 0.1 s each
    held = [*coarse, *[2.0] * 300]
    assert not _frozen(held, TURNS)
    powers = [5.0] * 80 + [5.0 + 0.1 * k for k in range(60)]
    asked = [Work(True, True, power, 1.0) for power in powers]
    assert _frozen(held, asked)
    # A driver without its signal draws the same all the time, and its wheel does not follow.
    assert not _frozen(held, [Work(True, False, power, 1.0) for power in powers])


def _stuck(
    readings: list[float], shown: list[float], share: float = 0.9, still: range = range(0)
) -> list[int]:
    """Samples of 100 Hz at which a sensor of the motion counts as stuck; `shown` by wheels."""
    watch, found = RepeatWatch(share, is_inertial=True), []
    for index, value in enumerate(readings):
        watch.take(index * 10 * MS, (value,))
        moves = index not in still
        if watch.is_stuck(index * 10 * MS, [0.0, shown[index]], moves=moves):
            found.append(index)
    return found


def test_an_imu_that_repeats_itself_while_the_motion_changes_is_stuck() -> None:
    """Of what wheels show counts what comes 0.15 s after the first repeat, and has to change by
    more than one."""
    held = [*_noisy(300), *[0.2] * 100, *_noisy(100, 1)]
    ramp = [0.02 * index for index in range(500)]
    found = _stuck(held, ramp)
    assert found == list(range(367, 400))  # 0.16 s after 3 s, and 51 of 0.02 more
    assert not _stuck(held, [1.0] * 500)
    assert not _stuck(held, [0.0, 1.0] * 250)
    assert not _stuck(held, [float("nan")] * 500)
    assert not _stuck(_noisy(500), ramp)


def test_where_it_stands_an_imu_without_noise_may_repeat_itself() -> None:
    held, ramp = [*_noisy(300), *[0.2] * 100], [0.02 * index for index in range(400)]
    assert not _stuck(held, ramp, still=range(250, 400))
    assert _stuck(held, ramp, still=range(250, 310))
    assert _stuck(held, ramp, still=range(310))  # it showed its noise there


@pytest.mark.parametrize(("share", "is_stuck"), [(0.9, False), (0.1, True)])
def test_one_that_has_never_changed_is_stuck_if_it_was_expected_to(
    share: float, is_stuck: bool
) -> None:
    ramp = [0.02 * index for index in range(400)]
    assert bool(_stuck([0.2] * 400, ramp, share)) == is_stuck


def test_a_coarse_one_is_not() -> None:
    coarse = np.repeat(np.random.default_rng(2).integers(0, 4, 40), 10).astype(float).tolist()
    assert not _stuck([*coarse, *[2.0] * 300], [0.02 * index for index in range(700)])
