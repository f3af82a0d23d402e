"""Whether wheels slide, from ticks: hand-made motions of the reference robot and their powers."""

import math
from collections.abc import Callable
from unittest.mock import Mock

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import DRAGS, ENCODERS, EXTERNAL, LOADED, OTHER
from tomr_fault_diag.classifier.contacts import NOTHING, Contacts
from tomr_fault_diag.classifier.evidence import Beside, said_by_forces
from tomr_fault_diag.classifier.judges import Opinion, WindowJudge, make_judge
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.outside import NOTHING_ACTS, Outside, OutsideWatch
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.slides import SlideWatch, _explains, _is_plain
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import NORMAL, SLIP, STATES
from tomr_fault_diag.residuals.frame import SPEEDS, UNKNOWN_FORCE, Residual, ResidualFrame
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of
from tomr_power_model.slides.particles import Pull, Slides

Array = NDArray[np.float64]
Twist = Callable[[float], Array]  # of the rims as if they rolled, at a time [s]
Felt = Callable[[float], tuple[float, float]]
Forces = Callable[[float, Array, Array], Array]  # of contacts [N]; of rolling, at rims [m/s]

ROBOT = shipped_robot("reference")
MOTORS = Motors(ROBOT)
BODY, RADIUS = body_of(ROBOT)
BASE = 1_700_000_000_000_000_000
MS = 1_000_000
BAND = 0.7  # W
TRACTION = 0.08
FASTER = 0.8  # m/s^2


def ahead(time: float) -> Array:
    """Half a metre per second, then for half a second faster and slower by turns."""
    phase = time % 2.0 if time > 2.0 else 0.0
    more = min(phase, 0.5) - max(0.0, min(phase - 1.0, 0.5))
    return np.array([0.5 + FASTER * more, 0.2, 0.3])


def rolling(_: float, forces: Array, __: Array) -> Array:
    return forces


def pushed(wrench: Array, begin: float, end: float) -> Forces:
    """What contacts that grip withstand: a force on the body [N, N, N m] for some time."""

    def forces(time: float, of_rolling: Array, _: Array) -> Array:
        return of_rolling - (BODY.to_twist.T @ wrench if begin <= time < end else 0.0)

    return forces


def turned(twist: Array) -> Array:
    """What a body's velocity changes by, in its own frame, because it turns [m/s^2]."""
    return np.array([-twist[2] * twist[1], twist[2] * twist[0], 0.0])


class Slippery:
    """From two seconds on contacts hand on no more than a share of their load."""

    def __init__(self) -> None:
        self._twist: Array | None = None

    def __call__(self, time: float, of_rolling: Array, rims: Array) -> Array:
        if time < 2.0:
            return of_rolling
        if self._twist is None:
            self._twist = BODY.to_twist @ rims
        most, found = TRACTION * BODY.load, np.zeros(3)
        for _ in range(50):  # 1 ms each
            sliding = rims - BODY.rows @ self._twist
            found = most * np.clip(sliding / 0.01, -1.0, 1.0)
            change = np.linalg.solve(BODY.inertia, BODY.rows.T @ found) - turned(self._twist)
            self._twist = self._twist + 0.001 * change
        return found


def power(force: Array, speed: Array, change: Array) -> Array:
    """Of motors whose contacts hand on so much [N], at wheel speeds and their change [W]."""
    none, one = (MOTORS.forces(np.full(3, amperes), speed, change) for amperes in (0.0, 1.0))
    current = (force - none) / (one - none)
    return MOTORS.resistance * current**2 + MOTORS.constant * speed * current + MOTORS.idle


