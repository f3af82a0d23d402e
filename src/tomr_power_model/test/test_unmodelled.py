"""Learnt terms: their tables, what they do, how they stand in robot.yaml, and how they run."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels, wheel_angles, wheels_to_twist
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.commanded import CommandPath, CommandTiming, Seen
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import (
    digest_of,
    read_description,
    robot_from_parameters,
    shipped_robot,
)
from tomr_power_model.robot.held import too_steep
from tomr_power_model.unmodelled import FAMILIES, LearntTerm, Motion, motion_of
from tomr_power_model.unmodelled.described import parameters_of, terms_of
from tomr_power_model.unmodelled.motion import contacts_at
from tomr_power_model.unmodelled.online import OnlineTerms
from tomr_power_model.unmodelled.term import value_at

ROBOT = shipped_robot("reference")
NAMES = ROBOT.wheel_names
VALUES = dict(read_description("reference"))
TICK = 0.05  # s
NAN = (float("nan"),) * 3


def _motion(twist: tuple[float, float, float], seconds: float = 4.0) -> Motion:
    """A steady drive."""
    time = np.arange(0.0, seconds, 0.005)
    speed = np.tile(twist_to_wheels(ROBOT) @ np.array(twist), (len(time), 1))
    angle = speed * time[:, None]
    current = np.full_like(speed, 0.5)
    return motion_of(wheels_to_twist(ROBOT), time, speed=speed, current=current, angle=angle)


def _term(family: str, knots: list[list[float]], values: object, *wheels: int) -> LearntTerm:
    points = tuple(np.array(item) for item in knots)
    return LearntTerm(
        FAMILIES[family], wheels, points, np.atleast_2d(np.array(values, dtype=float))
    )


def test_a_table_is_linear_between_its_knots_and_fades_beyond_them() -> None:
    family = FAMILIES["torque.speed"]
    knots = (np.array([1.0, 3.0, 5.0]),)
    at = np.array([[2.0], [5.0], [6.0], [7.0], [0.0], [-9.0]])
    found = value_at(family, knots, np.array([10.0, 20.0, 40.0]), at)
    np.testing.assert_allclose(found, [15.0, 40.0, 20.0, 0.0, 5.0, 0.0])


@given(st.floats(-50.0, 50.0))
def test_a_periodic_table_has_no_end(angle: float) -> None:
    knots = (np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False),)
    rows = np.array([[angle], [angle + 2.0 * np.pi]])
    found = value_at(FAMILIES["torque.angle"], knots, np.eye(12), rows)
    np.testing.assert_allclose(found[0], found[1], atol=1e-6)
    assert found.sum(axis=1) == pytest.approx([1.0, 1.0])


def test_a_force_takes_its_power_from_the_wheels() -> None:
    """3 N along x of the world against a drive at 0.4 m/s: 1.2 W, whatever the heading."""
    motion = _motion((0.4, 0.1, 0.7))
    grid = [[-9.0, 9.0], [-9.0, 9.0]]
    term = _term("force.place", grid, [[-3.0] * 4, [0.0] * 4])
    power = (term.actions(motion).torque * motion.speed).sum(axis=1)
    np.testing.assert_allclose(power, 3.0 * motion.velocity_x[:, 0], atol=5e-3)


def _wandering() -> Motion:
    """All ways and headings for 12 s, with a stand from 5 to 6 s."""
    time = np.arange(0.0, 12.0, 0.005)
    twist = np.stack([0.4 * np.cos(time), 0.3 * np.sin(0.7 * time), 0.8 * np.cos(0.4 * time)], 1)
    speed = (twist * ~((time > 5.0) & (time < 6.0))[:, None]) @ twist_to_wheels(ROBOT).T
    current = 0.3 * speed + 0.5 * np.sin(3.0 * time)[:, None]
    return motion_of(
        wheels_to_twist(ROBOT),
        time,
        speed=speed,
        current=current,
        angle=np.cumsum(speed, 0) * 0.005,
    )


def _own_variable(name: str) -> LearntTerm:
    """A term whose table holds its variable itself, or a sine of an angle."""
    family = FAMILIES[name]
    points = [np.array([-99.0, 99.0])] * len(family.axes)
    grid = np.meshgrid(*points, indexing="ij")
    if family.axes[0].is_periodic:
        points = [np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)]
        grid = [np.sin(points[0])]
    wheels = {"torque": (0, 1, 2), "driver": (0, 1, 2)}.get(family.acts, ())
    rows = [grid[0].ravel()] * LearntTerm.rows(family, len(wheels))
    if family.acts == "force":
        rows = [grid[0].ravel(), grid[-1].ravel()]
    return LearntTerm(family, wheels, tuple(points), np.array(rows))


# What each family's term does whose table holds its variable itself: in torques N m, (n, 3), forces
# N, (n, 2), powers W. Of angles, whose tables are periodic, the table holds a wave.
FAMILY_ACTIONS: dict[str, Callable[[Motion], np.ndarray]] = {
    "driver.current": lambda m: np.abs(m.current),
    "driver.speed": lambda m: np.abs(m.speed),
    "driver.time": lambda m: np.tile(m.time, 3),
    "force.place": lambda m: np.hstack([m.x, m.y]),
    "force.time": lambda m: np.hstack([m.time, m.time]),
    "force.velocity": lambda m: np.hstack([m.velocity_x, m.velocity_y]),
    "supply.current": lambda m: np.abs(m.current).sum(axis=1),
    "supply.time": lambda m: m.time[:, 0],
    "torque.angle": lambda m: np.sin(m.angle),
    "torque.current": lambda m: m.sign * np.abs(m.current),
    "torque.direction": lambda m: m.sign * np.sin(m.direction),
    "torque.heading": lambda m: m.sign * np.sin(m.heading),
    "torque.from_rest": lambda m: m.sign * np.minimum(m.from_rest, 12.0),
    "torque.place": lambda m: m.sign * m.contact_x,
    "torque.signed_speed": lambda m: np.abs(m.sign) * m.speed,
    "torque.since_stand": lambda m: m.sign * np.minimum(m.since_stand, 8.0),
    "torque.speed": lambda m: m.sign * np.abs(m.speed),
    "torque.tight_angle": lambda m: m.sign * np.sin(m.angle),
    "torque.time": lambda m: m.sign * m.time,
    "torque.turned": lambda m: m.sign * np.minimum(m.turned, 12.0),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_each_family_acts_as_it_says(name: str) -> None:
    family, motion = FAMILIES[name], _wandering()
    found = _own_variable(name).actions(motion)
    none = np.zeros_like(motion.speed)
    expected = {"torque": none, "driver": none, "supply": none[:, 0]}
    acted = FAMILY_ACTIONS[name](motion)
    if family.acts == "force":
        expected["torque"] = motion.resisting(acted[:, 0], acted[:, 1])
    else:
        expected[family.acts] = acted
    for kind, value in expected.items():
        np.testing.assert_allclose(getattr(found, kind), value, atol=2e-4, err_msg=kind)


@pytest.mark.parametrize("name", FAMILIES)
def test_nodes_know_the_motion_as_the_fit_does(name: str) -> None:
    """Tick by tick as in a whole drive, but for how far it goes in a tick."""
    motion, term = _wandering(), _own_variable(name)
    whole = term.actions(motion)
    online, errors = OnlineTerms((term,), wheels_to_twist(ROBOT), TICK), []
    for row in range(0, len(motion.time), 10):
        given = (motion.speed[row], motion.current[row], motion.angle[row])
        found = online.over(*(part.tolist() for part in given), float(motion.heading[row, 0]))
        errors.append(
            [
                *(found.torque - whole.torque[row]),
                *(found.driver - whole.driver[row]),
                found.supply - whole.supply[row],
            ]
        )
    size = max(np.abs(part).max() for part in (whole.torque, whole.driver, whole.supply))
    assert np.median(np.abs(errors), axis=0).max() < 0.05 * size
    assert np.quantile(np.abs(errors), 0.95, axis=0).max() < 0.1 * size


def test_a_motion_is_what_it_is_in_the_world() -> None:
    """Sideways at a heading of 90 degrees is backwards along x; the direction is the robot's."""
    time = np.arange(0.0, 6.0, 0.005)
    twist = np.where((time < 1.0)[:, None], [0.0, 0.0, 0.5 * np.pi], [0.0, 0.3, 0.0])
    speed = twist @ twist_to_wheels(ROBOT).T
    angle = np.cumsum(speed, axis=0) * 0.005
    motion = motion_of(wheels_to_twist(ROBOT), time, speed=speed, current=speed, angle=angle)
    last = [motion.velocity_x[-1, 0], motion.velocity_y[-1, 0], motion.direction[-1, 0]]
    np.testing.assert_allclose(last, [-0.3, 0.0, 0.5 * np.pi], atol=5e-3)
    assert motion.time[-1, 0] == pytest.approx(5.995)


