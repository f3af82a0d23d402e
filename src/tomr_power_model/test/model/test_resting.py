"""What drivers hold while their wheels are at rest, by hand."""

import math
from collections.abc import Callable

import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.model.commanded import CommandPath, CommandTiming, Seen
from tomr_power_model.model.resting import RestingDrivers
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
ROBOT = shipped_robot("reference")
Triple = tuple[float, float, float]
REST: Triple = (0.0, 0.0, 0.0)
TURNS: Triple = (2.0, 0.0, 0.0)
TICK = 0.05  # s
PUSHED = 0.004  # rad; friction holds 5.7 mrad


@pytest.fixture(name="path")
def _path() -> CommandPath:
    return _standing(ROBOT)


def _standing(robot: Robot) -> CommandPath:
    """Of a robot that is commanded to stand and stands."""
    path = CommandPath(robot, CommandTiming(50 * MS))
    path.command(BASE, REST)
    path.over(BASE + 50 * MS, Seen(REST, REST, 0.0))
    return path


def _volts(
    drivers: RestingDrivers,
    path: CommandPath,
    angle: Triple,
    speed: Triple = REST,
    simulated: Triple = REST,
    share: float = 1.0,
) -> list[float]:
    return drivers.voltages(path, angle, speed, simulated=simulated, share=share).held


def test_nothing_is_known_before_the_first_command() -> None:
    path = CommandPath(ROBOT, CommandTiming(50 * MS))
    found = _volts(RestingDrivers(ROBOT, TICK), path, REST)
    assert all(math.isnan(volts) for volts in found)


def test_a_wheel_pushed_aside_is_pulled_back(path: CommandPath) -> None:
    # k_i = 12 V/rad: 0.1 rad ahead are -1.2 V.
    drivers = RestingDrivers(ROBOT, TICK)
    assert _volts(drivers, path, REST) == pytest.approx(REST)
    assert _volts(drivers, path, (0.1, 0.0, 0.0))[0] == pytest.approx(-1.2)


