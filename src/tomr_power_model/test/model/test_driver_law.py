"""Voltages of the drivers beyond the simulated ones, in hand-worked motions."""

import math

import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.model.driver_law import DriverLaw
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
PROPORTIONAL, INTEGRAL = ROBOT.controller.proportional, ROBOT.controller.integral
TICK = 0.05
STILL = [0.0, 0.0, 0.0]
TURNING = [5.0, -5.0, 5.0]


def beyond(
    law: DriverLaw,
    ahead: list[float],
    speed: list[float] | None = None,
    simulated: list[float] | None = None,
    *,
    asked: list[float] | None = None,
    sums: list[float] | None = None,
    holds: float = 2.0,
    share: float = 1.0,
) -> list[float]:
    """Of a tick, by default at its end and of wheels that stand."""
    given = STILL if speed is None else speed
    same = given if simulated is None else simulated
    wanted, summed, held = asked or given, sums or STILL, [holds] * 3
    return law.beyond(ahead, given, same, asked=wanted, sums=summed, holds=held, share=share)


@pytest.fixture
def law() -> DriverLaw:
    """Whose wheels have turned for two seconds, and stand."""
    found = DriverLaw(ROBOT, TICK)
    for _ in range(40):
        beyond(found, STILL, TURNING)
    found._squares, found._products = STILL.copy(), STILL.copy()  # nothing is learnt yet
    beyond(found, STILL)
    return found


def test_what_a_push_left_before_the_first_command_is_soon_forgotten() -> None:
    law = DriverLaw(ROBOT, TICK)
    beyond(law, STILL)
    for _ in range(20):
        found = beyond(law, [0.03, 0.0, 0.0], [5.0, 0.0, 0.0])
    assert found[0] == pytest.approx(0.03 * INTEGRAL * math.exp(-2.1), rel=0.01)
    for _ in range(20):
        beyond(law, [0.03, 0.0, 0.0], [5.0, 0.0, 0.0])
    later = beyond(law, [0.06, 0.0, 0.0], [5.0, 0.0, 0.0])[0]
    assert later == pytest.approx(0.03 * INTEGRAL, rel=0.05)  # what comes then stays
    beyond(law, [0.06, 0.0, 0.0], [5.0, 0.0, 0.0], [5.5, 0.0, 0.0])  # nor does a shove change that
    later = beyond(law, [0.06, 0.0, 0.0], [5.0, 0.0, 0.0])[0]
    assert later == pytest.approx(0.03 * INTEGRAL, rel=0.05)
    law.forget()
    beyond(law, [0.06, 0.0, 0.0])
    for _ in range(20):
        found = beyond(law, [0.09, 0.0, 0.0], [5.0, 0.0, 0.0])
    assert found[0] == pytest.approx(0.03 * INTEGRAL * math.exp(-2.1), rel=0.01)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_more_than_friction_could_hold_is_a_load_that_stays(way: float) -> None:
    """1.3 times as much is forgotten, and then only slowly."""
    law, load = DriverLaw(ROBOT, TICK), [0.0, way * 0.1, 0.0]
    beyond(law, STILL)
    for _ in range(40):
        found = beyond(law, load, TURNING, holds=0.2)
    stays = way * (0.1 * INTEGRAL - 1.3 * 0.2)
    assert found[1] == pytest.approx(stays, rel=0.07)
    law.forget()  # what it is asked for is not known: so then may be anything
    beyond(law, STILL)
    for _ in range(40):
        found = beyond(law, load, TURNING, holds=0.5)
    assert found[1] == pytest.approx(way * (0.1 * INTEGRAL - 1.3 * 0.5), rel=0.07)


def test_where_friction_holds_nothing_a_difference_fades_slowly_from_the_first() -> None:
    law = DriverLaw(ROBOT, TICK)
    beyond(law, STILL)
    for _ in range(20):
        found = beyond(law, [0.1, 0.0, 0.0], TURNING, holds=0.0)
    assert found[0] == pytest.approx(0.1 * INTEGRAL * math.exp(-0.03), rel=1e-3)


