"""Faults of training drives do what they say."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault, TwistPhase
from tomr_training.drives import Drive
from tomr_training.planar.faults import (
    DOWNHILL,
    DRAG,
    SLOPE,
    TOTAL_METER,
    dry_friction,
    friction_left,
    loaded,
)
from tomr_training.planar.plant import Motion, run_plant
from tomr_training.planar.sensors import Signals

Straight = Callable[..., Drive]
REFERENCE = shipped_robot("reference")
WHEEL = 1  # 0..2: driving ahead, wheels 2 and 3 turn and wheel 1 need not
STANDBY = 1.2  # W
STOP = TwistPhase((0.0, 0.0, 0.0), 3.0)
SMOOTH = evolve(REFERENCE, sensors=evolve(REFERENCE.sensors, encoder_resolution=0.0))


def faulty(straight: Straight, fault_id: str, **settings: float) -> tuple[Motion, Drive]:
    fault = PlannedFault(fault_id, 3.0, None, {"severity": 1.0, **settings})
    drive = straight(faults=(fault,), robot=SMOOTH)
    return run_plant(drive), drive


def test_a_dragging_bearing_costs_its_torque(straight: Straight) -> None:
    motion, _ = faulty(straight, "bearing_dragging", wheel=WHEEL + 1, torque=0.14)
    healthy = run_plant(straight(robot=SMOOTH))
    speed = motion.truth.speed[-2, WHEEL]
    assert speed == pytest.approx(healthy.truth.speed[-2, WHEEL], rel=0.01)
    # 0.2 A more through 0.8 ohm and 0.7 V s/rad.
    before = (healthy.truth.power[-2, WHEEL] - STANDBY) / (0.7 * speed)
    more = 0.2 * (0.7 * speed + 0.8 * (2.0 * before + 0.2))
    rise = motion.truth.power[-2, WHEEL] - healthy.truth.power[-2, WHEEL]
    assert rise == pytest.approx(more, rel=0.05)
    assert motion.truth.power[:59] == pytest.approx(healthy.truth.power[:59])


def test_a_stuck_wheel_stands_and_its_motor_stalls(straight: Straight) -> None:
    motion, _ = faulty(straight, "wheel_stuck", wheel=WHEEL + 1, torque=40.0)
    assert abs(motion.truth.speed[-1, WHEEL]) < 1e-6
    assert motion.truth.power[-1, WHEEL] > 100.0


def test_a_worn_motor_heats_or_slackens(straight: Straight) -> None:
    healthy = run_plant(straight(robot=SMOOTH))
    current = healthy.steps.current[-1, WHEEL]
    worn, _ = faulty(straight, "motor_resistance_high", wheel=WHEEL + 1, rise=1.0)
    assert worn.steps.copper[-1, WHEEL] == pytest.approx(2.0 * 0.8 * current**2, rel=0.1)
    weak, _ = faulty(straight, "motor_torque_weak", wheel=WHEEL + 1, loss=0.5)
    assert weak.steps.current[-1, WHEEL] == pytest.approx(2.0 * current, rel=0.05)


def test_a_load_pulls_against_the_motion(straight: Straight) -> None:
    motion, _ = faulty(straight, "load_towed", drag=10.0)
    healthy = run_plant(straight(robot=SMOOTH))
    change = motion.steps.torque[-1] - healthy.steps.torque[-1]
    # Virtual work: 10 N at 0.5 m/s.
    assert float(change @ healthy.steps.speed[-1]) == pytest.approx(5.0, rel=0.05)
    back = PlannedFault("load_towed", 3.0, None, {"severity": 1.0, "drag": 10.0})
    phases = (TwistPhase((0.0, 0.0, 0.0), 1.0), TwistPhase((-0.5, 0.0, 0.0), 4.0))
    reverse = run_plant(straight(faults=(back,), phases=phases, robot=SMOOTH))
    assert reverse.steps.torque[-1, WHEEL] == pytest.approx(
        -motion.steps.torque[-1, WHEEL], rel=0.05
    )


def test_a_floor_that_slopes_or_drags_is_a_load(straight: Straight) -> None:
    """Not slippery at all it pulls as a load does."""
    towed, _ = faulty(straight, "load_towed", drag=10.0)
    for settings in ({DRAG: 10.0}, {SLOPE: 10.0, DOWNHILL: np.pi}):
        motion, _ = faulty(straight, "floor_slippery", **{"severity": 0.0, **settings})
        assert motion.steps.torque[-1] == pytest.approx(towed.steps.torque[-1], abs=0.01)
        assert motion.truth.power[:59] == pytest.approx(towed.truth.power[:59])
    left, _ = faulty(straight, "floor_slippery", **{"severity": 0.0, SLOPE: 10.0, DOWNHILL: 1.571})
    right, _ = faulty(
        straight, "floor_slippery", **{"severity": 0.0, SLOPE: 10.0, DOWNHILL: -1.571}
    )
    healthy = run_plant(straight(robot=SMOOTH)).steps.torque[-1]
    pulls = [motion.steps.torque[-1] - healthy for motion in (left, right)]
    assert pulls[0] == pytest.approx(-pulls[1], abs=0.01)
    assert np.abs(pulls[0]).max() > 0.1


def test_a_floor_drags_against_what_the_body_does_not_against_its_wheels(
    straight: Straight,
) -> None:
    """On ice the body goes on while the wheels have stopped: it is braked by both."""
    phases = (TwistPhase((0.0, 0.0, 0.0), 1.0), TwistPhase((0.5, 0.0, 0.0), 3.0), STOP)
    left = []
    for load in (0.0, 1.5):
        settings = {"severity": 1.0, DRAG: load}
        ice = PlannedFault("floor_slippery", 3.0, None, settings)
        motion = run_plant(straight(faults=(ice,), phases=phases, robot=SMOOTH))
        rolling = 0.05 * motion.steps.speed - motion.steps.gap
        ahead = rolling[round(4.0 / motion.step) :, WHEEL] / np.sin(2.0 * np.pi / 3.0)
        assert ahead.min() > -0.02  # it is not pulled back
        left.append(int((ahead > 0.05).sum()))
    assert left[1] < 0.85 * left[0]


def test_half_of_the_slippery_floors_load_and_nothing_else_does() -> None:
    random, count = np.random.default_rng(1), 400
    slippery = PlannedFault("floor_slippery", 3.0, None, {"severity": 0.5})
    found = [loaded((slippery,), REFERENCE, 0.8, random)[0].settings for _ in range(count)]
    loads = [
        float(str(settings[name]))
        for settings in found
        for name in (DRAG, SLOPE)
        if name in settings
    ]
    assert 0.4 * count < len(loads) < 0.6 * count
    sloping = sum({SLOPE, DOWNHILL} <= set(settings) for settings in found)
    assert 0.4 * len(loads) < sloping < 0.6 * len(loads)
    # Of 0.8 half of the way to 0.02 is left, by factors.
    assert friction_left(slippery, 0.8) == pytest.approx(np.sqrt(0.8 * 0.02))
    traction = REFERENCE.mass * 9.81 * np.sqrt(0.8 * 0.02)
    assert 0.2 * traction < min(loads) < 0.25 * traction
    assert 0.7 * traction < max(loads) < 0.75 * traction
    lost = PlannedFault("encoder_lost", 3.0, None, {"severity": 0.5, "wheel": 1})
    for others in ((), (lost,), (slippery, lost)):
        assert all(loaded(others, REFERENCE, 0.8, random) == others for _ in range(20))


def test_a_flat_battery_leaves_less_voltage(straight: Straight) -> None:
    motion, _ = faulty(straight, "supply_low", undervoltage=12.0)
    healthy = run_plant(straight(robot=SMOOTH))
    just_after = round(3.05 / motion.step)
    assert motion.steps.current[just_after, WHEEL] < 0.5 * healthy.steps.current[just_after, WHEEL]
    assert motion.truth.speed[-1, WHEEL] == pytest.approx(healthy.truth.speed[-1, WHEEL], rel=0.1)


@pytest.mark.parametrize(
    ("fault_id", "settings", "share", "more"),
    [
        ("power_sensor_scaled", {"wheel": 2, "factor": 0.5}, 0.5, 0.0),
        ("power_sensor_biased", {"wheel": 2, "bias": 3.0}, 1.0, 3.0),
        (TOTAL_METER, {"factor": 0.5}, 0.5, 0.0),
    ],
)
def test_sensors_that_are_off_mislead_and_change_nothing(
    straight: Straight, fault_id: str, settings: dict[str, float], share: float, more: float
) -> None:
    motion, drive = faulty(straight, fault_id, **settings)
    healthy = straight(robot=SMOOTH)
    np.testing.assert_array_equal(motion.steps.power, run_plant(healthy).steps.power)
    seen, true = (_power(Signals.of(one, motion)) for one in (drive, healthy))
    own = 3 if fault_id == TOTAL_METER else WHEEL
    after = slice(round(3.0 * 50) + 1, -1)
    np.testing.assert_allclose(seen[after, own], share * true[after, own] + more)
    others = [k for k in range(4) if k != own]
    np.testing.assert_array_equal(seen[:, others], true[:, others])


def test_a_frozen_sensor_repeats_itself(straight: Straight) -> None:
    motion, drive = faulty(straight, "power_sensor_frozen", wheel=2)
    power = _power(Signals.of(drive, motion))[:, WHEEL]
    assert np.ptp(power[round(3.0 * 50) + 1 : -1]) < 1e-9
    assert np.ptp(power[: round(3.0 * 50)]) > 1.0


def test_dry_friction_is_the_mean_of_the_wheels() -> None:
    assert dry_friction(REFERENCE) == pytest.approx(0.06)


def _power(signals: Signals) -> np.ndarray:
    return signals.voltage * signals.drawn
