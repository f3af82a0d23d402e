"""The model stage: driven by stamps, honest about what it does not know."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.encoders import EncoderSample, EncoderWindow
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN3 = (math.nan, math.nan, math.nan)
Twist = tuple[float, float, float]
Array = NDArray[np.float64]
Event = tuple[int, str]


def _events(until_ms: int, commands: bool = True) -> list[Event]:
    """Commands at 20 Hz, encoders at 100 Hz, in the order of their stamps [ms]."""
    events = [(t, "encoders") for t in range(3, until_ms, 10)]
    if commands:
        events += [(t, "command") for t in range(0, until_ms, 50)]
    return sorted(events)


def _run(
    events: Iterable[Event],
    twist: Twist = (0.3, 0.0, 0.0),
    robot: Robot | None = None,
    settings: ModelSettings | None = None,
    moving: bool = True,
) -> list[Prediction]:
    robot = robot or shipped_robot("reference")
    predictor = PowerPredictor(robot, settings)
    speed = twist_to_wheels(robot) @ twist
    found: list[Prediction] = []
    for at_ms, kind in events:
        stamp = BASE + at_ms * MS
        if kind == "command":
            predictor.command(stamp, twist)
        else:
            first, second, third = (float(value) for value in speed * moving * at_ms * 1e-3)
            predictor.encoders(stamp, (first, second, third), NAN3)
        found.extend(predictor.due())
    return found


def test_both_paths_agree_once_the_robot_follows() -> None:
    last = _run(_events(3000))[-1]
    for commanded, measured in zip(last.motors, last.from_encoders, strict=True):
        assert commanded.power == pytest.approx(measured.power, rel=1e-2)
    assert last.motors[0].power == pytest.approx(1.2, rel=1e-3)  # idle wheel: standby only
    parts = sum(reading.power for reading in last.motors)
    assert last.total.power == pytest.approx(parts + 12.0, rel=1e-6)
    assert last.total.current < 0.0


@given(st.lists(st.integers(0, 18), min_size=80, max_size=80))
def test_the_order_of_arrival_does_not_matter(delays_ms: list[int]) -> None:
    """Messages arrive up to 18 ms late, commands and encoders past each other."""
    events = _events(400)
    late = sorted(
        zip(events, delays_ms, strict=False),
        key=lambda pair: (pair[0][0] + (pair[1] if pair[0][1] == "command" else 0), pair[0]),
    )
    assert _run(event for event, _ in late) == _run(events)


def test_whether_a_gyro_s_sample_arrives_late_changes_nothing() -> None:
    """One stamped after a tick says nothing of it, even if it is there when the tick is decided."""
    found = _gyrating(late_ms=0)
    assert found == _gyrating(late_ms=12)
    assert found[10].from_encoders != _gyrating(late_ms=0, use_imu=False)[10].from_encoders


def _gyrating(late_ms: int, *, use_imu: bool = True) -> list[Prediction]:
    """A robot that drives along a circle, the rate that its gyro shows grows all the while."""
    robot, twist = shipped_robot("reference"), (0.3, 0.0, 0.5)
    predictor = PowerPredictor(robot, ModelSettings(use_imu=use_imu))
    speed = twist_to_wheels(robot) @ twist
    events = [*_events(1000), *((t, "imu") for t in range(1, 1000, 10))]
    events.sort(key=lambda event: (event[0] + late_ms * (event[1] == "imu"), event))
    found: list[Prediction] = []
    for at_ms, kind in events:
        stamp = BASE + at_ms * MS
        if kind == "command":
            predictor.command(stamp, twist)
        elif kind == "imu":
            predictor.imu(stamp, 0.5 + 2e-3 * at_ms)
        else:
            first, second, third = (speed * at_ms * 1e-3).tolist()
            predictor.encoders(stamp, (first, second, third), NAN3)
        found.extend(predictor.due())
    return found


def test_without_a_command_only_the_encoders_speak() -> None:
    last = _run(_events(500, commands=False))[-1]
    assert all(math.isnan(speed) for speed in last.speed)
    assert all(math.isnan(reading.power) for reading in (*last.motors, last.total))
    # Wheel 1 stands still: what its driver holds is not known without a command.
    assert math.isnan(last.from_encoders[0].power)
    assert all(math.isfinite(reading.power) for reading in last.from_encoders[1:])


@pytest.mark.parametrize(
    ("last_ms", "power"),
    [
        (775, 0.5**2 / 0.8 + 1.2),  # 0.5 V at 0.8 ohm, and 1.2 W of standby
        (250, math.nan),  # too old: what the driver holds now is not known
    ],
)
def test_a_wheel_at_rest_draws_what_its_driver_says_that_it_commands(
    last_ms: int, power: float
) -> None:
    robot = shipped_robot("reference")
    held = ({"torque": 0.7},) * 3  # N m: what a motor makes of 0.8 V
    robot = evolve(robot, physics={**robot.physics, "friction.coulomb": held})
    predictor, last = PowerPredictor(robot), None
    for at_ms in range(3, 800, 10):
        predictor.encoders(BASE + at_ms * MS, (0.0, 0.0, 0.0), NAN3)
        if at_ms <= last_ms:
            predictor.voltages(BASE + at_ms * MS, (0.5, -0.5, math.nan))
        last = next(iter(predictor.due()), last)
    assert last is not None
    first, second, third = (reading.power for reading in last.from_encoders)
    assert [first, second] == pytest.approx([power, power], nan_ok=True)
    assert math.isnan(third)  # said nothing


def test_a_wheel_that_turns_is_asked_of_its_motion_and_not_of_its_voltage() -> None:
    robot, found = shipped_robot("reference"), []
    for volts in (0.0, 9.0):
        predictor, predictions = PowerPredictor(robot), []
        speed = twist_to_wheels(robot) @ (0.3, 0.0, 0.0)
        for at_ms, kind in _events(1000):
            stamp = BASE + at_ms * MS
            predictor.voltages(stamp, (volts, volts, volts))
            if kind == "command":
                predictor.command(stamp, (0.3, 0.0, 0.0))
            else:
                first, second, third = (float(value) for value in speed * at_ms * 1e-3)
                predictor.encoders(stamp, (first, second, third), NAN3)
            predictions += predictor.due()
        found.append(predictions[-1].from_encoders[1:])
    assert found[0] == found[1]


def test_a_driver_holds_what_it_says_else_what_its_law_makes_of_the_motion() -> None:
    """The robot does as simulated, so both are what the simulation has."""
    robot = shipped_robot("reference")
    predictor, predictions = PowerPredictor(robot), []
    for at_ms, kind in _events(2000):
        stamp = BASE + at_ms * MS
        if at_ms > 1000:
            predictor.voltages(stamp, (7.0, math.nan, math.nan))
        if kind == "command":
            predictor.command(stamp, (0.0, 0.0, 0.0))
        else:
            predictor.encoders(stamp, (0.0, 0.0, 0.0), NAN3)
        predictions += predictor.due()
    said, law = predictions[-1], predictions[10]
    assert (law.voltage, law.held) == ((0.0,) * 3, (0.0,) * 3)
    assert (said.voltage, said.held) == ((0.0,) * 3, (7.0, 0.0, 0.0))


def test_without_encoders_only_the_commands_speak() -> None:
    events = [(t, kind) for t, kind in _events(2000) if kind == "command" or t < 500]
    last = _run(events)[-1]
    assert all(math.isnan(reading.power) for reading in last.from_encoders)
    assert all(math.isfinite(reading.power) for reading in last.motors)


def test_motor_currents_are_reported_where_they_are_what_is_measured() -> None:
    """Of a robot that publishes them: both paths, and the power that the modelled voltage makes."""
    robot = shipped_robot("robotino_v2_gray")
    last = _run(_events(3000), twist=(0.1, 0.0, 0.0), robot=robot)[-1]
    for wheel in (0, 2):  # the second is idle along x
        commanded, measured = last.motors[wheel], last.from_encoders[wheel]
        assert commanded.drawn_current > 0.05
        assert commanded.drawn_current == pytest.approx(measured.drawn_current, rel=0.3)
    total = sum(reading.power for reading in last.motors)
    assert last.total.power == pytest.approx(total, rel=1e-3)


def test_the_delay_postpones_the_response() -> None:
    robot = shipped_robot("reference")
    delayed = evolve(robot, controller=evolve(robot.controller, delay=0.15))
    prompt = {p.stamp_ns: p.speed[1] for p in _run(_events(1500), moving=False)}
    late = {p.stamp_ns: p.speed[1] for p in _run(_events(1500), robot=delayed, moving=False)}
    for stamp in range(BASE + 200 * MS, BASE + 1450 * MS, 50 * MS):
        if late[stamp] > 0.0:
            assert late[stamp] == pytest.approx(prompt[stamp - 150 * MS], abs=1e-6)
    assert late[BASE + 150 * MS] == 0.0 < late[BASE + 250 * MS]


def test_a_command_is_held_or_times_out() -> None:
    events = [(t, kind) for t, kind in _events(3000) if kind == "encoders" or t < 500]
    held = ModelSettings(command_timeout=0)
    assert _run(events, settings=held)[-1].speed[1] > 1.0
    stopped = {p.stamp_ns - BASE: p.speed[1] for p in _run(events, moving=False)}
    assert abs(stopped[2900 * MS]) < 0.05
    # Up to the timeout nobody knows whether commands ended or were lost; nor where wheels turn on.
    assert all(math.isnan(stopped[t * MS]) for t in range(650, 1000, 50))
    assert math.isnan(_run(events)[-1].speed[1])


def test_a_pause_of_the_commands_leaves_a_doubt_for_as_long_again() -> None:
    lost = range(1000, 1400)
    events = [(t, kind) for t, kind in _events(3000) if kind == "encoders" or t not in lost]
    unknown = [(p.stamp_ns - BASE) // MS for p in _run(events) if math.isnan(p.speed[1])]
    # The last command came at 950 ms; three periods are usual, and 0.3 s more go to be sure.
    assert unknown == list(range(1150, 1400 + 450 + 300, 50))


def test_after_standing_without_commands_the_next_one_is_followed_at_once() -> None:
    events = [(t, kind) for t, kind in _events(5000) if kind == "encoders" or not 500 <= t < 4000]
    speeds = {p.stamp_ns - BASE: p.speed[1] for p in _run(events, moving=False)}
    assert not any(math.isnan(speeds[t * MS]) for t in range(1600, 5000, 50))


def test_a_restart_in_mid_run_takes_up_the_motion() -> None:
    """A predictor that wakes while the robot drives expects it to go on, not to start."""
    whole = {p.stamp_ns: p for p in _run(_events(4000))}
    woken = _run([(t, kind) for t, kind in _events(4000) if t >= 2990])
    for prediction in woken[4:]:
        before = whole[prediction.stamp_ns]
        np.testing.assert_allclose(prediction.speed, before.speed, atol=0.05)
        assert prediction.motors[1].power == pytest.approx(before.motors[1].power, abs=0.2)


def test_a_clock_that_goes_back_starts_afresh() -> None:
    robot = shipped_robot("reference")
    predictor = PowerPredictor(robot)
    for _ in range(2):  # a bag in a loop
        found = []
        for at_ms, kind in _events(2000):
            stamp = BASE + at_ms * MS
            if kind == "command":
                predictor.command(stamp, (0.0, 0.0, 0.0))
            else:
                predictor.encoders(stamp, (0.0, 0.0, 0.0), NAN3)
            found.extend(prediction.stamp_ns for prediction in predictor.due())
        assert found[0] == BASE + 50 * MS
        assert found[-1] == BASE + 1950 * MS


@pytest.mark.parametrize(
    ("ahead_ms", "delay", "words"),
    [
        (0, 0.0, "as it should be"),
        (200, 0.0, "as it should be"),
        (400, 0.0, "stamped 0.4 s ahead of the sensors: synchronise the clocks"),
        (
            -200,
            0.0,
            "comes 0.2 s after its stamps: synchronise the clocks, or set controller.delay",
        ),
        (-200, 0.2, "as it should be"),
        (5000, 0.0, "stamped 5.0 s ahead of the other inputs: synchronise the clocks"),
        (-5000, 0.2, "stamped 5.0 s behind the other inputs: synchronise the clocks"),
    ],
)
def test_commands_that_another_clock_stamps_say_so(ahead_ms: int, delay: float, words: str) -> None:
    reference = shipped_robot("reference")
    robot = evolve(reference, controller=evolve(reference.controller, delay=delay))
    predictor, said = PowerPredictor(robot), []
    for at_ms, kind in _events(3000):
        stamp = BASE + at_ms * MS
        if kind == "command":
            predictor.command(stamp + ahead_ms * MS, (0.0, 0.0, 0.0))
        else:
            predictor.encoders(stamp, (0.0, 0.0, 0.0), NAN3)
        predictor.due()
        said += [report.statuses[0].message for report in predictor.reports()]
    assert said[-1] == words


def test_what_was_said_of_a_clock_is_forgotten_where_time_leaps() -> None:
    predictor = PowerPredictor(shipped_robot("reference"))
    legs: list[list[str]] = []
    for start_ms, ahead_ms in ((0, 400), (60_000, 0)):
        legs.append([])
        for at_ms, kind in _events(3000):
            stamp = BASE + (start_ms + at_ms) * MS
            if kind == "command":
                predictor.command(stamp + ahead_ms * MS, (0.0, 0.0, 0.0))
            else:
                predictor.encoders(stamp, (0.0, 0.0, 0.0), NAN3)
            predictor.due()
            legs[-1] += [report.statuses[0].message for report in predictor.reports()]
    assert legs[0][-1].startswith("stamped 0.4 s ahead")
    assert set(legs[1]) <= {"waiting", "as it should be"}


def test_of_sensors_that_died_commands_are_not_ahead() -> None:
    predictor, said = PowerPredictor(shipped_robot("reference")), []
    for at_ms, kind in _events(6000):
        if kind == "command":
            predictor.command(BASE + at_ms * MS, (0.0, 0.0, 0.0))
        elif at_ms < 3000:
            predictor.encoders(BASE + at_ms * MS, (0.0, 0.0, 0.0), NAN3)
        predictor.due()
        said += [report.statuses[0].message for report in predictor.reports()]
    assert set(said) == {"as it should be"}


class TestEncoderWindow:
    """Speed and acceleration from quantised angles or from speeds."""

    def _fit(self, samples: list[EncoderSample]) -> tuple[np.ndarray, np.ndarray]:
        window = EncoderWindow(to_ns(0.07), to_ns(0.05), to_ns(0.5))
        for sample in samples:
            window.add(sample)
        estimate = window.at(BASE + 100 * MS)
        return estimate.speed, estimate.acceleration

    @pytest.mark.parametrize("by", ["position", "velocity"])
    def test_constant_acceleration_is_exact(self, by: str) -> None:
        samples = []
        for at_ms in range(3, 101, 10):
            t = 1e-3 * at_ms
            position = (2.0 * t + 20.0 * t * t, 0.0, -t)
            velocity = (2.0 + 40.0 * t, 0.0, -1.0)
            stamp = BASE + at_ms * MS
            if by == "position":
                samples.append(EncoderSample(stamp, position, NAN3))
            else:
                samples.append(EncoderSample(stamp, NAN3, velocity))
        speed, acceleration = self._fit(samples)
        np.testing.assert_allclose(speed, [2.0 + 40.0 * 0.075, 0.0, -1.0], atol=1e-9)
        np.testing.assert_allclose(acceleration, [40.0, 0.0, 0.0], atol=1e-7)

    def test_a_simulated_motion_is_compared_at_the_angles_that_are_measured(self) -> None:
        """Simulated wheels count from where they began, 5 rad off, and turn by 1 rad/s slower."""

        class Slower:
            def beside(
                self, times_ns: Sequence[int], tick_ns: int, period_ns: int
            ) -> tuple[Array, Array, Array, Array]:
                times = np.array([*times_ns, tick_ns - period_ns // 2]) - BASE
                angles = np.repeat(2e-9 * times[:, None], 3, axis=1)
                return angles[:-1], angles[-1], np.full(3, 2.0), np.zeros(3)

        window = EncoderWindow(to_ns(0.07), to_ns(0.05), to_ns(0.5))
        for at_ms in range(3, 301, 10):
            window.add(EncoderSample(BASE + at_ms * MS, (5.0 + 3e-3 * at_ms,) * 3, NAN3))
        measured, simulated = window.beside(BASE + 300 * MS, Slower())
        np.testing.assert_allclose(measured.speed, 3.0, atol=1e-6)
        np.testing.assert_allclose(simulated.speed, 2.0)
        np.testing.assert_allclose(measured.angle, 5.0 + 3.0 * 0.275, atol=1e-6)
        assert simulated.angle.tolist() == measured.angle.tolist()

    def test_one_wheel_missing_leaves_the_others(self) -> None:
        samples = [
            EncoderSample(BASE + at * MS, (1e-3 * at, math.nan, 0.0), NAN3)
            for at in range(3, 101, 10)
        ]
        speed, _ = self._fit(samples)
        np.testing.assert_allclose(speed, [1.0, math.nan, 0.0], atol=1e-9)

    def test_slow_encoders_use_what_there_is(self) -> None:
        samples = [EncoderSample(BASE + at * MS, (1e-3 * at,) * 3, NAN3) for at in (0, 33, 66, 99)]
        np.testing.assert_allclose(self._fit(samples)[0], 1.0, atol=1e-9)

    @pytest.mark.parametrize("period", [50, 100, 200])
    def test_the_mean_speed_of_a_long_window_is_that_of_all_of_it(self, period: int) -> None:
        """A wheel that begins to turn in the last moments has hardly moved on the whole."""
        window = EncoderWindow(to_ns(0.07), period * MS, to_ns(0.5))
        for at in range(0, 401, 10):
            angle = 4.0 * max(at - 360, 0) * 1e-3
            window.add(EncoderSample(BASE + at * MS, (angle, 0.02 * at, 0.0), NAN3))
        speed, angle = 4.0 * 40 / period, 0.02 * (400 - period / 2)
        found = window.at(BASE + 400 * MS)
        np.testing.assert_allclose(found.speed, [speed, 20.0, 0.0], atol=0.2 * speed)
        assert found.angle[1] == pytest.approx(angle)

    def test_what_stray_stamps_break_off_is_forgotten_as_well(self) -> None:
        """Three messages of four are out of order, for minutes."""
        window = EncoderWindow(to_ns(0.07), to_ns(0.05), to_ns(0.5))
        for number in range(5000):
            stamp = BASE + 10 * number * MS
            window.add(EncoderSample(stamp, (1e-3 * number,) * 3, NAN3))
            for _ in range(3):
                window.continuity.precedes(stamp - 5 * MS)
            if number % 5 == 0:
                window.at(stamp)
        assert len(window._samples) < 100

    def test_stale_samples_say_nothing(self) -> None:
        samples = [EncoderSample(BASE - at * MS, (1.0,) * 3, NAN3) for at in (450, 440, 430)]
        assert np.isnan(self._fit(samples)[0]).all()


@pytest.mark.parametrize("early", [0, 45], ids=["in time", "arriving early"])
@pytest.mark.parametrize(
    ("lost", "turning", "doubted"),
    [
        ((), True, 0),
        ((20,), True, 11),
        ((20,), False, 0),
        ((3,), True, 0),  # before it is known what is usual
        ((20, 23), True, 14),
    ],
)
def test_after_a_lost_command_drivers_are_not_compared(
    monkeypatch: pytest.MonkeyPatch, lost: tuple[int, ...], turning: bool, doubted: int, early: int
) -> None:
    """Half a second from the next one's stamp on, and only where the command changed meanwhile."""
    assert len(_doubted(monkeypatch, lost, turning, early)) == doubted


