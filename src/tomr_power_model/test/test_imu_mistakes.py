"""An IMU that is mounted, signed or scaled otherwise, from what it measures beside the wheels."""

import math
import re
from itertools import permutations, product

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tomr_power_model.drive.imu_mistakes import Felt, imu_mistake
from tomr_power_model.messages.inertial import rotation
from tomr_power_model.robot import GRAVITY

Array = NDArray[np.float64]

STRAIGHT = (0.0, 0.0, 0.0)
RIGHT_ANGLED = [
    np.diag(signs)[list(order)]
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3))
    if np.linalg.det(np.diag(signs)[list(order)]) > 0.0
]


def felt(turned: Array | None = None, *, rows: int = 300, noise: float = 0.1) -> Felt:
    """Of a robot that turns and accelerates all ways, by an IMU whose axes `turned` takes to those
    of base_link."""
    random = np.random.default_rng(1)
    yaw = random.normal(0.0, 0.5, rows)
    pull = random.normal(0.0, 0.6, (rows, 2))
    rate = np.stack([np.zeros(rows), np.zeros(rows), yaw], axis=1)
    force = np.column_stack([pull, np.full(rows, GRAVITY)])
    axes = np.eye(3) if turned is None else turned
    rate += random.normal(0.0, 0.01, rate.shape)
    force += random.normal(0.0, noise, force.shape)
    return Felt(yaw, pull, rate @ axes, force @ axes)


def named(words: str | None) -> Array:
    """The rotation that `robot.imu_rpy` is to be."""
    found = re.search(r"imu_rpy: \[(.*?)\]", words or "")
    assert found is not None, words
    return rotation([float(value) for value in found[1].split(",")])


def test_one_that_is_as_described_has_no_mistake() -> None:
    assert imu_mistake(felt(), STRAIGHT) == ""
    # An accelerometer's bias, or a slope, is none.
    tilted = felt()
    tilted.force[:, 0] += 0.8
    tilted.rate[:, 2] += 0.03
    assert imu_mistake(tilted, STRAIGHT) == ""


@pytest.mark.parametrize("has_gyro", [True, False])
def test_a_slope_is_none(has_gyro: bool) -> None:
    """Up one of 12 degrees all the time: the wheels turn and accelerate along it."""
    seen = felt()
    if not has_gyro:
        seen = evolve(seen, rate=np.full((300, 3), math.nan))
    seen.force[:] += GRAVITY * np.array([math.sin(0.21), 0.0, math.cos(0.21) - 1.0])
    assert imu_mistake(seen, STRAIGHT) == ""
    turned = evolve(seen, rate=-seen.rate)
    if has_gyro:
        assert "the gyro of imu/data turns the other way" in str(imu_mistake(turned, STRAIGHT))
    aside = rotation((0.0, 0.0, math.pi / 2.0))
    across = evolve(seen, rate=seen.rate @ aside, force=seen.force @ aside)
    assert named(imu_mistake(across, STRAIGHT)) == pytest.approx(
        aside, abs=1e-3 if has_gyro else 0.3
    )


@pytest.mark.parametrize("turned", RIGHT_ANGLED, ids=str)
def test_whichever_way_it_is_mounted_is_named(turned: Array) -> None:
    words = imu_mistake(felt(turned), STRAIGHT)
    if np.array_equal(turned, np.eye(3)):
        assert words == ""
    else:
        assert named(words) == pytest.approx(turned, abs=1e-3)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.7), (0.4, 0.0, -2.0), (3.0, 0.3, 1.0)], ids=str)
def test_another_angle_is_named_nearly(rpy: tuple[float, float, float]) -> None:
    found = named(imu_mistake(felt(rotation(rpy)), STRAIGHT))
    assert math.acos((np.trace(found.T @ rotation(rpy)) - 1.0) / 2.0) < math.radians(4.0)


def test_what_was_described_before_is_part_of_it() -> None:
    """What is measured is read by a wrong key: the right one turns what was measured."""
    described, right = (0.0, 0.0, math.pi / 2.0), rotation((math.pi, 0.0, 0.0))
    raw = felt(right)
    seen = evolve(
        raw, rate=raw.rate @ rotation(described).T, force=raw.force @ rotation(described).T
    )
    assert named(imu_mistake(seen, described)) == pytest.approx(right, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: evolve(f, rate=-f.rate), "the gyro of imu/data turns the other way"),
        (lambda f: evolve(f, force=-f.force), "feels forces the other way"),
        (lambda f: evolve(f, rate=f.rate * 57.2958), "degrees per second in place of rad/s"),
        (lambda f: evolve(f, force=f.force / 9.80665), "g in place of m/s^2"),
    ],
    ids=["gyro", "forces", "degrees", "g"],
)
def test_signs_and_units_are_named(change: object, words: str) -> None:
    assert callable(change)
    found = imu_mistake(change(felt()), STRAIGHT)
    assert found is not None
    assert words in found
    assert "imu_rpy" not in found


