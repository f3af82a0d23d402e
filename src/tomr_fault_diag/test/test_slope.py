"""A slope that an accelerometer feels, taken out of residuals: by hand for the reference robot."""

import math

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.contacts import NOTHING, Contacts
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.slope import SlopeFilter
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    TOTAL,
    UNKNOWN_FORCE,
    Residual,
    ResidualFrame,
    Unit,
)
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
GRIPS = Contacts(0.0, felt=True)
SPEED, AMPERES = 10.0, 0.5  # of each wheel [rad/s], expected of each motor [A]
CONSTANT, RESISTANCE = 0.7, 0.8  # 0.035 N m/A times 20; ohm
# 15 kg at 0.5 m/s^2 along x: each wheel bears 2/3 of its sine, at 0.05 m.
TORQUE = 2.0 / 3.0 * 15.0 * 0.5 * np.sin([0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0]) * 0.05
MORE = TORQUE / CONSTANT  # A
IDLE = float(Motors(ROBOT).idle[0])


def drawn(amperes: float) -> float:
    return RESISTANCE * amperes**2 + CONSTANT * SPEED * amperes + IDLE


def frame(
    felt: float, off: tuple[float, ...], unit: Unit = "W", band: float = 0.0
) -> ResidualFrame:
    """Motors that draw so much beyond what is expected; `felt` along x [m/s^2], known but for a
    `band`."""
    model = drawn(AMPERES) if unit == "W" else AMPERES
    motors = [Residual(more, 1.0, model, unit) for more in off]
    speeds = [Residual(0.0, 0.2, SPEED, "rad/s")] * 3
    total = Residual(sum(off), 3.0, 3.0 * model, unit)
    along = Residual(felt, band or 1e-9, 0.0, "m/s^2"), Residual(0.0, band or 1e-9, 0.0, "m/s^2")
    return ResidualFrame(1, (total, *motors, *speeds, *motors), along=along)


def left(found: ResidualFrame) -> list[float]:
    return [found.residuals[k].residual for k in (TOTAL, *MOTORS, *ENCODERS)]


SHOWN = tuple(drawn(AMPERES + more) - drawn(AMPERES) for more in MORE.tolist())


def test_what_motors_draw_on_a_slope_is_gone_and_the_rest_stays() -> None:
    assert SHOWN[1] > 2.0  # 0.31 A more
    assert SHOWN[0] == pytest.approx(0.0, abs=1e-9)  # the first wheel is across
    found = SlopeFilter(ROBOT).without(frame(0.5, SHOWN), GRIPS)
    assert left(found) == pytest.approx([0.0] * 7, abs=1e-6)
    # Measured powers are what they were.
    for before, after in zip(frame(0.5, SHOWN).residuals, found.residuals, strict=True):
        assert after.modelled + after.residual == pytest.approx(before.modelled + before.residual)
        assert after.band == before.band
    dragging = tuple(np.add(SHOWN, (2.0, 0.0, 0.0)).tolist())
    found = SlopeFilter(ROBOT).without(frame(0.5, dragging), GRIPS)
    assert left(found) == pytest.approx([2.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0], abs=1e-6)


def test_currents_of_motors() -> None:
    robot = evolve(ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current"))
    found = SlopeFilter(robot).without(frame(0.5, tuple(MORE.tolist()), "A"), GRIPS)
    assert left(found) == pytest.approx([0.0] * 7, abs=1e-9)
    unsigned = evolve(robot, measurement=evolve(robot.measurement, signed=False))
    item = frame(0.5, tuple(MORE.tolist()), "A")
    assert SlopeFilter(unsigned).without(item, GRIPS) is item


@pytest.mark.parametrize("contacts", [NOTHING, Contacts(0.3, felt=True), Contacts(1.0)])
def test_where_a_wheel_may_slide_nothing_is_taken_off(contacts: Contacts) -> None:
    item = frame(0.5, SHOWN)
    assert SlopeFilter(ROBOT).without(item, contacts) is item


def test_nor_where_an_encoder_is_off_or_nothing_is_felt() -> None:
    item, slopes = frame(0.5, SHOWN), SlopeFilter(ROBOT)
    residuals = list(item.residuals)
    residuals[SPEEDS.start] = evolve(residuals[SPEEDS.start], residual=-0.3)
    for same in (
        evolve(item, residuals=tuple(residuals)),
        evolve(item, along=(UNKNOWN_FORCE, UNKNOWN_FORCE)),
        evolve(item, yaw=Residual(0.3, 0.2, 0.5, "rad/s")),  # the body turns otherwise
        frame(0.0, SHOWN),
        frame(0.1, SHOWN, band=0.33),  # a standard deviation of noise
    ):
        assert slopes.without(same, GRIPS) is same
    # Three standard deviations are believed by 8/9.
    found = slopes.without(frame(0.5, SHOWN, band=0.55), GRIPS)
    assert left(found)[2] == pytest.approx(SHOWN[1] / 9.0, rel=0.1)


def test_numbers_beyond_all_bounds_are_survived() -> None:
    item = frame(1e300, SHOWN)
    assert SlopeFilter(ROBOT).without(item, GRIPS) is item
