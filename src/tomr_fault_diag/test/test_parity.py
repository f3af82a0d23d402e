"""Parity of voltage, power and speed, from ticks whose numbers are worked by hand."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    EXTERNAL,
    HYPOTHESES,
    OTHER,
    WEAKS,
)
from tomr_fault_diag.classifier.contacts import Contacts
from tomr_fault_diag.classifier.evidence import Beside, said_by_forces, said_by_parity
from tomr_fault_diag.classifier.losses import Losses
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.parity import NOT_KNOWN, Parity, ParityWatch
from tomr_fault_diag.classifier.rules import WINDOW_RULES, Moment
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame, Unit
from tomr_power_model.robot import Robot, shipped_robot

Array = NDArray[np.float64]

ROBOT = shipped_robot("reference")
MOTORS = Motors(ROBOT)
BASE = 1_700_000_000_000_000_000
TICK = 50_000_000
SPEED = np.array([8.0, -8.0, 8.0])  # rad/s
CURRENT = np.array([1.0, -1.0, 0.8])  # A
BAND = 0.1  # V, and W
NONE = [False, False, False]
ALL = [True, True, True]
FIRST = [True, False, False]
LONG = 44  # ticks: two seconds, and some


def volts(speed: Array, current: Array) -> Array:
    """That a motor takes."""
    return MOTORS.resistance * current + MOTORS.constant * speed


def power(speed: Array, current: Array) -> Array:
    """That it draws then."""
    return MOTORS.idle + volts(speed, current) * current


def frame(
    held: Array,
    drawn: Array,
    shown: Array = SPEED,
    *,
    band: float = BAND,
    unit: Unit = "W",
    supply: float = math.nan,
) -> ResidualFrame:
    """A tick with such voltages [V], powers and speeds as encoders show [rad/s]."""
    motors = [Residual(0.0, band, value, unit) for value in drawn.tolist()]
    speeds = [Residual(0.0, 0.3, value, "rad/s") for value in shown.tolist()]
    first, second, third = (Residual(value, band, 0.0, "V") for value in held.tolist())
    residuals = (Residual(0.0, 1.0, 20.0), *motors, *speeds, *motors)
    return ResidualFrame(BASE, residuals, voltages=(first, second, third), supply=supply)


WELL = frame(volts(SPEED, CURRENT), power(SPEED, CURRENT))
# Wheel 1 turns twice as fast as it shows.
TWICE = SPEED * [2.0, 1.0, 1.0]
MISCOUNTED = frame(volts(TWICE, CURRENT), power(TWICE, CURRENT))


class Watched:
    """Ticks of 50 ms, one after the other."""

    def __init__(self, robot: Robot = ROBOT) -> None:
        self.watch = ParityWatch(robot)
        self.last = NOT_KNOWN
        self._stamp = BASE

    def after(self, item: ResidualFrame, ticks: int = 4) -> tuple[list[bool], list[bool]]:
        """Where it holds and where it is broken after so many alike."""
        parity = self._after(item, ticks)
        return parity.holds.tolist(), parity.broken.tolist()

    def after_all(self, items: Sequence[ResidualFrame]) -> None:
        """The first for long, so that it is trusted; the others for a moment."""
        for index, item in enumerate(items):
            self.after(item, 4 if index else LONG)

    def skip(self, ticks: int) -> None:
        """So many are missing."""
        self._stamp += ticks * TICK

    def breaks(self, item: ResidualFrame, ticks: int) -> list[bool]:
        """The same: where it breaks."""
        return self._after(item, ticks).breaks.tolist()

    def broke(self, item: ResidualFrame, ticks: int) -> list[bool]:
        """The same: where it breaks, or broke a moment ago."""
        return self._after(item, ticks).broke.tolist()

    def _after(self, item: ResidualFrame, ticks: int) -> Parity:
        parity = NOT_KNOWN
        for _ in range(ticks):
            self._stamp += TICK
            parity = self.watch.take(evolve(item, stamp_ns=self._stamp))
        self.last = parity
        return parity


def seen(
    item: ResidualFrame, ticks: int = 4, robot: Robot = ROBOT
) -> tuple[list[bool], list[bool]]:
    """The same of a watch that has seen nothing else."""
    return Watched(robot).after(item, ticks)


def test_a_healthy_motor_s_holds_after_150_ms() -> None:
    assert seen(WELL, 3) == (NONE, NONE)
    assert seen(WELL) == (ALL, NONE)


def test_nor_do_loads_and_brakes_break_it() -> None:
    for current in (3.0 * CURRENT, -CURRENT, np.zeros(3)):
        assert seen(frame(volts(SPEED, current), power(SPEED, current))) == (ALL, NONE)


def test_a_slow_wheel_says_nothing_for_its_encoder() -> None:
    """A band of 0.1 V, and what 0.1 W leave open, are more than a twelfth of what it takes."""
    slow = SPEED / 8.0
    item = frame(volts(slow, CURRENT), power(slow, CURRENT), slow)
    assert seen(item) == (NONE, NONE)


def test_an_encoder_that_shows_half_of_the_speed_breaks_it() -> None:
    assert seen(MISCOUNTED, 3) == (NONE, NONE)
    assert seen(MISCOUNTED) == ([False, True, True], FIRST)


def test_so_do_a_lost_signal_and_a_winding_that_loses_more() -> None:
    lost = np.where(FIRST, MOTORS.idle, power(SPEED, CURRENT))
    driven = volts(SPEED, CURRENT) * [2.0, 1.0, 1.0]  # more and more, for nothing comes of it
    assert seen(frame(driven, lost))[1] == FIRST
    more = np.where(FIRST, 2.0, 0.0)
    weak = frame(volts(SPEED, CURRENT) + more, power(SPEED, CURRENT) + more * CURRENT)
    assert seen(weak)[1] == FIRST


def test_what_a_description_may_be_off_by_is_no_break() -> None:
    off = 0.14 * MOTORS.constant * SPEED
    assert (np.abs(off) > 4.0 * BAND).all()
    assert seen(frame(volts(SPEED, CURRENT) + off, power(SPEED, CURRENT))) == (NONE, NONE)


def test_a_break_is_remembered_for_ten_seconds_or_until_it_holds() -> None:
    unknown = evolve(WELL, voltages=(evolve(WELL.voltages[0], residual=math.nan),) * 3)
    watched = Watched()
    assert watched.after(MISCOUNTED, 4)[1] == FIRST
    assert watched.after(unknown, 199) == (NONE, FIRST)
    assert watched.after(unknown, 1) == (NONE, NONE)
    watched.after(MISCOUNTED, 4)
    assert watched.after(WELL, 3)[1] == FIRST
    assert watched.after(WELL, 1) == (ALL, NONE)
    watched.after(MISCOUNTED, 4)
    watched.watch.clear()
    assert watched.after(unknown, 1) == (NONE, NONE)


def test_it_breaks_where_it_agreed_before() -> None:
    unknown = evolve(WELL, voltages=(evolve(WELL.voltages[0], residual=math.nan),) * 3)
    most = np.full(3, 0.95 * ROBOT.supply.nominal_voltage)
    at_its_limit = frame(most, power(SPEED, CURRENT))
    low = frame(volts(TWICE, CURRENT), power(TWICE, CURRENT), supply=0.5)  # 12 V of 12.8
    slow = frame(volts(0.2 * SPEED, CURRENT), power(0.2 * SPEED, CURRENT), 0.2 * SPEED)
    still = frame(volts(0.01 * SPEED, CURRENT), power(0.01 * SPEED, CURRENT), 0.01 * SPEED)
    for before, breaks in (
        ([WELL], FIRST),
        ([slow], FIRST),  # which does not say that its encoder is well
        ([still], NONE),
        ([], NONE),
        ([WELL, at_its_limit], NONE),
        ([WELL, at_its_limit, WELL], FIRST),
        ([WELL, low], FIRST),  # whose supply is measured
        ([WELL, unknown], NONE),
    ):
        watched = Watched()
        watched.after_all(before)
        assert watched.breaks(MISCOUNTED, 3) == NONE
        assert watched.breaks(MISCOUNTED, 1) == breaks
        assert watched.breaks(WELL, 1) == NONE


def test_at_first_a_law_is_trusted_after_a_second() -> None:
    """Before, what its driver has summed up may be anything: wheels that turn back agree with that
    for a moment. So is one again that is off before it is known, as after a gap."""
    for ticks, breaks in ((20, NONE), (21, FIRST)):
        watched = Watched()
        watched.after(WELL, ticks)
        assert watched.breaks(MISCOUNTED, 4) == breaks
    for off, ticks, breaks in ((0, 4, FIRST), (3, 4, FIRST), (4, 20, NONE), (4, 21, FIRST)):
        watched = Watched()
        watched.after(WELL, LONG)
        watched.skip(6)
        watched.after(MISCOUNTED, off)
        watched.after(WELL, ticks)
        assert watched.breaks(MISCOUNTED, 4) == breaks


def test_a_break_counts_for_half_a_second_or_until_it_agrees() -> None:
    unknown = evolve(WELL, voltages=(evolve(WELL.voltages[0], residual=math.nan),) * 3)
    still = frame(np.zeros(3), power(np.zeros(3), 0.0 * CURRENT), 0.0 * SPEED)
    slow = frame(volts(0.2 * SPEED, CURRENT), power(0.2 * SPEED, CURRENT), 0.2 * SPEED)
    for after, ticks in ((still, 10), (slow, 3)):
        watched = Watched()
        watched.after_all([WELL])
        assert watched.broke(MISCOUNTED, 3) == NONE
        assert watched.broke(MISCOUNTED, 1) == FIRST
        assert watched.broke(after, ticks) == FIRST
        assert watched.breaks(after, 0) == NONE
        assert watched.broke(after, 1) == NONE
    assert watched.broke(unknown, 4) == NONE  # whose law says nothing


def test_a_driver_that_was_at_its_limit_may_be_off_by_a_tenth_of_it() -> None:
    """2.4 V, until it has agreed for two seconds on end: that of the third wheel gives too much."""
    most = np.full(3, ROBOT.supply.nominal_voltage)
    fast = (most - MOTORS.resistance * CURRENT) / MOTORS.constant
    at_its_limit = frame(most, power(fast, CURRENT), fast, supply=1.0)
    held, drawn = volts(SPEED, CURRENT), power(SPEED, CURRENT)
    third = [False, False, True]
    for off, before, breaks in (
        (2.3, [WELL], third),
        (2.3, [WELL, at_its_limit], NONE),
        (2.3, [WELL, at_its_limit, WELL], NONE),
        (2.3, [WELL, at_its_limit, *[WELL] * 11], third),
        (4.0, [WELL, at_its_limit], third),
    ):
        watched = Watched()
        watched.after_all(before)
        assert watched.breaks(frame(held + np.multiply(third, off), drawn), 4) == breaks


def test_at_its_limit_a_driver_s_voltage_is_that_of_its_supply() -> None:
    """Its wheel turns twice as fast as it shows, at 24 V, or at 18 V of a supply that is low."""
    for supply in (1.0, 0.75):
        full = ROBOT.supply.nominal_voltage
        fast = np.array([(supply * full - MOTORS.resistance[0]) / MOTORS.constant[0], *SPEED[1:]])
        held, drawn = volts(fast, CURRENT), power(fast, CURRENT)
        held[0] = full  # by its law
        watched = Watched()
        watched.after_all([evolve(WELL, supply=supply)])
        shown = frame(held, drawn, fast, supply=supply)
        assert watched.breaks(shown, 4) == NONE
        assert watched.breaks(frame(held, drawn, fast * [0.5, 1.0, 1.0], supply=supply), 4) == FIRST


def test_what_was_before_a_gap_says_nothing() -> None:
    for gap, breaks in ((2, FIRST), (5, FIRST), (6, NONE)):  # ticks; 0.3 s are none too many
        watched = Watched()
        watched.after_all([WELL])
        watched.skip(gap)
        assert watched.breaks(MISCOUNTED, 4) == breaks
    watched = Watched()
    watched.after_all([WELL])
    watched.after(MISCOUNTED, 3)
    watched.skip(6)
    assert watched.after(MISCOUNTED, 1)[1] == NONE


def test_what_a_supply_lacks_is_no_break() -> None:
    """Its driver gives a fifth less than its law says: of 10 V and more 2 V are no break."""
    fast = 1.8 * SPEED
    held, drawn = volts(fast, CURRENT), power(fast, CURRENT)
    for more, breaks in ((0.2, NONE), (0.3, NONE), (0.5, FIRST)):
        watched = Watched()
        watched.after_all([frame(held, drawn, fast, supply=0.8)])
        by_law = held * [1.0 + more, 1.0, 1.0]
        assert watched.breaks(frame(by_law, drawn, fast, supply=0.8), 4) == breaks


def beside(*off: float) -> ResidualFrame:
    """Motors whose drivers' laws are so far off [V]; a band of each is 0.1 V and 0.026 of power."""
    return frame(volts(SPEED, CURRENT) + off, power(SPEED, CURRENT))


