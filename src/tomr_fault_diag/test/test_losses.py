"""Whether a lost signal or lost counts explain what motors draw, of a robot that drives evenly."""

import math

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray
from scipy.optimize import brentq

from tomr_fault_diag.classifier.losses import UNEXPLAINED, LossWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame, Unit
from tomr_power_model.robot import Robot, shipped_robot
from tomr_power_model.slides.body import body_of, rolling_forces

Array = NDArray[np.float64]

ROBOT = shipped_robot("reference")
MOTORS = Motors(ROBOT)
BASE, TICK = 1_700_000_000_000_000_000, 50_000_000
SPEED = np.array([14.0, -6.0, 9.0])  # rad/s, in truth
HALF = 0.5
BAND = 0.5  # W
NONE = [False, False, False]


def currents(robot: Robot, speed: Array, change: Array | None = None) -> Array:
    """That motors take of a robot that drives evenly, or whose wheels become faster by so much
    [rad/s^2] [A]."""
    motors, (body, radius) = Motors(robot), body_of(robot)
    drag = robot.everywhere("contact.roller_drag", "coefficient")[0]
    faster = np.zeros(3) if change is None else change
    twist, gains = (body.to_twist @ (radius * part) for part in (speed, faster))
    forces = rolling_forces(body, drag, twist, gains)
    forces -= motors.forces(np.zeros(3), speed, faster)
    return np.asarray(forces * radius / motors.constant)


def seen(
    shown: Array,
    volts: Array,
    drawn: Array,
    *,
    unit: Unit = "W",
    supply: float = math.nan,
    band: float = BAND,
) -> ResidualFrame:
    """A tick with such speeds [rad/s], voltages [V] and powers [W], or currents [A]."""
    motors = [Residual(0.0, band, value, unit) for value in drawn.tolist()]
    speeds = [Residual(0.0, 0.3, value, "rad/s") for value in shown.tolist()]
    first, second, third = (Residual(0.0, 0.1, value, "V") for value in volts.tolist())
    residuals = (Residual(0.0, 1.0, 20.0), *motors, *speeds, *motors)
    return ResidualFrame(BASE, residuals, voltages=(first, second, third), supply=supply)


def after(
    item: ResidualFrame,
    breaks: NDArray[np.bool_],
    robot: Robot = ROBOT,
    ticks: int = 4,
    every: int = TICK,
) -> tuple[list[bool], list[bool]]:
    """Signals and counts that are lost after so many ticks alike."""
    watch, found = LossWatch(robot, Motors(robot)), UNEXPLAINED
    for tick in range(ticks):
        found = watch.take(evolve(item, stamp_ns=BASE + tick * every), breaks)
    return found.signal.tolist(), found.counts.tolist()


def only(wheel: int) -> NDArray[np.bool_]:
    return np.arange(3) == wheel


def held(robot: Robot, speed: Array, current: Array) -> Array:
    """Voltages that motors take then [V]."""
    motors = Motors(robot)
    return np.asarray(motors.constant * speed + motors.resistance * current)


def half_counted(
    speed: Array = SPEED,
    change: Array | None = None,
    *,
    wheel: int = 0,
    robot: Robot = ROBOT,
    supply: float = math.nan,
    band: float = BAND,
) -> ResidualFrame:
    """The encoder of a wheel shows half of the turns."""
    current = currents(robot, speed, change)
    volts = held(robot, speed, current)
    shown = np.where(only(wheel), HALF * speed, speed)
    drawn = Motors(robot).idle + volts * current
    return seen(shown, volts, drawn, supply=supply, band=band)


def half_signalled(wheel: int) -> ResidualFrame:
    """A motor gets half of what its driver gives."""
    current = currents(ROBOT, SPEED)
    volts = held(ROBOT, SPEED, current)
    given = np.where(only(wheel), volts / HALF, volts)
    return seen(SPEED, given, MOTORS.idle + volts * current)