def test_place_and_heading_are_reckoned_from_the_start() -> None:
    """A quarter of a circle of 0.5 m radius to the left ends at (0.5, 0.5), heading 90 degrees."""
    seconds = 0.5 * np.pi / 0.4
    motion = _motion((0.2, 0.0, 0.4), seconds)
    ends = [motion.x[-1, 0], motion.y[-1, 0], motion.heading[-1, 0]]
    np.testing.assert_allclose(ends, [0.5, 0.5, 0.5 * np.pi], atol=5e-3)


def test_a_sticky_place_resists_each_wheel_against_its_motion() -> None:
    """0.1 N m everywhere; wheel 1 stands in a straight drive and is not resisted."""
    motion = _motion((0.4, 0.0, 0.0))
    term = _term("torque.place", [[-9.0, 9.0], [-9.0, 9.0]], [[0.1] * 4], 0, 1, 2)
    np.testing.assert_allclose(term.actions(motion).torque, 0.1 * motion.sign)
    np.testing.assert_allclose(np.abs(motion.sign[-1]), [0.0, 1.0, 1.0], atol=1e-6)


def test_wheels_touch_the_floor_a_radius_from_the_centre_each_in_its_own_direction() -> None:
    """At a heading of 90 degrees at (1, 2) all contacts have turned about (1, 2) with the body."""
    here, turned = (
        np.stack(contacts_at(wheels_to_twist(ROBOT), *np.array([[x], [y], [heading]])))[:, 0]
        for x, y, heading in ((0.0, 0.0, 0.0), (1.0, 2.0, 0.5 * np.pi))
    )
    around = wheel_angles(ROBOT)
    expected = ROBOT.robot_radius * np.stack([np.cos(around), np.sin(around)])
    np.testing.assert_allclose(here, expected, atol=1e-12)
    np.testing.assert_allclose(turned, [1.0 - here[1], 2.0 + here[0]])


