"""What acts on the body from outside, from ticks: hand-made motions of the reference robot."""

import math
from collections.abc import Callable, Iterator
from unittest.mock import Mock

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import WEAKS
from tomr_fault_diag.classifier.evidence import Beside
from tomr_fault_diag.classifier.judges import Opinion, WindowJudge, make_judge
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.outside import NOTHING_ACTS, Outside, OutsideWatch
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import BURDENED, DEGRADED
from tomr_fault_diag.residuals.frame import SPEEDS, Residual, ResidualFrame
from tomr_power_model.robot import Robot, shipped_robot
from tomr_power_model.slides.body import body_of

Array = NDArray[np.float64]
# Force [N] and moment [N m] on the body, at a time [s], a twist and an angle to the world [rad].
Wrench = Callable[[float, Array, float], Array]

ROBOT = shipped_robot("reference")
MOTORS = Motors(ROBOT)
BODY, RADIUS = body_of(ROBOT)
MASS = BODY.mass
BASE = 1_700_000_000_000_000_000
MS = 1_000_000
PERIOD = 0.05  # s
BAND = 1.0  # W
LEAST = 0.1  # m/s

MORE = np.array([0.8, 0.0, 0.0])  # W
OBLIQUE = np.array([0.3, 0.15, 0.3])  # a motion of which every wheel turns
# Ahead, to the left, turning on the spot, back: a second and a half each.
WAYS = [
    np.array(way) for way in ([0.4, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 1.0], [-0.4, 0.1, 0.4])
]


def twist_at(time: float) -> Array:
    return WAYS[int(time / 1.5) % len(WAYS)]


def ahead(_: float) -> Array:
    return WAYS[0]


def nothing(_: float, __: Array, ___: float) -> Array:
    return np.zeros(3)


def cart(drag: float, hitch: float) -> Wrench:
    """Drags so much [N/kg] at a hitch on the x axis [m]."""

    def wrench(_: float, twist: Array, __: float) -> Array:
        velocity = twist[:2] + twist[2] * np.array([0.0, hitch])
        force = -drag * MASS * velocity / max(float(np.hypot(*velocity)), 1e-3)
        return np.array([*force, hitch * force[1]])

    return wrench


def fixed(force: float, azimuth: float = 0.5, rise: float = 0.0) -> Wrench:
    """So much [N/kg] in one direction of the world, from nothing in a time [s]."""

    def wrench(time: float, _: Array, yaw: float) -> Array:
        size = force * MASS * (min(time / rise, 1.0) if rise else 1.0)
        return size * np.array([math.cos(azimuth - yaw), math.sin(azimuth - yaw), 0.02])

    return wrench


def power(force: Array, speed: Array) -> Array:
    """Of motors whose contacts hand on so much [N] [W]."""
    none, one = (MOTORS.forces(np.full(3, amps), speed, np.zeros(3)) for amps in (0.0, 1.0))
    current = (force - none) / (one - none)
    return MOTORS.resistance * current**2 + MOTORS.constant * speed * current + MOTORS.idle


def frames(
    wrench: Wrench,
    seconds: float = 6.0,
    motion: Callable[[float], Array] = twist_at,
    more: Array | None = None,
    turned: int = 0,
    sloping: float = math.nan,
) -> Iterator[ResidualFrame]:
    """Ticks of wheels that turn as they should; `more`: that each motor draws besides [W];
    `turned`: by so many thirds of a turn is the robot called otherwise; `sloping`: share of the
    force that is a slope's, which an accelerometer feels; NaN without one."""
    random, yaw = np.random.default_rng(3), 0.0
    for tick in range(round(seconds / PERIOD)):
        time = tick * PERIOD
        twist = motion(time)
        yaw += float(twist[2]) * PERIOD
        speed = BODY.rows @ twist / RADIUS
        explained = power(np.zeros(3), speed)
        shown = power(-(BODY.to_twist.T @ wrench(time, twist, yaw)), speed) - explained
        shown = shown + 0.1 * BAND * random.standard_normal(3) + (0.0 if more is None else more)
        rows = (np.roll(item, turned).tolist() for item in (speed, shown, explained))
        felt = -sloping * wrench(time, twist, yaw)[:2] / MASS
        x, y = (Residual(off, 0.3, 0.0, "m/s^2") for off in felt.tolist())
        yield evolve(frame(tick, *rows), along=(x, y))


