"""What drivers hold beside what they hold in the simulation."""

import math

import pytest
from attrs import evolve

from tomr_fault_diag.residuals.frame import (
    ALONG,
    NO_COMMAND,
    NO_ENCODERS,
    RESIDUALS,
    UNKNOWN_VOLTAGE,
    Residual,
    ResidualFrame,
    voltage_names,
)
from tomr_fault_diag.residuals.messages import frame_of, residual_message
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_fault_diag.residuals.voltages import VoltageWatch
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import Level
from tomr_power_model.messages.readings import UNKNOWN_READING
from tomr_power_model.model.prediction import Prediction, Triple
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
BANDS = BandSettings(voltage=0.2, voltage_relative=0.05, voltage_transient=0.5)
NOTHING = (UNKNOWN_READING,) * 3


def prediction(voltage: Triple, held: Triple) -> Prediction:
    still = (0.0, 0.0, 0.0)
    return Prediction(0, still, still, NOTHING, UNKNOWN_READING, NOTHING, voltage, held)


def test_a_residual_is_what_is_held_beyond_what_is_simulated() -> None:
    watch = VoltageWatch(3)
    found = watch.residuals(prediction((2.0, -8.0, 0.0), (2.1, -8.6, 0.0)), BANDS)
    assert [item.residual for item in found] == [0.1, -0.6, 0.0]
    assert [item.band for item in found] == [0.2, 0.4, 0.2]  # the least, and 0.05 of 8 V
    assert [item.code for item in found] == [0, -1, 0]
    assert [(item.modelled, item.unit) for item in found] == [(2.0, "V"), (-8.0, "V"), (0.0, "V")]


def test_a_voltage_that_changes_has_a_wider_band_for_a_while() -> None:
    watch, bands = VoltageWatch(3), []
    for volts in (0.0, 2.0, 2.0, 2.0):
        same = (volts, 0.0, 0.0)
        bands.append(watch.residuals(prediction(same, same), BANDS)[0].band)
    assert bands == pytest.approx([0.2, 1.2, 1.2, 0.2])
    watch.clear()
    assert watch.residuals(prediction((0.0,) * 3, (0.0,) * 3), BANDS)[0].band == 0.2


def test_what_is_missing_is_said() -> None:
    watch, nan = VoltageWatch(3), math.nan
    assert watch.residuals(None, BANDS) == (UNKNOWN_VOLTAGE,) * 3
    first, second, third = watch.residuals(prediction((1.0, nan, 1.0), (nan, nan, 1.0)), BANDS)
    assert (first.missing, second.missing, third.missing) == (NO_ENCODERS, NO_COMMAND, "")
    assert (first.stale, second.stale, third.stale) == (True, True, False)
    # What was not known does not widen the bands of what follows.
    assert watch.residuals(prediction((1.0,) * 3, (1.0,) * 3), BANDS)[1].band == 0.2


@pytest.mark.parametrize("known", [True, False])
def test_it_travels_with_the_residuals_and_is_no_fault_where_it_is_missing(known: bool) -> None:
    item = Residual(0.5, 0.3, 2.0, "V")
    volts = (item, evolve(item, residual=0.1), item) if known else (UNKNOWN_VOLTAGE,) * 3
    frame = ResidualFrame(10, (Residual(0.0, 1.0, 5.0),) * RESIDUALS, 1.0, voltages=volts)
    message = to_bag(residual_message(ROBOT, frame).plain)
    shown = message.status[RESIDUALS + 1 + len(ALONG) :]
    assert tuple(one.name for one in shown) == voltage_names(ROBOT.wheel_topics)
    levels = [one.level for one in shown]
    assert levels == ([Level.WARN, Level.OK, Level.WARN] if known else [Level.OK] * 3)
    back = frame_of(message, frame.stamp_ns).voltages
    assert back == volts if known else all(one.missing == NO_COMMAND for one in back)
