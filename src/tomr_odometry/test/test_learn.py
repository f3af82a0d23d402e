"""The fit finds the creep that made a drive."""

import math

import numpy as np
import pytest

from tomr_odometry.learn.drives import Leg
from tomr_odometry.learn.fit import Batch, fit_creep
from tomr_odometry.start import body_of
from tomr_power_model.robot import shipped_robot

BODY = body_of(shipped_robot("robotino_v2"))[0]


def _legs(coefficient: float, growth: float, drag: float) -> list[Leg]:
    """Straight drives at many headings on a floor whose rollers drag with a share of the load."""
    legs = []
    for heading in np.radians(np.arange(0.0, 360.0, 15.0)):
        direction = np.array([math.cos(heading), math.sin(heading), 0.0])
        used = 1.5 * drag * (BODY.rows @ direction)
        step = 0.003 * direction
        rims = BODY.rows @ step + coefficient * used * (1.0 + growth * used**2) * 0.003
        moved = 500 * step
        legs.append(Leg(np.tile(rims, (500, 1)), np.tile(used, (500, 1)), moved, 1.5))
    return legs


def test_relation_is_inverted_exactly() -> None:
    batch = Batch(_legs(0.7, 0.5, 0.3), BODY)
    assert batch.errors(np.full(3, 0.7), 0.5) == pytest.approx(0.0, abs=1e-3)
    assert np.median(batch.errors(np.zeros(3), 0.0)) > 0.1


def test_one_floor_is_learnt_in_its_details() -> None:
    found = fit_creep({"floor": _legs(0.7, 0.5, 0.3)}, BODY)
    assert found.coefficient == pytest.approx((0.7, 0.7, 0.7), abs=0.06)
    assert found.uncertainty < 0.1


def test_several_floors_share_one_coefficient_and_say_how_far_they_are_apart() -> None:
    found = fit_creep({"one": _legs(0.5, 0.0, 0.3), "other": _legs(0.9, 0.0, 0.3)}, BODY)
    assert 0.5 < found.coefficient[0] < 0.9
    assert found.coefficient[0] == found.coefficient[2]
    assert 0.1 < found.uncertainty < 0.3