@pytest.mark.parametrize("wheel", [0, 1, 2])
def test_lost_counts_and_a_lost_signal_are_distinguished(wheel: int) -> None:
    there = only(wheel).tolist()
    assert after(half_counted(wheel=wheel), only(wheel)) == (NONE, there)
    assert after(half_signalled(wheel), only(wheel)) == (there, NONE)


def test_the_less_a_band_leaves_the_sooner_it_is_known() -> None:
    """At once with the second tick; with bands of 4 W in half a second, of 6 W in no time."""
    for band, ticks in ((BAND, 2), (4.0, 9)):
        assert after(half_counted(band=band), only(0), ticks=ticks - 1) == (NONE, NONE)
        assert after(half_counted(band=band), only(0), ticks=ticks) == (NONE, [True, *NONE[1:]])
    assert after(half_counted(band=6.0), only(0), ticks=100) == (NONE, NONE)
    slow = after(half_counted(band=4.0), only(0), ticks=5, every=2 * TICK)
    assert slow == (NONE, [True, *NONE[1:]])  # half as many that stand for twice the time


def test_a_pause_in_which_nothing_breaks_ends_it() -> None:
    watch, item = LossWatch(ROBOT, MOTORS), half_counted(band=4.0)
    for tick in range(60):  # every fifth tick does not break
        found = watch.take(evolve(item, stamp_ns=BASE + tick * TICK), only(0) & (tick % 5 > 0))
        assert not found.counts.any()


def test_a_wheel_that_turns_slower_than_it_shows_has_lost_no_counts() -> None:
    """Its encoder shows two turns for each."""
    item = half_counted()
    twice = evolve(item.residuals[4], modelled=2.0 * SPEED[0])
    residuals = (*item.residuals[:4], twice, *item.residuals[5:])
    assert after(evolve(item, residuals=residuals), only(0)) == (NONE, NONE)


def test_no_other_motor_than_one_whose_parity_breaks_is_looked_at() -> None:
    assert after(half_counted(), only(1)) == (NONE, NONE)
    assert after(half_counted(), np.zeros(3, dtype=np.bool_)) == (NONE, NONE)


@pytest.mark.parametrize(("volts", "counts"), [(1.1, [True, False, False]), (0.9, NONE)])
def test_of_a_driver_that_gives_next_to_nothing_nothing_is_known(
    volts: float, counts: list[bool]
) -> None:
    """Of the same motion, so much slower that the first driver gives 1.1 V, or 0.9."""

    def beyond(share: float) -> float:
        return float(held(ROBOT, share * SPEED, currents(ROBOT, share * SPEED))[0]) - volts

    slow = half_counted(brentq(beyond, 0.0, 1.0) * SPEED, band=1e-4)
    assert after(slow, only(0)) == (NONE, counts)


def test_what_drivers_draw_themselves_is_no_current_of_a_motor() -> None:
    physics = {**ROBOT.physics, "electrical.driver_standby": ({"power": 40.0},) * 3}
    robot = evolve(ROBOT, physics=physics)
    assert (Motors(robot).idle > 39.0).all()
    assert after(half_counted(robot=robot), only(0), robot) == (NONE, [True, *NONE[1:]])


def test_a_wheel_of_lost_counts_speeds_up_as_its_driver_makes_it() -> None:
    """Each tick all turn faster by a fifth of what they did in the first."""
    watch = LossWatch(ROBOT, MOTORS)
    for tick in range(6):
        item = half_counted((1.0 + 0.2 * tick) * SPEED, 0.2 * SPEED / 0.05)
        found = watch.take(evolve(item, stamp_ns=BASE + tick * TICK), only(0))
        assert found.counts.tolist() == [tick > 0, False, False]


