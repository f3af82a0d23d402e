"""Slides estimated from power alone, against hand-worked floors."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of
from tomr_power_model.slides.particles import Felt, Pair, Particles, ParticleSettings, Slides

Array = NDArray[np.float64]
BODY, _ = body_of(shipped_robot("reference"))
FRICTION = np.full(3, 1.0)  # N
STEP = 0.02  # s
SHARE = 0.12  # traction coefficient of the slippery floor
FORWARD = np.array([1.0, 0.0, 0.0])
Forces = Callable[[int, float], float]  # force of a wheel at a time [N]


def either(force: float, first: bool = True) -> Pair:
    """A power that leaves two forces, on either side of that at which it is least."""
    other = -300.0 - force
    pair = (force, other) if first else (other, force)
    return pair, (0.2, 0.2)


def played(
    rims: Callable[[float], Array],
    force: Forces | None,
    seconds: float,
    first: bool = True,
    settings: ParticleSettings | None = None,
    times: int = 1,
) -> tuple[Slides, Array]:
    """What the particles say after some seconds, and the rims' speeds then."""
    particles, time = Particles(BODY, FRICTION, 0.0, settings), 0.0
    while time < seconds:
        time += STEP
        for wheel in times * [0, 1, 2]:
            if force is not None:
                particles.take(wheel, either(force(wheel, time), first=first))
        assert particles.step(STEP, rims(time))
    return particles.slides(rims(time)), rims(time)


def rolling(acceleration: float) -> tuple[Callable[[float], Array], Forces]:
    """Rims and forces of wheels that roll, forward at a constant acceleration [m/s^2]."""
    forces = np.linalg.solve(BODY.rows.T, BODY.inertia @ (acceleration * FORWARD))
    return (
        lambda time: BODY.rows @ (acceleration * time * FORWARD),
        lambda wheel, time: float(forces[wheel]),
    )


def spinning(speed: float = 1.5) -> tuple[Callable[[float], Array], Forces, float]:
    """Rims at full speed at once on a slippery floor, their limits as forces, and what follows.

    Two wheels pull with the traction coefficient times their loads, at 30 degrees to the motion:
    0.12 * 15 kg / 3 * 9.81 m/s^2 * 2 cos(30 deg) / 15 kg = 0.68 m/s^2. The third does not turn.
    """
    rims = BODY.rows @ (speed * FORWARD)
    forces = SHARE * BODY.load * np.sign(np.round(rims, 9))
    acceleration = float(np.linalg.solve(BODY.inertia, BODY.rows.T @ forces)[0])
    return lambda time: rims, lambda wheel, time: float(forces[wheel]), acceleration


def test_a_body_on_a_slippery_floor_gains_what_its_traction_gives_it() -> None:
    rims, force, acceleration = spinning()
    found, _ = played(rims, force, 0.8, settings=ParticleSettings(dragging=0.0))
    assert acceleration == pytest.approx(0.68, abs=0.005)
    assert found.twist[0] == pytest.approx(0.8 * acceleration, rel=0.2)
    assert abs(found.twist[1]) < 0.05
    assert found.any_probability > 0.9
    turning = np.abs(rims(0.0)) > 0.1
    assert (found.probability[turning] > 0.9).all()


def test_wheels_whose_forces_are_those_of_rolling_grip() -> None:
    rims, force = rolling(0.8)
    found, last = played(rims, force, 0.8)
    assert found.any_probability < 0.1
    assert found.twist == pytest.approx(BODY.to_twist @ last, abs=0.02)


def test_which_of_the_two_forces_comes_first_does_not_count() -> None:
    rims, force, _ = spinning()
    one, other = (played(rims, force, 0.4, first=first)[0] for first in (True, False))
    assert one.twist.tolist() == other.twist.tolist()


def test_power_that_is_measured_more_often_is_no_more_evidence() -> None:
    rims, force, _ = spinning()
    one, other = (played(rims, force, 0.4, times=times)[0] for times in (1, 3))
    assert one.twist == pytest.approx(other.twist, abs=1e-9)


def test_the_same_messages_give_the_same_numbers() -> None:
    rims, force, _ = spinning()
    one, other = (played(rims, force, 0.3)[0] for _ in range(2))
    assert one.twist.tolist() == other.twist.tolist()


