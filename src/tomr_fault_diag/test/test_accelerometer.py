"""The accelerometer's force beside the acceleration that wheels show: what it says, and when it is
believed."""

import math
from collections.abc import Callable
from unittest.mock import Mock

import numpy as np
import pytest

from tomr_fault_diag.residuals.accelerometer import AccelerometerWatch, Force, Pair
from tomr_fault_diag.residuals.frame import (
    ALONG,
    IMU_REPEATS,
    NO_ENCODERS,
    NO_IMU,
    NO_WEIGHT,
    NOT_BELIEVED,
    RESIDUALS,
    UNKNOWN_YAW,
    Residual,
    ResidualFrame,
)
from tomr_fault_diag.residuals.messages import frame_of, residual_message
from tomr_fault_diag.residuals.settings import BandSettings, ResidualSettings
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import GRAVITY, shipped_robot

MS = 1_000_000
ROBOT = shipped_robot("reference")
TURNING, SPEED, ACROSS, FASTER = 0.8, 0.5, 0.2, 0.6  # rad/s, m/s, m/s, m/s^2
BANDS = BandSettings()
Felt = Callable[[float], Force | None]


def twist(time: float) -> np.ndarray:
    """Turning all the while, ahead faster and slower by turns, a second each."""
    return np.array([SPEED + FASTER * abs(time % 2.0 - 1.0), ACROSS, TURNING])


def level(time: float) -> Force:
    """What an accelerometer feels then on a level floor: dv/dt + omega x v, and gravity."""
    change = -FASTER if time % 2.0 < 1.0 else FASTER
    speed = float(twist(time)[0])
    return change - TURNING * ACROSS, TURNING * speed, GRAVITY


def leaning(x: float, y: float, since: float = 0.0, z: float = GRAVITY) -> Felt:
    """As `level`, and so much more along the axes from a time on [m/s^2]."""

    def felt(time: float) -> Force:
        f_x, f_y, _ = level(time)
        return (f_x + x, f_y + y, z) if time >= since else (f_x, f_y, z)

    return felt


def followed(
    felt: Felt,
    period_ms: int = 50,
    is_well: Callable[[float], bool] = lambda time: True,
    seconds: float = 6.0,
    motion: Callable[[float], np.ndarray] = twist,
) -> dict[int, Pair]:
    """Residuals by the time of their ticks [ms]."""
    watch, found = AccelerometerWatch(period_ms * MS, 3), {}
    for at_ms in range(10, round(1000 * seconds), 10):
        force = felt(at_ms / 1000.0)
        if force is not None:
            watch.add(at_ms * MS, force)
        if at_ms % period_ms == 0:
            time = at_ms / 1000.0
            middle = motion(time - 0.0005 * period_ms)
            found[at_ms] = watch.residuals(at_ms * MS, middle, BANDS, is_well=is_well(time))
    return found


@pytest.mark.parametrize("period_ms", [10, 50, 200])
def test_it_agrees_with_wheels_that_turn_and_speed_up(period_ms: int) -> None:
    """At any rate of decisions; where they change both may differ for a tick or two."""
    found = followed(level, period_ms)
    steady = [pair for at, pair in found.items() if at > 500 and 300 <= at % 1000 <= 900]
    off = np.array([[item.residual for item in pair] for pair in steady])
    assert np.abs(off).max() < 0.03
    assert max(abs(pair[0].residual) / pair[0].band for at, pair in found.items() if at > 500) < 1.0
    # The mean of a window that ends half a period ago, in which the robot slows down.
    x, y = found[2600]
    middle = 2.6 - 0.0005 * (period_ms + max(period_ms, 50))
    assert x.modelled == pytest.approx(-FASTER - TURNING * ACROSS, abs=1e-3)
    assert y.modelled == pytest.approx(TURNING * float(twist(middle)[0]), abs=1e-3)


@pytest.mark.parametrize("rate", [5.0, 15.0, 25.0, 30.0, 50.0, 60.0, 75.0, 90.0])
def test_it_is_known_at_every_rate_of_decisions(rate: float) -> None:
    period = to_ns(1.0 / rate)
    watch = AccelerometerWatch(period, 3)
    found = []
    for number in range(1, round(4.0 * rate)):
        tick = number * period
        for stamp in range(tick - period, tick, 5 * MS):
            watch.add(stamp + 1, (0.0, 0.0, GRAVITY))
        found.append(watch.residuals(tick, np.array([0.5, 0.0, 0.0]), BANDS, is_well=True))
    assert [x.missing for x, _ in found[5:]] == [""] * len(found[5:])


