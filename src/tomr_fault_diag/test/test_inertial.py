"""An IMU as a whole: not used, and said, where it is not as described."""

import math

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.residuals.frame import (
    IMU_MISTAKEN,
    RESIDUALS,
    Residual,
    ResidualFrame,
)
from tomr_fault_diag.residuals.inertial import InertialWatch
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import GRAVITY, shipped_robot

PERIOD = to_ns(0.05)
START = 20_000 * PERIOD
KNOWN = Residual(0.0, 1.0, 0.0, "W")
FRAME = ResidualFrame(START, (KNOWN,) * RESIDUALS)


def driven(turned: float) -> tuple[InertialWatch, list[tuple[str, str]]]:
    """Ten seconds of all sorts of motion, with an IMU that is turned about its vertical [rad];
    why its rate and its forces are not known, tick by tick."""
    watch, missing = InertialWatch(shipped_robot("reference"), PERIOD, 3), []
    c, s = math.cos(turned), math.sin(turned)
    for sample in range(1000):
        time = 0.01 * sample
        v_x, v_y, turning = 0.4 * math.sin(2.0 * time), 0.3 * math.sin(1.3 * time), math.sin(time)
        a_x = 0.8 * math.cos(2.0 * time) - turning * v_y
        a_y = 0.39 * math.cos(1.3 * time) + turning * v_x
        force = (c * a_x + s * a_y, c * a_y - s * a_x, GRAVITY + 0.01 * (sample % 7))
        watch.add(START + to_ns(time), (0.0, 0.0, turning), force)
        if sample % 5 == 0:
            twist = np.array([v_x, v_y, turning])
            yaw, along = watch.residuals(
                START + to_ns(time), twist, BandSettings(), moves=True, is_well=True
            )
            missing.append((yaw.missing, along[0].missing))
    return watch, missing


def said(watch: InertialWatch, mistake: str = "") -> tuple[Level, str]:
    (state,) = watch.states(START + to_ns(10.0), evolve(FRAME, mistake=mistake))
    return state.verdict(START + to_ns(10.0))


def test_one_that_is_as_described_is_used() -> None:
    watch, missing = driven(0.0)
    assert missing[-1] == ("", "")
    assert said(watch) == (Level.OK, "as it should be")


@pytest.mark.parametrize("turned", [math.pi / 2.0, math.pi])
def test_one_that_is_not_is_left_out_and_why_is_said(turned: float) -> None:
    watch, missing = driven(turned)
    assert missing[-1] == (IMU_MISTAKEN, IMU_MISTAKEN)
    level, words = said(watch)
    assert level is Level.WARN
    assert "is mounted otherwise than described: write robot.imu_rpy: [0, 0, " in words
    # Wheels that are not as described show no IMU.
    assert said(watch, "the order of the wheels is wrong") == (Level.OK, "as it should be")