def frames(
    forces: Forces, seconds: float = 4.0, yaw: float = math.nan, felt: Felt | None = None
) -> list[ResidualFrame]:
    """Ticks of 50 ms of rims that turn as commanded; powers are explained by rolling. `felt`: by an
    accelerometer beyond what rims show."""
    found, last = [], BODY.rows @ ahead(0.0)
    for tick in range(1, round(seconds / 0.05)):
        time = 0.05 * tick
        twist = ahead(time)
        rims = BODY.rows @ twist
        speed, change = rims / RADIUS, (rims - last) / RADIUS / 0.05
        last = rims
        turning = np.array([-twist[2] * twist[1], twist[2] * twist[0], 0.0])
        of_rolling = BODY.to_twist.T @ (
            BODY.inertia @ (BODY.to_twist @ (RADIUS * change) + turning)
        )
        explained = power(of_rolling, speed, change)
        shown = power(forces(time, of_rolling, rims), speed, change) - explained
        item = frame(tick, speed, shown, explained, yaw)
        if felt is not None:
            change_of_body = BODY.to_twist @ (RADIUS * change) + turning
            x, y = (
                Residual(more, 0.3, model, "m/s^2")
                for more, model in zip(felt(time), change_of_body.tolist()[:2], strict=True)
            )
            item = evolve(item, along=(x, y))
        found.append(item)
    return found


def since(begin: float, x: float, y: float) -> Felt:
    """Felt from a time on [m/s^2]."""
    return lambda time: (x, y) if time >= begin else (0.0, 0.0)


def frame(
    tick: int, speed: Array, off: Array, explained: Array, yaw: float = math.nan
) -> ResidualFrame:
    total = Residual(float(off.sum()), 3.0 * BAND, 30.0)
    motors = [Residual(o, BAND, m) for o, m in zip(off.tolist(), explained.tolist(), strict=True)]
    speeds = [Residual(0.0, 0.2, want, "rad/s") for want in speed.tolist()]
    gyro = Residual(yaw, 0.1, 0.3, "rad/s")
    return ResidualFrame(BASE + 50 * tick * MS, (total, *motors, *speeds, *motors), yaw=gyro)


def probabilities(items: list[ResidualFrame]) -> Array:
    watch = SlideWatch(ROBOT)
    return np.array([watch.take(item).slides for item in items])


def test_contacts_that_hand_on_their_traction_slide() -> None:
    found = probabilities(frames(Slippery()))
    assert (found[:39] == 0.0).all()
    assert (found[39 + 8 :] > 0.6).all()
    assert found[-10:].min() > 0.9


@pytest.mark.parametrize(
    "forces",
    [
        pytest.param(pushed(BODY.mass * np.array([2.0, 1.0, 0.1]), 2.2, 2.35), id="a shove"),
        pytest.param(pushed(BODY.mass * np.array([-0.6, 0.0, 0.0]), 2.2, 9.0), id="a load"),
        pytest.param(pushed(BODY.mass * np.array([0.3, 0.3, 0.0]), 2.2, 9.0), id="a slope"),
    ],
)
def test_what_contacts_withstand_is_no_slide(forces: Forces) -> None:
    items = frames(forces)
    off = [abs(motor.residual) for item in items for motor in item.residuals[1:4]]
    assert max(off) > 2.0 * BAND
    assert np.nanmax(probabilities(items)) < 0.5


def test_while_nothing_lies_outside_its_band_particles_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    watch, steps = SlideWatch(ROBOT), []
    step = watch._particles.step
    monkeypatch.setattr(
        watch._particles, "step", lambda dt, rims: steps.append(dt) or step(dt, rims)
    )
    well = frames(rolling)
    shoved = frames(pushed(np.array([30.0, 0.0, 0.0]), 2.175, 2.275), seconds=6.0)
    assert [watch.take(item) for item in well] == [Contacts(0.0, calm=True)] * len(well)
    assert not steps
    watch.clear()
    for item in shoved:
        watch.take(item)
    # Hints at 2.2 and 2.25 s: from 1.15 s until 4.2 s, of which the first tick has none before.
    assert len(steps) == 61
    assert np.allclose(steps, 0.05)