def test_several_motors_that_are_off_at_once_obey_what_is_not_known() -> None:
    """Of one that is off alone something is wrong; of others alike, or a third as much, nothing."""
    for off, breaks in (
        ((5.0, 0.0, 0.0), FIRST),
        ((5.0, 5.0, 5.0), NONE),
        ((5.0, -2.0, 0.0), NONE),
        ((5.0, 0.0, 1.4), [True, False, True]),
        ((5.0, 0.0, 1.6), NONE),
    ):
        watched = Watched()
        watched.after_all([WELL])
        assert watched.breaks(beside(*off), 4) == breaks
        assert watched.after(beside(*off), 4) == (watched.last.holds.tolist(), breaks)


def test_what_is_within_a_band_or_in_doubt_is_not_off_with_others() -> None:
    for other, breaks in ((1.8, FIRST), (2.2, NONE)):  # of a band of 2 V; 5 V are more than two
        watched = Watched()
        held = volts(SPEED, CURRENT) + np.array([5.0, other, 0.0])
        watched.after_all([frame(volts(SPEED, CURRENT), power(SPEED, CURRENT), band=1.9)])
        assert watched.breaks(frame(held, power(SPEED, CURRENT), band=1.9), 4) == breaks
    for was_full, breaks in ((True, FIRST), (False, NONE)):  # a tenth of 24 V is in doubt then
        watched = Watched()
        watched.after_all([evolve(WELL, supply=1.0)])
        full = volts(SPEED, CURRENT)
        full[1] = -24.0 if was_full else full[1]
        watched.after(frame(full, power(SPEED, CURRENT), supply=1.0), 1)
        off = evolve(beside(5.0, 2.0, 0.0), supply=1.0)
        assert watched.breaks(off, 4) == breaks