def test_without_power_no_wheel_is_said_to_slide() -> None:
    for rims in (rolling(0.8)[0], spinning()[0]):
        found, _ = played(rims, None, 2.0)
        assert found.any_probability < 0.5


def test_wheels_find_their_grip_again() -> None:
    """The floor is slippery for half a second, and then the forces are those of rolling."""
    rims, limits, _ = spinning(0.3)
    found, last = played(rims, lambda wheel, time: limits(wheel, time) if time < 0.5 else 0.0, 3.0)
    assert found.any_probability < 0.2
    assert found.twist == pytest.approx(BODY.to_twist @ last, abs=0.03)


def test_a_robot_whose_wheels_stand_does_not_slide_off() -> None:
    """On a floor that may slope: there forces show nothing, and particles would run away."""
    particles = Particles(BODY, FRICTION, 0.0, ParticleSettings(sloping=1.0, slope=1.0))
    for _ in range(500):
        particles.step(STEP, np.zeros(3))
    found = particles.slides(np.zeros(3))
    assert found.any_probability < 0.3
    assert np.abs(found.twist).max() < 0.1


def test_where_wheels_stand_the_robot_comes_to_rest() -> None:
    """Else on a slippery slope it would slide down for as long as nothing moves."""
    speeds = []
    for rate in (0.0, 2.0):
        settings = ParticleSettings(
            gripping=0.0, sloping=1.0, slope=1.0, regain=0.0, new_floor=0.0, comes_to_rest=rate
        )
        particles = Particles(BODY, FRICTION, 0.0, settings)
        for _ in range(200):
            particles.step(STEP, np.zeros(3))
        speeds.append(float(np.abs(particles._twist).mean()))
    assert speeds[1] < 0.3 * speeds[0]


def test_wheels_that_find_their_grip_may_do_so_on_a_slope_or_with_drag() -> None:
    """A slide that was none leaves no particle that knows of these."""
    settings = ParticleSettings(sloping=0.0, dragging=0.0, regain=50.0, otherwise=0.5)
    particles = Particles(BODY, FRICTION, 0.0, settings)
    assert particles.step(STEP, np.zeros(3))
    steep = np.hypot(*particles._slope.T) > 0.3
    assert 0.25 < steep.mean() < 0.5  # of half of them, those beyond 0.3 of 0.4 m/s^2
    assert 0.4 < (particles._drag > 1e-3).mean() < 0.6


def _alike(traction: float, twist: Array) -> Particles:
    """Particles of one floor that is level and on which nothing drags."""
    settings = ParticleSettings(
        regain=0.0, new_floor=0.0, wander=0.0, comes_to_rest=0.0, walk_slope=0.0, walk_twist=0.0
    )
    particles = Particles(BODY, FRICTION, 0.0, settings)
    particles.start(twist)
    particles._traction[:], particles._slope[:], particles._drag[:] = traction, 0.0, 0.0
    return particles


def test_a_slope_pulls_downhill_in_the_world_and_drag_against_the_rollers() -> None:
    particles = _alike(1.0, np.array([1.0, 0.0, 0.0]))
    particles._slope[:] = 0.3, 0.0
    particles._yaw[:] = 0.5 * math.pi  # the robot looks to the left of downhill
    assert sum(particles._wrenches())[0] == pytest.approx([0.0, -0.3 * BODY.mass, 0.0], abs=1e-9)
    particles._slope[:] = 9.0, 0.0  # more than the floor holds: 0.7 of its traction
    particles._yaw[:] = 0.0
    assert sum(particles._wrenches())[0, 0] == pytest.approx(0.7 * 9.81 * BODY.mass, rel=1e-3)
    particles._slope[:] = 0.0
    particles._drag[:] = 0.1
    # Forward, one wheel's rollers turn at full speed and two at half of it: along the axles 1 and
    # 1/2; each drags with a tenth of its load, and of two of them half of that is forward.
    load = 0.1 * BODY.mass * 9.81 / 3.0
    assert sum(particles._wrenches())[0] == pytest.approx(
        [-2.0 * load, 0.0, 0.0], rel=1e-3, abs=1e-6
    )


def test_without_traction_a_body_that_turns_keeps_its_way_in_the_world() -> None:
    particles = _alike(0.0, np.array([0.5, 0.0, 1.0]))
    particles._traction[:] = 0.0
    particles._move(0.02, np.zeros(3))
    assert particles._twist[0] == pytest.approx([0.5, -0.5 * 0.02, 1.0])
    assert particles._yaw[0] == pytest.approx(0.02)