def test_it_hangs_neither_on_the_rate_of_decisions_nor_on_repeated_ticks() -> None:
    items = frames(Slippery())
    plain = probabilities(items)
    doubled = [
        evolve(item, stamp_ns=item.stamp_ns + later * MS) for item in items for later in (0, 10, 30)
    ]
    assert np.array_equal(probabilities(doubled)[::3], plain, equal_nan=True)
    slow = probabilities(items[::4])
    assert (np.isnan(slow) | (slow == 0.0)).all()  # 5 Hz show no acceleration


def test_a_tick_without_a_power_says_nothing_and_particles_begin_anew() -> None:
    items = frames(Slippery())
    gone = Residual(math.nan, BAND, 3.0)
    lost = items[60]
    items[60] = evolve(lost, residuals=(lost.residuals[0], gone, *lost.residuals[2:]))
    found = probabilities(items)
    assert np.isnan(found[60:62]).all()
    assert np.isfinite(found[62:]).all()


def test_magnitudes_of_currents_show_no_slide() -> None:
    measurement = evolve(ROBOT.measurement, quantity="motor_current", signed=False)
    watch = SlideWatch(evolve(ROBOT, measurement=measurement))
    assert all(watch.take(item) is NOTHING for item in frames(Slippery()))


def test_numbers_beyond_all_bounds_are_survived() -> None:
    items = frames(Slippery())
    wild = Residual(1e300, BAND, 3.0)
    for tick in range(50, 55):
        item = items[tick]
        items[tick] = evolve(item, residuals=(item.residuals[0], wild, *item.residuals[2:]))
    assert np.isfinite(probabilities(items)[70:]).all()


def test_a_gyro_tells_a_slide_sooner() -> None:
    """That the body turns otherwise than its wheels no load explains."""
    alone = probabilities(frames(pushed(np.array([-4.0, 0.0, 0.0]), 2.2, 9.0)))
    seen = probabilities(frames(pushed(np.array([-4.0, 0.0, 0.0]), 2.2, 9.0), yaw=-0.25))
    assert np.nanmax(alone) < 0.5 < np.nanmax(seen[45:])


def forces_stay(items: list[ResidualFrame]) -> list[float]:
    """Times [s] at which a force is said to stay."""
    watch = SlideWatch(ROBOT)
    return [0.05 * (n + 1) for n, item in enumerate(items) if watch.take(item).force]


def test_a_slope_that_is_felt_is_known_at_once_and_what_pushes_is_none() -> None:
    """Of a slope an accelerometer feels what the motors do, of a push nothing."""
    push = pushed(BODY.mass * np.array([-0.6, 0.2, 0.0]), 2.175, 9.0)
    unknown = forces_stay(frames(push))
    sloping = forces_stay(frames(push, felt=since(2.175, 0.6, -0.2)))
    leant_on = forces_stay(frames(push, felt=since(2.175, 0.0, 0.0)))
    assert 2.2 <= sloping[0] <= 2.45
    assert not unknown or unknown[0] > sloping[0] + 0.3
    assert len(sloping) > 0.9 * (4.0 - sloping[0]) / 0.05
    assert not leant_on


def named_on_a_slope(felt: Felt | None) -> set[str]:
    """States of a robot that holds itself on one of 3 degrees for seven seconds."""
    classifier = FaultClassifier.of(ClassifierSettings(), ROBOT)
    push = pushed(BODY.mass * np.array([-0.5, 0.2, 0.0]), 2.175, 9.0)
    found = [classifier.classify(item) for item in frames(push, 9.0, felt=felt)]
    return {item.state.name for item in found if item is not None}


def test_a_slope_that_is_felt_changes_nothing_that_is_named() -> None:
    assert named_on_a_slope(since(2.175, 0.5, -0.2)) == {"normal"}
    assert named_on_a_slope(None) > {"normal"}


def test_what_is_felt_wakes_particles_where_all_else_lies_within_its_bands() -> None:
    """A slide on a robot that is light for its bands."""
    watch = SlideWatch(ROBOT)
    found = [watch.take(item) for item in frames(rolling, felt=since(2.175, -0.6, 0.2))]
    assert all(item.calm and item.felt for item in found[:42])
    assert not any(item.calm for item in found[43:])


