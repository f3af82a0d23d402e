"""How bad a fault is: worked by hand on the reference robot. Constants are known to 5 %."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.evidence import ALONE, Beside
from tomr_fault_diag.classifier.judges import Opinion
from tomr_fault_diag.classifier.messages import diagnosis_message
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.severity import SeverityWatch
from tomr_fault_diag.classifier.severity.interval import jackknife_half, slope, student
from tomr_fault_diag.classifier.severity.measures import MEASURES
from tomr_fault_diag.classifier.severity.tick import Tick
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import (
    BURDENED,
    CONTROL,
    DEGRADED,
    DISOBEYS,
    DRAGGING,
    LOW_SUPPLY,
    MOTOR,
    NORMAL,
    POWER_SENSOR,
    PUSHED,
    SLIP,
    STATES,
    STUCK,
    UNKNOWN,
    State,
)
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame, Unit
from tomr_power_model.robot import shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
ROBOT = shipped_robot("reference")
# Of each motor: 0.7 N m/A at the wheel, 0.8 ohm, 1.2 W standby; wheels of 0.05 m.
CONSTANT, RESISTANCE, STANDBY, RADIUS = 0.7, 0.8, 1.2, 0.05
SPEED = np.array([4.0, -6.0, 2.0])
CURRENT = np.array([0.5, -0.8, 0.3])  # that the motion takes [A]
NAN = float("nan")


def power(current: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """At the driver [W]."""
    return np.asarray(STANDBY + RESISTANCE * current**2 + CONSTANT * speed * current)


def frame(
    tick: int,
    shown: np.ndarray,
    speed: np.ndarray = SPEED,
    expected: np.ndarray = SPEED,
    current: np.ndarray = CURRENT,
    unit: Unit = "W",
) -> ResidualFrame:
    """Measured powers `shown`; what the model says follows from currents and speeds."""
    of_encoders = power(current, speed) if unit == "W" else current
    of_commands = power(current, expected) if unit == "W" else current
    residuals = [Residual(0.0, 1.0, 30.0)]
    residuals += [Residual(p - m, 1.0, m, unit) for p, m in zip(shown, of_commands, strict=True)]
    residuals += [
        Residual(math.copysign(1.0, m) * (w - m), 1.0, m, "rad/s")
        for w, m in zip(speed, expected, strict=True)
    ]
    residuals += [Residual(p - m, 1.0, m, unit) for p, m in zip(shown, of_encoders, strict=True)]
    return ResidualFrame(BASE + 50 * tick * MS, tuple(residuals))


Make = Callable[[int], ResidualFrame]


def said(state: State, wheel: int | None, ill: Make, well: Make | None = None) -> str:
    """What is said after 5 s of a fault, before it 5 s of a robot that is well."""
    watch = SeverityWatch(ROBOT)
    for tick in range(100):
        watch.take((well or healthy)(tick), STATES[NORMAL], None)
    for tick in range(100, 200):
        watch.take(ill(tick), state, wheel)
    found = watch.severity(state, wheel)
    return "" if found is None else found.words


def healthy(tick: int) -> ResidualFrame:
    return frame(tick, power(CURRENT, SPEED))


def test_friction_added() -> None:
    # 0.14 N m are 0.2 A, in the direction in which the wheel turns.
    more = CURRENT + np.array([0.0, -0.2, 0.0])
    words = said(DRAGGING[1], 1, lambda tick: frame(tick, power(more, SPEED)))
    assert words == "friction added 0.14 N m (0.133 to 0.147 N m)"


def test_a_winding_that_heats_more() -> None:
    shown = power(CURRENT, SPEED) + np.array([0.6 * RESISTANCE * CURRENT[0] ** 2, 0.0, 0.0])
    words = said(DEGRADED[0], 0, lambda tick: frame(tick, shown))
    assert words == "winding resistance, or a loss like it, +60 % (+57 to +63 %)"


def test_a_wheel_that_stands_shows_nothing_of_its_winding() -> None:
    shown = power(CURRENT, SPEED) + np.array([0.6 * RESISTANCE * CURRENT[0] ** 2, 0.0, 0.0])
    still = SPEED * np.array([0.0, 1.0, 1.0])

    def now_and_then(tick: int) -> ResidualFrame:
        if tick // 10 % 2:
            return frame(tick, power(CURRENT, still) + 1.0, still, still)
        return frame(tick, shown)

    words = said(DEGRADED[0], 0, now_and_then)
    assert words == "winding resistance, or a loss like it, +60 % (+57 to +63 %)"


def test_currents_do_not_show_what_a_winding_loses() -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current")
    watch = SeverityWatch(evolve(ROBOT, measurement=measurement))
    for tick in range(100):
        watch.take(frame(tick, 1.5 * CURRENT, unit="A"), DEGRADED[0], 0)
    assert watch.severity(DEGRADED[0], 0) is None


def test_a_robot_that_hardly_moves_shows_no_force() -> None:
    speed = 0.01 / RADIUS * np.sin(np.radians([0.0, 120.0, 240.0]))  # 0.01 m/s ahead
    watch = SeverityWatch(ROBOT)
    for tick in range(100):
        watch.take(frame(tick, power(CURRENT + 1.0, speed), speed, speed), BURDENED, None)
    assert watch.severity(BURDENED, None) is None


def test_a_voltage_that_is_not_known_leaves_out_its_ticks() -> None:
    watch = SeverityWatch(ROBOT)
    for tick in range(100):
        supply = NAN if tick % 2 else 0.8
        watch.take(evolve(frame(tick, power(CURRENT, SPEED)), supply=supply), LOW_SUPPLY, None)
    found = watch.severity(LOW_SUPPLY, None)
    assert found is not None
    assert found.value == pytest.approx(-0.2)


def test_a_power_sensor_that_shows_too_little() -> None:
    shown = power(CURRENT, SPEED) * np.array([1.0, 1.0, 0.6])
    words = said(POWER_SENSOR[2], 2, lambda tick: frame(tick, shown))
    assert words == "power shown -40 % (-42 to -38 %)"


def test_a_motor_without_its_signal_draws_nothing() -> None:
    shown = power(CURRENT * np.array([0.0, 1.0, 1.0]), SPEED)
    words = said(STATES[CONTROL], 0, lambda tick: frame(tick, shown))
    assert words == "motor power -100 % (-105 to -95 %)"


def test_an_encoder_that_stands() -> None:
    speed = SPEED * np.array([1.0, 1.0, 0.0])
    words = said(STATES[MOTOR + 2], 2, lambda tick: frame(tick, power(CURRENT, SPEED), speed))
    assert words == "wheel speed shown -100 % (-105 to -95 %)"


def test_what_a_stuck_wheel_withstands() -> None:
    speed, current = SPEED * np.array([0.0, 1.0, 1.0]), CURRENT + np.array([3.5, 0.0, 0.0])
    words = said(STUCK[0], 0, lambda tick: frame(tick, power(current, speed), speed))
    assert words == "withstands 2.8 N m (2.66 to 2.94 N m)"


def test_a_force_that_resists() -> None:
    # Straight ahead at 0.2 m/s: wheel torques are J^T F, with omega = sin(a) v / r.
    ways = np.array([math.sin(math.radians(angle)) for angle in (0.0, 120.0, 240.0)])
    speed = ways * 0.2 / RADIUS
    torque = ways * RADIUS * 9.0 * 2.0 / 3.0
    still = np.zeros(3)

    def pulled(tick: int) -> ResidualFrame:
        return frame(tick, power(torque / CONSTANT, speed), speed, speed, still)

    words = said(
        BURDENED, None, pulled, lambda tick: frame(tick, power(still, speed), current=still)
    )
    assert words == "resisting force 9 N (8.55 to 9.45 N)"


def test_traction_is_what_wheels_hand_to_the_floor() -> None:
    # 5 kg on each wheel; 0.06 N m Coulomb and 0.004 N m s/rad take 0.3 and 0.08 N of the rest.
    load, speed = 5.0 * 9.80665, np.array([4.0, 4.0, 4.0])
    torque = 0.06 + 0.004 * 4.0 + 0.05 * load * RADIUS

    def slipping(tick: int) -> ResidualFrame:
        return frame(tick, power(np.full(3, torque / CONSTANT), speed), speed, speed)

    assert said(STATES[SLIP], None, slipping, slipping) == (
        "traction used 0.05 of the load (0.0449 to 0.0551 of the load)"
    )


def test_the_wheels_that_push_hardest_show_the_traction() -> None:
    # Of the load, by the cubes of the forces: (0.06**4 + 2 * 0.03**4) / (0.06**3 + 2 * 0.03**3).
    load, speed = 5.0 * 9.80665, np.array([4.0, 4.0, 4.0])
    torque = 0.06 + 0.004 * 4.0 + np.array([0.06, 0.03, 0.03]) * load * RADIUS
    shown = power(torque / CONSTANT, speed)
    watch = SeverityWatch(ROBOT)
    for tick in range(100):
        watch.take(frame(tick, shown, speed, speed), STATES[SLIP], None)
    found = watch.severity(STATES[SLIP], None)
    assert found is not None
    assert found.value == pytest.approx(0.054, rel=1e-3)


def test_a_tick_knows_how_fast_its_speeds_change() -> None:
    motors = Motors(ROBOT)
    shown, faster = power(CURRENT, SPEED), np.array([0.1, -0.2, 0.0])
    first = Tick.of(motors, frame(0, shown), None)
    assert first is not None
    assert first.change.tolist() == [0.0, 0.0, 0.0]
    second = Tick.of(motors, frame(2, shown, SPEED + faster), first)
    assert second is not None
    np.testing.assert_allclose(second.change, faster / 0.1)
    late = Tick.of(motors, frame(8, shown, SPEED + faster), first)
    assert late is not None
    assert late.change.tolist() == [0.0, 0.0, 0.0]


def test_what_turns_wheels_faster_is_not_handed_to_the_floor() -> None:
    motors, still = Motors(ROBOT), np.zeros(3)
    faster = motors.forces(CURRENT, SPEED, np.array([10.0, 0.0, 0.0]))
    steady = motors.forces(CURRENT, SPEED, still)
    inertia = ROBOT.motors[0].rotor_inertia * ROBOT.motors[0].gear_ratio ** 2 + ROBOT.wheel_inertia
    np.testing.assert_allclose(steady - faster, [10.0 * inertia / RADIUS, 0.0, 0.0])


@pytest.mark.parametrize("signed", [True, False])
def test_currents_need_no_power(signed: bool) -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current", signed=signed)
    watch = SeverityWatch(evolve(ROBOT, measurement=measurement))
    more, current = CURRENT + np.array([0.0, -0.2, 0.0]), CURRENT
    if not signed:
        more, current = np.abs(more), np.abs(current)
    for tick in range(100):
        watch.take(frame(tick, more, current=current, unit="A"), DRAGGING[1], 1)
    found = watch.severity(DRAGGING[1], 1)
    assert found is not None
    assert found.value == pytest.approx(0.14)


def test_currents_of_a_supply_whose_voltage_is_not_known_are_powers() -> None:
    watch = SeverityWatch(ROBOT)
    shown, current = (
        power(CURRENT + more, SPEED) / 24.0 for more in (np.array([0.0, -0.2, 0.0]), 0.0)
    )
    for tick in range(100):
        watch.take(frame(tick, shown, current=current, unit="A"), DRAGGING[1], 1)
    found = watch.severity(DRAGGING[1], 1)
    assert found is not None
    assert found.value == pytest.approx(0.14, rel=0.01)


def test_the_other_way_around_it_is_as_bad() -> None:
    more = -CURRENT + np.array([0.0, 0.2, 0.0])
    words = said(
        DRAGGING[1],
        1,
        lambda tick: frame(tick, power(more, -SPEED), -SPEED, -SPEED, -CURRENT),
    )
    assert words == "friction added 0.14 N m (0.133 to 0.147 N m)"


def test_what_a_robot_shows_that_is_well_widens_the_interval() -> None:
    more = CURRENT + np.array([0.0, -0.2, 0.0])
    lacking = CURRENT + np.array([0.0, -0.05, 0.0])
    words = said(
        DRAGGING[1],
        1,
        lambda tick: frame(tick, power(more, SPEED)),
        lambda tick: frame(tick, power(lacking, SPEED)),
    )
    assert words == "friction added 0.14 N m (0.098 to 0.182 N m)"


def test_what_a_pushed_robot_shows_is_not_how_it_is_when_it_is_well() -> None:
    more, pushed = (power(CURRENT + np.array([0.0, by, 0.0]), SPEED) for by in (-0.2, -0.05))
    watch = SeverityWatch(ROBOT)
    for tick in range(200):
        well = tick < 100
        state = PUSHED if well else DRAGGING[1]
        watch.take(frame(tick, pushed if well else more), state, None if well else 1)
    found = watch.severity(DRAGGING[1], 1)
    assert found is not None
    assert found.words == "friction added 0.14 N m (0.133 to 0.147 N m)"


def test_what_may_be_nothing_is_not_reported() -> None:
    noise = np.random.default_rng(7)

    def noisy(tick: int) -> ResidualFrame:
        return frame(tick, power(CURRENT, SPEED) + noise.normal(0.0, 1.0, 3))

    assert said(DRAGGING[1], 1, noisy) == ""


def test_nineteen_intervals_of_twenty_hold_the_truth() -> None:
    noise, held = np.random.default_rng(3), 0
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    for _ in range(200):
        watch = SeverityWatch(ROBOT)
        for tick in range(60):
            watch.take(frame(tick, more + noise.normal(0.0, 0.2, 3)), DRAGGING[1], 1)
        found = watch.severity(DRAGGING[1], 1)
        assert found is not None
        scatter = found.high - found.value - 0.05 * found.value
        held += abs(found.value - 0.14) <= scatter
    assert 180 <= held <= 199


def test_nothing_is_reported_of_a_moment_or_of_ticks_without_data() -> None:
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    watch = SeverityWatch(ROBOT)
    for tick in range(30):
        watch.take(frame(tick, more), DRAGGING[1], 1)
    assert watch.severity(DRAGGING[1], 1) is None
    for tick in range(30, 200):
        silent = frame(tick, more)
        missing = evolve(silent.residuals[2], residual=NAN, missing="wheel_2/power")
        residuals = (*silent.residuals[:2], missing, *silent.residuals[3:])
        watch.take(evolve(silent, residuals=residuals), DRAGGING[1], 1)
    assert watch.severity(DRAGGING[1], 1) is None


def test_what_is_beyond_all_numbers_is_left_out() -> None:
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    huge = np.array([1e300, 1.0, 1.0])
    words = said(
        DRAGGING[1],
        1,
        lambda tick: frame(tick, more * huge if tick % 7 == 0 else more),
        lambda tick: frame(tick, power(CURRENT, SPEED) * huge),
    )
    assert words == "friction added 0.14 N m (0.133 to 0.147 N m)"


def test_another_fault_begins_anew_and_its_cause_does_not() -> None:
    watch = SeverityWatch(ROBOT)
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    for tick in range(60):
        watch.take(frame(tick, more), STATES[MOTOR + 1], 1)
    watch.take(frame(60, more), DRAGGING[1], 1)
    assert watch.severity(DRAGGING[1], 1) is not None
    watch.take(frame(61, more), DRAGGING[2], 2)
    assert watch.severity(DRAGGING[2], 2) is None


def test_every_fault_of_a_part_has_a_measure() -> None:
    measured = {state for measure in MEASURES for state in measure.states}
    assert measured == {
        *STATES[SLIP:], *DRAGGING, *STUCK, *DEGRADED, *POWER_SENSOR, BURDENED, LOW_SUPPLY,
    }  # fmt: skip
    watch = SeverityWatch(ROBOT)
    assert all(watch.severity(state, None) is None for state in (UNKNOWN, DISOBEYS, PUSHED))


def test_a_message_states_it() -> None:
    watch = SeverityWatch(ROBOT)
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    for tick in range(100):
        watch.take(frame(tick, more), DRAGGING[1], 1)
    diagnosis = Diagnosis(
        BASE, DRAGGING[1], BASE, (), frame(100, more), False, 1,
        severity=watch.severity(DRAGGING[1], 1),
    )  # fmt: skip
    values = dict(diagnosis_message(ROBOT, diagnosis, "robot").statuses[0].values)
    assert values["severity"] == "friction added 0.14 N m (0.133 to 0.147 N m)"
    plain = evolve(diagnosis, severity=None)
    assert dict(diagnosis_message(ROBOT, plain, "robot").statuses[0].values)["severity"] == ""


@pytest.mark.parametrize(("freedom", "quantile"), [(3, 3.182), (5, 2.571), (20, 2.086)])
def test_students_quantile(freedom: int, quantile: float) -> None:
    assert student(freedom) == pytest.approx(quantile, rel=0.01)


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    values = np.array([1.0, 2.0, 4.0, 9.0])  # deviate by 12.667 squared, of 3 degrees
    half = jackknife_half((values.sum() - values) / 3.0)
    assert half == pytest.approx(student(3) * math.sqrt(12.667 / 4.0), rel=1e-3)


def test_stretches_that_show_nothing_count_for_nothing() -> None:
    """Four that were all but at rest beside one that was not are not five."""
    squares = np.array([1e-31, 2e-31, 5e-31, 4e-31, 128.0])
    products = np.array([-8e-17, 6e-17, 1e-16, 2e-16, -24.0])
    assert slope(squares, products) is None
    more, less = np.append(squares, [4.0, 4.0, 4.0]), np.append(products, [-0.75, -0.75, -0.75])
    assert slope(more, less) == pytest.approx((-0.1875, 0.0))


def test_numbers_beyond_all_are_left_out() -> None:
    more = CURRENT + np.array([0.0, -0.2, 0.0])

    def beyond_all(tick: int) -> ResidualFrame:
        shown = power(more, SPEED)
        return frame(tick, shown * (1e300 if tick % 7 == 0 else 1.0))

    words = said(DRAGGING[1], 1, beyond_all)
    assert words == "friction added 0.14 N m (0.133 to 0.147 N m)"


def test_after_a_clock_goes_back_it_is_measured_anew() -> None:
    more = power(CURRENT + np.array([0.0, -0.2, 0.0]), SPEED)
    found = []
    classifier = FaultClassifier(Dragging(), SeverityWatch(ROBOT))
    for tick in (*range(1000, 1200), *range(100, 140)):
        diagnosis = classifier.classify(frame(tick, more))
        if diagnosis is not None:
            found.append((diagnosis.stamp_ns, diagnosis.severity is not None))
    before = [known for stamp, known in found if stamp > BASE + 500 * 50 * MS]
    again = [known for stamp, known in found if stamp < BASE + 500 * 50 * MS]
    assert before[-1]
    assert again
    assert not any(again)


class Dragging:
    """A judge that is sure of a wheel that drags."""

    settings = ClassifierSettings()

    def clear(self) -> None:
        pass

    def interrupt(self) -> None:
        pass

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        return Opinion(np.eye(6)[MOTOR + 1], sure=True, wheel=1, state=DRAGGING[1])
