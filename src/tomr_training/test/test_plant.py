"""The robot in a training drive: sane physics, whatever befalls it, whatever robot it is."""

from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.dynamics import layout as at
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault, TwistPhase
from tomr_training.drives import Bump, Drive
from tomr_training.planar.believed import run_believed
from tomr_training.planar.plant import Motion, run_plant
from tomr_training.planar.schedule import commanded, tick_count
from tomr_training.planar.sensors import Signals

Straight = Callable[..., Drive]
REFERENCE = shipped_robot("reference")


def test_steady_driving_by_hand(straight: Straight) -> None:
    """Wheel 1 sits at 0 degrees: driving ahead it is idle, the others turn at v sin(120) / r."""
    motion = run_plant(straight())
    wanted = 0.5 * np.sin(2.0 * np.pi / 3.0) / 0.05
    np.testing.assert_allclose(motion.truth.speed[-2], [0.0, wanted, -wanted], atol=0.02)
    torque = 0.06 + 0.004 * wanted  # N m of friction
    current = torque / 0.7
    power = (0.8 * current + 0.7 * wanted) * current + 1.2
    np.testing.assert_allclose(motion.truth.power[-2], [1.2, power, power], rtol=0.02)


def test_traction_bounds_acceleration(straight: Straight) -> None:
    """On ice of friction mu no robot accelerates faster than mu g."""
    ice = PlannedFault("floor_slippery", 0.5, None, {"severity": 1.0})
    steps = run_plant(straight(faults=(ice,))).steps
    assert np.abs(steps.gap[300:320, 1:]).max() > 0.1
    ahead = (0.05 * steps.speed - steps.gap)[:, 1] / np.sin(2.0 * np.pi / 3.0)
    assert np.diff(ahead[:400:20]).max() / 0.1 < 0.02 * 9.81 * 1.05


def test_a_bump_is_over_soon_and_shows(straight: Straight) -> None:
    bumped = run_plant(straight(bumps=(Bump(2.0, 0.1, (30.0, 0.0), 0.0),)))
    calm = run_plant(straight())
    # Pushed ahead, the robot is faster: wheel 2 turns forwards in this drive.
    assert (bumped.steps.speed - calm.steps.speed)[405:420, 1].min() > 0.0
    change = np.abs(bumped.steps.power - calm.steps.power).max(axis=1)
    assert change[400:430].max() > 2.0
    assert change[:400].max() == 0.0
    assert change[560:].max() < 0.5


def test_faults_act_on_what_they_name(straight: Straight) -> None:
    """An open bridge draws standby only; an encoder that loses counts makes its wheel too fast."""
    lost = PlannedFault("control_signal_lost", 3.0, None, {"severity": 1.0, "wheel": 2})
    assert run_plant(straight(faults=(lost,))).truth.power[-2, 1] == pytest.approx(1.2)
    half = PlannedFault("encoder_lost", 3.0, None, {"severity": 0.5, "wheel": 2})
    motion, healthy = run_plant(straight(faults=(half,))), run_plant(straight())
    assert motion.truth.speed[-1, 1] < 0.9 * motion.steps.speed[-1, 1]
    assert motion.steps.speed[-1, 1] > 1.2 * healthy.steps.speed[-1, 1]


def test_a_payload_costs_power_while_speeding_up(straight: Straight) -> None:
    light, heavy = run_plant(straight()), run_plant(straight(payload=5.0))
    assert heavy.truth.power[20:26, 1].sum() > 1.1 * light.truth.power[20:26, 1].sum()


def _expected(drive: Drive) -> Motion:
    signals = Signals.of(drive, run_plant(drive))
    return run_believed(drive, signals, np.full(tick_count(drive), 0.5)).motion