def test_what_a_slope_pulls_with_is_the_rest() -> None:
    """It is felt as an acceleration uphill that the wheels do not show."""
    found = followed(leaning(0.5, -0.3, since=3.0), is_well=lambda time: time < 3.0)
    before, after = found[2900], found[3100]
    assert [item.code for item in before] == [0, 0]
    assert [item.residual for item in after] == pytest.approx([0.5, -0.3], abs=0.03)
    assert [item.code for item in found[3800]] == [1, 0]


def test_a_bias_is_learnt_while_all_is_well_and_makes_bands_wide_until_then() -> None:
    found = followed(leaning(0.2, -0.1), seconds=40.0)
    first, middle, last = found[100], found[4900], found[39900]
    assert [item.residual for item in first] == pytest.approx([0.2, -0.1], abs=0.05)
    assert [item.residual for item in middle] == pytest.approx([0.09, -0.045], abs=0.02)
    assert [item.residual for item in last] == pytest.approx([0.02, -0.01], abs=0.02)
    assert first[0].band == pytest.approx(BANDS.along + 0.3, abs=0.05)
    assert found[39800][0].band == pytest.approx(BANDS.along, abs=0.04)
    off = followed(leaning(0.2, -0.1), is_well=lambda time: False)
    assert off[5900][0].residual == pytest.approx(0.2, abs=0.03)


def test_a_robot_that_stands_shows_no_bias() -> None:
    """It may stand on a slope."""
    found = followed(lambda time: (0.3, 0.0, GRAVITY), motion=lambda time: np.zeros(3))
    assert found[5900][0].residual == pytest.approx(0.3)


@pytest.mark.parametrize("period_ms", [10, 50])
def test_one_that_is_mounted_otherwise_is_not_believed_until_it_agrees(period_ms: int) -> None:
    def turned(time: float) -> Force:
        x, y, z = level(time)
        return (-y, x, z) if time < 3.0 else (x, y, z)

    found = followed(turned, period_ms)
    assert {pair[0].missing for at, pair in found.items() if 1500 < at <= 3000} == {NOT_BELIEVED}
    first = min(at for at, pair in found.items() if at > 3000 and not pair[0].missing)
    assert 3400 <= first <= 3700  # half a second of acceleration


@pytest.mark.parametrize("is_noisy", [True, False])
def test_one_that_repeats_itself_while_wheels_speed_up_and_slow_down_is_not_believed(
    is_noisy: bool,
) -> None:
    """From 3.3 s to 5.3 s; one without any noise repeats itself as the motion does."""
    random, last = np.random.default_rng(1), [(0.0, 0.0, 0.0)]

    def felt(time: float) -> Force:
        noise = random.normal(0.0, 0.01, 3) if is_noisy else np.zeros(3)
        x, y, z = (np.array(level(time)) + noise).tolist()
        if not 3.3 <= time < 5.3:
            last[0] = (x, y, z)
        return last[0]

    found = followed(felt, seconds=7.0)
    assert {pair[0].missing for at, pair in found.items() if 4400 < at < 5300} == {IMU_REPEATS}
    assert not any(pair[0].missing for at, pair in found.items() if 200 < at < 4000 or at > 5500)


def test_readings_of_before_a_leap_hide_no_repeats() -> None:
    watch = AccelerometerWatch(50 * MS, 3)
    watch.add(60_000 * MS, (0.1, 0.2, GRAVITY))
    watch.clear()
    for at_ms in range(50, 4000, 50):
        watch.add(at_ms * MS, (0.1, 0.2, GRAVITY))
        x, _ = watch.residuals(at_ms * MS, twist(1e-3 * at_ms), BANDS, is_well=True)
    assert x.missing == IMU_REPEATS


def test_an_accelerometer_without_noise_repeats_itself_as_the_motion_does() -> None:
    def straight(time: float) -> np.ndarray:
        return twist(time) * [1.0, 0.0, 0.0]

    found = followed(
        lambda time: (-FASTER if time % 2.0 < 1.0 else FASTER, 0.0, GRAVITY), motion=straight
    )
    assert not any(pair[0].missing for at, pair in found.items() if at > 200)