def frame(tick: int, speed: list[float], shown: list[float], power: list[float]) -> ResidualFrame:
    motors = [Residual(off, BAND, drawn) for off, drawn in zip(shown, power, strict=True)]
    speeds = [Residual(0.0, 0.5, want, "rad/s") for want in speed]
    total = Residual(sum(shown), 3.0 * BAND, sum(power))
    return ResidualFrame(BASE + 50 * tick * MS, (total, *motors, *speeds, *motors))


def found(items: Iterator[ResidualFrame], robot: Robot = ROBOT) -> list[Outside]:
    watch = OutsideWatch(robot)
    return [watch.take(item) for item in items]


def first(items: list[Outside]) -> float:
    """When a load is first found [s]."""
    return next((n * PERIOD for n, item in enumerate(items) if item.load), math.inf)


@pytest.mark.parametrize("hitch", [0.0, -0.2, -0.35, 0.3])
def test_what_drags_whichever_way_the_robot_goes_is_a_load(hitch: float) -> None:
    items = found(frames(cart(0.8, hitch)))
    assert first(items) < 3.0  # the second direction shows it
    assert all(item.load for item in items[-20:])


@pytest.mark.parametrize("azimuth", [0.5, 2.5])
def test_a_slope_that_an_accelerometer_feels_acts_from_nowhere(azimuth: float) -> None:
    unknown = found(frames(fixed(0.7, azimuth), 8.0))
    assert unknown[-1].push
    felt = found(frames(fixed(0.7, azimuth), 8.0, sloping=1.0))
    assert set(felt) == {NOTHING_ACTS, Outside(fits_felt=True)}
    assert all(item.fits_felt for item in felt[20:])


def test_what_is_felt_need_not_be_all() -> None:
    """Three quarters of a steep slope leave a sixteenth of the squares, more than noise."""
    items = found(frames(fixed(2.0), 8.0, sloping=0.75))
    assert all(item.fits_felt for item in items[20:])


def test_only_what_an_accelerometer_feels_is_felt() -> None:
    assert not any(
        item.fits_felt for item in found(frames(fixed(0.2), 8.0, sloping=1.0))
    )  # in bands
    assert not any(item.fits_felt for item in found(frames(fixed(0.7), 8.0)))  # without one
    assert not any(item.fits_felt for item in found(frames(nothing, 8.0, sloping=1.0)))
    assert not any(item.fits_felt for item in found(frames(fixed(0.7), 8.0, sloping=0.5)))
    wheel = np.array([6.0, 0.0, 0.0])  # W
    items = frames(fixed(0.7), 8.0, lambda _: OBLIQUE, more=wheel, sloping=1.0)
    assert not any(item.fits_felt for item in found(items))


def test_what_no_slope_is_and_no_person_does_is_a_load() -> None:
    """Nobody pushes for six seconds with so much; a slope would be felt."""
    unknown = found(frames(fixed(0.7), 9.0))
    assert not any(item.load for item in unknown)
    assert 6.0 <= first(found(frames(fixed(0.7), 9.0, sloping=0.0))) < 7.5
    assert first(found(frames(fixed(1.0), 9.0, sloping=0.4))) < 7.5  # and a slope besides
    assert first(found(frames(fixed(0.25), 9.0, sloping=0.0))) == math.inf

    def leans(time: float, twist: Array, yaw: float) -> Array:
        return fixed(0.9)(time, twist, yaw) * max(1.0 - abs(time - 4.5) / 3.0, 0.0)

    assert first(found(frames(leans, 9.0, sloping=0.0))) == math.inf  # for six seconds


@pytest.mark.parametrize("more", [1.0, 1.5, 3.0])
def test_drivers_that_draw_more_tow_nothing(more: float) -> None:
    """A constant power is lost whichever way the robot goes, as a cart's drag is."""
    assert not any(item.load for item in found(frames(nothing, 12.0, more=np.full(3, more))))


def test_straight_ahead_a_cart_may_be_anything() -> None:
    """A wheel stands; whoever leans does the same, and so does an encoder that shows too little."""
    items = found(frames(cart(0.8, -0.2), motion=ahead))
    assert not any(item.load or item.push for item in items)
    assert any(item.may_be_push for item in items)


def test_while_a_wheel_stands_some_force_explains_the_others() -> None:
    """Of more than a person's, nothing is known."""
    assert set(found(frames(fixed(2.5), motion=ahead))) == {NOTHING_ACTS}