def test_what_a_wheel_falls_behind_is_summed_up(law: DriverLaw) -> None:
    found = beyond(law, [0.01, 0.0, -0.02])
    assert found == pytest.approx([0.01 * INTEGRAL, 0.0, -0.02 * INTEGRAL])


def test_what_a_shove_leaves_while_a_wheel_begins_to_turn_is_forgotten_as_well() -> None:
    law, turns, behind = DriverLaw(ROBOT, TICK), [5.0, 0.0, 0.0], [0.05, 0.0, 0.0]
    for _ in range(30):
        beyond(law, STILL, turns)
    for _ in range(4):
        shoved = beyond(law, behind, turns, [5.3, 0.0, 0.0])
    assert shoved[0] == pytest.approx(0.05 * INTEGRAL + 0.3 * PROPORTIONAL, rel=0.01)  # it is real
    for _ in range(40):  # two seconds anew
        found = beyond(law, behind, turns)
    assert found[0] == pytest.approx(0.05 * INTEGRAL * math.exp(-2.0 * 2.1), rel=0.02)
    behind = [0.06, 0.0, 0.0]
    assert beyond(law, behind, turns)[0] == pytest.approx(0.01 * INTEGRAL + found[0], rel=0.02)


def test_a_wheel_that_is_slower_is_driven_at_once(law: DriverLaw) -> None:
    found = beyond(law, STILL, [-0.2, 0.0, 0.0], STILL)
    assert found == pytest.approx([0.2 * PROPORTIONAL, 0.0, 0.0])


def test_within_a_tick_the_sum_grows_evenly(law: DriverLaw) -> None:
    beyond(law, [0.01, 0.0, 0.0])
    found = beyond(law, [0.03, 0.0, 0.0], share=0.25)
    assert found[0] == pytest.approx(INTEGRAL * (0.01 + 0.25 * 0.02))


@pytest.mark.parametrize("restart", [DriverLaw.clear, DriverLaw.forget])
def test_where_nothing_is_known_the_sums_are_taken_for_equal(
    law: DriverLaw, restart: object
) -> None:
    beyond(law, [0.5, 0.5, 0.5])
    restart(law)  # type: ignore[operator]
    assert beyond(law, [0.5, 0.5, 0.5]) == STILL
    assert beyond(law, [0.51, 0.5, 0.5]) == pytest.approx([0.01 * INTEGRAL, 0.0, 0.0])


def test_an_angle_that_is_not_known_leaves_the_other_wheels_alone(law: DriverLaw) -> None:
    first, second, third = beyond(law, [math.nan, 0.01, 0.0], [math.nan, 0.0, 0.0], STILL)
    assert math.isnan(first)
    assert (second, third) == (pytest.approx(0.01 * INTEGRAL), 0.0)
    for _ in range(3):  # nor does it spoil what is learnt
        found = beyond(law, [0.02, 0.01, 0.0], TURNING)
    assert found[0] == pytest.approx(0.02 * INTEGRAL, rel=0.02)


def test_what_the_simulation_takes_over_is_no_difference_any_more(law: DriverLaw) -> None:
    beyond(law, [0.02, 0.0, 0.0])
    law.taken_over([0.02, 0.0, 0.0])
    assert beyond(law, [0.02, 0.0, 0.0], share=0.0) == pytest.approx(STILL)
    assert beyond(law, [0.02, 0.0, 0.0]) == pytest.approx(STILL)


def test_a_lasting_difference_fades_in_half_a_minute_of_motion_not_at_rest(law: DriverLaw) -> None:
    for _ in range(600):
        found = beyond(law, [0.02, 0.0, 0.0])
    assert found[0] == pytest.approx(0.02 * INTEGRAL)
    for _ in range(round(1.0 / 0.03 / TICK)):
        found = beyond(law, [0.02, 0.0, 0.0], [5.0, 0.0, 0.0])
    assert found[0] == pytest.approx(0.02 * INTEGRAL / math.e, rel=0.01)


