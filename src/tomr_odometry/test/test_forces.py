"""What the odometry makes of its wheels' forces: creep, and slides where there is no IMU."""

import math
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from odometry_drives import ROBOT, START, Recorded, drive, play

from tomr_odometry.creep import Creep
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.kernel import CREEP, RIM, WZ
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.traction import Traction
from tomr_odometry.unaided import Unaided
from tomr_power_model.slides.body import body_of
from tomr_power_model.slides.particles import Pair, Slides

Array = NDArray[np.float64]
SETTINGS = OdometrySettings(creep=Creep((0.5, 1.0, 1.5), 0.0, 0.05))


@cache
def recorded() -> Recorded:
    return drive(length=3.0)


def without_the_first(time: float, topic: str, message: Any) -> Any:
    return None if topic == "wheel_1/power" and time > 2.0 else message


def test_wheels_creep_as_their_traction_and_the_travel_ask() -> None:
    """Ground at 0.31, -0.29 and 0.01 m/s: a robot that travels at sqrt(0.12) m/s, and turns."""
    core = SlipOdometry(ROBOT, SETTINGS)
    for sample in range(6):
        core.encoders(START + 10_000_000 * sample, (0.01 * sample,) * 3, (0.0, 0.0, 0.0))
    list(core.due())
    core._used.value, core._x[CREEP] = np.array([0.1, 0.2, -0.01]), 2.0
    *core._travel[:], core._x[WZ] = core._body.to_twist @ np.array([0.31, -0.29, 0.01])
    item, creep = core._estimate(core._time), math.sqrt(0.12) * np.array([0.1, 0.4, -0.03])
    assert item.creeping == pytest.approx(creep)
    assert item.sliding == pytest.approx(creep)
    # Over the larger of rim and ground; a ratio to next to nothing says nothing.
    assert item.slip == pytest.approx([creep[0] / (0.31 + creep[0]), creep[1] / 0.29, 0.0])


def test_a_robot_that_creeps_comes_less_far() -> None:
    plain, creeping = (list(play(recorded(), settings=given))[-1] for given in (None, SETTINGS))
    assert creeping.pose[0] < plain.pose[0] - 0.001


def test_a_force_is_forgotten_when_its_power_is_silent() -> None:
    last = list(play(recorded(), without_the_first))[-1]
    assert np.isnan(last.traction).tolist() == [True, False, False]


def test_the_forces_of_powers_that_are_heard_are_kept() -> None:
    core = SlipOdometry(ROBOT)
    core._heard = {"encoders": START, "power 1": START}
    core._tractive = [Traction(START, 1, 3.0, 2.0, 5.0, ((3.0, -9.0), (2.0, 2.0)), 0.0)]
    core._keep_forces(0.01)
    assert core._forces[1] == 3.0
    assert core._force_std[1] == 2.0
    assert np.isnan(core._forces[[0, 2]]).all()
    used = core._used.value
    assert used[0] == used[2] == 0.0 < used[1]


def test_creep_goes_by_forces_that_are_held_against_the_motion_of_the_wheels() -> None:
    core = SlipOdometry(ROBOT)
    core._heard = {"encoders": START} | {f"power {wheel}": START for wheel in range(3)}
    core._forces = np.array([4.0, 2.0, 0.0])
    for sample in range(12):  # wheels that stand: nothing turns the robot
        core._tractions.encoders(START + 10_000_000 * sample, (0.0, 0.0, 0.0))
    assert core._tractions.speeds is not None
    core._tractive = [Traction(START, 0, 4.0, 2.0, 5.0, ((4.0, -9.0), (2.0, 1.0)), 0.0)]
    core._keep_forces(1e3)
    assert core._used.value * core._body.load == pytest.approx([3.0, 1.0, -1.0])


def test_without_an_imu_the_force_reported_is_the_one_that_the_slides_speak_for() -> None:
    core = SlipOdometry(ROBOT)
    core._tractive = [Traction(START, 1, 3.0, 2.0, 5.0, ((3.0, -9.0), (2.0, 1.0)), 0.0)]
    core._forces = np.array([1.0, 3.0, 1.0])
    core._tractions = SimpleNamespace(speeds=np.zeros(3))  # type: ignore[assignment]
    core._by_power = SimpleNamespace(  # type: ignore[assignment]
        force=np.full(3, -8.0), step=lambda *given: None
    )
    core._ask_power(0.01)
    assert core._forces.tolist() == [1.0, -9.0, 1.0]
    assert core._force_std[1] == 1.0


