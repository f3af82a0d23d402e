"""Powers of motors under each other's names."""

from itertools import permutations

import numpy as np
import pytest

from tomr_power_model.drive.exchanged import draws_by, exchange_words, exchanged
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")


def _time(count: int) -> np.ndarray:
    return 0.02 * np.arange(count)


def _speeds(count: int = 400) -> np.ndarray:
    """Of wheels that do not know of each other [rad/s]."""
    phase = _time(count)[:, None] * [2.0, 3.1, 4.3] + [0.1, 1.0, 2.0]
    return 6.0 * np.sin(phase) + 2.0 * np.cos(2.7 * phase)


def _exchanged(power: np.ndarray, speed: np.ndarray) -> tuple[int, ...] | None:
    return exchanged(power, draws_by(speed, _time(len(speed))))


def _powers(speed: np.ndarray, noise: float) -> np.ndarray:
    """Friction, copper and inertia of each motor [W], and a sensor's noise."""
    random = np.random.default_rng(6)
    gained = 0.02 * speed * np.gradient(speed, 0.02, axis=0)
    return (
        0.4 * np.abs(speed) + 0.02 * speed**2 + gained + noise * random.standard_normal(speed.shape)
    )


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_each_order_is_found(order: tuple[int, ...]) -> None:
    speed = _speeds()
    found = _exchanged(_powers(speed, 0.3)[:, order], speed)
    assert found == (None if order == (0, 1, 2) else order)


def test_what_does_not_show_it_clearly_says_nothing() -> None:
    speed = _speeds()
    swapped = _powers(speed, 0.3)[:, [1, 0, 2]]
    assert _exchanged(swapped, speed) == (1, 0, 2)
    assert _exchanged(swapped[:99], speed[:99]) is None  # too few samples
    for noise in (1.5, 5.0):  # W: half of it, and most
        assert _exchanged(_powers(speed, noise)[:, [1, 0, 2]], speed) is None
    dead = np.where([True, False, False], 0.0, _powers(speed, 0.3))
    assert _exchanged(dead, speed) is None
    unknown = np.where([True, False, False], np.nan, swapped)
    assert _exchanged(unknown, speed) is None
    assert _exchanged(swapped, np.abs(speed[:, :1]) * [1.0, 1.0, 1.0]) is None  # all alike


def test_samples_of_each_motor_may_come_at_times_of_their_own() -> None:
    speed = _speeds(900)
    swapped = _powers(speed, 0.3)[:, [0, 2, 1]]
    own = np.arange(900)[:, None] % 3 == np.arange(3)
    assert _exchanged(np.where(own, swapped, np.nan), speed) == (0, 2, 1)


def test_on_a_circle_inertia_counts_as_much_as_speed() -> None:
    """Wheels a third of a turn apart: by speed alone each would look like another's."""
    angle = _time(600)[:, None] - 2.0 * np.pi / 3.0 * np.arange(3)
    speed = 5.0 * np.sin(angle)
    power = 0.05 * np.abs(speed) + 2.0 * speed * np.gradient(speed, 0.02, axis=0)
    assert exchanged(power, np.abs(speed)[:, :, None]) is not None
    assert _exchanged(power, speed) is None


def test_what_a_motor_draws_does_not_fall_with_what_it_should() -> None:
    power = _powers(_speeds(), 0.1)
    expected = power[:, [1, 0, 2], None]
    assert exchanged(power, expected) == (1, 0, 2)
    assert exchanged(power, -expected) is None


def test_the_words_name_what_belongs_to_what() -> None:
    seen, remedy = exchange_words((1, 0, 2), ROBOT)
    assert seen == (
        "the power of wheel_1 is that of wheel_2_joint, the power of wheel_2 is that of "
        "wheel_1_joint"
    )
    assert "plugs" in remedy