def test_of_a_slope_little_is_left_whoever_else_may_do_the_same() -> None:
    """Its force passes the centre: two wheels that turn show all of it, and how steep it is."""
    items = found(frames(fixed(0.8), seconds=3.0, motion=ahead))
    assert all(item.fits_slope for item in items[20:])
    assert not any(item.push for item in items)
    assert not any(item.fits_slope for item in found(frames(fixed(1.4), motion=ahead)))


def test_after_three_quarters_of_a_second_a_slope_is_looked_for() -> None:
    items = found(frames(fixed(0.8), seconds=3.0, motion=ahead))
    assert [item.fits_slope for item in items].index(True) * PERIOD < 0.95


def test_what_turns_the_body_is_no_slope() -> None:
    def moment(_: float, __: Array, ___: float) -> Array:
        return np.array([0.0, 0.0, 3.0 * MASS * ROBOT.robot_radius])

    items = list(frames(moment, seconds=3.0, motion=lambda _: OBLIQUE))
    assert min(abs(entry.residual) for item in items for entry in item.residuals[1:4]) > 1.5
    assert not any(item.fits_slope for item in found(iter(items)))


def test_a_motion_that_does_not_change_has_tried_nothing() -> None:
    items = found(frames(cart(0.8, -0.2), motion=lambda _: OBLIQUE))
    assert not any(item.load for item in items)


def test_a_floor_that_drags_a_little_more_is_no_load() -> None:
    assert first(found(frames(cart(0.25, 0.0)))) == math.inf


@pytest.mark.parametrize("rise", [0.0, 3.0])
def test_who_leans_on_the_robot_is_no_load(rise: float) -> None:
    items = found(frames(fixed(1.0, rise=rise), seconds=6.0))
    assert first(items) == math.inf
    assert sum(item.push for item in items) > 60


@settings(max_examples=15, deadline=None)
@given(st.floats(0.3, 1.0), st.floats(-math.pi, math.pi), st.integers(0, 3))
def test_nobody_who_leans_is_a_load(force: float, azimuth: float, start: int) -> None:
    items = found(
        frames(fixed(force, azimuth), motion=lambda time: twist_at(time + 1.5 * start)),
    )
    assert first(items) == math.inf


def test_more_than_a_person_pushes_for_seconds_is_a_load() -> None:
    assert first(found(frames(fixed(2.5)))) < 3.0


def test_a_shove_is_neither() -> None:
    def shove(time: float, twist: Array, yaw: float) -> Array:
        return fixed(3.0)(time, twist, yaw) if 1.0 <= time < 1.2 else np.zeros(3)

    assert set(found(frames(shove))) == {NOTHING_ACTS}


@pytest.mark.parametrize("wheel", [0, 1, 2])
@pytest.mark.parametrize("watts", [3.0, 12.0])
def test_what_one_wheel_bears_alone_comes_from_that_wheel(wheel: int, watts: float) -> None:
    more = np.zeros(3)
    more[wheel] = watts
    items = found(frames(nothing, more=more))
    assert not any(item.load or item.push or item.may_be_push for item in items)


def test_little_of_another_wheel_takes_the_blame_off_none() -> None:
    """Some force explains that as well, for as long as the motion is the same."""
    items = frames(nothing, 2.0, lambda _: OBLIQUE, more=np.array([12.0, 0.3, 0.0]))
    assert set(found(items)) == {NOTHING_ACTS}


def widened(item: ResidualFrame, band: float) -> ResidualFrame:
    wide = (evolve(entry, band=band) if entry.unit == "W" else entry for entry in item.residuals)
    return evolve(item, residuals=tuple(wide))


def test_what_bands_hide_is_nothing() -> None:
    assert set(found(widened(item, 4.0) for item in frames(cart(0.8, -0.2)))) == {NOTHING_ACTS}


@pytest.mark.parametrize(
    ("wrench", "sloping"), [(cart(1.2, -0.2), math.nan), (fixed(0.8), math.nan), (fixed(0.8), 0.5)]
)
def test_bands_fifty_times_narrower_change_nothing(wrench: Wrench, sloping: float) -> None:
    """However many bands three motors are off, what they say together is the same."""
    wide, narrow = (
        found(widened(item, band) for item in frames(wrench, sloping=sloping))
        for band in (BAND, 0.02 * BAND)
    )
    for name in ("load", "push", "fits_felt"):
        assert [getattr(item, name) for item in narrow] == [getattr(item, name) for item in wide]