def test_what_the_slides_leave_open_of_the_twist_is_in_its_covariance() -> None:
    core = SlipOdometry(ROBOT)
    for sample in range(12):
        core.encoders(START + 10_000_000 * sample, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        list(core.due())
    before = core._estimate(core._time).twist_covariance
    core._by_power.covariance = np.diag([0.1, 0.2, 0.3])
    after = core._estimate(core._time).twist_covariance
    assert np.diag(after - before) == pytest.approx([0.1, 0.2, 0.3])


def test_slides_are_looked_for_from_the_motion_with_which_an_imu_leaves_off() -> None:
    body, radius = body_of(ROBOT)
    by_power, twist = Unaided(ROBOT, body, radius), np.array([0.5, 0.2, 0.3])
    by_power.step(0.02, np.zeros(3), np.zeros(3), [])
    by_power.rest()
    by_power.step(0.02, twist, body.rows @ twist, [])
    assert by_power.probability.max() < 0.05


class Watched:
    """Particles that keep what they are given."""

    def __init__(self) -> None:
        self.taken: list[tuple[int, Pair]] = []
        self.steps: list[float] = []

    def start(self, twist: Array) -> None:
        self.taken.clear()

    def take(self, wheel: int, either: Pair) -> None:
        self.taken.append((wheel, either))

    def step(self, dt: float, rims: Array) -> bool:
        self.steps.append(dt)
        return False


def test_powers_count_as_what_they_say_beyond_rolling() -> None:
    """Of two readings of wheel 2 the mean, on top of what these rims' acceleration takes."""
    body, radius = body_of(ROBOT)
    by_power, particles = Unaided(ROBOT, body, radius), Watched()
    by_power._particles = particles  # type: ignore[assignment]
    ahead = np.array([1.0, 0.0, 0.0])

    def reading(force: float, rolling: float, speed: float = 5.0) -> Traction:
        return Traction(START, 1, force, 0.2, speed, ((force, -90.0), (0.2, 0.4)), rolling)

    by_power.step(0.0, np.zeros(3), np.zeros(3), [])
    by_power.step(0.025, np.zeros(3), 0.01 * body.rows @ ahead, [reading(3.0, 1.0)])
    assert not particles.steps
    still = reading(50.0, 0.0, speed=0.1)  # dry friction hides what it hands on
    by_power.step(0.025, np.zeros(3), 0.02 * body.rows @ ahead, [reading(6.0, 2.0), still])
    assert particles.steps == [pytest.approx(0.05)]
    ((wheel, (forces, stds)),) = particles.taken
    # 0.4 m/s^2 of 15 kg, at two wheels of three and at 30 degrees.
    rolls = 0.4 * 15.0 / (2.0 * np.cos(np.pi / 6.0)) * np.sign(body.rows[1, 0])
    assert wheel == 1
    assert forces == pytest.approx((rolls + (2.0 + 4.0) / 2.0, rolls - 90.0 - 1.5), rel=1e-3)
    assert stds == pytest.approx((0.2, 0.4))


class Scripted(Watched):
    """Particles that say what they are told to, and keep what they are asked."""

    def __init__(self, sliding: list[float]) -> None:
        super().__init__()
        self.sliding, self.ways, self.settled = sliding, list[tuple[Array, Array]](), 0

    def step(self, dt: float, rims: Array) -> bool:
        return True

    def slides(self, rims: Array) -> Slides:
        share, nothing = self.sliding.pop(0), np.zeros(3)
        return Slides(nothing, np.eye(3), nothing, np.full(3, share), share)

    def part(self, dt: float, rims: Array, rolled: Array, taken: Array, keep: float) -> None:
        self.ways.append((rolled, taken))
        assert keep == pytest.approx(math.exp(-dt / 5.0))

    def settle(self) -> Array:
        self.settled += 1
        return np.array([0.1 * self.settled, 0.0, 0.0])


def test_the_pose_is_corrected_while_wheels_slide_and_for_some_time_after() -> None:
    """Not before: where wheels grip the pose is theirs."""
    body, radius = body_of(ROBOT)
    ahead = np.array([1.0, 0.0, 0.0])
    by_power, particles = Unaided(ROBOT, body, radius), Scripted([0.2, 0.9, *[0.0] * 120])
    by_power._particles = particles  # type: ignore[assignment]
    corrected = []
    for _ in range(122):
        by_power.step(0.05, np.zeros(3), body.rows @ ahead, [])
        corrected.append(by_power.correction is not None)
    assert corrected[0] is False
    assert 98 <= sum(corrected) == particles.settled <= 101  # 5 s
    # What was rolled; taken was the same until they said that it slides, then nothing.
    taken = [(rolled[0], way[0]) for rolled, way in particles.ways[1:4]]
    assert np.array(taken) == pytest.approx(np.array([[0.05, 0.05], [0.05, 0.0], [0.05, 0.05]]))
    particles.sliding.append(0.9)
    by_power.step(0.05, np.zeros(3), body.rows @ ahead, [])
    by_power.rest()
    assert by_power.correction is None
    for share, is_corrected in ((0.0, False), (0.4, True)):  # begun anew nothing has slid yet
        particles.sliding.append(share)
        by_power.step(0.05, np.zeros(3), body.rows @ ahead, [])
        assert (by_power.correction is not None) == is_corrected


def test_wheels_may_come_to_a_patch_alone() -> None:
    by_power = Unaided(ROBOT, *body_of(ROBOT))
    for _ in range(40):
        by_power.step(0.05, np.zeros(3), np.full(3, 0.1), [])
    assert np.ptp(by_power._particles._traction, axis=1).any()


def test_a_correction_moves_the_pose_along_its_heading() -> None:
    core = SlipOdometry(ROBOT)
    for sample in range(4):
        core.encoders(START + 10_000_000 * sample, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        list(core.due())
    before = core._x[:3].copy()
    core._x[2] += 0.5 * np.pi
    core._by_power = SimpleNamespace(  # type: ignore[assignment]
        slid=np.zeros(3), rest=lambda: None, probability=np.zeros(3),
        correction=np.array([0.3, 0.1, 0.2]),
    )  # fmt: skip
    core._heard["encoders"] = core._time
    core._step(core._time + 10_000_000, np.stack([core._x[RIM : RIM + 3], np.full(3, 1e-8)]))
    off = 0.5 * np.pi + 0.1  # half of what it turned
    way = [0.3 * np.cos(off) - 0.1 * np.sin(off), 0.3 * np.sin(off) + 0.1 * np.cos(off)]
    assert core._x[:2] - before[:2] == pytest.approx(way, abs=1e-6)
    assert core._x[2] - before[2] == pytest.approx(0.5 * np.pi + 0.2, abs=1e-6)


def test_power_alone_says_sooner_that_a_wheel_slides() -> None:
    core = SlipOdometry(ROBOT)
    core._by_power.probability = core._mode[:3] = np.array([0.4, 0.2, 0.6])
    assert core._slides.tolist() == [True, False, True]
    core._is_aided = True
    assert core._slides.tolist() == [False, False, True]


def test_what_power_alone_says_to_slide_has_a_slip_ratio_and_a_place_on_the_floor() -> None:
    core, rims = SlipOdometry(ROBOT), np.array([0.5, 0.5, 0.5])  # m/s
    for sample in range(6):
        first, second, third = (0.01 * sample * rims / ROBOT.wheel_radius).tolist()
        core.encoders(START + 10_000_000 * sample, (first, second, third), (0.0, 0.0, 0.0))
    list(core.due())
    seen: list[list[bool]] = []
    core.floor.take = lambda pose, sliding, force: seen.append(sliding.tolist())  # type: ignore[method-assign]
    core._by_power.rest = lambda: None  # type: ignore[method-assign]
    core._by_power.probability = np.array([0.4, 0.2, 0.0])
    sliding, slip = core._slip(np.full(3, 0.1), np.zeros(3))
    assert sliding == pytest.approx([0.4, 0.0, 0.0])
    assert slip == pytest.approx([0.8, 0.0, 0.0])
    core._step(core._time + 10_000_000, np.stack([core._x[RIM : RIM + 3], np.full(3, 1e-8)]))
    assert seen == [[True, False, False]]