def test_no_motor_counts_for_more_than_five_standard_deviations() -> None:
    watch, nothing = LossWatch(ROBOT, MOTORS), np.zeros(3)
    assert watch._log_odds(np.array([900.0, 1.0, 2.0]), nothing) == 14.0
    assert watch._log_odds(nothing, np.array([900.0, 1.0, 2.0])) == -14.0
    assert watch._log_odds(np.array([900.0, 0.0, 0.0]), np.array([13.0, 0.0, 0.0])) == 0.0


def test_a_supply_that_is_low_gives_as_much_less() -> None:
    """By their laws drivers give a fifth more than they do."""
    item = half_counted(supply=0.8)
    first, second, third = (evolve(v, modelled=v.modelled / 0.8) for v in item.voltages)
    assert after(evolve(item, voltages=(first, second, third)), only(0)) == (
        NONE,
        [True, *NONE[1:]],
    )


def test_what_neither_explains_is_neither() -> None:
    """Its motor draws 20 W more: a band is 0.5 W."""
    item = half_counted()
    first = evolve(item.residuals[1], modelled=item.residuals[1].modelled + 20.0)
    residuals = (item.residuals[0], first, *item.residuals[2:7], first, *item.residuals[8:])
    assert after(evolve(item, residuals=residuals), only(0)) == (NONE, NONE)


def test_where_both_explain_it_it_is_neither() -> None:
    """Bands of 100 W hide what either takes."""
    assert after(half_counted(band=100.0), only(0)) == (NONE, NONE)


def test_a_robot_that_is_to_stand_and_draws_nothing_has_lost_no_signal() -> None:
    """Its driver gives 12 V by its law, and may have let go; of one that draws counts are lost."""
    still, volts = np.zeros(3), np.array([12.0, 0.0, 0.0])
    idle = MOTORS.idle
    assert after(seen(still, volts, idle), only(0)) == (NONE, NONE)
    asked = seen(still, volts, idle)
    speeds = [evolve(item, modelled=5.0, residual=-5.0) for item in asked.residuals[4:7]]
    asked = evolve(asked, residuals=(*asked.residuals[:4], *speeds, *asked.residuals[7:]))
    assert after(asked, only(0)) == ([True, *NONE[1:]], NONE)
    freely = np.array([12.0 / MOTORS.constant[0], 0.0, 0.0])
    drawn = idle + np.abs(volts * currents(ROBOT, 0.95 * freely))
    assert after(seen(still, volts, drawn), only(0))[1] == [True, *NONE[1:]]


def test_without_a_power_nothing_is_known() -> None:
    item = half_counted()
    blind = evolve(item.residuals[2], missing="no power", modelled=math.nan)
    residuals = (*item.residuals[:2], blind, *item.residuals[3:])
    assert after(evolve(item, residuals=residuals), only(0)) == (NONE, NONE)


@pytest.mark.parametrize("pause", [np.zeros(3, dtype=np.bool_), only(1)])
def test_what_was_before_its_parity_held_counts_no_more(pause: NDArray[np.bool_]) -> None:
    """Of the first tick after that its change is not known; with bands of 4 W one says little."""
    watch = LossWatch(ROBOT, MOTORS)
    for tick in range(4):
        found = watch.take(evolve(half_counted(), stamp_ns=BASE + tick * TICK), only(0))
    assert found.counts.any()
    weak = half_counted(band=4.0)
    for tick, breaks in ((4, pause), (5, only(0))):
        found = watch.take(evolve(weak, stamp_ns=BASE + tick * TICK), breaks)
    assert not found.counts.any()


@pytest.mark.parametrize("signed", [True, False])
def test_currents_do_as_well_as_powers(signed: bool) -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current", signed=signed)
    robot = evolve(ROBOT, measurement=measurement)
    current = currents(robot, SPEED)
    volts, drawn = held(robot, SPEED, current), current if signed else np.abs(current)
    shown = np.where(only(0), HALF * SPEED, SPEED)
    item = seen(shown, volts, drawn, unit="A", band=0.05)
    assert after(item, only(0), robot) == (NONE, only(0).tolist())
