"""The gyro's yaw rate beside that of the wheels: when it is believed, and what it says."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.belief import ENCODERS, OTHER
from tomr_fault_diag.classifier.evidence import said_by_gyro
from tomr_fault_diag.classifier.judges import WindowJudge, make_judge
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import SLIP
from tomr_fault_diag.residuals.frame import (
    IMU_MISTAKEN,
    IMU_REPEATS,
    NO_IMU,
    NOT_BELIEVED,
    RESIDUALS,
    SPEEDS,
    YAW,
    Residual,
    ResidualFrame,
)
from tomr_fault_diag.residuals.gyro import GyroWatch
from tomr_fault_diag.residuals.messages import frame_of, residual_message
from tomr_fault_diag.residuals.settings import BandSettings, ResidualSettings
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import Level
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.model.ticks import TickSettings
from tomr_power_model.robot import GRAVITY, Robot, shipped_robot
from tomr_power_model.topics.inputs import model_inputs

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
ROBOT = shipped_robot("reference")
SPEED = (3.0, 4.0, 5.0)
RATE = float(wheels_to_twist(ROBOT)[2] @ SPEED)  # rad/s


def frames(
    gyro: Callable[[int], float | None],
    robot: Robot = ROBOT,
    faster: Callable[[int], float] = lambda at_ms: 1.0,
    period_ms: int = 50,
    leap_ms: int = 6000,
) -> dict[int, ResidualFrame]:
    """By time [ms] for 6 s; wheels turn at SPEED times `faster`, `gyro` says what is measured at a
    time, None: nothing. An accelerometer feels a tenth of it more along x than wheels show
    [m/s^2]. From `leap_ms` on stamps are two seconds earlier."""
    stage = ResidualStage(robot, ResidualSettings(ticks=TickSettings(period=period_ms * MS)))
    reading = SupplyReading.rounded(24.0, 0.4)
    along, across, _ = wheels_to_twist(ROBOT) @ SPEED
    found, turned = {}, np.zeros(3)
    for at_ms in range(0, 6000, 10):
        stamp = BASE + (at_ms - 2000 * (at_ms >= leap_ms)) * MS
        if at_ms % period_ms == 0:
            motors = (reading, reading, reading)
            stage.prediction(Prediction(stamp, SPEED, SPEED, motors, reading, motors))
        first, second, third = turned
        turned = turned + 0.01 * faster(at_ms) * np.array(SPEED)
        stage.encoders(stamp, (first, second, third), SPEED)
        rate = gyro(at_ms)
        if rate is not None:
            stage.imu(stamp, (0.0, 0.0, rate), (0.1 * rate - RATE * across, RATE * along, GRAVITY))
        found.update({(frame.stamp_ns - BASE) // MS: frame for frame in stage.due()})
    return found


@pytest.mark.parametrize("period_ms", [10, 50, 200])
def test_a_gyro_is_believed_once_it_has_agreed_for_two_seconds_of_turning(period_ms: int) -> None:
    """At any rate of decisions."""
    found = frames(lambda at_ms: RATE, period_ms=period_ms)
    missing = {at_ms: frame.yaw.missing for at_ms, frame in found.items() if at_ms >= 200}
    first = min(at_ms for at_ms, why in missing.items() if not why)
    assert 1900 <= first <= 2600
    assert {why for at_ms, why in missing.items() if at_ms < first} == {NOT_BELIEVED}
    assert found[5000].yaw.residual == pytest.approx(0.0, abs=1e-6)
    assert found[5000].yaw.modelled == pytest.approx(RATE, rel=1e-5)


def test_what_differs_then_is_judged_over_its_band() -> None:
    found = frames(lambda at_ms: RATE if at_ms < 4000 else RATE - 0.5)
    assert found[3900].yaw.code == 0
    assert found[5000].yaw.residual == pytest.approx(-0.5, abs=1e-6)
    assert found[5000].yaw.code == -1
    assert found[5000].yaw.band == pytest.approx(max(0.1, 0.1 * abs(RATE)), rel=1e-3)


def test_a_change_of_the_wheels_yaw_rate_widens_the_band() -> None:
    """By all of it: a gyro may be late by a tick or two."""
    found = frames(
        lambda at_ms: RATE if at_ms < 4000 else 1.5 * RATE,
        faster=lambda at_ms: 1.0 if at_ms < 4000 else 1.5,
    )
    usual = found[3900].yaw.band
    assert found[4100].yaw.band > usual + 0.3 * abs(RATE)
    assert found[4400].yaw.band == pytest.approx(max(0.1, 0.15 * abs(RATE)), rel=1e-2)
    watch = GyroWatch(50 * MS, 3)
    spreads = [watch.spread(rate) for rate in (1.0, 1.5, math.nan, 1.2, 1.2)]
    assert spreads == pytest.approx([0.0, 0.5, 0.0, 0.5, 0.3])


def test_wheels_are_taken_to_turn_as_flawed_encoders_mean() -> None:
    flaw = {"sensor.encoder_scale": ({"scale": 0.5},) * 3}
    robot = evolve(ROBOT, physics={**ROBOT.physics, **flaw})
    assert frames(lambda at_ms: 2.0 * RATE, robot)[5000].yaw.code == 0
    assert frames(lambda at_ms: 2.0 * RATE, robot)[5000].yaw.missing == ""


def test_agreement_is_counted_anew_after_a_tick_without() -> None:
    watch = GyroWatch(50 * MS, 3)
    for residual in (*[0.0] * 39, 0.2, *[0.0] * 39):
        watch.compare(0.5, residual, 0.1)
    assert not watch.is_believed
    watch.compare(0.5, 0.0, 0.1)
    assert watch.is_believed


@pytest.mark.parametrize("rate", [-RATE, 0.0, 2.0 * RATE])
def test_a_gyro_that_is_mounted_otherwise_is_never_believed(rate: float) -> None:
    found = frames(lambda at_ms: rate)
    said = {IMU_MISTAKEN} if rate == -RATE else set()
    missing = {frame.yaw.missing for frame in found.values()}
    assert said <= missing <= said | {NOT_BELIEVED, "no fresh joint_states"}


def test_a_robot_without_one_misses_nothing_else() -> None:
    with_one, without = frames(lambda at_ms: RATE), frames(lambda at_ms: None)
    assert {frame.yaw.missing for frame in without.values()} == {NO_IMU}
    assert repr(without[5000].residuals) == repr(with_one[5000].residuals)


def test_a_robot_that_does_not_turn_proves_no_gyro() -> None:
    watch = GyroWatch(50 * MS, 3)
    for _ in range(500):
        watch.compare(0.1, 0.0, 0.1)
    assert not watch.is_believed


def test_a_bias_of_the_accelerometer_is_learnt_of_no_robot_that_may_not_be_well() -> None:
    """No motor's power is known here."""
    found = frames(lambda at_ms: RATE)
    x, y = found[5900].along
    assert x.residual == pytest.approx(0.1 * RATE, abs=1e-4)
    assert y.residual == pytest.approx(0.0, abs=1e-4)
    assert y.modelled == pytest.approx(RATE * float(wheels_to_twist(ROBOT)[0] @ SPEED), rel=1e-4)