def test_one_map_of_the_floor_holds_for_whichever_wheel_is_there() -> None:
    """0.1 N m beyond the line x = 0, where only the wheels in front are: 0.174 m at most."""
    motion = _motion((0.0, 0.02, 0.0), 1.0)
    floor = _term("torque.place", [[-0.5, 0.0, 0.5], [-0.5, 0.5]], [[0.0, 0.0, 0.0, 0.0, 0.1, 0.1]])
    found = evolve(floor, wheels=(0, 1, 2)).actions(motion).torque[-1]
    expected = 0.2 * np.maximum(motion.contact_x[-1], 0.0) * motion.sign[-1]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.count_nonzero(np.abs(expected) > 1e-3) in (1, 2)


def test_time_and_angle_count_since_the_last_stand() -> None:
    time = np.arange(0.0, 3.0, 0.01)
    speed = np.where((time > 1.0) & (time < 2.0), 0.0, 2.0)[:, None] * np.ones(3)
    motion = _driven(time, speed)
    assert motion.since_stand[150] == pytest.approx([0.0] * 3)
    assert motion.since_stand[-1] == pytest.approx([1.0] * 3, abs=0.02)
    assert motion.turned[-1] == pytest.approx([2.0] * 3, abs=0.04)
    assert motion.since_stand[50, 0] > 50.0  # it has not stood yet
    assert motion.from_rest[50, 0] > 50.0