def test_what_is_felt_counts_for_nothing_where_encoders_or_the_gyro_are_off() -> None:
    """For then wheels do not show how the body moves."""
    push = pushed(BODY.mass * np.array([-0.6, 0.2, 0.0]), 2.175, 9.0)
    items = frames(push, felt=since(2.175, 0.6, -0.2))

    def lost(item: ResidualFrame) -> ResidualFrame:
        off = [evolve(item.residuals[k], residual=-0.7) for k in SPEEDS]
        return evolve(item, residuals=(*item.residuals[:4], *off, *item.residuals[7:]))

    def turns(item: ResidualFrame) -> ResidualFrame:
        return evolve(item, yaw=Residual(0.3, 0.1, 0.3, "rad/s"))

    for astray in (lost, turns):
        seen = [astray(item) for item in items]
        deaf = [evolve(item, along=(UNKNOWN_FORCE, UNKNOWN_FORCE)) for item in seen]
        one, other = SlideWatch(ROBOT), SlideWatch(ROBOT)
        assert repr([one.take(item) for item in seen]) == repr([other.take(item) for item in deaf])


def test_a_slide_is_one_whatever_is_felt_of_it() -> None:
    """An accelerometer feels no more than what contacts hand on."""
    slippery = Slippery()

    def felt(time: float) -> tuple[float, float]:
        if time < 2.05:
            return 0.0, 0.0
        handed = handed_on[round(time / 0.05)]
        rims, last = (BODY.rows @ ahead(at) for at in (time, time - 0.05))
        change = BODY.to_twist @ (rims - last) / 0.05 + turned(ahead(time))
        x, y, _ = np.linalg.solve(BODY.inertia, BODY.rows.T @ handed) - change
        return float(x), float(y)

    handed_on: dict[int, Array] = {}

    def noted(time: float, of_rolling: Array, rims: Array) -> Array:
        handed_on[round(time / 0.05)] = slippery(time, of_rolling, rims)
        return handed_on[round(time / 0.05)]

    found = probabilities(frames(noted, felt=felt))
    assert (found[39 + 8 :] > 0.6).all()


def test_both_currents_leave_a_motor_its_power() -> None:
    speed, drawn = np.array([6.0, -4.0, 0.0]), np.array([12.0, 5.0, 3.0])
    both = MOTORS.both_currents(drawn, speed)
    watts = MOTORS.resistance[:, None] * both**2 + (MOTORS.constant * speed)[:, None] * both
    assert watts + MOTORS.idle[:, None] == pytest.approx(np.column_stack([drawn, drawn]))
    assert (both[:, 0] < both[:, 1]).all()
    measurement = evolve(ROBOT.measurement, quantity="motor_current")
    measured = Motors(evolve(ROBOT, measurement=measurement)).both_currents(drawn, speed)
    assert measured.tolist() == [[12.0, 12.0], [5.0, 5.0], [3.0, 3.0]]


def test_noise_of_a_measurement() -> None:
    sensors = evolve(ROBOT.sensors, current_noise=0.03, current_resolution=0.04)
    robot = evolve(ROBOT, sensors=sensors)
    assert Motors(robot).noise(robot) == pytest.approx(0.05 * robot.supply.nominal_voltage)
    robot = evolve(robot, measurement=evolve(ROBOT.measurement, quantity="motor_current"))
    assert Motors(robot).noise(robot) == pytest.approx(0.05)


def newest(contacts: Contacts, off: float = 0.0) -> Array:
    """What a second of frames without residuals says of the states, and their contacts beside."""
    judge = make_judge(ClassifierSettings())
    assert isinstance(judge, WindowJudge)
    still = np.zeros(3)
    for tick in range(20):
        item = frame(tick, np.array([3.0, -8.0, 5.0]), still, 4.0 + still)
        if off:
            residuals = list(item.residuals)
            residuals[4] = evolve(residuals[4], residual=off)
            item = evolve(item, residuals=tuple(residuals))
        judge.judge(item, 50 * MS, Unseen(), Beside(contacts))
    return judge._recent[-1]