@pytest.mark.parametrize("watts", [1e30, 1e200, 1e300])
def test_what_no_motor_draws_breaks_nothing(watts: float) -> None:
    items = list(frames(cart(1.2, -0.2), seconds=3.0))
    entry = Residual(watts, BAND, 5.0)
    shown = items[30].residuals
    items[30] = evolve(items[30], residuals=(shown[0], *[entry] * 3, *shown[4:7], *[entry] * 3))
    with np.errstate(over="raise", invalid="raise"):
        assert len(found(iter(items))) == len(items)


def test_a_tick_without_bands_hides_no_cart() -> None:
    items = list(frames(cart(1.2, -0.2)))
    items[20] = widened(items[20], math.nan)
    assert first(found(iter(items))) < 2.0


def test_a_drag_that_is_another_in_each_tick_is_no_load() -> None:
    """As a wheel that runs away makes the others feel, by tens to hundreds of bands."""
    random = np.random.default_rng(5)

    def erratic(time: float, twist: Array, yaw: float) -> Array:
        return cart(float(np.exp(random.uniform(0.0, 3.0))), -0.2)(time, twist, yaw)

    items = list(frames(erratic))
    largest = [max(abs(entry.residual) for entry in item.residuals[:4]) for item in items]
    assert np.median(largest) > 10.0 * BAND
    assert first(found(widened(item, 0.1 * BAND) for item in items)) == math.inf


def halved(item: ResidualFrame) -> ResidualFrame:
    """Half of what the motors show beyond their encoders is explained by the commands."""
    motors = [
        evolve(entry, residual=0.5 * entry.residual, modelled=entry.modelled + 0.5 * entry.residual)
        for entry in item.residuals[1:4]
    ]
    return evolve(item, residuals=(item.residuals[0], *motors, *item.residuals[4:]))


def test_what_commands_explain_is_no_load() -> None:
    assert first(found(frames(cart(0.6, -0.2)))) < math.inf
    assert first(found(halved(item) for item in frames(cart(0.6, -0.2)))) == math.inf


def test_a_healthy_robot_shows_nothing() -> None:
    assert set(found(frames(nothing))) == {NOTHING_ACTS}


def test_a_clock_that_begins_at_0_shows_nothing_either() -> None:
    """Of a motor with a residual now and then, as a simulation begins."""
    early = (evolve(item, stamp_ns=item.stamp_ns - BASE) for item in frames(nothing, more=MORE))
    assert set(found(early)) == {NOTHING_ACTS}


def test_it_is_over_when_no_motor_shows_it_any_more() -> None:
    def ends(time: float, twist: Array, yaw: float) -> Array:
        return cart(0.8, -0.2)(time, twist, yaw) if time < 4.0 else np.zeros(3)

    items = found(frames(ends))
    assert items[79].load
    assert items[92] == NOTHING_ACTS


@pytest.mark.parametrize("turned", [1, 2])
def test_which_wheel_is_called_the_first_changes_nothing(turned: int) -> None:
    """Wheels in another order, of a robot that is the same after a third of a turn."""
    items = found(frames(cart(0.8, 0.0)))
    assert found(frames(cart(0.8, 0.0), turned=turned)) == items


def strays(item: ResidualFrame) -> ResidualFrame:
    """Wheel 2 is four bands off its command."""
    residuals = list(item.residuals)
    residuals[SPEEDS[1]] = evolve(residuals[SPEEDS[1]], residual=2.0)
    return evolve(item, residuals=tuple(residuals))


def test_wheels_that_do_not_follow_show_nothing_of_the_body() -> None:
    assert set(found(strays(item) for item in frames(cart(0.8, -0.2)))) == {NOTHING_ACTS}


def test_after_wheels_that_did_not_follow_it_begins_anew() -> None:
    items = found(
        strays(item) if 80 <= n < 92 else item for n, item in enumerate(frames(cart(0.8, -0.2)))
    )
    assert items[79].load
    assert items[93] == NOTHING_ACTS


def test_magnitudes_of_currents_show_no_direction() -> None:
    unsigned = evolve(ROBOT, measurement=evolve(ROBOT.measurement, signed=False))
    assert set(found(frames(cart(0.8, -0.2)), unsigned)) == {NOTHING_ACTS}