@pytest.mark.parametrize("rate", [60.0, 1000.0])
def test_any_rate_of_drivers_drives_alike(straight: Straight, rate: float) -> None:
    """A tick need not be a whole number of their periods."""
    other = evolve(REFERENCE, controller=evolve(REFERENCE.controller, rate=rate))
    wanted, found = _expected(straight()).truth, _expected(straight(robot=other)).truth
    assert len(found.power) == len(wanted.power)
    np.testing.assert_allclose(found.power[-30:], wanted.power[-30:], rtol=0.01)


def test_a_driver_hears_commands_late_by_its_delay(straight: Straight) -> None:
    late = evolve(REFERENCE, controller=evolve(REFERENCE.controller, delay=0.1))
    drives = straight(), straight(robot=late)
    heard, later = (commanded(drive, drive.plant)[:, at.COMMAND] for drive in drives)
    np.testing.assert_array_equal(later[20:], heard[:-20])


def test_sensors_show_sag_and_scale(straight: Straight) -> None:
    """Any effect of the vocabulary may be in the plant; those of sensors are in what they show."""
    physics = {
        **REFERENCE.physics,
        "electrical.supply_sag": ({"resistance": 0.5},) * 3,
        "sensor.power_scale": ({"scale": 1.1}, None, None),
    }
    plain, changed = straight(), straight(robot=evolve(REFERENCE, physics=physics))
    before, after = (Signals.of(drive, run_plant(drive)) for drive in (plain, changed))
    sag = (before.voltage - after.voltage).mean()
    assert sag == pytest.approx(0.5 * after.drawn[:, 3].mean(), rel=0.05)
    idle, scaled = ((seen.voltage * seen.drawn)[:, 0].mean() for seen in (before, after))
    assert scaled / idle == pytest.approx(1.1, abs=0.02)


def test_drivers_feel_the_quanta_of_their_encoders(straight: Straight) -> None:
    powers = []
    for quantum in (1e-5, 8e-3):
        sensors = evolve(REFERENCE.sensors, encoder_resolution=quantum)
        drive = straight(robot=evolve(REFERENCE, sensors=sensors))
        powers.append(run_plant(drive).steps.power[-200:, 1])
    smooth, rough = (np.std(np.diff(power)) for power in powers)
    assert rough > 10.0 * smooth


def test_noise_of_power_is_of_rollers_and_of_monitors(straight: Straight) -> None:
    """Rollers disturb what a motor draws by 3 %; a battery's monitor has twice a driver's noise."""
    silent = {"current_noise": 0.0, "voltage_noise": 0.0, "encoder_resolution": 1e-6}
    drive = straight(robot=evolve(REFERENCE, sensors=evolve(REFERENCE.sensors, **silent)))
    seen = Signals.of(drive, run_plant(drive))
    steady = (seen.voltage * seen.drawn)[-100:, 1] - 1.2  # W above standby
    assert np.std(steady) / np.mean(steady) == pytest.approx(0.03, rel=0.3)
    drive = straight(phases=(TwistPhase((0.0, 0.0, 0.0), 10.0),))
    noise = np.std(Signals.of(drive, run_plant(drive)).drawn, axis=0)
    np.testing.assert_allclose(noise[:3], REFERENCE.sensors.current_noise, rtol=0.15)
    assert noise[3] == pytest.approx(2.0 * REFERENCE.sensors.current_noise, rel=0.15)


def test_encoders_report_their_scale(straight: Straight) -> None:
    """The driver turns the wheel by less, so that its encoder shows what is asked for."""
    scale = {"sensor.encoder_scale": (None, {"scale": 1.02}, None)}
    scaled = evolve(REFERENCE, physics={**REFERENCE.physics, **scale})
    motion, plain = run_plant(straight(robot=scaled)), run_plant(straight())
    turned = motion.step * motion.steps.speed.sum(axis=0)
    np.testing.assert_allclose(motion.reported[-1, 1:], [1.02, 1.0] * turned[1:], rtol=1e-9)
    np.testing.assert_allclose(motion.reported[-1, 1:], plain.reported[-1, 1:], rtol=2e-3)