def late_by(law: DriverLaw, delay: float, ticks: int) -> list[float]:
    """Of drivers that much late [s], of wheels that turn to and fro; the last tick's voltages."""
    for tick in range(ticks):
        speeds = TURNING if tick % 20 < 10 else [-speed for speed in TURNING]
        found = beyond(law, [delay * speed for speed in speeds], speeds)
    return found


def test_drivers_that_begin_later_hold_no_other_voltage(law: DriverLaw) -> None:
    first, *_ = late_by(law, 0.002, 11)  # less than a period, and they have just turned round
    last = late_by(law, 0.002, 200)
    assert max(map(abs, last)) < 0.1 * abs(first)


def test_a_delay_that_an_offset_has_swallowed_is_none_when_wheels_turn_round() -> None:
    law, late = DriverLaw(ROBOT, TICK), [0.002 * speed for speed in TURNING]
    beyond(law, STILL)
    for _ in range(40):
        beyond(law, late, TURNING)  # at once in the offset
    late_by(law, 0.002, 200)
    assert max(map(abs, beyond(law, late, TURNING))) < 0.1 * 0.002 * TURNING[0] * INTEGRAL
    assert max(map(abs, beyond(law, STILL))) < 0.1 * 0.002 * TURNING[0] * INTEGRAL


def test_wheels_that_turn_when_commands_begin_are_no_later_for_it(law: DriverLaw) -> None:
    late_by(law, 0.002, 200)
    law.forget()  # of offsets, not of the delay
    assert beyond(law, STILL, TURNING) == STILL


def test_a_delay_that_changes_is_followed_within_a_minute(law: DriverLaw) -> None:
    for late in (0.002, -0.002):
        found = late_by(law, late, 1200)
    assert abs(found[0]) < 0.5 * 0.002 * TURNING[0] * INTEGRAL
    law.clear()  # of another robot, or after a leap of the clock, none is known
    beyond(law, STILL)
    again = beyond(law, [0.002 * speed for speed in TURNING], TURNING, share=1.0)
    assert again[0] == pytest.approx(0.9 * 0.002 * TURNING[0] * INTEGRAL, rel=0.02)


def test_an_angle_that_is_lost_in_motion_spoils_no_delay(law: DriverLaw) -> None:
    beyond(law, [math.nan, math.nan, 0.0], TURNING)
    assert all(map(math.isfinite, beyond(law, STILL, TURNING)))


def test_one_wheel_alone_is_not_late(law: DriverLaw) -> None:
    behind = [0.02, 0.0, 0.0]
    for _ in range(100):
        found = beyond(law, behind, TURNING)
    assert found == pytest.approx([0.02 * INTEGRAL * math.exp(-0.03 * 5.0), 0.0, 0.0], rel=0.01)


def test_a_load_is_no_delay(law: DriverLaw) -> None:
    """It puts the wheels ahead that it slows down; without it no voltage is another."""
    faster = [1.6 * speed for speed in TURNING]  # by 3 rad/s: no delay makes 20 mrad of that
    loaded = [math.copysign(0.02, speed) for speed in faster]
    for _ in range(100):
        found = beyond(law, loaded, faster)
    faded = 0.02 * INTEGRAL * (1.0 - math.exp(-0.03 * 5.0))
    assert found[0] == pytest.approx(0.02 * INTEGRAL - faded, rel=0.01)
    back = [-speed for speed in TURNING]
    assert beyond(law, STILL, back) == pytest.approx([-faded, faded, -faded], rel=0.01)