def test_a_slide_within_the_bands_does_not_make_it_a_liar() -> None:
    """After three seconds that agree, one in which it differs all the while."""

    def slides(time: float) -> Force:
        x, y, z = level(time)
        return (x - 1.5 * (3.0 <= time < 4.0), y, z)

    found = followed(slides)
    assert not any(pair[0].missing for at, pair in found.items() if at > 100)
    assert found[3500][0].code == -1
    assert found[5000][0].code == 0


@pytest.mark.parametrize(
    ("felt", "missing"),
    [
        pytest.param(lambda time: None, NO_IMU, id="none"),
        pytest.param(leaning(0.0, 0.0, z=0.0), NO_WEIGHT, id="gravity taken off"),
        pytest.param(lambda time: (0.0, 0.0, 0.0), NO_WEIGHT, id="never filled in"),
        pytest.param(leaning(math.nan, 0.0), NO_IMU, id="no number"),
    ],
)
def test_what_does_not_measure_says_so(felt: Felt, missing: str) -> None:
    found = followed(felt, seconds=1.0)
    assert {item.missing for pair in found.values() for item in pair} == {missing}
    assert all(item.stale for pair in found.values() for item in pair)


def test_without_the_speed_of_every_wheel_nothing_is_known() -> None:
    found = followed(level, seconds=1.0, motion=lambda time: np.full(3, np.nan))
    assert {item.missing for pair in found.values() for item in pair} == {NO_ENCODERS}


def test_after_a_leap_of_time_it_is_the_same_sensor() -> None:
    watch = AccelerometerWatch(50 * MS, 3)
    bias = leaning(0.2, 0.0)
    for restart in (0, 1):
        if restart:
            watch.clear()
        for at_ms in range(10, 4010, 10):
            watch.add(at_ms * MS, bias(at_ms / 1000.0) or (0.0, 0.0, 0.0))
            if at_ms % 50 == 0:
                x, _ = watch.residuals(
                    at_ms * MS, twist(at_ms / 1000.0 - 0.025), BANDS, is_well=True
                )
                if restart and at_ms == 50:
                    assert x.missing == NO_ENCODERS  # no speed before
                if restart and at_ms == 200:
                    assert x.residual == pytest.approx(0.1, abs=0.03)  # half of it is known


def test_it_travels_with_the_residuals_and_is_no_fault_where_it_is_missing() -> None:
    item = Residual(0.5, 0.3, 0.1, "m/s^2")
    for along in ((item, item), followed(lambda time: None, seconds=0.2)[100]):
        frame = ResidualFrame(100 * MS, (Residual(0.0, 1.0, 5.0),) * 10, 1.0, UNKNOWN_YAW, along)
        message = to_bag(residual_message(ROBOT, frame).plain)
        shown = message.status[RESIDUALS + 1 : RESIDUALS + 1 + len(ALONG)]
        assert tuple(one.name for one in shown) == ALONG
        level_of = shown[-1].level
        assert level_of == (Level.OK if along[0].stale else Level.WARN)
        back = frame_of(message, frame.stamp_ns).along
        assert [item.missing for item in back] == [item.missing for item in along]
        assert along[0].stale or back == along


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("forces", [False, True])
def test_either_is_left_out_where_the_robot_says_so(turns: bool, forces: bool) -> None:
    stage = Mock(settings=ResidualSettings(watch_gyro=turns, watch_accelerometer=forces))
    taken = [item for item in residual_inputs(ROBOT, stage) if item.topic == "imu/data"]
    assert bool(taken) == (turns or forces)
    nothing = [0.0] * 9
    message = Mock(linear_acceleration_covariance=nothing, angular_velocity_covariance=nothing)
    message.header.stamp = Mock(sec=7, nanosec=5)
    message.angular_velocity = Mock(x=0.0, y=0.0, z=0.7)
    message.linear_acceleration = Mock(x=0.1, y=0.2, z=9.8)
    for item in taken:
        item.take(message, 0)
        stamp, rate, force = stage.imu.call_args.args
        assert stamp == 7_000 * MS + 5
        assert rate == (0.0, 0.0, 0.7) if turns else np.isnan(rate).all()
        assert force == (0.1, 0.2, 9.8) if forces else all(map(math.isnan, force))