def test_steps_wait_for_enough_time_and_are_never_long() -> None:
    particles = Particles(BODY, FRICTION, 0.0)
    assert not particles.step(0.01, np.zeros(3))
    assert particles.step(0.01, np.zeros(3))
    start = np.array([0.0, 0.5, 0.0])
    particles.start(start)
    particles._slope[:] = 0.0
    assert particles.step(60.0, np.zeros(3))  # a tenth of a second of braking at most
    assert particles._twist[:, 1].max() > 0.4


def test_coarse_counts_that_shake_the_motors_count_less() -> None:
    """Forces that lack half of what rolling takes, smooth and shaken."""
    rims, force = rolling(1.2)

    def found(shake: float) -> Slides:
        def shaken(wheel: int, time: float) -> float:
            return 0.5 * force(wheel, time) + shake * math.cos(math.pi * time / STEP)

        return played(rims, shaken, 0.8)[0]

    assert found(20.0).any_probability < 0.5 < found(0.0).any_probability


def test_a_gyro_decides_which_particles_live_on() -> None:
    """Of those that slide without traction, one half turns and the other does not."""
    found = []
    for rate in (0.0, 1.0):
        particles = _alike(0.02, np.array([0.5, 0.0, 0.0]))
        particles._twist[::2, 2] = 1.0
        for _ in range(10):
            particles.turns(rate, 0.1)
            particles.step(STEP, BODY.rows @ np.array([0.5, 0.0, 0.5]))
        found.append(particles.slides(np.zeros(3)).twist[2])
    assert found[0] < 0.4
    assert found[1] > 0.6


def test_a_rate_of_the_gyro_counts_for_one_step() -> None:
    particles = _alike(0.0, np.zeros(3))
    particles._twist[:, 2] = np.linspace(0.0, 0.5, len(particles._twist))
    particles.turns(0.2, 0.5)
    particles.step(STEP, np.zeros(3))
    before = particles._weight.copy()
    assert before.std() > 0.0
    particles.step(STEP, np.zeros(3))
    assert particles._weight == pytest.approx(before)


def test_particles_that_are_drawn_again_keep_their_shoves() -> None:
    particles = Particles(BODY, FRICTION, 0.0)
    number = np.arange(len(particles._twist))
    particles._twist[:, 0], particles._shove[:, 0] = number, number
    particles._weight = number / number.sum()
    particles._draw()
    assert particles._shove[:, 0].tolist() == particles._twist[:, 0].tolist()
    assert particles._shove[:, 0].mean() > 1.2 * number.mean()


def test_shoves_come_and_go() -> None:
    settings = ParticleSettings(shoved=1.0, shove=2.0, shove_ends=5.0)
    particles = Particles(BODY, FRICTION, 0.0, settings)
    for _ in range(400):
        particles.step(STEP, np.zeros(3))
    hit = particles._shove.any(axis=1)
    # One in a second that lasts a fifth of it: a sixth of the time, 2 N per kg in each direction.
    assert hit.mean() == pytest.approx(1.0 / 6.0, abs=0.05)
    assert particles._shove[hit].std() == pytest.approx(2.0 * BODY.mass, rel=0.15)
    particles._slope[:], particles._drag[:] = 0.0, 0.0
    assert sum(particles._wrenches())[:, :2] == pytest.approx(particles._shove)
    assert not Particles(BODY, FRICTION, 0.0)._shove.any()


def test_ramps_come_and_go() -> None:
    """One in a second, for ten seconds, steep and less steep; without them a slope stays."""
    settings = ParticleSettings(ramps=1.0, slope=0.5, walk_slope=0.0, regain=0.0)
    sloping, level = (
        Particles(BODY, FRICTION, 0.0, settings),
        Particles(BODY, FRICTION, 0.0, settings._replace(ramps=0.0)),
    )
    for particles in (sloping, level):
        particles._slope[:] = [3.0, 0.0]
        for _ in range(500):
            particles.step(STEP, np.zeros(3))
    assert (level._slope == [3.0, 0.0]).all()
    changed = sloping._slope[:, 0] != 3.0
    assert changed.mean() > 0.99
    assert sloping._slope[changed].std() == pytest.approx(0.5, rel=0.15)