def test_one_that_is_off_for_long_says_nothing_of_the_others() -> None:
    """The second fault of a robot is one, 0.5 s after the first, and none a moment after it."""
    for ticks, breaks in ((14, [True, True, False]), (9, NONE)):
        watched = Watched()
        watched.after_all([WELL])
        assert watched.breaks(beside(5.0, 0.0, 0.0), ticks) == FIRST
        assert watched.breaks(beside(5.0, 5.0, 0.0), 4) == breaks
        assert watched.last.broken.tolist() == breaks
    watched = Watched()
    watched.after_all([WELL])
    assert watched.breaks(beside(14.0, 0.0, 0.0), 14) == FIRST
    assert watched.breaks(beside(14.0, 4.0, 4.0), 4) == NONE  # these two, together, are no faults


def test_drivers_that_were_misled_are_believed_after_two_seconds() -> None:
    for ticks, breaks in ((38, NONE), (45, FIRST)):
        watched = Watched()
        watched.after_all([WELL])
        watched.breaks(beside(5.0, 5.0, 5.0), 4)
        assert watched.after(WELL, 20)[1] == NONE
        turning_back = 0.01 * SPEED
        watched.after(
            frame(volts(turning_back, CURRENT), power(turning_back, CURRENT), turning_back), 1
        )
        assert watched.after(WELL, ticks - 21)[1] == NONE
        assert watched.breaks(beside(5.0, 0.0, 0.0), 4) == breaks
    watched.breaks(beside(5.0, 5.0, 5.0), 4)
    watched.watch.clear()
    watched.after_all([WELL])
    assert watched.breaks(beside(5.0, 0.0, 0.0), 4) == FIRST


