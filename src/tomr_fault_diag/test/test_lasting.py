"""Small faults that last, from ticks: hand-made motions of the reference robot and their powers."""

import copy
import math
from typing import cast
from unittest.mock import Mock

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import DRAGS, HYPOTHESES, METERS, WEAKS
from tomr_fault_diag.classifier.evidence import Beside
from tomr_fault_diag.classifier.forces import SteadyForce
from tomr_fault_diag.classifier.judges import GATHERED, WindowJudge
from tomr_fault_diag.classifier.lasting import LastingSettings, LastingWatch, _beyond_others
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import DRAGGING
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import (
    ENCODERS,
    MOTORS,
    SPEEDS,
    Residual,
    ResidualFrame,
)
from tomr_power_model.robot import Robot, shipped_robot

Array = NDArray[np.float64]

ROBOT = shipped_robot("reference")
WHEELS = Motors(ROBOT)
BASE = 1_700_000_000_000_000_000
TICK = 50_000_000
BAND = 0.7  # W
WIDE = 6.0  # W: a band that hides a fifth of a motor's power
SECOND = 20  # ticks
FAR = float(0.25 * 24.0 / (ROBOT.controller.proportional + WHEELS.constant[0]))  # rad/s
VOLTS = 0.3  # V, band


def speeds(tick: int) -> Array:
    """Every wheel turns, now faster, now slower, and each the other way after two seconds."""
    phase = 2.0 * math.pi * tick / (2.0 * SECOND)
    return (8.0 + 3.0 * math.sin(phase)) * np.array([1.0, -0.8, 0.6]) * (-1.0) ** (tick // 40)


def explained(tick: int) -> Array:
    """Power that its motion takes: two amperes the way that a wheel turns [W]."""
    speed = speeds(tick)
    current = 2.0 * np.sign(speed)
    return WHEELS.resistance * current**2 + WHEELS.constant * speed * current + WHEELS.idle


def noise(tick: int) -> Array:
    return 0.15 * BAND * np.random.default_rng([7, tick]).standard_normal(3)


def frame(tick: int, off: Array, in_total: bool = True, band: float = BAND) -> ResidualFrame:
    """A tick at which motors show so much beyond what is explained [W]."""
    power, speed = explained(tick), speeds(tick)
    shown = off + noise(tick)
    total = Residual(float(off.sum()) if in_total else 0.0, 3.0 * BAND, 30.0)
    motors = [Residual(o, band, m) for o, m in zip(shown.tolist(), power.tolist(), strict=True)]
    turning = [Residual(0.0, 0.5, want, "rad/s") for want in speed.tolist()]
    return ResidualFrame(BASE + TICK * tick, (total, *motors, *turning, *motors))


def of_friction(tick: int, wheel: int, share: float) -> Array:
    """What an axle shows that takes more, of its own friction [W]."""
    current = 2.0 * np.sign(speeds(tick))
    gain = speeds(tick) + 2.0 * WHEELS.resistance * current / WHEELS.constant
    off = share * WHEELS.friction(5.0) * np.abs(gain)
    return np.asarray(np.where(np.arange(3) == wheel, off, 0.0))


def with_volts(item: ResidualFrame, off: Array, band: float = VOLTS) -> ResidualFrame:
    """The same with what the drivers hold beyond what is expected of them [V]."""
    random = np.random.default_rng([8, item.stamp_ns // TICK])
    shown = off + 0.15 * band * random.standard_normal(3)
    first, second, third = (Residual(volts, band, 5.0, "V") for volts in shown.tolist())
    return evolve(item, voltages=(first, second, third))


def weak(
    tick: int, wheel: int, *, rise: float = 0.0, loss: float = 0.0, band: float = WIDE
) -> ResidualFrame:
    """Of a motor whose winding has so much more resistance, or whose magnet gives less."""
    current, speed = 2.0 * np.sign(speeds(tick)), speeds(tick)
    drop = WHEELS.resistance * current
    volts = rise * drop + loss * (drop - WHEELS.constant * speed)
    power = (rise + 2.0 * loss) * drop * current
    here = np.arange(3) == wheel
    return with_volts(frame(tick, np.where(here, power, 0.0), band=band), np.where(here, volts, 0))


def gathered(frames: list[ResidualFrame], robot: Robot = ROBOT, is_well: bool = True) -> Array:
    """Evidence of all ticks together, (19,)."""
    watch, found = LastingWatch(robot), np.zeros(HYPOTHESES)
    for item in frames:
        found = np.maximum(found + watch.take(item, is_well), 0.0)
    return found


NOTHING = np.zeros(3)
FEW = range(4 * SECOND)


@pytest.mark.parametrize("fault", [{"rise": 0.3}, {"loss": 0.12}])
def test_voltages_tell_a_weak_motor_from_a_bearing(fault: dict[str, float]) -> None:
    found = gathered([weak(tick, 2, **fault) for tick in FEW])
    assert np.argmax(found) == WEAKS.start + 2
    assert found[WEAKS.start + 2] > 24.0
    assert found[DRAGS].max() == found[METERS].max() == 0.0


def test_a_bearing_shows_in_both_alike() -> None:
    """Its torque takes tau / k more amperes, and the volts that drive them."""
    off = 0.5 * WHEELS.friction(5.0) / WHEELS.constant * WHEELS.resistance * [0.0, 1.0, 0.0]
    ticks = [with_volts(frame(t, of_friction(t, 1, 0.5)), np.sign(speeds(t)) * off) for t in FEW]
    found = gathered(ticks)
    assert np.argmax(found) == DRAGS.start + 1
    assert found[WEAKS].max() == found[METERS].max() == 0.0


def test_a_power_sensor_shows_in_no_voltage() -> None:
    """Whatever the total power says, of which there may be none."""
    unknown = Residual(math.nan, math.nan, math.nan, "W", "not measured")
    ticks = [
        with_volts(frame(t, 0.3 * explained(t) * [1.0, 0.0, 0.0], band=WIDE), NOTHING) for t in FEW
    ]
    found = gathered([evolve(t, residuals=(unknown, *t.residuals[1:])) for t in ticks])
    assert np.argmax(found) == METERS.start
    assert found[DRAGS].max() == found[WEAKS].max() == 0.0


def test_a_force_is_no_weak_motor() -> None:
    """What it takes of each motor shows as torque does, in power and voltage."""

    def pushed(tick: int) -> ResidualFrame:
        torque = WHEELS.mass * WHEELS.from_force @ [0.05, 0.08, 0.0]
        per_torque = (
            speeds(tick) + 4.0 * np.sign(speeds(tick)) * WHEELS.resistance / WHEELS.constant
        )
        volts = WHEELS.resistance / WHEELS.constant * torque
        return with_volts(frame(tick, per_torque * torque, band=WIDE), volts)

    found = gathered([pushed(tick) for tick in FEW])
    assert found[WEAKS].max() < 6.0


def test_where_the_voltage_is_not_known_the_power_speaks_alone() -> None:
    ticks = drag(0.5)
    assert (gathered([with_volts(t, np.full(3, math.nan)) for t in ticks]) == gathered(ticks)).all()


@pytest.mark.parametrize("share", [0.55, -0.55])
def test_what_stays_in_a_drivers_sum_is_no_fault_within_healthy_bands(share: float) -> None:
    """Whatever it is, it is the same tick by tick; it says nothing however long it lasts."""
    wide = 1.0  # V, in which a tenth of a winding does not show
    off = share * wide * np.array([0.0, 0.0, 1.0])
    ways = [np.sign(speeds(tick)) for tick in FEW]
    ticks = [
        with_volts(frame(tick, NOTHING, band=WIDE), way * off, wide)
        for tick, way in zip(FEW, ways, strict=True)
    ]
    assert gathered(ticks)[WEAKS].max() < 6.0


def test_a_magnet_not_quite_as_described_is_no_winding() -> None:
    """What a small current needs is little beside the motor's own voltage."""

    def found(loss: float) -> float:
        bent = [weak(tick, 0, loss=loss, band=BAND) for tick in FEW]
        narrow = [evolve(t, voltages=tuple(evolve(v, band=0.03) for v in t.voltages)) for t in bent]
        return float(gathered(narrow)[WEAKS].max())

    assert found(0.04) < 6.0
    assert found(-0.045) < 6.0  # the volts of a sixth of the winding
    assert found(0.12) > 24.0


def test_less_than_a_tenth_of_a_winding_is_no_fault() -> None:
    assert gathered([weak(tick, 2, rise=0.08) for tick in FEW])[WEAKS].max() < 6.0
    assert gathered([weak(tick, 2, rise=0.16) for tick in FEW])[WEAKS].max() > 24.0


def test_a_driver_that_may_not_have_obeyed_its_law_says_nothing_for_a_while() -> None:
    ticks = [weak(tick, 2, rise=0.3) for tick in range(15 * SECOND)]
    stray = tuple(
        evolve(item, residual=1.01 * FAR) if index == SPEEDS[2] else item
        for index, item in enumerate(ticks[10].residuals)
    )
    ticks[10] = evolve(ticks[10], residuals=stray)
    watch = LastingWatch(ROBOT)
    said = np.array([watch.take(item, False)[WEAKS.start + 2] for item in ticks])
    alone = LastingWatch(ROBOT)
    unknown = Residual(math.nan, math.nan, 5.0, "V")
    ticks = [evolve(t, voltages=(*t.voltages[:2], unknown)) for t in ticks]
    blind = np.array([alone.take(item, False)[WEAKS.start + 2] for item in ticks])
    # But for what was learnt before it strayed.
    np.testing.assert_allclose(said[21:201], blind[21:201], atol=0.1)
    assert said[-3 * SECOND :].max() == pytest.approx(12.0)


def test_a_voltage_says_nothing_while_its_wheel_stands() -> None:
    """What its driver holds there is friction's: what was gathered stays."""

    def still(off: float) -> Array:
        tick = frame(0, NOTHING, band=WIDE)
        speeds_now = tuple(
            evolve(item, modelled=0.0, residual=0.0) if index in SPEEDS else item
            for index, item in enumerate(tick.residuals)
        )
        tick = with_volts(evolve(tick, residuals=speeds_now), np.array([0.0, 0.0, off]))
        after = [evolve(tick, stamp_ns=BASE + TICK * (100 + n)) for n in range(5)]
        watch = LastingWatch(ROBOT)
        return np.array([watch.take(item, False) for item in [*drag(0.5), *after]])[-5:]

    np.testing.assert_array_equal(still(0.9), 0.0)
    np.testing.assert_array_equal(still(0.0), 0.0)


def test_what_is_far_beyond_a_band_counts_less_in_both_alike() -> None:
    """Else a bearing whose power is cut off looks like a winding."""
    ticks = [weak(tick, 2, rise=3.0) for tick in FEW]
    assert max(item.voltages[2].residual for item in ticks) > 12.0 * VOLTS
    found = gathered(ticks)
    assert np.argmax(found) == WEAKS.start + 2
    assert found[DRAGS].max() == 0.0


LEFT = np.array([0.0, 0.0, -1.5])  # bands


def after(loaded: Array, *, is_cleared: bool = False) -> float:
    """Most evidence for a weak motor once voltages beyond the simulated ones [bands] are over, of
    which one and a half stay at the third wheel whichever way it turns."""
    watch, found = LastingWatch(ROBOT), np.zeros(HYPOTHESES)
    for tick in range(8 * SECOND):
        off = loaded if tick < 2 * SECOND else LEFT
        if is_cleared and tick == 2 * SECOND:
            watch.clear()
        said = watch.take(with_volts(frame(tick, NOTHING, band=WIDE), VOLTS * off), is_well=False)
        if tick > 3 * SECOND:
            found = np.maximum(found + said, 0.0)
    return float(found[WEAKS].max())


def test_what_a_load_leaves_in_a_driver_s_sum_is_no_weak_motor() -> None:
    assert after(np.array([0.0, -4.0, 4.0])) < 6.0
    assert after(np.array([0.0, 0.0, 8.0])) > 24.0  # no load on the robot is one wheel's alone
    forgotten = after(np.array([0.0, -4.0, 4.0]), is_cleared=True)
    assert forgotten == after(NOTHING, is_cleared=True) > 0.0


def drag(share: float, seconds: int = 4, band: float = BAND) -> list[ResidualFrame]:
    return [frame(t, of_friction(t, 1, share), band=band) for t in range(seconds * SECOND)]


def test_an_axle_that_drags_a_little_is_found_at_its_wheel() -> None:
    assert of_friction(10, 1, 0.5)[1] < 0.8 * BAND  # all the time within its band
    found = gathered(drag(0.5))
    assert np.argmax(found) == DRAGS.start + 1
    assert found[DRAGS.start + 1] > 24.0


def test_a_healthy_robot_shows_nothing() -> None:
    assert gathered([frame(tick, NOTHING) for tick in range(60 * SECOND)]).max() < 6.0


def test_less_than_a_fifth_of_an_axle_s_own_friction_is_no_fault() -> None:
    narrow = 0.15 * of_friction(20, 1, 1.0)[1] / 0.4  # bands in which that would show
    ticks = [frame(t, of_friction(t, 1, 0.15), band=narrow) for t in range(4 * SECOND)]
    quiet = [frame(t, NOTHING, band=narrow) for t in range(4 * SECOND)]
    assert gathered(ticks)[DRAGS].max() <= gathered(quiet)[DRAGS].max() + 6.0


@pytest.mark.parametrize("in_total", [True, False])
def test_the_total_power_tells_a_sensor_from_a_motor(in_total: bool) -> None:
    ticks = [
        frame(t, 0.2 * explained(t) * [0.0, 0.0, 1.0], in_total, WIDE) for t in range(4 * SECOND)
    ]
    found = gathered(ticks)
    if in_total:
        assert found[METERS].max() < found.max()
        assert found[[DRAGS.start + 2, WEAKS.start + 2]].max() > 24.0
    else:
        assert np.argmax(found) == METERS.start + 2
        assert found[DRAGS].max() == found[WEAKS].max() == 0.0


def test_without_a_total_power_either_may_be() -> None:
    ticks = drag(4.0, band=WIDE)
    unknown = Residual(math.nan, math.nan, math.nan, "W", "not measured")
    ticks = [evolve(t, residuals=(unknown, *t.residuals[1:])) for t in ticks]
    found = gathered(ticks)
    assert found[DRAGS.start + 1] > 24.0
    assert found[METERS.start + 1] > 24.0


def test_a_sensor_that_shows_too_little_is_none_that_drags() -> None:
    ticks = [
        frame(t, -0.2 * explained(t) * [0.0, 1.0, 0.0], False, WIDE) for t in range(4 * SECOND)
    ]
    found = gathered(ticks)
    assert np.argmax(found) == METERS.start + 1
    assert found[DRAGS].max() == found[WEAKS].max() == 0.0


def test_what_all_wheels_show_is_no_fault_of_one() -> None:
    carpet = [
        frame(t, sum((of_friction(t, w, 1.5) for w in range(3)), NOTHING))
        for t in range(4 * SECOND)
    ]
    assert gathered(carpet).max() < 6.0


def against_wheel_2(tick: int) -> Array:
    """0.05 N/kg along the second wheel, always against its way; the others bear less [W]."""
    current = 2.0 * np.sign(speeds(tick))
    gain = speeds(tick) + 2.0 * WHEELS.resistance * current / WHEELS.constant
    along = np.linalg.pinv(WHEELS.from_force[:, :2])[:, 1]
    torque = WHEELS.from_force[:, :2] @ (0.05 * WHEELS.mass * along / np.hypot(*along))
    return np.asarray(gain * torque * np.sign(gain[1] * torque[1]))


def test_a_force_on_the_body_is_no_fault_of_a_wheel() -> None:
    ticks = [frame(t, against_wheel_2(t)) for t in range(4 * SECOND)]
    alone = [frame(t, against_wheel_2(t) * [0.0, 1.0, 0.0]) for t in range(4 * SECOND)]
    assert gathered(alone)[DRAGS.start + 1] > 24.0
    assert gathered(ticks).max() < 6.0


def test_a_winding_that_loses_more_is_told_from_an_axle() -> None:
    loss = np.array([0.0, WHEELS.resistance[1] * 4.0, 0.0])
    found = gathered([frame(t, 2.0 * loss, band=WIDE) for t in range(4 * SECOND)])
    assert np.argmax(found) == WEAKS.start + 1
    assert found[WEAKS.start + 1] > 24.0


@pytest.mark.parametrize("late", [MOTORS, ENCODERS])
def test_of_a_motor_s_two_residuals_the_smaller_counts(late: range) -> None:
    def off(item: ResidualFrame, tick: int) -> ResidualFrame:
        more = of_friction(tick, 1, 0.5)
        residuals = list(item.residuals)
        for wheel, index in enumerate(late):
            residuals[index] = evolve(
                residuals[index], residual=residuals[index].residual + more[wheel]
            )
        return evolve(item, residuals=tuple(residuals))

    assert gathered([off(frame(t, NOTHING), t) for t in range(4 * SECOND)]).max() < 6.0


def test_what_another_wheel_shows_as_well_is_taken_off() -> None:
    sizes = np.array([[0.5, 0.2, -0.1], [-0.3, -0.1, 0.4], [0.1, 0.1, 0.1]])
    beyond = np.array([[0.3, 0.0, -0.1], [-0.2, 0.0, 0.4], [0.0, 0.0, 0.0]])
    assert np.allclose(_beyond_others(sizes), beyond)


def test_what_comes_within_minutes_is_no_fault() -> None:
    """To where it would be one in seconds."""
    off = 0.3 * BAND / of_friction(20, 1, 1.0)[1]
    length = 300 * SECOND
    slow = [frame(t, of_friction(t, 1, off * t / length)) for t in range(length)]
    assert gathered(slow).max() < 12.0
    at_once = [frame(length + t, of_friction(t, 1, 3.0 * off)) for t in range(4 * SECOND)]
    assert gathered([*slow, *at_once])[DRAGS.start + 1] > 24.0


def test_nothing_is_learnt_of_a_robot_that_is_not_well() -> None:
    off = 0.3 * BAND / of_friction(20, 1, 1.0)[1]
    length = 60 * SECOND
    later = [frame(t, of_friction(t, 1, off)) for t in range(length)]
    last = later[-4 * SECOND :]
    watches = [LastingWatch(ROBOT), LastingWatch(ROBOT)]
    for item in later[: -4 * SECOND]:
        for watch, is_well in zip(watches, (True, False), strict=True):
            watch.take(item, is_well)
    used_to, remembered = (
        sum(float(watch.take(item, False)[DRAGS.start + 1]) for item in last) for watch in watches
    )
    assert used_to < 0.5 * remembered


def test_wheels_that_turn_otherwise_than_they_should_say_nothing_for_a_while() -> None:
    ticks = drag(0.5)
    astray = evolve(
        ticks[60],
        residuals=tuple(
            evolve(item, residual=1.01 * FAR / 2.0) if index == SPEEDS[0] else item
            for index, item in enumerate(ticks[60].residuals)
        ),
    )
    assert astray.residuals[SPEEDS[0]].code
    watch = LastingWatch(ROBOT)
    said = [watch.take(item, True) for item in [*ticks[:60], astray, *ticks[61:]]]
    assert said[59].any()
    assert not any(one.any() for one in said[60:70])
    assert any(one.any() for one in said[70:])


def test_ticks_of_one_slot_count_once() -> None:
    ticks = drag(0.5)
    twice = [
        item for tick in ticks for item in (tick, evolve(tick, stamp_ns=tick.stamp_ns + TICK // 2))
    ]
    one, other = LastingWatch(ROBOT), LastingWatch(ROBOT)
    alone = [one.take(item, True) for item in ticks]
    doubled = [other.take(item, True) for item in twice]
    assert np.array_equal(alone, doubled[::2])
    assert np.array_equal(doubled[::2], doubled[1::2])


@pytest.mark.parametrize(
    "lacking",
    [
        {ENCODERS[1]: (math.nan, math.nan, math.nan)},  # no encoder
        {MOTORS[1]: (math.nan, BAND, 20.0), ENCODERS[1]: (math.nan, BAND, 20.0)},  # no power
        {SPEEDS[0]: (math.nan, math.nan, math.nan)},
    ],
)
def test_a_tick_that_lacks_something_says_nothing(
    lacking: dict[int, tuple[float, float, float]],
) -> None:
    ticks = drag(0.5)
    gone = evolve(
        ticks[60],
        residuals=tuple(
            Residual(*lacking[index], item.unit, "stale") if index in lacking else item
            for index, item in enumerate(ticks[60].residuals)
        ),
    )
    watch = LastingWatch(ROBOT)
    said = [watch.take(item, True) for item in [*ticks[:60], gone, *ticks[61:]]]
    assert not said[60].any()
    assert max(one[DRAGS.start + 1] for one in said[70:]) > 0.0  # it goes on


@pytest.mark.parametrize("channels", [range(1, 10), ENCODERS])
@pytest.mark.parametrize("exponent", [4, 8, 14, 32, 100, 300])
@pytest.mark.parametrize(("base", "fields"), [(10.0, ("residual", "modelled")), (0.1, ("band",))])
def test_absurd_numbers_are_survived(
    channels: range, exponent: int, base: float, fields: tuple[str, ...]
) -> None:
    ticks = drag(0.5)
    value = dict.fromkeys(fields, base**exponent)
    wild = evolve(
        ticks[40],
        residuals=tuple(
            evolve(item, **value) if index in channels else item
            for index, item in enumerate(ticks[40].residuals)
        ),
    )
    watch = LastingWatch(ROBOT)
    said = [watch.take(item, True) for item in [*ticks[:40], wild, *ticks[41:]]]
    assert np.isfinite(said).all()
    assert max(one[DRAGS.start + 1] for one in said[50:]) > 0.0


def of_currents(number: int, more: Array, band: float, signed: bool) -> ResidualFrame:
    """A tick at which motors draw two amperes the way they turn, and so much more."""
    way = np.sign(speeds(number)) if signed else np.ones(3)
    items = [
        Residual(o, band, m, "A")
        for o, m in zip((way * more).tolist(), (2.0 * way).tolist(), strict=True)
    ]
    turning = [Residual(0.0, 0.5, want, "rad/s") for want in speeds(number).tolist()]
    unknown = Residual(math.nan, math.nan, math.nan, "A", "not measured")
    return ResidualFrame(BASE + TICK * number, (unknown, *items, *turning, *items))


@pytest.mark.parametrize("signed", [True, False])
def test_currents_show_what_drags_either_way(signed: bool) -> None:
    robot = evolve(
        ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current", signed=signed)
    )
    motors = Motors(robot)
    drawn = motors.friction(5.0) / motors.constant * [0.0, 1.0, 0.0]
    ticks = [of_currents(n, drawn, float(drawn[1]) / 0.6, signed) for n in range(4 * SECOND)]
    for first in (0, 2 * SECOND - 10):  # of the wheels' ways
        found = gathered(ticks[first:], robot)
        assert found[DRAGS.start + 1] > 24.0
        assert found[WEAKS].max() == 0.0
    watch = LastingWatch(robot)
    said = [watch.take(tick, True)[DRAGS.start + 1] for tick in ticks]
    assert min(said[2 * SECOND : 3 * SECOND]) > 6.0  # as soon as the wheels turn the other way


def test_a_sensor_of_signed_currents_is_off_either_way() -> None:
    robot = evolve(
        ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current", signed=True)
    )
    more = np.array([0.0, 0.0, 0.6])
    ticks = [of_currents(n, more, 1.0, signed=True) for n in range(4 * SECOND)]
    watch = LastingWatch(robot)
    said = [watch.take(tick, True)[METERS.start + 2] for tick in ticks]
    assert min(said[2 * SECOND : 3 * SECOND]) > 6.0


def uphill(tick: int, turning: Array, azimuth: float) -> ResidualFrame:
    """Straight ahead with wheels that turn so fast [rad/s], where a slope pulls with 0.25 N/kg."""
    current = 2.0 * np.sign(turning)
    power = WHEELS.resistance * current**2 + WHEELS.constant * turning * current + WHEELS.idle
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    torque = 0.25 * WHEELS.mass * (WHEELS.from_force @ along)
    shown = (turning + 2.0 * WHEELS.resistance * current / WHEELS.constant) * torque + noise(tick)
    motors = [Residual(o, 2.0, m) for o, m in zip(shown.tolist(), power.tolist(), strict=True)]
    speeds = [Residual(0.0, 0.5, want, "rad/s") for want in turning.tolist()]
    return ResidualFrame(
        BASE + TICK * tick,
        (Residual(float(shown.sum()), 3.0 * BAND, 30.0), *motors, *speeds, *motors),
    )


@pytest.mark.parametrize("azimuth", np.arange(0.0, 6.2, 0.4))
def test_a_slope_is_no_fault_of_the_wheel_that_bears_most_of_it(azimuth: float) -> None:
    """One wheel stands; of the two that turn a slope across the other's way loads one alone."""
    turning = np.array([-8.0, 8.0, 0.0])
    found = gathered([uphill(t, turning, azimuth) for t in range(4 * SECOND)])
    assert found[DRAGS.start : WEAKS.stop].max() < 12.0


def test_where_a_force_explains_the_same_there_is_no_evidence_either_way() -> None:
    """As far as it explains less than the fault does, more counts for the fault."""
    watch, ticks = LastingWatch(ROBOT), drag(0.5)
    for item in ticks[:76]:
        watch.take(item, True)
    explained, said = np.arange(0.0, 9.0, 0.05), []
    for steady in explained:
        again = copy.deepcopy(watch)
        again._steady = Mock(spec=SteadyForce)
        again._steady.take.return_value = float(steady)
        said.append(again.take(ticks[76], True)[DRAGS.start + 1])
    found = np.array(said)
    assert found[0] > 6.0
    assert (np.diff(found) <= 0.0).all()
    assert found[-1] < 0.0
    assert 0.05 * np.sum(found == 0.0) == pytest.approx(2.0 * LastingSettings().alike, abs=0.06)


def test_it_is_looked_for_where_that_is_asked_for_alone() -> None:
    """There the network sees nothing in it, and the belief gathers it."""
    off = 0.37 * BAND / of_friction(20, 1, 1.0)[1]
    healthy = [frame(t, NOTHING) for t in range(3 * SECOND)]
    ticks = [*healthy, *(frame(3 * SECOND + t, of_friction(t, 1, off)) for t in range(8 * SECOND))]
    named = []
    for small_faults in (False, True):
        classifier = FaultClassifier.of(ClassifierSettings(small_faults=small_faults), ROBOT)
        said = [classifier.classify(item) for item in ticks]
        named.append({one.state.name for one in said if one is not None})
    assert not any("drag" in name for name in named[0])
    assert "dragging wheel 2" in named[1]


class Contrary:
    """A network that sees no drag in any window."""

    def log_likelihoods(self, window: Array) -> Array:
        found = np.full(HYPOTHESES, -30.0)
        found[0] = 0.0
        return found


@pytest.mark.parametrize(("shaken", "drags"), [(0, True), (5, False)])
def test_the_belief_gathers_it_but_not_after_a_push(shaken: int, drags: bool) -> None:
    judge = WindowJudge(cast(WindowNetwork, Contrary()), ClassifierSettings(small_faults=True))
    lasting = np.zeros(HYPOTHESES)
    lasting[DRAGS.start] = 8.0
    item = frame(0, NOTHING)
    for tick in range(2 * SECOND):
        judge._shaken = shaken
        said = judge.judge(
            evolve(item, stamp_ns=BASE + TICK * tick), TICK, Unseen(), Beside(lasting=lasting)
        )
    assert said.sure == drags
    assert (said.leading in DRAGGING) == drags


def test_what_ended_does_not_count_for_long() -> None:
    """A minute of a fault is forgotten in two seconds."""
    judge = WindowJudge(cast(WindowNetwork, Contrary()), ClassifierSettings(small_faults=True))
    shows, ended = np.zeros(HYPOTHESES), np.zeros(HYPOTHESES)
    shows[DRAGS.start], ended[DRAGS.start] = 12.0, -1.2
    gathered = []
    for tick in range(62 * SECOND):
        lasting = shows if tick < 60 * SECOND else ended
        judge.judge(frame(tick, NOTHING), TICK, Unseen(), Beside(lasting=lasting))
        gathered.append(judge.gathered)
    assert gathered[60 * SECOND - 1] > GATHERED
    assert gathered[-1] < GATHERED


def test_a_sensor_that_freezes_for_a_second_leaves_a_diagnosis() -> None:
    """Its power is not known meanwhile, its band is."""
    classifier = FaultClassifier.of(ClassifierSettings(small_faults=True), ROBOT)
    said = classifier.classify(frame(0, NOTHING))
    for tick in range(1, 7 * SECOND):
        item = frame(tick, NOTHING if tick < 4 * SECOND else of_friction(tick, 1, 0.5))
        if SECOND <= tick < 2 * SECOND:
            residuals = list(item.residuals)
            for index in (MOTORS[2], ENCODERS[2]):
                residuals[index] = evolve(residuals[index], residual=math.nan, missing="frozen")
            item = evolve(item, residuals=tuple(residuals))
        said = classifier.classify(item) or said
        assert said is not None
        assert np.isfinite(said.probabilities).all()
    assert said is not None
    assert said.state is DRAGGING[1]


def test_a_classifier_that_starts_afresh_forgets_it() -> None:
    classifier = FaultClassifier.of(ClassifierSettings(small_faults=True), ROBOT)
    for item in drag(0.5):
        classifier.classify(item)
    watch = classifier._lasting
    assert watch is not None
    assert watch._squares.any()
    classifier.clear()
    assert not watch._squares.any()