def test_wheels_that_turn_otherwise_than_simulated_say_nothing_of_a_delay(law: DriverLaw) -> None:
    behind = [0.002 * speed for speed in TURNING]
    for _ in range(200):
        beyond(law, behind, TURNING, [speed + 1.0 for speed in TURNING])
    found = beyond(law, behind, TURNING)
    assert found[0] == pytest.approx(behind[0] * INTEGRAL * math.exp(-0.03 * 10.0), rel=0.02)


def test_a_driver_gives_no_more_than_its_supply_and_does_not_sum_up_then(law: DriverLaw) -> None:
    most = ROBOT.supply.nominal_voltage
    asked = [4.0 / PROPORTIONAL, 0.0, 0.0]  # 4 V for its error
    found = beyond(law, [9.0, 0.0, 0.0], asked=asked)
    assert found[0] == pytest.approx(most - 4.0)
    # As soon as the wheel catches up the voltage falls.
    after = beyond(law, [8.9, 0.0, 0.0], asked=asked)
    assert after[0] == pytest.approx(most - 4.0 - 0.1 * INTEGRAL)
    back = beyond(law, [-9.0, 0.0, 0.0], asked=asked)
    assert back[0] == pytest.approx(-most - 4.0)


def test_at_its_limit_a_driver_s_sum_stays_what_it_was(law: DriverLaw) -> None:
    """Its wheel is so slow that its error alone is a limit and a half; it neither winds up nor
    down, whatever the wheel does, also where its angle is not shown."""
    slow = [-1.5 * ROBOT.supply.nominal_voltage / PROPORTIONAL, 0.0, 0.0]
    beyond(law, [0.02, 0.0, 0.0])
    for ahead in (3.0, 6.0, math.nan, 50.0):
        beyond(law, [ahead, 0.0, 0.0], slow, STILL, asked=STILL)
    assert beyond(law, [50.0, 0.0, 0.0])[0] == pytest.approx(0.02 * INTEGRAL)
    assert beyond(law, [50.01, 0.0, 0.0])[0] == pytest.approx(0.03 * INTEGRAL)


def test_of_a_driver_that_begins_at_its_limit_the_sum_is_that_which_gives_it(
    law: DriverLaw,
) -> None:
    """10 V of its own error, and 4 V that the simulated one has summed up."""
    most, error = ROBOT.supply.nominal_voltage, [-10.0 / PROPORTIONAL, 0.0, 0.0]
    sums = [4.0 / INTEGRAL, 0.0, 0.0]
    law.forget()
    beyond(law, STILL, error, STILL, asked=STILL, sums=sums)
    beyond(law, [9.0, 0.0, 0.0], error, STILL, asked=STILL, sums=sums)
    found = beyond(law, [9.0, 0.0, 0.0], sums=sums)
    assert found[0] == pytest.approx(most - 10.0 - 4.0)


def test_a_driver_without_an_integral_holds_what_the_speeds_say() -> None:
    robot = evolve(ROBOT, controller=evolve(ROBOT.controller, integral=0.0))
    law = DriverLaw(robot, TICK)
    beyond(law, STILL)
    found = beyond(law, [50.0, 0.0, 0.0], [-0.1, 0.0, 0.0], STILL)
    assert found == pytest.approx([0.1 * PROPORTIONAL, 0.0, 0.0])


@given(st.lists(st.floats(-0.05, 0.05), min_size=3, max_size=3), st.integers(0, 2))
def test_it_does_not_matter_which_wheel_is_called_the_first(ahead: list[float], shift: int) -> None:
    one, other = DriverLaw(ROBOT, TICK), DriverLaw(ROBOT, TICK)

    def turned(values: list[float]) -> list[float]:
        return values[shift:] + values[:shift]

    for _ in range(3):
        found = beyond(one, ahead, TURNING)
        same = beyond(other, turned(ahead), turned(TURNING))
        assert turned(found) == same
        beyond(one, STILL, TURNING)
        beyond(other, STILL, turned(TURNING))