def test_what_wheels_do_is_unsettled_a_moment_longer() -> None:
    """For 0.35 s since several motors were found off at once, however long they are."""
    watched = Watched()
    watched.after_all([WELL])
    assert not watched.last.misled
    watched.breaks(beside(5.0, 5.0, 5.0), 1)
    assert watched.last.misled
    watched.after(beside(5.0, 5.0, 5.0), 6)
    assert watched.last.misled
    watched.after(beside(5.0, 5.0, 5.0), 1)
    assert not watched.last.misled


def test_how_far_beyond_what_is_allowed() -> None:
    """15 % of what the speed takes is allowed, or two bands."""
    takes = float(MOTORS.constant[0] * SPEED[0])
    for more in (0.5, 3.0):
        watched = Watched()
        watched.after_all([WELL])
        watched.breaks(beside((1.0 + more) * 0.15 * takes, 0.0, 0.0), 4)
        assert watched.last.beyond == pytest.approx(more)
        watched.after(WELL, 1)
        assert watched.last.beyond == pytest.approx(more)
        watched.after(WELL, 12)
        assert watched.last.beyond == 0.0


def test_a_stray_tick_is_none() -> None:
    watched = Watched()
    for _ in range(5):
        assert watched.after(MISCOUNTED, 3)[1] == NONE
        watched.after(WELL, 1)


