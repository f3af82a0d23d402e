"""Which hypotheses there are, and how far described values may be off."""

import math

import pytest

from tomr_power_model.effects.scales import Scales
from tomr_power_model.estimation.parameter import ParameterisedRobot, per_wheel
from tomr_power_model.robot import read_description, shipped_robot
from tomr_reality_gap.hypotheses.catalogue import catalogue, nuisances

WHEELS = shipped_robot("reference").wheel_names
SCALES = Scales(
    torque=0.3, speed=5.0, current=1.0, power=5.0, copper=1.0, load=50.0, radius=0.05, arm=0.2,
    mass=15.0, gear=15.0, voltage=24.0, duration=60.0, period=0.005, traction_ratios=(0.2, 0.1),
)  # fmt: skip


@pytest.fixture(scope="module")
def base() -> ParameterisedRobot:
    return per_wheel(dict(read_description("reference")), WHEELS, "reference")


def test_a_tolerance_is_of_all_values_of_one_or_of_one_at_one_wheel(
    base: ParameterisedRobot,
) -> None:
    own = {
        "robot.mass": 0.1,
        "motor.resistance": 0.05,
        "motor.wheel_2_joint.torque_constant": 0.0,
        "physics.friction.coulomb.torque": 0.3,
    }
    found = {item.keys[0]: item for item in nuisances(base, WHEELS, 0.02, own)}
    expected = {"robot.mass": 0.1, "robot.inertia_z": 0.02}
    expected |= {f"motor.{wheel}.resistance": 0.05 for wheel in WHEELS}
    expected |= {f"motor.{wheel}.torque_constant": 0.02 for wheel in (WHEELS[0], WHEELS[2])}
    expected |= {f"physics.friction.coulomb.{wheel}.torque": 0.3 for wheel in WHEELS}
    for key, share in expected.items():
        value = base.values[key]
        assert isinstance(value, float)
        assert found[key].prior_std * math.sqrt(3.0) == pytest.approx(share * value)
        assert found[key].upper == -found[key].lower == pytest.approx(1.25 * share * value)
    assert "motor.wheel_2_joint.torque_constant" not in found


def test_currents_do_not_show_what_only_power_does(base: ParameterisedRobot) -> None:
    sag = ParameterisedRobot({**base.values, "physics.sensor.power_scale.scale": 1.1}, "made")
    effects, in_currents = (
        {item.effect for item in catalogue(sag, WHEELS, SCALES, 0.02, currents_only=currents_only)}
        for currents_only in (False, True)
    )
    hidden = {"electrical.switching_loss", "parameter.physics.sensor.power_scale.scale"}
    assert hidden <= effects - in_currents
    assert {"friction.quadratic", "parameter.motor.resistance"} <= in_currents


def test_what_is_described_is_no_effect_left_out(base: ParameterisedRobot) -> None:
    effects = {item.effect for item in catalogue(base, WHEELS, SCALES, 0.02)}
    assert "friction.coulomb" not in effects
    assert "parameter.physics.friction.coulomb.torque" in effects