def test_what_forces_say_by_hand() -> None:
    plain = newest(NOTHING)
    # Three times the log odds, 10 nats at most; 0.7 of it for an encoder, and these alone accuse
    # none.
    most = 3.0 * math.log(9.0)
    assert newest(Contacts(0.9))[SLIP] - plain[SLIP] == pytest.approx(most)
    assert newest(Contacts(1.0))[SLIP] - plain[SLIP] == pytest.approx(10.0)
    assert newest(Contacts(0.9))[ENCODERS].tolist() == plain[ENCODERS].tolist()
    said = said_by_forces(frame(0, np.full(3, 5.0), np.zeros(3), np.full(3, 4.0)), Contacts(0.9))
    assert said[ENCODERS] == pytest.approx(0.7 * most)
    assert said.sum() == pytest.approx(3.1 * most)
    assert newest(Contacts(0.9))[EXTERNAL] == plain[EXTERNAL]
    assert newest(Contacts(0.5)).tolist() == newest(Contacts(0.1)).tolist() == plain.tolist()
    # Where an encoder shows what it should not, the motion is in doubt.
    assert newest(Contacts(0.9), off=1.0).tolist() == newest(NOTHING, off=1.0).tolist()


def newest_beside(slides: float, outside: Outside) -> Array:
    """What a second of frames says of the states, with what is seen to act on the body."""
    judge = make_judge(ClassifierSettings())
    assert isinstance(judge, WindowJudge)
    still = np.zeros(3)
    for tick in range(20):
        item = frame(tick, np.array([3.0, -8.0, 5.0]), still, 4.0 + still)
        judge.judge(item, 50 * MS, Unseen(), Beside(Contacts(slides), outside))
    return judge._recent[-1]


def test_what_a_slope_explains_is_neither_a_load_nor_a_slip_of_wheels_that_grip() -> None:
    plain = newest_beside(0.0, NOTHING_ACTS)
    pulled = Outside(may_be_push=True)
    said = newest_beside(0.0, pulled) - plain
    assert said[[SLIP, LOADED]] == pytest.approx(-10.0)
    assert np.delete(said, [SLIP, LOADED]) == pytest.approx(0.0)
    for slides in (0.2, math.nan):
        said = newest_beside(slides, pulled) - newest_beside(slides, NOTHING_ACTS)
        assert said[LOADED] == pytest.approx(-10.0)
        assert np.delete(said, LOADED) == pytest.approx(0.0)


def borne(wheel: int, share: float, begin: float, end: float) -> Forces:
    """One wheel pushes beyond rolling, by a share of the robot's mass [N/kg]."""

    def forces(time: float, of_rolling: Array, _: Array) -> Array:
        more = share * BODY.mass if begin <= time < end else 0.0
        return of_rolling + more * np.eye(3)[wheel]

    return forces


def lone(items: list[ResidualFrame]) -> list[int | None]:
    watch = SlideWatch(ROBOT)
    return [watch.take(item).lone for item in items]


@pytest.mark.parametrize("wheel", range(3))
def test_a_wheel_that_bears_a_force_alone_is_known_after_a_fifth_of_a_second(wheel: int) -> None:
    found = lone(frames(borne(wheel, 1.5, 2.175, 3.175)))
    # The first tick in it is that of 2.2 s, number 43; four more make 0.2 s.
    assert found == [None] * 47 + [wheel] * 16 + [None] * 16