def test_a_driver_at_its_limit_says_nothing() -> None:
    most = np.full(3, 0.95 * ROBOT.supply.nominal_voltage)
    assert seen(frame(most, power(SPEED, CURRENT))) == (NONE, NONE)
    fast = (most - MOTORS.resistance * CURRENT) / MOTORS.constant
    assert seen(frame(most, power(fast, CURRENT), fast)) == (NONE, NONE)


def test_what_is_within_two_bands_is_no_break() -> None:
    off = float(MOTORS.constant[0] * SPEED[0])  # V
    voltages = frame(volts(TWICE, CURRENT), power(TWICE, CURRENT), band=off / 1.8).voltages
    assert seen(evolve(MISCOUNTED, voltages=voltages))[1] == NONE
    voltages = frame(volts(TWICE, CURRENT), power(TWICE, CURRENT), band=off / 2.5).voltages
    assert seen(evolve(MISCOUNTED, voltages=voltages))[1] == FIRST


def test_a_power_that_is_hardly_known_breaks_nothing() -> None:
    """60 W, or as much of a supply's current, leave 4 V open: twice that is more than is off."""
    held, drawn = volts(TWICE, CURRENT), power(TWICE, CURRENT)
    supply = evolve(ROBOT, measurement=evolve(ROBOT.measurement, quantity="supply_current"))
    of_supply = frame(held, drawn / 24.0, unit="A", band=60.0 / 24.0)
    for item, robot in ((frame(held, drawn, band=60.0), ROBOT), (of_supply, supply)):
        vague = evolve(item, voltages=MISCOUNTED.voltages)
        assert seen(vague, robot=robot) == (NONE, NONE)


def test_a_robot_at_rest_says_nothing_whatever_it_draws() -> None:
    with np.errstate(all="raise"):
        assert seen(frame(np.zeros(3), MOTORS.idle, np.zeros(3))) == (NONE, NONE)
        assert seen(frame(np.zeros(3), MOTORS.idle - 50.0, np.zeros(3))) == (NONE, NONE)