def test_what_a_push_leaves_is_not_in_the_simulated_drivers(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    proportional = ROBOT.controller.proportional
    for share in (1.0, 0.5):
        found = drivers.voltages(path, (0.1, 0.0, 0.0), REST, simulated=TURNS, share=share)
        assert found.simulated == pytest.approx([-2.0 * proportional, 0.0, 0.0])


def test_what_the_simulation_takes_over_it_holds_from_then_on(path: CommandPath) -> None:
    drivers, found = RestingDrivers(ROBOT, TICK), []
    drivers.voltages(path, REST, REST, simulated=REST, share=1.0)
    for _ in range(3):
        angle = PUSHED, 0.0, 0.0
        found.append(drivers.voltages(path, angle, REST, simulated=REST, share=0.0).simulated[0])
    # At the begin of each tick: half of what is left is taken over at the end of each.
    assert found == pytest.approx([0.0, -12.0 * 0.5 * PUSHED, -12.0 * 0.75 * PUSHED])


def test_voltages_are_those_of_the_time_asked_for(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    assert _volts(drivers, path, (0.1, 0.0, 0.0), share=0.25)[0] == pytest.approx(-0.3)


def test_what_a_start_left_different_fades_in_motion(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    asked = path.wheel(at.ASKED)[0]
    for _ in range(1000):
        found = _volts(drivers, path, (0.1, 0.0, 0.0), TURNS)[0]
    assert found == pytest.approx(1.2 * (asked - 2.0), abs=0.02)


@pytest.mark.parametrize(
    ("before", "then", "left"),
    [
        (1.4, 2.0, math.exp(-2.1 * 2.0 - 0.1 * 0.5)),  # a fault that ended
        (2.0, 2.0, math.exp(-0.1 * 2.5)),  # friction that is not as described
        (1.4, 1.4, math.exp(-0.1 * 2.5)),  # a fault that goes on
    ],
)
@pytest.mark.parametrize("tick", [0.01, 0.05, 0.1])
def test_what_is_different_fades_soon_where_a_wheel_turns_as_simulated_again(
    path: CommandPath, before: float, then: float, left: float, tick: float
) -> None:
    drivers = RestingDrivers(ROBOT, tick)
    # Nothing fades before there is a difference.
    _volts(drivers, path, REST, TURNS, (before, 0.0, 0.0))
    for _ in range(round(2.5 / tick)):
        found = _volts(drivers, path, (0.1, 0.0, 0.0), TURNS, (then, 0.0, 0.0))[0]
    error = 12.0 * 0.1 * left
    assert found == pytest.approx(1.2 * (path.wheel(at.ASKED)[0] - 2.0) - error, abs=1e-6)


def _sum_after(path: CommandPath, angle: float, speed: float) -> float:
    """Of the first wheel's simulated errors, 40 ticks after it was moved [rad]."""
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    for _ in range(40):
        _volts(drivers, path, (angle, 0.0, 0.0), (speed, 0.0, 0.0))
    return path.wheel(at.INTEGRAL)[0]


def test_what_a_push_leaves_in_a_driver_is_expected_of_its_wheel(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    for _ in range(40):
        volts = _volts(drivers, path, (PUSHED, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] == pytest.approx(-PUSHED, abs=1e-5)
    assert volts[0] == pytest.approx(-12.0 * PUSHED)  # and none of it counts twice
    assert path.wheel(at.INTEGRAL)[1:] == [0.0, 0.0]


def test_by_its_law_a_driver_holds_the_same_whoever_has_summed_it_up(path: CommandPath) -> None:
    """What the simulation takes over is no difference any more, and what it expects instead."""
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    for _ in range(40):
        found = drivers.voltages(path, (PUSHED, 0.0, 0.0), REST, simulated=REST, share=1.0)
        assert found.by_law[0] == pytest.approx(-12.0 * PUSHED)
    assert found.simulated[0] == pytest.approx(-12.0 * PUSHED, abs=1e-4)


def test_by_its_law_a_driver_forgets_no_more_than_friction_held(path: CommandPath) -> None:
    """Half of a volt as it begins to turn: 5.7 mrad, 1.3 times, are no load."""
    drivers, far = RestingDrivers(ROBOT, TICK), (0.5 / 12.0, 0.0, 0.0)
    _volts(drivers, path, REST)
    for _ in range(40):
        found = drivers.voltages(path, far, TURNS, simulated=TURNS, share=1.0)
    beyond = found.by_law[0] - found.simulated[0]
    assert beyond == pytest.approx(-0.5 + 1.3 * 12.0 * 0.0057, rel=0.06)


@pytest.mark.parametrize("speed", [-900.0, 900.0])
def test_by_its_law_a_driver_gives_no_more_than_its_supply(path: CommandPath, speed: float) -> None:
    drivers, most = RestingDrivers(ROBOT, TICK), ROBOT.supply.nominal_voltage
    _volts(drivers, path, REST)  # so that what its driver has summed up is known
    found = drivers.voltages(path, REST, (speed, 0.0, 0.0), simulated=REST, share=1.0)
    assert found.by_law == [math.copysign(most, -speed), *found.simulated[1:]]


def test_what_it_gives_for_its_error_leaves_less_for_its_sum_at_the_limit(
    path: CommandPath,
) -> None:
    """It turns backwards by 2 rad/s, for which k_p gives 2.4 V, and then stands."""
    drivers, far = RestingDrivers(ROBOT, TICK), (-9.0, 0.0, 0.0)
    _volts(drivers, path, REST)
    drivers.voltages(path, far, (-2.0, 0.0, 0.0), simulated=REST, share=1.0)
    found = drivers.voltages(path, far, REST, simulated=REST, share=1.0)
    assert found.by_law[0] == pytest.approx(ROBOT.supply.nominal_voltage - 2.4)


@pytest.mark.parametrize("restart", [RestingDrivers.clear, RestingDrivers.forget])
def test_by_its_law_a_driver_begins_as_simulated(
    path: CommandPath, restart: Callable[[RestingDrivers], None]
) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    far = (0.6, 0.0, 0.0)  # more than a push leaves
    assert drivers.voltages(path, far, REST, simulated=REST, share=1.0).by_law[0] < -7.0
    restart(drivers)
    found = drivers.voltages(path, far, REST, simulated=REST, share=1.0)
    assert found.by_law == found.simulated


def test_a_wheel_that_hardly_moves_stands(path: CommandPath) -> None:
    assert _sum_after(path, PUSHED, 0.03) < 0.0


def test_nothing_is_taken_over_from_a_wheel_that_is_to_turn(path: CommandPath) -> None:
    assert path.state is not None
    path.state[at.STATE_HEADER + at.SPEED] = path.state[at.STATE_HEADER + at.ASKED] = 0.6
    assert _sum_after(path, PUSHED, 0.0) == 0.0


def test_nothing_is_taken_over_from_a_wheel_in_motion(path: CommandPath) -> None:
    assert _sum_after(path, PUSHED, 2.0) == 0.0


def test_as_much_is_taken_over_as_friction_holds(path: CommandPath) -> None:
    # 0.06 N m at 0.7 N m/A and 0.8 ohm are 68.6 mV, at 12 V/rad 5.71 mrad.
    assert _sum_after(path, 0.0114, 0.0) == pytest.approx(-0.0057)


def test_nothing_is_taken_over_from_an_encoder_that_no_push_explains(path: CommandPath) -> None:
    assert _sum_after(path, 0.0115, 0.0) == 0.0


def test_a_simulated_wheel_that_creeps_takes_over_nothing(path: CommandPath) -> None:
    assert path.state is not None
    path.state[at.STATE_HEADER + at.SPEED] = 0.1  # asked to stand
    assert _sum_after(path, PUSHED, 0.0) == 0.0


def test_while_the_simulation_creeps_nothing_is_taken_over_and_then_it_is(
    path: CommandPath,
) -> None:
    drivers, angle = RestingDrivers(ROBOT, TICK), (PUSHED, 0.0, 0.0)
    assert path.state is not None
    _volts(drivers, path, REST, (2.0, 0.0, 0.0))
    path.state[at.STATE_HEADER + at.SPEED] = 0.1
    _volts(drivers, path, angle)
    assert path.wheel(at.INTEGRAL)[0] == 0.0
    path.state[at.STATE_HEADER + at.SPEED] = 0.0
    _volts(drivers, path, angle)
    assert path.wheel(at.INTEGRAL)[0] == pytest.approx(-0.5 * PUSHED, rel=0.04)


def test_an_angle_that_is_not_known_leaves_the_simulation_alone(path: CommandPath) -> None:
    assert _sum_after(path, math.nan, 0.0) == 0.0
    unknown = _volts(RestingDrivers(ROBOT, TICK), path, (math.nan, 0.0, 0.0))
    assert unknown == pytest.approx(REST)  # as the simulation has it


def test_a_sum_that_would_turn_the_wheel_is_not_the_drivers(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    _volts(drivers, path, (PUSHED, 0.0, 0.0))
    taken = path.wheel(at.INTEGRAL)[0]
    assert taken < 0.0
    assert path.state is not None
    path.state[at.STATE_HEADER + at.SPEED] = -0.02  # it gives way
    for _ in range(3):
        volts = _volts(drivers, path, (PUSHED, 0.0, 0.0))
        path.state[at.STATE_HEADER + at.SPEED] = 0.0
    assert volts[0] == pytest.approx(12.0 * taken)
    _volts(drivers, path, (1.2 * PUSHED, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] == taken
    _volts(drivers, path, (1.2 * PUSHED, 0.0, 0.0), (0.1, 0.0, 0.0))
    _volts(drivers, path, (1.2 * PUSHED, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] == taken
    _volts(drivers, path, (1.2 * PUSHED, 0.0, 0.0), (0.3, 0.0, 0.0))  # it turns after all
    _volts(drivers, path, (1.2 * PUSHED, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] < taken


def test_a_wheel_without_dry_friction_holds_nothing() -> None:
    physics = {name: sets for name, sets in ROBOT.physics.items() if name != "friction.coulomb"}
    robot = evolve(ROBOT, physics=physics)
    drivers, path = RestingDrivers(robot, TICK), _standing(robot)
    for angle in (0.0, PUSHED, PUSHED):
        _volts(drivers, path, (angle, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] == 0.0


@pytest.mark.parametrize(("held", "follows"), [(0.0, True), (0.05, False), (-0.05, True)])
def test_of_a_wheel_that_stands_while_others_turn_friction_holds_what_is_left(
    path: CommandPath, held: float, follows: bool
) -> None:
    # Its sum of 0.1 rad makes 1.2 V, 1.05 N m, and friction can hold 0.06 N m of these: it bears
    # the rest for the body. 2 mrad more are 0.024 V, 0.021 N m.
    drivers = RestingDrivers(ROBOT, TICK)
    assert path.state is not None
    wheel = at.STATE_HEADER
    path.state[wheel + at.STATE_WHEEL + at.SPEED] = 3.0
    path.state[wheel + at.STATE_WHEEL + at.ASKED] = 3.0
    path.state[wheel + at.INTEGRAL] = 0.1
    path.state[wheel + at.HELD] = held
    _volts(drivers, path, (0.0, 0.0, 0.0))
    _volts(drivers, path, (-PUSHED, 0.0, 0.0))
    assert (path.wheel(at.INTEGRAL)[0] > 0.1) is follows


def test_after_what_is_not_known_the_sums_are_taken_for_equal(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST)
    drivers.forget()
    assert _volts(drivers, path, (0.1, 0.0, 0.0)) == pytest.approx(REST)


def test_after_a_leap_of_the_clock_nothing_is_remembered(path: CommandPath) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    assert path.state is not None
    for angle in (0.0, 0.6):  # a difference that no push makes
        _volts(drivers, path, (angle, 0.0, 0.0))
    drivers.clear()
    assert _volts(drivers, path, (0.6, 0.0, 0.0), share=0.25) == pytest.approx(REST)
    drivers.clear()
    path.state[at.STATE_HEADER + at.SPEED] = 0.1
    _volts(drivers, path, REST)
    path.state[at.STATE_HEADER + at.SPEED] = 0.0
    _volts(drivers, path, (PUSHED, 0.0, 0.0))
    assert path.wheel(at.INTEGRAL)[0] < 0.0


def test_after_a_leap_of_the_clock_it_is_forgotten_that_a_wheel_turned_otherwise(
    path: CommandPath,
) -> None:
    drivers = RestingDrivers(ROBOT, TICK)
    _volts(drivers, path, REST, TURNS, (1.4, 0.0, 0.0))
    drivers.clear()
    _volts(drivers, path, REST, TURNS, TURNS)
    found = _volts(drivers, path, (0.1, 0.0, 0.0), TURNS, TURNS)[0]
    error = 12.0 * 0.1 * math.exp(-0.1 * TICK)
    assert found == pytest.approx(1.2 * (path.wheel(at.ASKED)[0] - 2.0) - error, abs=1e-6)