def test_after_a_leap_of_time_the_samples_of_before_are_forgotten() -> None:
    found = frames(lambda at_ms: RATE + 0.5 * (at_ms >= 4500), leap_ms=4000)
    assert found[2600].yaw.residual == pytest.approx(0.5, abs=1e-6)
    assert found[2600].along[0].residual == pytest.approx(0.1 * (RATE + 0.5), abs=1e-4)


def moving(
    gyro: Callable[[int], float],
) -> tuple[dict[int, ResidualFrame], list[tuple[str, Level, str]]]:
    """As `frames`, faster and slower by turns, with an IMU that has noise; and what is said of it.

    `gyro`: by time [ms], what is added to its reading.
    """
    random, stage = np.random.default_rng(1), ResidualStage(ROBOT, ResidualSettings())
    reading = SupplyReading.rounded(24.0, 0.4)
    along, across, _ = wheels_to_twist(ROBOT) @ SPEED
    found, said, turned, last = {}, [], np.zeros(3), (0.0, 0.0, 0.0, 0.0)
    for at_ms in range(0, 9000, 10):
        stamp, share = BASE + at_ms * MS, 1.0 + 0.4 * math.sin(0.003 * at_ms)
        speeds = tuple(share * speed for speed in SPEED)
        if at_ms % 50 == 0:
            motors = (reading, reading, reading)
            stage.prediction(Prediction(stamp, speeds, speeds, motors, reading, motors))
        first, second, third = turned
        turned = turned + 0.01 * np.array(speeds)
        stage.encoders(stamp, (first, second, third), speeds)
        more, rate = gyro(at_ms), share * RATE
        if more == more:
            change = 1.2 * math.cos(0.003 * at_ms)
            turning = (change * along - rate * share * across, rate * share * along, GRAVITY)
            noise = random.normal(0.0, 0.01, 4)
            last = tuple(np.array([rate + more, *turning]) + noise)
        stage.imu(stamp, (0.0, 0.0, last[0]), last[1:])
        found.update({(frame.stamp_ns - BASE) // MS: frame for frame in stage.due()})
        said += [
            (status.name, status.level, status.message)
            for report in stage.reports()
            for status in report.statuses
            if status.name == "inputs: imu/data"
        ]
    return found, said


def test_an_imu_that_repeats_itself_is_not_believed_until_it_goes_on() -> None:
    found, said = moving(lambda at_ms: math.nan if 5000 <= at_ms < 7000 else 0.0)
    for at, frame in found.items():
        if not 5000 <= at < 5500:  # the first repeats may be noise, and are what it measured last
            assert not any(item.code for item in (frame.yaw, *frame.along)), at
        if 5500 <= at < 7000:
            assert frame.yaw.missing == IMU_REPEATS, at
        elif at > 7200 or 3000 < at < 5000:
            assert not frame.yaw.missing, at
    words = [message for _, level, message in said if level == Level.WARN]
    assert "repeats itself while the robot moves" in words
    assert said[-1] == ("inputs: imu/data", Level.OK, "as it should be")


def test_readings_of_before_a_leap_hide_no_repeats() -> None:
    watch, random = GyroWatch(50 * MS, 3), np.random.default_rng(1)
    for at_ms in range(0, 2000, 10):
        watch.add(BASE + (at_ms + 60_000) * MS, random.normal())
    watch.clear()
    for at_ms in range(0, 2000, 10):
        watch.add(BASE + at_ms * MS, 1.0 if at_ms > 1000 else random.normal())
        last = watch.residual(BASE + at_ms * MS, 1e-3 * at_ms, BandSettings(), moves=True)
    assert last.missing == IMU_REPEATS


def test_a_gyro_that_died_while_the_robot_stood_is_found_once_it_moves() -> None:
    watch, random, found = GyroWatch(50 * MS, 3), np.random.default_rng(1), {}
    for at_ms in range(0, 4000, 10):
        watch.add(BASE + at_ms * MS, 0.01 if at_ms > 2000 else random.normal(0.0, 0.01))
        wheels = max(0.0, 1e-3 * at_ms - 3.0)
        tick, moves = BASE + at_ms * MS, wheels > 0.0
        found[at_ms] = watch.residual(tick, wheels, BandSettings(), moves=moves).missing
    assert IMU_REPEATS not in {why for at_ms, why in found.items() if at_ms < 3000}
    assert {why for at_ms, why in found.items() if at_ms > 3500} == {IMU_REPEATS}


def test_a_bus_that_answers_with_zeros_measures_nothing() -> None:
    """And says so."""
    stage, reading = ResidualStage(ROBOT, ResidualSettings()), SupplyReading.rounded(24.0, 0.4)
    for at_ms in range(0, 600, 10):
        stamp, rest = BASE + at_ms * MS, (0.0, 0.0, 0.0)
        if at_ms % 50 == 0:
            stage.prediction(Prediction(stamp, rest, rest, (reading,) * 3, reading, (reading,) * 3))
        stage.encoders(stamp, rest, rest)
        stage.imu(stamp, (0.0, 0.0, 0.01 if at_ms < 200 else 0.0), rest)
    last = stage.due()[-1]
    assert last.yaw.missing == NO_IMU
    (status,) = (
        status
        for report in stage.reports()[-1:]
        for status in report.statuses
        if status.name == "inputs: imu/data"
    )
    assert (status.level, status.message) == (
        Level.WARN,
        "sends what cannot be used: nothing but zeros",
    )


def test_without_an_imu_nothing_is_said_of_one() -> None:
    stage = ResidualStage(ROBOT, ResidualSettings())
    for at_ms in range(0, 500, 10):
        stage.encoders(BASE + at_ms * MS, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert stage.due()
    names = {status.name for report in stage.reports() for status in report.statuses}
    assert names
    assert "inputs: imu/data" not in names


def test_the_mean_is_of_the_tick() -> None:
    watch = GyroWatch(50 * MS, 3)
    for at_ms, rate in ((40, 9.0), (50, 9.0), (60, 1.0), (80, 2.0), (100, 3.0), (120, 9.0)):
        watch.add(at_ms * MS, rate)
    assert watch.rate(100 * MS) == pytest.approx(2.0)
    assert math.isnan(watch.rate(200 * MS))


def test_it_is_left_out_where_the_robot_says_so() -> None:
    settings = ResidualSettings(watch_gyro=False, watch_accelerometer=False)
    topics = {item.topic for item in residual_inputs(ROBOT, ResidualStage(ROBOT, settings))}
    assert "imu/data" not in topics
    (gyro,) = (
        item for item in residual_inputs(ROBOT, ResidualStage(ROBOT)) if item.topic == "imu/data"
    )
    assert gyro.is_optional


def test_model_and_residuals_take_the_same_samples_of_an_imu() -> None:
    predictor = PowerPredictor(ROBOT, ModelSettings(use_imu=True))
    inputs = (*model_inputs(ROBOT, predictor), *residual_inputs(ROBOT, ResidualStage(ROBOT)))
    one, other = (item.is_too_close for item in inputs if item.topic == "imu/data")
    assert one is not None
    assert other is not None
    stamps = range(100 * MS, 1100 * MS, 5 * MS)  # 200 Hz
    kept = [not one(stamp) for stamp in stamps]
    assert kept == [not other(stamp) for stamp in stamps]
    assert sum(kept) == 50


def test_it_travels_with_the_residuals() -> None:
    found = frames(lambda at_ms: RATE if at_ms < 4000 else RATE - 0.5)
    for frame in (found[500], found[5000]):
        message = to_bag(residual_message(ROBOT, frame).plain)
        assert message.status[RESIDUALS].name == YAW
        back = frame_of(message, frame.stamp_ns).yaw
        assert (back.residual == frame.yaw.residual) or (back.stale and frame.yaw.stale)
        assert back.missing == frame.yaw.missing


def healthy_frame(yaw: float, off: float = 0.0) -> ResidualFrame:
    """A frame without residuals but of the yaw rate [rad/s], and of the first wheel's speed."""
    speeds = [Residual(0.0, 0.2, want, "rad/s") for want in SPEED]
    speeds[0] = evolve(speeds[0], residual=off)
    power = Residual(0.0, 2.0, 4.0)
    residuals = (*(power,) * SPEEDS.start, *speeds, *(power,) * (RESIDUALS - SPEEDS.stop))
    return ResidualFrame(BASE, residuals, yaw=Residual(yaw, 0.2, RATE, "rad/s"))


def test_what_a_gyro_says_by_hand() -> None:
    said = said_by_gyro(healthy_frame(-0.25))
    # A quarter of a band beyond it, 8 nats a band. Wheels that turn forwards turn the body
    # clockwise: more of that may be encoders that show too little.
    accused = [SLIP, *range(ENCODERS.start, ENCODERS.stop), OTHER]
    assert said[accused] == pytest.approx(2.0)
    assert said.sum() == pytest.approx(2.0 * len(accused))
    less = said_by_gyro(healthy_frame(0.25))
    assert less[[SLIP, OTHER]] == pytest.approx(2.0)
    assert less.sum() == pytest.approx(4.0)
    assert said_by_gyro(healthy_frame(-5.0)).max() == pytest.approx(10.0)
    # Where an encoder shows what it should not, it alone is in doubt, and of it what turns the body
    # as its wheel does.
    doubted = said_by_gyro(healthy_frame(-5.0, off=0.7))
    assert doubted[ENCODERS.start] == doubted.sum() == pytest.approx(10.0)
    assert not said_by_gyro(healthy_frame(5.0, off=0.7)).any()


def test_a_gyro_alone_accuses_no_encoder() -> None:
    judge = make_judge(ClassifierSettings())
    assert isinstance(judge, WindowJudge)
    for tick in range(60):
        frame = evolve(healthy_frame(-0.6), stamp_ns=BASE + 50 * tick * MS)
        judge.judge(frame, 50 * MS, Unseen())
    newest = judge._recent[-1]
    assert newest[SLIP] > judge.settings.striking
    assert (newest[ENCODERS] < 0.5 * judge.settings.striking).all()


def named(yaw: float) -> list[str]:
    """States named of a robot whose residuals are 0, but for the yaw rate, after two seconds."""
    classifier = FaultClassifier(make_judge(ClassifierSettings()))
    states = []
    for tick in range(100):
        now = BASE + 50 * tick * MS
        frame = evolve(healthy_frame(yaw if tick >= 40 else math.nan), stamp_ns=now)
        diagnosis = classifier.classify(frame)
        if diagnosis is not None and diagnosis.changed:
            states.append(diagnosis.state.name)
    return states


def test_a_body_that_turns_otherwise_than_its_wheels_say_slips() -> None:
    assert named(-0.6) == ["normal", "slip"]
    assert named(0.6) == ["normal", "slip"]


@pytest.mark.parametrize("yaw", [0.0, 0.19, math.nan])
def test_within_the_band_or_without_a_gyro_nothing_is_said(yaw: float) -> None:
    assert named(yaw) == ["normal"]