@pytest.mark.parametrize(
    "forces",
    [
        pytest.param(borne(1, 0.8, 2.175, 3.175), id="a lean on one wheel"),
        pytest.param(borne(1, 3.0, 2.175, 2.375), id="a shove on one wheel"),
        pytest.param(pushed(BODY.mass * np.array([3.0, 0.0, 0.0]), 2.2, 3.2), id="ahead"),
        pytest.param(pushed(BODY.mass * np.array([0.0, 3.0, 0.0]), 2.2, 3.2), id="sideways"),
        pytest.param(pushed(BODY.mass * np.array([0.0, 0.0, 0.5]), 2.2, 3.2), id="turned"),
    ],
)
def test_what_may_come_from_outside_no_wheel_bears_alone(forces: Forces) -> None:
    assert set(lone(frames(forces))) == {None}


def first_force(forces: Forces) -> float:
    """When a force on the body is first known to explain all [s], 9 if never."""
    watch = SlideWatch(ROBOT)
    found = [watch.take(item).force for item in frames(forces, 6.0)]
    return 0.05 * (1 + found.index(True)) if any(found) else 9.0


@pytest.mark.parametrize("azimuth", [0.6, 2.2, 4.0])
def test_a_slope_is_known_within_two_seconds(azimuth: float) -> None:
    pull = 0.6 * BODY.mass * np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    assert 2.4 < first_force(pushed(pull, 2.2, 9.0)) < 4.2


@pytest.mark.parametrize("azimuth", [1.4, 2.2, 4.0])
def test_robots_come_to_ramps(azimuth: float) -> None:
    """A gentle one is known within 1.2 s: there are always some particles that have come to it."""
    pull = 0.3 * BODY.mass * np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    assert first_force(pushed(pull, 2.2, 9.0)) < 3.4


@pytest.mark.parametrize(
    "forces",
    [
        pytest.param(rolling, id="nothing"),
        pytest.param(pushed(BODY.mass * np.array([2.0, 1.0, 0.1]), 2.2, 2.35), id="a shove"),
        pytest.param(pushed(BODY.mass * np.array([0.1, 0.05, 0.0]), 2.2, 9.0), id="hardly one"),
        pytest.param(pushed(BODY.mass * np.array([0.0, 0.0, 0.5]), 2.2, 9.0), id="a moment"),
        pytest.param(borne(1, 0.8, 2.2, 9.0), id="one wheel"),
    ],
)
def test_nothing_else_is_a_slope(forces: Forces) -> None:
    assert first_force(forces) == 9.0


def test_a_slope_is_known_for_half_a_second_more_where_the_motion_changes() -> None:
    watch = SlideWatch(ROBOT)
    items = frames(pushed(0.6 * BODY.mass * np.array([math.cos(0.6), math.sin(0.6), 0.0]), 2.2, 9))
    seen = [watch.take(item).force for item in items]
    assert seen[-1]
    watch._particles._slope[:] = 0.0  # as if there were none any more
    watch._particles._set = watch._particles._set._replace(ramps=0.0, regain=0.0)
    later = [
        watch.take(evolve(items[-1], stamp_ns=items[-1].stamp_ns + 50 * tick * MS)).force
        for tick in range(1, 15)
    ]
    assert later == [True] * 10 + [False] * 4


@pytest.mark.parametrize(
    ("mean", "std", "off", "explains", "plain"),
    [
        ((0.3, 0.4), 0.16, 1.1, True, True),
        ((0.3, 0.4), 0.17, 1.1, True, False),  # three standard deviations
        ((0.3, 0.4), 0.16, 1.3, False, True),  # a wheel's force is another
        ((0.12, 0.12), 0.01, 0.0, False, True),  # hardly any
        ((math.nan, 0.4), 0.16, 1.1, False, False),
    ],
)
def test_which_force_is_plain(
    mean: tuple[float, float], std: float, off: float, explains: bool, plain: bool
) -> None:
    pull = Pull(np.array(mean), std, off)
    assert (_explains(pull), _is_plain(pull)) == (explains, plain)