def test_two_mistakes_are_two() -> None:
    seen = felt(RIGHT_ANGLED[7])
    found = imu_mistake(evolve(seen, rate=seen.rate * 57.2958), STRAIGHT)
    assert named(found) == pytest.approx(RIGHT_ANGLED[7], abs=1e-3)
    assert "degrees per second" in str(found)


def test_a_gyro_alone_shows_its_sign() -> None:
    none = np.full((300, 3), math.nan)
    alone = evolve(felt(), force=none)
    assert imu_mistake(alone, STRAIGHT) == ""
    assert "turns the other way" in str(imu_mistake(evolve(alone, rate=-alone.rate), STRAIGHT))
    alone.rate[:, :2] = math.nan
    assert imu_mistake(alone, STRAIGHT) == ""


def test_an_accelerometer_alone_that_takes_gravity_off_may_be_right() -> None:
    seen = felt()
    seen.force[:, 2] -= GRAVITY
    assert imu_mistake(evolve(seen, rate=np.full((300, 3), math.nan)), STRAIGHT) == ""
    assert imu_mistake(evolve(seen, rate=np.zeros((300, 3))), STRAIGHT) is None
    assert imu_mistake(seen, STRAIGHT) == ""


@pytest.mark.parametrize("share", [0.0, 0.3, 0.65])
def test_wheels_that_slide_show_no_other_imu(share: float) -> None:
    """The body turns and accelerates by a part of what they show, and as the floor has it."""
    random, seen = np.random.default_rng(2), felt()
    seen.rate[:, 2] *= share
    seen.rate[:, 2] += random.normal(0.0, 0.3, 300)
    seen.force[:, :2] *= share
    for turned in (np.eye(2), rotation((0.0, 0.0, 0.8))[:2, :2]):
        slid = evolve(seen, force=seen.force.copy())
        slid.force[:, :2] = slid.force[:, :2] @ turned
        assert not imu_mistake(slid, STRAIGHT)


def test_without_motion_nothing_shows() -> None:
    """But which way is up."""
    turned = felt(rotation((0.0, 0.0, 2.0)))
    still = evolve(turned, yaw_rate=0.1 * turned.yaw_rate, acceleration=0.1 * turned.acceleration)
    assert imu_mistake(still, STRAIGHT) is None
    few = Felt(turned.yaw_rate[:5], turned.acceleration[:5], turned.rate[:5], turned.force[:5])
    assert imu_mistake(few, STRAIGHT) is None
    dead = evolve(turned, rate=np.zeros((300, 3)), force=np.full((300, 3), math.nan))
    assert imu_mistake(dead, STRAIGHT) is None
    lying = evolve(still, force=still.force @ rotation((0.0, 1.2, 0.0)))
    assert str(imu_mistake(lying, STRAIGHT)).endswith("write robot.imu_rpy")


def test_accelerations_along_one_line_show_a_turned_one() -> None:
    seen = felt(rotation((0.0, 0.0, math.pi / 2.0)))
    seen.acceleration[:, 1] = 0.0
    along = np.column_stack([seen.acceleration, np.full(300, GRAVITY)])
    straight = evolve(seen, force=along @ rotation((0.0, 0.0, math.pi / 2.0)))
    assert named(imu_mistake(straight, STRAIGHT)) == pytest.approx(
        rotation((0.0, 0.0, math.pi / 2.0)), abs=1e-3
    )


@given(
    st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)),
    st.integers(1, 12),
    st.sampled_from([0.0, 1e-9, 1.0, 1e4]),
)
def test_whatever_is_measured_has_an_answer(
    rpy: tuple[float, float, float], rows: int, size: float
) -> None:
    """Without noise as well, and of sensors that measure next to nothing or far too much."""
    seen = felt(rotation(rpy), rows=rows, noise=0.0)
    few = evolve(seen, rate=size * seen.rate, force=size * seen.force)
    for described in (STRAIGHT, rpy):
        assert isinstance(imu_mistake(few, described), str | None)
        assert isinstance(imu_mistake(seen, described), str | None)


def test_a_few_degrees_take_more_than_noise() -> None:
    turned = rotation((0.0, 0.0, math.radians(12.0)))
    assert "imu_rpy: [0, 0, 0.2]" in str(imu_mistake(felt(turned), STRAIGHT))
    assert imu_mistake(felt(turned, rows=60, noise=1.0), STRAIGHT) is None
    # Directions are known to 0.12 rad there, and it is off by 0.21.
    assert imu_mistake(felt(turned, rows=100, noise=0.4), STRAIGHT) is None
    few = felt(turned)
    few = Felt(0.1 * few.yaw_rate, few.acceleration, 0.1 * few.rate, few.force)
    assert "imu_rpy: [0, 0, 0.2]" in str(imu_mistake(few, STRAIGHT))  # not the gyro's sign
    assert imu_mistake(felt(rotation((0.0, 0.0, math.radians(5.0)))), STRAIGHT) == ""