def test_of_a_motor_that_is_not_measured_nothing_is_known() -> None:
    drawn = power(SPEED, CURRENT)
    blind = frame(volts(SPEED, CURRENT), np.where(FIRST, math.nan, drawn))
    assert seen(blind) == ([False, True, True], NONE)


def test_currents_do_as_well_as_powers() -> None:
    signed, unsigned = (
        evolve(
            ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current", signed=signed)
        )
        for signed in (True, False)
    )
    item = frame(volts(SPEED, CURRENT), CURRENT, unit="A")
    assert seen(item, robot=signed) == (ALL, NONE)
    assert seen(frame(volts(SPEED, CURRENT), np.abs(CURRENT), unit="A"), robot=unsigned)[0] == ALL
    supply = evolve(ROBOT, measurement=evolve(ROBOT.measurement, quantity="supply_current"))
    drawn = power(SPEED, CURRENT) / ROBOT.supply.nominal_voltage
    item = frame(volts(SPEED, CURRENT), drawn, unit="A", band=BAND / 24.0)
    assert seen(item, robot=supply) == (ALL, NONE)


def test_what_it_says_by_hand() -> None:
    said = said_by_parity(Parity(np.array(FIRST), np.array(NONE)))
    lowered = [CONTROLS.start, ENCODERS.start]
    assert said[lowered].tolist() == [-10.0, -10.0]
    assert not np.delete(said, lowered).any()
    said = said_by_parity(Parity(np.array(NONE), np.array(FIRST)))
    assert said[SLIP] == -10.0
    assert not np.delete(said, SLIP).any()
    for beyond, less in ((0.0, 0.0), (0.2, -4.0), (0.5, -10.0), (3.0, -10.0)):
        parity = Parity(broken=np.array(FIRST), broke=np.array(FIRST), beyond=beyond)
        said = said_by_parity(parity)
        assert said[SLIP] == -10.0
        assert said[[NORMAL, EXTERNAL, DRAGS.start]].tolist() == [less] * 3
        assert not np.delete(said, [NORMAL, SLIP, EXTERNAL, DRAGS.start]).any()
    none, first = np.array(NONE), np.array(FIRST)
    for losses, lost in ((Losses(first, none), CONTROLS), (Losses(none, first), ENCODERS)):
        said = said_by_parity(Parity(losses=losses))
        assert said[[NORMAL, EXTERNAL]].tolist() == [-24.0, -24.0]
        left = [lost.start, WEAKS.start, OTHER]  # a winding that takes more explains it as well
        assert not said[left].any()
        assert (np.delete(said, [NORMAL, EXTERNAL, *left]) == -10.0).all()
    assert not said_by_parity(NOT_KNOWN).any()
    moment = Moment(WELL, by_parity=np.arange(HYPOTHESES, dtype=float))
    added = WINDOW_RULES["parity of the motors"](np.ones(HYPOTHESES), moment)
    assert added.tolist() == list(range(1, HYPOTHESES + 1))


def test_what_looks_like_a_slide_is_the_encoder_s_where_it_is_broken() -> None:
    plain = said_by_forces(WELL, Contacts(0.9))
    broken = said_by_forces(WELL, Contacts(0.9), Parity(np.array(NONE), np.array(FIRST)))
    assert plain[SLIP] > 0.0
    assert broken[SLIP] == 0.0
    assert broken[ENCODERS].tolist() == plain[ENCODERS].tolist()


def test_the_classifier_looks_at_it() -> None:
    classifier, found = FaultClassifier.of(ClassifierSettings(), ROBOT), []
    judge = classifier._judge.judge

    def noted(item: ResidualFrame, elapsed: int, unseen: object, beside: Beside) -> object:
        found.append(beside.parity)
        return judge(item, elapsed, unseen, beside)  # type: ignore[arg-type]

    classifier._judge.judge = noted  # type: ignore[assignment,method-assign]
    for tick in range(60):
        classifier.classify(evolve(WELL, stamp_ns=BASE + tick * TICK))
    assert found[-1].holds.all()
    classifier.clear()
    classifier.classify(evolve(WELL, stamp_ns=BASE + 61 * TICK))
    assert not found[-1].holds.any()