def test_what_pulls_by_hand() -> None:
    particles = Particles(BODY, FRICTION, 0.0)
    particles._weight[:] = 0.0
    particles._weight[:2] = [0.25, 0.75]
    particles._slope[:2] = [[0.4, 0.2], [0.8, 0.2]]
    particles._off[:2] = [[0.0, 2.0, 1.0], [0.0, 0.0, 1.0]]
    assert particles.pull().off == 0.0  # no force is known
    particles._is_heard[:] = [True, False, True]
    pull = particles.pull()
    assert pull.mean == pytest.approx([0.7, 0.2])
    assert pull.std == pytest.approx(0.4 * np.sqrt(0.25 * 0.75))
    assert pull.off == pytest.approx(1.0)
    particles._is_heard[1] = True
    assert particles.pull().off == pytest.approx(1.0)
    particles._off[0, 1] = 4.0
    assert particles.pull().off == pytest.approx(2.0)


def test_wheels_are_heard_whose_power_was_measured_in_the_last_step() -> None:
    particles = Particles(BODY, FRICTION, 0.0)
    heard = []
    for wheels in ([0, 2], [1], []):
        for wheel in wheels:
            particles.take(wheel, either(0.0))
        particles.step(STEP, np.zeros(3))
        heard.append(particles._is_heard.tolist())
    assert heard == [[True, False, True], [False, True, False], [False] * 3]


@pytest.mark.parametrize("is_felt", [False, True])
def test_a_slope_that_is_felt_is_known_at_once(is_felt: bool) -> None:
    """0.5 N/kg along x for 0.24 s: wheels at a steady speed hold it, and it feels what they do."""
    particles = Particles(BODY, FRICTION, 0.0, ParticleSettings(ramps=0.1, shoved=1.0))
    particles.start(FORWARD)
    pull, rims = np.array([0.5, 0.0]), BODY.rows @ FORWARD
    holding = np.linalg.solve(BODY.rows.T, np.array([*(-BODY.mass * pull), 0.0]))
    for tick in range(62):
        is_on = tick >= 50
        for wheel in range(3):
            particles.take(wheel, either(float(holding[wheel]) * is_on))
        if is_felt:
            particles.feels(Felt(force=-pull * is_on, std=np.full(2, 0.1), pull=pull * is_on))
        assert particles.step(STEP, rims)
    found = particles.pull()
    assert (np.hypot(*(found.mean - pull)) < 0.15) == is_felt


def test_a_steep_slope_explains_less_of_what_is_felt_than_a_gentle_one() -> None:
    """As slopes are spread: by exp(-1/2) at a standard deviation, exp(-8) at four."""
    for pull, share in ((0.4, math.exp(-0.5)), (1.6, math.exp(-8.0))):
        particles = Particles(BODY, FRICTION, 0.0, ParticleSettings(ramps=0.1))
        before = particles._weight.copy()
        felt = np.array([pull, 0.0])
        particles._explain(0.5, Felt(force=-felt, std=np.full(2, 0.1), pull=felt))
        changed = particles._weight != before
        assert 0.05 < changed.mean() < 0.15  # 0.2 a second
        assert particles._weight[changed] == pytest.approx(share * before[changed])
        assert np.abs(particles._slope[changed].mean(axis=0) - felt).max() < 0.1


