"""What changes slowly and is no fault, worked by hand on the reference robot."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.messages import diagnosis_message
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.severity import Severity, SeverityWatch
from tomr_fault_diag.classifier.severity.conditions import ConditionsWatch, _rows
from tomr_fault_diag.classifier.severity.tick import Tick
from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import DRAGGING, NORMAL, PUSHED, STATES, State
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame, Unit
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
ROBOT = shipped_robot("reference")
# Of each motor: 0.7 N m/A at the wheel, 0.8 ohm, 1.2 W standby; wheels of 0.05 m.
CONSTANT, RESISTANCE, STANDBY, RADIUS = 0.7, 0.8, 1.2, 0.05
CURRENTS = evolve(ROBOT, measurement=evolve(ROBOT.measurement, quantity="motor_current"))
NAN = float("nan")

Array = np.ndarray
# Current [A] of the encoders, speed and its change [rad/s, rad/s^2] to watts or amperes shown.
Shown = Callable[[Array, Array, Array], Array]


def power(current: Array, speed: Array) -> Array:
    """At the driver [W]."""
    return np.asarray(STANDBY + RESISTANCE * current**2 + CONSTANT * speed * current)


def motion(tick: int) -> tuple[Array, Array, Array]:
    """Current [A], speed [rad/s] and its change [rad/s^2] of wheels that each go their own way."""
    time, rates = 0.05 * tick, np.array([0.45, 0.65, 0.85])
    speed = 6.0 * np.sin(rates * time)
    change = 6.0 * rates * np.cos(rates * time)
    return 0.1 * np.sign(speed) + 0.2 * change, speed, change


def frame(tick: int, shown: Shown, unit: Unit = "W", noise: float = 0.0) -> ResidualFrame:
    """What encoders explain, and what is shown."""
    current, speed, _ = motion(tick)
    before = motion(tick - 1)[1]
    measured = shown(current, speed, (speed - before) / 0.05)
    measured = measured + noise * np.random.default_rng(tick).normal(size=3)
    explained = power(current, speed) if unit == "W" else current
    powers = [Residual(m - e, 1.0, e, unit) for m, e in zip(measured, explained, strict=True)]
    speeds = [Residual(0.0, 1.0, w, "rad/s") for w in speed]
    return ResidualFrame(
        BASE + 50 * tick * MS, (Residual(0.0, 1.0, 30.0), *powers, *speeds, *powers)
    )


def reported(
    shown: Shown,
    state: State = STATES[NORMAL],
    ticks: int = 5000,
    robot: Robot = ROBOT,
    unit: Unit = "W",
    supply: Callable[[int], float] = lambda _: NAN,
) -> dict[str, Severity]:
    """What is said after so many ticks; `supply`: its share of the nominal voltage at a tick."""
    watch = SeverityWatch(robot)
    wheel = 1 if state in DRAGGING else None
    for tick in range(ticks):
        watch.take(evolve(frame(tick, shown, unit, 0.02), supply=supply(tick)), state, wheel)
    return {change.quantity: change for change in watch.conditions}


def unchanged(current: Array, speed: Array, change: Array) -> Array:
    return power(current, speed)


def holds(change: Severity, truth: float) -> bool:
    """Whether an interval holds the truth, and is no wider than two fifths of it either way."""
    return change.low < truth < change.high and change.high - change.low < 0.8 * truth


def test_a_robot_as_described_has_not_changed() -> None:
    assert reported(unchanged) == {}


def test_hot_windings() -> None:
    found = reported(lambda i, w, a: power(i, w) + 0.3 * RESISTANCE * i**2)
    assert set(found) == {"winding resistance"}
    assert holds(found["winding resistance"], 0.3)


def test_stiff_grease_at_one_axle() -> None:
    more = np.array([0.0, 0.04, 0.0]) / CONSTANT
    found = reported(lambda i, w, a: power(i + np.sign(w) * more, w))
    assert set(found) == {"friction of motor 2"}
    assert holds(found["friction of motor 2"], 0.04)
    assert found["friction of motor 2"].unit == "N m"


def loaded(share: float, hot: float = 0.0) -> Shown:
    """By a payload, as a share of the robot, and windings that are hot."""
    # What the floor takes of a torque: 0.06 N m and 0.004 N m s/rad of it turn the axle, and the
    # wheel and its rotor take theirs.
    inertia = ROBOT.motors[0].rotor_inertia * ROBOT.motors[0].gear_ratio ** 2 + ROBOT.wheel_inertia

    def shown(current: Array, speed: Array, change: Array) -> Array:
        axle = 0.06 * np.sign(speed) + 0.004 * speed
        floor = CONSTANT * current - axle - inertia * change
        more = current + share * floor / CONSTANT
        return power(more, speed) + hot * RESISTANCE * more**2

    return shown


def test_a_payload() -> None:
    found = reported(loaded(0.3))
    assert set(found) == {"payload"}
    assert holds(found["payload"], 0.3 * ROBOT.mass)
    assert found["payload"].unit == "kg"


def test_a_payload_as_heavy_as_the_robot() -> None:
    assert reported(loaded(1.0))["payload"].value == pytest.approx(ROBOT.mass, rel=0.02)


def test_hot_windings_that_the_jerks_of_a_payload_may_feign_are_not_reported() -> None:
    assert set(reported(loaded(0.4, hot=0.2))) == {"payload"}
    assert set(reported(loaded(0.0, hot=0.2))) == {"winding resistance"}


def test_drivers_that_draw_more() -> None:
    found = reported(lambda i, w, a: power(i, w) + np.array([0.0, 0.0, 0.8]))
    assert set(found) == {"standby power of motor 3"}
    assert holds(found["standby power of motor 3"], 0.8)


def test_a_battery_that_has_given_much() -> None:
    found = reported(unchanged, supply=lambda tick: 0.93 if tick % 3 else NAN)
    assert set(found) == {"supply voltage"}
    assert found["supply voltage"].value == pytest.approx(-0.07)
    assert reported(unchanged, supply=lambda _: 0.97) == {}


def test_a_supply_that_comes_and_goes_shows_nothing() -> None:
    # 14 % less every other stretch, of which a mean of ten is no surer than to 5 %.
    assert reported(unchanged, ticks=1800, supply=lambda tick: 1.0 - 0.14 * (tick // 180 % 2)) == {}


def test_a_battery_that_was_replaced() -> None:
    found = reported(unchanged, ticks=12_000, supply=lambda tick: 0.85 if tick < 5000 else 1.0)
    assert found == {}


def test_currents_show_friction() -> None:
    more = np.array([0.04, 0.0, 0.0]) / CONSTANT
    found = reported(lambda i, w, a: i + np.sign(w) * more, robot=CURRENTS, unit="A")
    assert set(found) == {"friction of motor 1"}
    assert holds(found["friction of motor 1"], 0.04)


@pytest.mark.parametrize(
    ("speed", "change", "current", "rows"),
    [
        (4.0, 0.0, 0.5, 1),
        (-4.0, 0.0, -0.5, 1),
        (0.4, 0.0, 0.1, 0),  # hardly turns
        (-4.0, 1.5, -0.5, 0),  # slows down
        (4.0, 1.5, 0.5, 1),
        (1.0, 0.0, 0.5, 0),  # sets off: 0.7 V of back-EMF, 0.4 V twice over the winding
        (1.2, 0.0, 0.5, 1),
    ],
)
def test_which_motors_show_something(
    speed: float, change: float, current: float, rows: int
) -> None:
    motors, still = Motors(ROBOT), Residual(0.0, 1.0, 0.0, "rad/s")
    watts = float(power(np.array(current), np.array(speed)))
    powers = (Residual(0.0, 1.0, watts), Residual(0.0, 1.0, STANDBY), Residual(0.0, 1.0, STANDBY))

    def at(tick: int, turning: float) -> ResidualFrame:
        speeds = (Residual(0.0, 1.0, turning, "rad/s"), still, still)
        return ResidualFrame(
            BASE + 50 * tick * MS, (Residual(0.0, 1.0, 30.0), *powers, *speeds, *powers)
        )

    before = Tick.of(motors, at(0, speed - 0.05 * change), None)
    tick = Tick.of(motors, at(1, speed), before)
    assert tick is not None
    assert before is not None
    assert len(_rows(tick, before, np.full(3, 0.1))) == rows


@pytest.mark.parametrize(("more", "rows"), [(0.05, 1), (0.07, 0)])
def test_a_motor_that_jerks_shows_nothing(more: float, rows: int) -> None:
    # A tenth of 0.5 A, and of 0.1 A that friction takes.
    motors, still = Motors(ROBOT), Residual(0.0, 1.0, 0.0, "rad/s")
    ticks = []
    for number, current in enumerate((0.5 - more, 0.5)):
        watts = float(power(np.array(current), np.array(4.0)))
        powers = (Residual(0.0, 1.0, watts), *[Residual(0.0, 1.0, STANDBY)] * 2)
        speeds = (Residual(0.0, 1.0, 4.0, "rad/s"), still, still)
        residuals = (Residual(0.0, 1.0, 30.0), *powers, *speeds, *powers)
        ticks.append(Tick.of(motors, ResidualFrame(BASE + 50 * number * MS, residuals), None))
    before, tick = ticks
    assert before is not None
    assert tick is not None
    assert len(_rows(tick, before, np.full(3, 0.1))) == rows


def test_constants_of_a_description_are_known_to_5_percent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exact = np.array([0.3, *[0.0] * 8]), np.zeros(9)
    monkeypatch.setattr(ConditionsWatch, "_fitted", lambda _: exact)
    (found,) = reported(unchanged, ticks=3000).values()
    assert (found.low, found.high) == (pytest.approx(0.285), pytest.approx(0.315))


def test_what_is_little_is_not_reported() -> None:
    assert reported(lambda i, w, a: power(i, w) + 0.05 * RESISTANCE * i**2) == {}


def test_it_takes_minutes_of_driving() -> None:
    hot = lambda i, w, a: power(i, w) + 0.3 * RESISTANCE * i**2  # noqa: E731
    assert reported(hot, ticks=900) == {}
    assert set(reported(hot, ticks=4000)) == {"winding resistance"}


@pytest.mark.parametrize("state", [PUSHED, DRAGGING[1]])
def test_only_a_robot_that_is_well_has_conditions(state: State) -> None:
    hot = lambda i, w, a: power(i, w) + 0.3 * RESISTANCE * i**2  # noqa: E731
    assert reported(hot, state) == {}


def test_ticks_apart_show_no_payload_and_no_ticks_nothing() -> None:
    watch = SeverityWatch(ROBOT)
    for tick in range(0, 60_000, 20):  # a second apart
        watch.take(frame(tick, lambda i, w, a: 2.0 * power(i, w)), STATES[NORMAL], None)
    assert watch.conditions == ()


def test_five_minutes_are_remembered_and_a_clock_that_leaps_forgets() -> None:
    watch = SeverityWatch(ROBOT)
    for tick in range(14_000):
        hot = 0.3 * (tick < 6000)
        watch.take(
            frame(tick, lambda i, w, a, s=hot: power(i, w) + s * RESISTANCE * i**2),
            STATES[NORMAL],
            None,
        )
        if tick == 5999:
            assert watch.conditions
    assert watch.conditions == ()
    watch.clear()
    assert watch.conditions == ()


def test_a_message_states_them() -> None:
    changes = (
        Severity("winding resistance", "", 0.2, 0.15, 0.25),
        Severity("payload", "kg", 3.0, 2.5, 3.5),
    )
    diagnosis = Diagnosis(
        BASE, STATES[NORMAL], BASE, (), frame(1, unchanged), False, conditions=changes
    )
    values = dict(diagnosis_message(ROBOT, diagnosis, "robot").statuses[0].values)
    assert values["conditions"] == (
        "winding resistance +20 % (+15 to +25 %); payload 3 kg (2.5 to 3.5 kg)"
    )