def test_who_turns_about_has_stood_but_not_rested() -> None:
    """A rest of 0.3 s, 1 rad forth at 2 rad/s, 1.6 rad back at 1.6: never slow in between."""
    time = np.arange(0.0, 2.0, 0.01)
    pace = np.select([time < 0.3, time < 0.8], [0.0, 2.0], -1.6)
    motion = _driven(time, pace[:, None] * np.ones(3))
    half, last = 142, 179  # after 1.425 s where it rested, and after 1.8 s beyond it
    assert motion.since_stand[half] == pytest.approx([0.625] * 3, abs=0.03)
    assert motion.turned[half] == pytest.approx([2.0] * 3, abs=0.05)
    assert motion.from_rest[half] == pytest.approx([0.0] * 3, abs=0.05)
    assert motion.from_rest[last] == pytest.approx([0.6] * 3, abs=0.05)


def _driven(time: np.ndarray, speed: np.ndarray) -> Motion:
    angle = np.cumsum(speed, 0) * float(time[1] - time[0])
    return motion_of(wheels_to_twist(ROBOT), time, speed=speed, current=speed, angle=angle)


@pytest.mark.parametrize(
    "term",
    [
        _term("torque.speed", [[0.0, 2.0, 4.0]], [[0.01, 0.02, -0.03], [0.0, 0.1, 0.2]], 0, 2),
        _term("force.place", [[0.0, 1.0], [0.0, 0.5, 1.0]], [[1.0] * 6, [2.0] * 6]),
        _term("supply.current", [[0.0, 5.0]], [0.0, 2.0]),
    ],
    ids=lambda term: term.family.family_id,
)
def test_a_term_stands_in_a_description_and_is_read_again(term: LearntTerm) -> None:
    values = {**VALUES, **parameters_of("term_1", term, NAMES, VALUES)}
    (read,) = robot_from_parameters(values, "made").unmodelled
    assert (read.family, read.wheels) == (term.family, term.wheels)
    np.testing.assert_allclose(read.values, term.values)
    for one, other in zip(read.knots, term.knots, strict=True):
        np.testing.assert_allclose(one, other)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("version", 1, r"version = 1: only 2 is understood"),
        ("version", None, r"version = None: only 2"),
        ("robot", [17.0, 0.2, 0.05], r"robot = .* is not this one"),
        ("robot", [15.0, 0.2], r"robot = .* is not this one"),
        ("family", "torque.moon", r"unmodelled\.term_1\.family = 'torque\.moon': give one of"),
        ("wheels", ["left"], r"left is no wheel: give some of"),
        ("wheels", [], r"acts elsewhere: name them"),
        ("knots_1", [0.0, 1.0, 3.0], r"knots_1: give two knots or more, evenly spaced"),
        ("values", [0.1, 0.2], r"values: has 2 numbers: give 3"),
        ("values", ["a"], r"give a list of finite numbers"),
        ("unit", "W", r"unit = 'W': give N m"),
        ("colour", "red", r"colour is unknown: give version"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(field: str, value: object, message: str) -> None:
    term = _term("torque.speed", [[0.0, 1.0, 2.0]], [0.0, 0.1, 0.2], 1)
    values = VALUES | parameters_of("term_1", term, NAMES, VALUES)
    with pytest.raises(InputError, match=message):
        terms_of(values | {f"unmodelled.term_1.{field}": value}, NAMES, "made")


def test_a_robot_that_was_measured_anew_keeps_its_tables() -> None:
    term = _term("torque.speed", [[0.0, 1.0, 2.0]], [0.0, 0.1, 0.2], 1)
    values = VALUES | parameters_of("term_1", term, NAMES, VALUES)
    mass = values["robot.mass"]
    assert terms_of(values | {"robot.mass": 1.05 * mass}, NAMES, "made")
    with pytest.raises(InputError, match="is not this one"):
        terms_of(values | {"robot.mass": 1.15 * mass}, NAMES, "made")


def test_a_table_belongs_to_the_robot_that_it_was_learnt_on() -> None:
    term = _term("torque.speed", [[0.0, 1.0, 2.0]], [0.0, 0.1, 0.2], 1)
    another = VALUES | {"robot.mass": 20.0}
    assert terms_of(another | parameters_of("term_1", term, NAMES, another), NAMES, "made")
    with pytest.raises(InputError, match="is not this one"):
        terms_of(VALUES | parameters_of("term_1", term, NAMES, another), NAMES, "made")


def test_a_commissioning_hangs_on_every_value_of_a_table() -> None:
    line = np.linspace(-3.0, 3.0, 60).tolist()
    values = np.zeros((2, 3600))
    digests = {digest_of(ROBOT)}
    for changed in (0.0, 1e-3):
        values[1, 1800] = changed
        term = _term("force.place", [line, line], values.tolist())
        digests.add(digest_of(evolve(ROBOT, unmodelled=(term,))))
    assert len(digests) == 3


def test_a_commissioning_outlives_keys_that_came_later() -> None:
    """Until one is used: the digest of the reference robot as it was before `robot.imu_rpy`."""
    assert digest_of(ROBOT) == "4f9430fcc9ae02e6"
    assert digest_of(evolve(ROBOT, imu_rpy=(0.0, 0.0, 1.0))) != digest_of(ROBOT)


# Curves whose steepest part is 1 N m s/rad, 0.6 N m/A or 671 N s/m, scaled to what drivers hold.
@pytest.mark.parametrize("stable", [True, False])
@pytest.mark.parametrize(
    ("family", "knots", "values", "wheels"),
    [
        ("torque.speed", [[0.0, 1.0, 2.0]], [0.0, 0.0, -1.0], (0,)),
        ("torque.speed", [[1.0, 2.0, 3.0]], [8.0, 8.5, 9.5], (1,)),  # it ends, and that is all
        ("torque.signed_speed", [[-2.0, 0.0, 2.0]], [-0.1, 1.9, 1.9], (2,)),
        ("torque.current", [[0.0, 1.0, 2.0]], [0.2, 0.8, 0.6], (0,)),
        ("force.velocity", [[-0.5, 0.5], [-0.5, 0.5]],
         [[300.0, 0.0, -300.0, -600.0], [0.0] * 4], ()),
        ("force.velocity", [[-0.5, 0.5], [-0.5, 0.5]],  # either way alike
         [[335.4, 335.4, -335.4, -335.4], [335.4, -335.4, 335.4, -335.4]], ()),
    ],
)  # fmt: skip
def test_a_curve_steeper_than_the_drivers_hold_is_refused(
    family: str,
    knots: list[list[float]],
    values: list[float],
    wheels: tuple[int, ...],
    stable: bool,
) -> None:
    """By a tenth over or under what they hold."""
    size = {"torque.current": 0.6, "force.velocity": float(np.hypot(600.0, 300.0))}.get(family, 1.0)
    term = _term(family, knots, values, *wheels)
    held = _held(family)
    term = evolve(term, values=term.values * held / size * (0.9 if stable else 1.1))
    described = VALUES | parameters_of("term_1", term, NAMES, VALUES)
    if stable:
        assert robot_from_parameters(described, "made").unmodelled
        return
    with pytest.raises(InputError, match=r"learnt term 1 .* steep .* the loop would not be stable"):
        robot_from_parameters(described, "made")


def test_the_weakest_of_a_terms_wheels_has_to_hold_it() -> None:
    given = {"constants": (1.0, 3.0, 2.0), "resistances": (1.0,) * 3, "proportional": 1.0}
    for wheels, holds in (((0, 1, 2), 1.0), ((1, 2), 2.0), ((1,), 3.0)):
        for slope in (0.9 * holds, 1.1 * holds):
            term = _term("torque.current", [[0.0, 1.0]], [[0.0, slope]] * len(wheels), *wheels)
            assert bool(too_steep(term, **given, wheel_radius=0.05)) is (slope > holds)  # type: ignore[arg-type]


def _held(family: str) -> float:
    """What the drivers of the reference robot hold."""
    motor = ROBOT.motors[0]
    if family == "torque.current":
        return motor.wheel_constant
    own = motor.wheel_constant * (ROBOT.controller.proportional + motor.wheel_constant)
    own /= motor.resistance
    return own * 1.5 / ROBOT.wheel_radius**2 if family == "force.velocity" else own


def test_a_simulation_draws_and_resists_what_was_learnt() -> None:
    """A driver that draws 2 W more at any speed; a wheel that resists with 0.05 N m more."""
    draws = _term("driver.speed", [[0.0, 50.0]], [2.0, 2.0], 1)
    resists = _term("torque.speed", [[0.0, 50.0]], [0.05, 0.05], 0)
    powers = {}
    for name, terms in (("none", ()), ("draws", (draws,)), ("resists", (resists,))):
        path = CommandPath(evolve(ROBOT, unmodelled=terms), CommandTiming(50_000_000))
        path.command(0, (0.3, 0.0, 0.5))
        seen = Seen((0.0, 0.0, 0.0), NAN, 0.0)
        steps = [path.over(tick * 50_000_000, seen) for tick in range(1, 41)]
        last = steps[-1]
        assert last is not None
        powers[name] = np.mean([last.wheels(row, 1) for row in last.rows], axis=0)
        torque = last.torque[0]
        if name == "none":
            before = torque
    np.testing.assert_allclose(powers["draws"] - powers["none"], [0.0, 2.0, 0.0], atol=1e-9)
    assert abs(torque) - abs(before) == pytest.approx(0.05, rel=0.02)


def _predicted(term: LearntTerm) -> Prediction:
    """Of a node at the end of two seconds at 0.6 m/s, with encoders that follow."""
    predictor = PowerPredictor(evolve(ROBOT, unmodelled=(term,)))
    twist, found = (0.6, 0.0, 0.0), []
    speed = twist_to_wheels(ROBOT) @ np.array(twist)
    for at_ms in range(10, 2050, 10):
        if at_ms % 50 == 0:
            predictor.command(at_ms * 1_000_000, twist)
        first, second, third = (float(value) for value in 1e-3 * at_ms * speed)
        predictor.encoders(at_ms * 1_000_000, (first, second, third), (*NAN,))
        found += predictor.due()
    return found[-1]


def test_a_node_has_what_was_learnt_in_the_power_of_both_paths_and_of_the_whole() -> None:
    """2 W at a driver, 0.05 N m at a wheel, 3 W at the supply; nothing."""
    anywhere = [[0.0, 50.0]]
    none, draws, resists, supply = (
        _predicted(term)
        for term in (
            _term("driver.speed", anywhere, [0.0, 0.0], 1),
            _term("driver.speed", anywhere, [2.0, 2.0], 1),
            _term("torque.speed", anywhere, [0.05, 0.05], 1),
            _term("supply.current", anywhere, [3.0, 3.0]),
        )
    )

    def more(found: Prediction) -> tuple[list[float], list[float], float]:
        paths = [
            [one.power - other.power for one, other in zip(mine, plain, strict=True)]
            for mine, plain in (
                (found.motors, none.motors),
                (found.from_encoders, none.from_encoders),
            )
        ]
        return paths[0], paths[1], found.total.power - none.total.power

    for commanded, measured, total, expected in (
        (*more(draws), 2.0),
        (*more(supply), 0.0),
    ):
        assert commanded == pytest.approx([0.0, expected, 0.0], abs=1e-3)
        assert measured == pytest.approx([0.0, expected, 0.0], abs=1e-3)
        assert total == pytest.approx(expected or 3.0, abs=1e-2)
    # 0.05 N m at 10.4 rad/s, and the copper loss of its current.
    commanded, measured, _ = more(resists)
    assert measured[1] == pytest.approx(commanded[1], rel=0.02)
    assert measured[1] > 0.05 * 0.6 * np.sqrt(0.75) / 0.05
    assert abs(measured[0]) + abs(measured[2]) < 0.01


def test_beyond_its_table_a_term_fades_and_says_so() -> None:
    term = _term("torque.speed", [[0.0, 1.0, 2.0]], [[0.1] * 3] * 3, 0, 1, 2)
    inside, outside = _motion((0.02, 0.0, 0.0)), _motion((0.6, 0.0, 0.0))
    assert term.outside(inside) == 0.0
    assert term.outside(outside) > 0.5
    online = OnlineTerms((term,), wheels_to_twist(ROBOT), TICK)
    speed = twist_to_wheels(ROBOT) @ np.array([0.6, 0.0, 0.0])
    found = online.over(speed.tolist(), (0.0,) * 3, NAN, 0.0)
    assert found.outside == ("torque.speed",)
    assert found.torque[1] == 0.0


def test_where_an_angle_is_not_known_nothing_ripples_and_nothing_fades() -> None:
    """As an effect's ripple; the wheel whose angle is known ripples on."""
    knots = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False).tolist()
    term = _term("torque.angle", [knots], [[0.3] * 12] * 3, 0, 1, 2)
    online = OnlineTerms((term,), wheels_to_twist(ROBOT), TICK)
    found = online.over((1.0, 1.0, 1.0), (0.0,) * 3, (NAN[0], 2.0, NAN[0]), 0.0)
    assert list(found.torque) == pytest.approx([0.0, 0.3, 0.0])
    assert found.outside == ()