@pytest.mark.parametrize(
    ("mean", "std", "off", "known"),
    [(0.6, 0.1, 0.5, True), (0.6, 0.3, 0.5, False), (0.6, 0.1, 1.3, None), (0.1, 0.01, 0.5, None)],
)
def test_a_force_explains_before_it_is_known(
    monkeypatch: pytest.MonkeyPatch, mean: float, std: float, off: float, known: bool | None
) -> None:
    """None: it explains nothing."""
    watch = SlideWatch(ROBOT)
    pull = Pull(np.array([mean, 0.0]), std, off)
    monkeypatch.setattr(watch._particles, "pull", lambda: pull)
    awake = frames(pushed(BODY.mass * np.array([0.4, 0.3, 0.0]), 0.0, 9.0), 1.0)
    found = [watch.take(item) for item in awake][-1]
    assert (found.slopes, found.force) == (known is not None, bool(known))


@pytest.mark.parametrize(("slides", "force"), [(0.05, True), (0.5, False)])
def test_while_a_wheel_may_slide_no_force_explains_all(
    monkeypatch: pytest.MonkeyPatch, slides: float, force: bool
) -> None:
    watch, still = SlideWatch(ROBOT), np.zeros(3)
    said = Slides(still, np.eye(3), still, still, slides)
    monkeypatch.setattr(watch._particles, "slides", lambda rims: said)
    monkeypatch.setattr(watch._particles, "pull", lambda: Pull(np.array([0.6, 0.0]), 0.1, 0.5))
    awake = frames(pushed(BODY.mass * np.array([0.4, 0.3, 0.0]), 0.0, 9.0), 1.0)
    found = [watch.take(item) for item in awake][-1]
    assert (found.force, found.slopes) == (force, force)


def test_a_clock_that_begins_at_0_shows_no_slope() -> None:
    watch = SlideWatch(ROBOT)
    awake = frames(pushed(BODY.mass * np.array([0.4, 0.3, 0.0]), 0.0, 9.0), 0.4)
    items = [evolve(item, stamp_ns=item.stamp_ns - BASE) for item in awake]
    found = [watch.take(item) for item in items]
    assert not found[-1].calm
    assert not any(one.force for one in found)


def test_a_slide_is_no_slope() -> None:
    assert first_force(Slippery()) == 9.0


def test_what_drags_is_no_load_where_a_slope_explains_it() -> None:
    contacts, outside = Mock(spec=SlideWatch), Mock(spec=OutsideWatch)
    judge = Mock(spec=WindowJudge, settings=ClassifierSettings())
    judge.judge.return_value = Opinion(np.eye(18)[0], True, None, STATES[NORMAL])
    outside.take.return_value = Outside(load=True)
    classifier = FaultClassifier(judge, slides=contacts, outside=outside)
    for force in (True, False):
        contacts.take.return_value = Contacts(0.0, force=force)
        for item in frames(rolling, 6.0):
            classifier.classify(item)
        beside = judge.judge.call_args.args[3]
        assert beside.outside == Outside(load=not force, may_be_push=force)
        classifier.clear()


@pytest.mark.parametrize(
    ("seen", "called"),
    [
        (Contacts(0.0), "unknown"),
        (Contacts(0.0, force=True), "pushed"),
        (Contacts(0.0, slopes=True), "pushed"),
        (Contacts(0.0, slopes=True, felt=True), "unknown"),  # an accelerometer feels none
    ],
)
def test_what_is_far_off_on_a_slope_is_not_unknown(seen: Contacts, called: str) -> None:
    contacts = Mock(spec=SlideWatch)
    contacts.take.return_value = seen
    judge = Mock(spec=WindowJudge, settings=ClassifierSettings())
    judge.judge.return_value = Opinion(np.eye(18)[0], True, None, STATES[NORMAL])
    classifier = FaultClassifier(judge, slides=contacts)
    far = pushed(BODY.mass * np.array([0.7, 0.5, 0.0]), 2.2, 9.0)
    said = [classifier.classify(item) for item in frames(far, 6.0)]
    assert {one.state.name for one in said if one is not None} == {"normal", called}