def test_particles_carry_where_they_have_the_body() -> None:
    """Half of them hold that it stood while its rims went on by 0.1 m and it was taken to roll."""
    ahead = np.array([1.0, 0.0, 0.0])
    particles = _alike(1.0, ahead)
    n = len(particles._twist)
    particles._twist[: n // 2] = 0.0
    way = 0.1 * ahead
    particles.part(0.1, BODY.rows @ ahead, way, way, keep=1.0)
    assert particles.settle() == pytest.approx([-0.05, 0.0, 0.0])
    assert particles.settle() == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    # Those that hold that it stood turn out to be right: the rest of the way comes off.
    particles._weight[:] = np.where(np.arange(n) < n // 2, 2.0 / n, 0.0)
    assert particles.settle() == pytest.approx([-0.05, 0.0, 0.0])


def test_what_particles_are_apart_is_forgotten() -> None:
    ahead = np.array([1.0, 0.0, 0.0])
    particles = _alike(1.0, np.zeros(3))
    particles.part(0.1, BODY.rows @ ahead, 0.1 * ahead, 0.1 * ahead, keep=1.0)
    particles._twist[:] = ahead
    particles.part(0.1, BODY.rows @ ahead, 0.1 * ahead, 0.1 * ahead, keep=0.5)
    assert particles.settle() == pytest.approx([-0.05, 0.0, 0.0])


def test_a_turn_that_was_a_slide_turns_the_way_since() -> None:
    """A robot that did not turn by 90 degrees has gone ahead, not to its left."""
    turn, ahead = np.array([0.0, 0.0, 0.5 * math.pi]), np.array([1.0, 0.0, 0.0])
    particles = _alike(1.0, np.zeros(3))
    particles.part(1.0, BODY.rows @ turn, turn, turn, keep=1.0)
    particles._twist[:] = ahead
    particles.part(1.0, BODY.rows @ ahead, ahead, ahead, keep=1.0)
    # Taken to be at (0, 1), looking along y; it is at (1, 0), looking along x.
    assert particles.settle() == pytest.approx([-1.0, -1.0, -0.5 * math.pi])


def test_places_live_on_with_their_particles_and_go_with_a_new_beginning() -> None:
    particles = _alike(1.0, np.zeros(3))
    particles._offset[:] = np.arange(len(particles._twist))[:, None]
    particles._weight[:] = np.arange(len(particles._twist)) == 7
    particles._draw()
    assert (particles._offset == 7.0).all()
    particles.start(np.zeros(3))
    assert not particles._offset.any()


def test_a_particle_that_hardly_slides_goes_with_the_wheels() -> None:
    """What sweeps over the contacts leave is no slide."""
    ahead = np.array([1.0, 0.0, 0.0])
    particles = _alike(1.0, 0.96 * ahead)
    particles.part(0.1, BODY.rows @ ahead, 0.1 * ahead, 0.1 * ahead, keep=1.0)
    assert particles.settle() == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_wheel_alone_may_come_to_another_floor() -> None:
    for rate, share in ((0.0, 0.0), (0.5, 1.0 - math.exp(-1.5))):
        settings = ParticleSettings(patches=rate, new_floor=0.0, regain=0.0)
        particles = Particles(BODY, FRICTION, 0.0, settings)
        for _ in range(50):
            assert particles.step(STEP, np.zeros(3))
        differ = np.ptp(particles._traction, axis=1) > 1e-9
        assert differ.mean() == pytest.approx(share, abs=0.05)
        for wheel in (0, 1, 2):  # each of them
            others = np.delete(particles._traction, wheel, axis=1)
            alone = (np.ptp(others, axis=1) < 1e-9) & differ
            assert alone.mean() == pytest.approx(
                math.exp(-1.0) * (1.0 - math.exp(-0.5)) * (rate > 0), abs=0.05
            )


def test_a_slope_pulls_a_robot_with_one_wheel_on_ice_no_less() -> None:
    particles = _alike(1.0, np.zeros(3))
    particles._traction[:, 1], particles._slope[:] = 0.01, (9.0, 0.0)
    assert sum(particles._wrenches())[0, 0] == pytest.approx(0.7 * 9.81 * BODY.mass, rel=1e-3)


def test_wheels_that_find_their_grip_do_so_with_the_forces_of_those_that_all_grip() -> None:
    particles = Particles(BODY, FRICTION, 0.0, ParticleSettings(regain=100.0, new_floor=0.0))
    particles._traction[:], particles._force[:] = 0.9, 1.0
    particles._traction[::2, 1], particles._force[::2] = 0.02, 5.0
    particles._change(STEP, np.zeros(3))
    assert (particles._force == 1.0).all()


def test_a_wheel_on_a_patch_slides_alone() -> None:
    """It spins with next to no force; about where the others stand the robot begins to turn."""
    rims, pull = np.array([0.5, 0.0, 0.0]), 1.2  # m/s, N
    free = np.cross(BODY.rows[1], BODY.rows[2])  # the twist that the other two allow
    rate = float(BODY.rows[0] @ free) ** 2 * pull / float(free @ BODY.inertia @ free)
    settings = ParticleSettings(patches=0.05)
    found, _ = played(
        lambda time: rims, lambda wheel, time: pull * (wheel == 0), 1.0, settings=settings
    )
    assert found.probability[0] > 0.9
    assert found.probability[1:].max() < 0.5
    assert BODY.rows @ found.twist == pytest.approx([1.0 * rate, 0.0, 0.0], abs=0.03)