def test_a_term_is_outside_where_its_own_wheel_is() -> None:
    """Straight on wheel 1 stands, within the table that the others are beyond."""
    motion = _motion((0.6, 0.0, 0.0))
    assert _term("torque.speed", [[0.0, 1.0, 2.0]], [[0.1] * 3], 0).outside(motion) == 0.0
    assert _term("torque.speed", [[0.0, 1.0, 2.0]], [[0.1] * 3], 1).outside(motion) == 1.0


def test_nodes_say_once_a_term_fades_and_once_it_is_back() -> None:
    """Slow, fast and slow again, with a table that ends between."""
    term = _term("torque.speed", [[0.0, 4.0, 8.0]], [[0.01] * 3], 1)
    predictor = PowerPredictor(evolve(ROBOT, unmodelled=(term,)))
    said = []
    for at_ms in range(0, 5950, 50):
        speed = 0.6 if 2000 <= at_ms < 4000 else 0.2
        predictor.command(at_ms * 1_000_000, (speed, 0.0, 0.0))
        predictor.due()
        said += [report.statuses[-1] for report in predictor.reports()]
    assert {status.name for status in said} == {"inputs: learnt terms"}
    words = [(status.level, status.message) for status in said]
    inside = (Level.OK, "within their tables")
    beyond = (Level.WARN, "fading beyond the table of torque.speed")
    changed = [later for earlier, later in pairwise([None, *words]) if earlier != later]
    assert changed == [inside, beyond, inside]
    assert len(said) == 8  # each second, and at both changes


def test_a_robot_without_learnt_terms_says_nothing_of_them() -> None:
    predictor = PowerPredictor(ROBOT)
    for at_ms in range(0, 500, 50):
        predictor.command(at_ms * 1_000_000, (0.2, 0.0, 0.0))
        predictor.due()
    assert [len(report.statuses) for report in predictor.reports()] == [1]
