"""Forces on the body that explain what wheels feel, by hand and on drives."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_fault_diag.classifier.forces import SteadyForce, by_sudden_force
from tomr_power_model.dynamics.body import Body
from tomr_power_model.robot import shipped_robot

Array = NDArray[np.float64]

# Forces along and across of 1 N/kg and a moment at the lever of 0.3 radii, in bands.
ROBOT = shipped_robot("reference")
SHARED = Body.of(ROBOT).from_force * [1.0, 1.0, 0.3 * ROBOT.robot_radius]
SHARED = 4.0 * SHARED / np.abs(SHARED).max()
TICK = 50_000_000  # ns
SCATTER = 0.2


def watch() -> SteadyForce:
    return SteadyForce(1_500_000_000, 1.0, SCATTER)


def last(shown: list[Array], yaw_rate: float = 0.0) -> float:
    """What ticks before say of the last of these residuals."""
    force = watch()
    return [force.take(one, SHARED, TICK, yaw_rate) for one in shown][-1]


def none_to(shown: Array) -> float:
    """Log-likelihood of an exact explanation over none."""
    return float(shown @ shown) / (2.0 * SCATTER**2)


def test_a_sudden_force_explains_what_it_may_be() -> None:
    shown = SHARED @ [0.3, 0.2, 0.0]
    assert by_sudden_force(np.zeros(3), SHARED, (0.1, 1.0), SCATTER) == 0.0
    assert 0.5 * none_to(shown) < by_sudden_force(shown, SHARED, (0.3,), SCATTER) < none_to(shown)
    assert by_sudden_force(shown, SHARED, (0.001,), SCATTER) < 0.01 * none_to(shown)


def test_of_one_direction_one_number_by_hand() -> None:
    """Of a wheel that alone shows anything, and one axis: r = a f; f = a r / (a^2 + (s / 1)^2)."""
    shared = np.zeros((3, 3))
    shared[0, 0] = 2.0
    force, shown = watch(), np.array([1.0, 0.0, 0.0])
    assert force.take(shown, shared, TICK, 0.0) == 0.0  # no ticks before
    size = 2.0 / (4.0 + SCATTER**2)
    explained = (1.0 - (1.0 - 2.0 * size) ** 2) / (2.0 * SCATTER**2)
    assert force.take(shown, shared, TICK, 0.0) == pytest.approx(explained)


def test_what_stays_is_explained_and_what_turns_round_is_not() -> None:
    shown = SHARED @ [0.3, 0.2, 0.0]
    assert last([shown] * 20) > 0.95 * none_to(shown)
    assert last([*[shown] * 20, -shown]) == 0.0


@pytest.mark.parametrize("yaw_rate", [1.5, -0.7])
def test_it_stays_in_the_world(yaw_rate: float) -> None:
    """A robot that turns feels it from another side."""
    ticks = []
    for tick in range(1, 41):
        yaw = yaw_rate * 0.05 * tick
        along = np.array([math.cos(yaw), -math.sin(yaw), 0.0])
        ticks.append(SHARED @ (0.4 * along))
    assert last(ticks, yaw_rate) > 0.95 * none_to(ticks[-1])
    assert last(ticks, 0.0) < 0.9 * none_to(ticks[-1])


def test_one_wheel_alone_is_not_quite_a_force() -> None:
    """Along a wheel, 0.3 radii off the centre, a force loads it with 2/3 + 1/10 and the others with
    -1/3 + 1/10: of one wheel alone that explains 0.767^2 / (0.767^2 + 2 0.233^2)."""
    for wheel in range(3):
        shown = 0.6 * np.eye(3)[wheel]
        assert last([shown] * 40) == pytest.approx(0.844 * none_to(shown), rel=0.01)
    turned = SHARED @ [0.0, 0.0, 0.3]
    assert last([turned] * 40) < 0.1 * none_to(turned)  # nobody turns a robot on the spot


def test_what_was_long_ago_is_forgotten() -> None:
    shown = SHARED @ [0.3, 0.2, 0.0]
    force = watch()
    for _ in range(20):
        force.take(shown, SHARED, TICK, 0.0)
    assert force.take(0.0 * shown, SHARED, 60_000_000_000, 0.0) == 0.0
    assert force.take(shown, SHARED, TICK, 0.0) < 0.1 * none_to(shown)
    force.clear()
    assert force.take(shown, SHARED, TICK, 0.0) == 0.0


def test_the_first_stamp_is_no_time_to_turn_in() -> None:
    force = watch()
    force.take(np.zeros(3), SHARED, 1_700_000_000 * 1_000_000_000, 0.5)
    assert abs(force._yaw) <= 0.5  # of what came before nothing is known but that