def test_while_commands_pause_drivers_are_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(_doubted(monkeypatch, tuple(range(20, 30)), False)) > 10


def test_a_lost_command_is_forgotten_where_the_clock_leaps(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(_doubted(monkeypatch, (20,), True, passes=(1200, 3000))) == 3


@pytest.mark.parametrize("delay", [0.0, 0.3])
def test_a_lost_command_is_doubted_from_when_it_would_have_acted_on(
    monkeypatch: pytest.MonkeyPatch, delay: float
) -> None:
    found = [at for at in _doubted(monkeypatch, (20,), True, delay=delay) if at > 500]
    assert len(found) == 11
    assert found[0] == pytest.approx(1050 + 1000 * delay, abs=50)


def _doubted(
    monkeypatch: pytest.MonkeyPatch,
    lost: tuple[int, ...],
    turning: bool,
    early: int = 0,
    passes: tuple[int, ...] = (3000,),
    delay: float = 0.0,
) -> list[int]:
    """When the drivers' sums are forgotten [ms]; commands are lost in the first pass.

    `passes`: length of each [ms]; the clock begins anew with it.
    """
    robot = shipped_robot("reference")
    robot = evolve(robot, controller=evolve(robot.controller, delay=delay))
    predictor, now = PowerPredictor(robot), 0
    forgotten: list[int] = []
    monkeypatch.setattr(predictor._resting, "forget", lambda: forgotten.append(now))
    for number, end in enumerate(passes):
        missing = [50 * place for place in lost] if number == 0 else []
        events = [(t - early, t, True) for t in range(0, end, 50) if t not in missing]
        events += [(t, t, False) for t in range(0, end, 10)]
        for _, at_ms, is_command in sorted(events):
            now = at_ms
            if is_command:
                speed = 2e-4 * at_ms if turning else 0.1
                predictor.command(BASE + at_ms * MS, (speed, 0.0, 0.0))
            else:
                predictor.encoders(BASE + at_ms * MS, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            predictor.due()
    return forgotten


@pytest.mark.parametrize(
    ("twist", "is_known", "first"),
    [
        ((0.0, 0.3, 0.4), True, 500),  # ms: when the first command comes
        ((0.0, 0.0, 0.0), False, 1000),  # when the encoder that is lacking is waited for no more
        ((0.0, 0.3, 0.4), False, 1500),
    ],
)
def test_of_a_start_in_motion_of_which_not_all_is_known_nothing_is_said_for_a_moment(
    twist: Twist, is_known: bool, first: int
) -> None:
    predictor, found = PowerPredictor(shipped_robot("reference")), []
    speed = twist_to_wheels(shipped_robot("reference")) @ twist
    for at_ms, kind in _events(2000):
        stamp = BASE + at_ms * MS
        if kind == "encoders":
            one, two, three = (float(value) for value in speed * at_ms * 1e-3)
            predictor.encoders(stamp, (one, two, three if is_known else math.nan), NAN3)
        elif at_ms >= 500:
            predictor.command(stamp, twist)
        found.extend(predictor.due())
    predicted = [item.stamp_ns for item in found if not math.isnan(item.motors[0].power)]
    assert (min(predicted) - BASE) // MS == first