def test_after_a_silence_it_begins_anew() -> None:
    late = (
        evolve(item, stamp_ns=item.stamp_ns + (1_000 * MS if n >= 80 else 0))
        for n, item in enumerate(frames(cart(0.8, -0.2)))
    )
    items = found(late)
    assert items[79].load
    assert items[80] == NOTHING_ACTS


@pytest.mark.parametrize("period", [0.02, 0.1])
def test_other_rates_find_the_same(period: float) -> None:
    random = np.random.default_rng(5)
    watch, when = OutsideWatch(ROBOT), math.inf
    for tick in range(round(6.0 / period)):
        twist = twist_at(tick * period)
        speed = BODY.rows @ twist / RADIUS
        explained = power(np.zeros(3), speed)
        shown = power(-(BODY.to_twist.T @ cart(0.8, -0.2)(0.0, twist, 0.0)), speed) - explained
        shown = shown + 0.1 * BAND * random.standard_normal(3)
        item = frame(0, speed.tolist(), shown.tolist(), explained.tolist())
        if watch.take(evolve(item, stamp_ns=BASE + round(tick * period * 1e9))).load:
            when = min(when, tick * period)
    assert when < 3.5


def turning_on(share: float, wheel: int = 1) -> Iterator[ResidualFrame]:
    """An encoder shows too little: its wheel turns faster by a share, and the body with it."""
    for tick, item in enumerate(frames(nothing, motion=lambda time: twist_at(time + 1.5))):
        twist = twist_at(tick * PERIOD + 1.5)
        shown = BODY.rows @ twist / RADIUS
        true = shown.copy()
        true[wheel] *= 1.0 + share
        moves = BODY.to_twist @ (RADIUS * true)
        keeps = MASS * np.array([-moves[2] * moves[1], moves[2] * moves[0], 0.0])
        force = BODY.to_twist.T @ (
            keeps - MASS * np.array([-twist[2] * twist[1], twist[2] * twist[0], 0.0])
        )
        off = power(force, true) - power(np.zeros(3), shown)
        off = off + [entry.residual for entry in item.residuals[1:4]]
        yield frame(tick, shown.tolist(), off.tolist(), power(np.zeros(3), shown).tolist())


@pytest.mark.parametrize("share", [0.5, 1.0, 2.2])
def test_an_encoder_that_shows_too_little_is_no_push(share: float) -> None:
    """The others feel it as well: what keeps a body on its way that turns on."""
    items = found(turning_on(share))
    assert not any(item.load or item.push for item in items)


def test_a_classifier_that_starts_afresh_forgets_what_acts() -> None:
    watch = Mock(spec=OutsideWatch)
    classifier = FaultClassifier(make_judge(ClassifierSettings()), outside=watch)
    before = watch.clear.call_count
    classifier.clear()
    assert watch.clear.call_count == before + 1


class Looks:
    """A network that sees one hypothesis far before all others."""

    def __init__(self, hypothesis: int) -> None:
        self._said = np.full(19, -8.0)
        self._said[[0, hypothesis]] = -8.0, 0.0

    def log_likelihoods(self, window: Array) -> Array:
        return self._said.copy()


def opinion(outside: Outside) -> Opinion:
    """After a second in which every window looks like a weak motor."""
    judge = WindowJudge(Looks(WEAKS.start), ClassifierSettings())  # type: ignore[arg-type]
    item = next(frames(nothing))
    for tick in range(40):
        last = judge.judge(
            evolve(item, stamp_ns=BASE + 50 * tick * MS), 50 * MS, Unseen(), Beside(outside=outside)
        )
    return last


def test_what_is_seen_for_seconds_outweighs_a_window() -> None:
    assert opinion(NOTHING_ACTS).leading == DEGRADED[0]
    loaded, pushed = opinion(Outside(load=True)), opinion(Outside(push=True))
    assert (loaded.leading, loaded.sure) == (BURDENED, True)
    assert pushed.leading.wheel is None  # all wheels feel it, and none is accused


def test_a_cart_is_named_and_no_wheel_accused() -> None:
    classifier = FaultClassifier.around(make_judge(ClassifierSettings()), ROBOT)
    names = set()
    for n, item in enumerate(frames(cart(1.2, -0.2), seconds=9.0)):
        said = classifier.classify(item)
        if said is not None and n * PERIOD > 4.0:
            names.add(said.state.name)
    assert names == {BURDENED.name}