def test_wheels_that_take_turns_bear_nothing_for_long() -> None:
    def forces(time: float, of_rolling: Array, _: Array) -> Array:
        return of_rolling + 2.0 * BODY.mass * np.eye(3)[int(time / 0.2) % 3]

    assert set(lone(frames(forces))) == {None}


def test_what_was_borne_before_a_gap_does_not_count() -> None:
    items = frames(borne(0, 1.5, 2.175, 4.0))
    gone = Residual(math.nan, BAND, 3.0)
    items[46] = evolve(
        items[46], residuals=(items[46].residuals[0], gone, *items[46].residuals[2:])
    )
    found = lone(items)
    assert found[46:52] == [None] * 6
    assert found[52:] == [0] * (len(items) - 52)


def test_what_a_wheel_bears_alone_is_no_push() -> None:
    plain, alone = newest(NOTHING), newest(Contacts(math.nan, 2))
    assert alone[EXTERNAL] - plain[EXTERNAL] == pytest.approx(-10.0)
    others = np.delete(np.arange(SLIP, EXTERNAL), 0)
    assert alone[others].tolist() == plain[others].tolist()


def unmoved(
    *, spun: float = 8.0, expected: float = 8.0, quantum: float = 1e-4, ticks: int = 20
) -> list[int | None]:
    """Of a robot whose second wheel shows from tick 5 on that it turns at `spun` [rad/s] where it
    should at `expected`, and draws what a heavy load asks of it; of a sensor's quantum [rad]."""
    robot = evolve(ROBOT, sensors=evolve(ROBOT.sensors, encoder_resolution=quantum))
    watch, found = SlideWatch(robot), list[int | None]()
    wanted = np.array([3.0, -expected, 5.0])
    for tick in range(ticks):
        item = frame(tick, wanted, np.array([0.0, 60.0 * (tick >= 5), 0.0]), np.full(3, 4.0))
        if tick >= 5:
            residuals = list(item.residuals)
            residuals[5] = evolve(residuals[5], residual=spun - expected)
            item = evolve(item, residuals=tuple(residuals))
        found.append(watch.take(item).unmoved)
    return found


def test_a_wheel_that_works_hard_and_shows_no_motion_is_known_in_two_ticks() -> None:
    assert unmoved(spun=0.0) == [None] * 6 + [1] * 14
    assert set(unmoved(spun=0.5)) == {None}  # it turns
    assert set(unmoved(spun=0.0, expected=0.9)) == {None}  # it need hardly turn
    # It may turn by what is not seen: 0.02 rad in a tick of 50 ms are 0.4 rad/s.
    assert set(unmoved(spun=0.0, quantum=0.02)) == {None}
    assert 1 in unmoved(spun=0.0, quantum=0.019)


def test_of_a_wheel_that_shows_no_motion_the_encoder_or_a_stuck_axle_is_left() -> None:
    item = frame(0, np.full(3, 5.0), np.zeros(3), np.full(3, 4.0))
    said = said_by_forces(item, Contacts(0.9, 1, 1))
    left = [ENCODERS.start + 1, DRAGS.start + 1, OTHER]
    assert not said[left].any()
    assert np.delete(said, left) == pytest.approx(-24.0)


def test_a_robot_that_slides_is_named_though_it_looks_like_a_load() -> None:
    classifier, states = FaultClassifier.of(ClassifierSettings(), ROBOT), set()
    for item in frames(Slippery(), seconds=6.0):
        diagnosis = classifier.classify(item)
        if diagnosis is not None:
            states.add(diagnosis.state.name)
    assert "slip" in states


def test_after_a_clock_goes_back_nothing_is_left_of_the_particles() -> None:
    classifier = FaultClassifier.of(ClassifierSettings(), ROBOT)
    items = frames(Slippery(), seconds=5.0)
    for item in items:
        classifier.classify(item)
    watch = classifier._slides
    assert watch is not None
    assert watch._awake_until
    classifier.classify(evolve(items[0], stamp_ns=BASE - 3_600_000 * MS))
    assert not watch._awake_until
    assert len(watch._recent) == 1
