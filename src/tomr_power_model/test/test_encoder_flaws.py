"""How wheels turn whose encoders are flawed; numbers worked by hand."""

import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.commanded import CommandPath
from tomr_power_model.model.encoder_flaws import EncoderFlaws
from tomr_power_model.model.encoders import WheelEstimate
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import Robot, shipped_robot

NAN3 = np.full(3, math.nan)


def flawed(scale: float = 1.0, cosine: float = 0.0, sine: float = 0.0) -> Robot:
    """The reference robot; its second wheel's encoder is not as it should be."""
    robot = shipped_robot("reference")
    physics = {
        "sensor.encoder_scale": (None, {"scale": scale}, None),
        "sensor.encoder_eccentricity": (None, {"cosine": cosine, "sine": sine}, None),
    }
    return evolve(robot, physics={**robot.physics, **physics})


def test_an_encoder_that_loses_half_of_its_counts() -> None:
    shown = WheelEstimate(np.full(3, 4.0), np.full(3, -2.0), np.full(3, 1.0))
    flaws = EncoderFlaws.of(flawed(scale=0.5))
    turned = flaws.turned(shown)
    assert turned.speed.tolist() == [4.0, 8.0, 4.0]
    assert turned.acceleration.tolist() == [-2.0, -4.0, -2.0]
    assert flaws.angle(shown.angle).tolist() == [1.0, 2.0, 1.0]


def test_a_disc_off_its_centre_shows_too_slow_and_too_fast_once_a_turn() -> None:
    flaws = EncoderFlaws.of(flawed(cosine=0.1))
    for angle, speed, change in ((0.0, 4.4, 0.0), (0.5 * math.pi, 4.0, -1.6), (math.pi, 3.6, 0.0)):
        shown = WheelEstimate(np.full(3, 4.0), np.zeros(3), np.full(3, angle))
        turned = flaws.turned(shown)
        assert turned.speed[1] == pytest.approx(speed)
        assert turned.acceleration[1] == pytest.approx(change, abs=1e-12)
    # Where the angle is not known, as if it were centred.
    unknown = flaws.turned(WheelEstimate(np.full(3, 4.0), np.zeros(3), NAN3))
    assert unknown.speed.tolist() == [4.0, 4.0, 4.0]


@given(st.floats(0.5, 2.0), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-9.0, 9.0))
def test_speed_is_how_the_angle_changes(
    scale: float, cosine: float, sine: float, angle: float
) -> None:
    flaws, step = EncoderFlaws.of(flawed(scale, cosine, sine)), 1e-6
    there, here = (flaws.angle(np.full(3, angle + d)) for d in (0.5 * step, -0.5 * step))
    turned = flaws.turned(WheelEstimate(np.ones(3), np.zeros(3), np.full(3, angle)))
    np.testing.assert_allclose((there - here) / step, turned.speed, rtol=1e-6)


def test_without_a_flaw_nothing_changes() -> None:
    flaws = EncoderFlaws.of(shipped_robot("reference"))
    shown = WheelEstimate(np.full(3, 4.0), np.zeros(3), np.full(3, 1.0))
    assert flaws.is_none
    assert flaws.turned(shown) is shown


@pytest.mark.parametrize(("scale", "cosine"), [(0.9, 0.0), (1.0, 0.05)])
def test_the_driver_holds_what_its_encoder_shows(scale: float, cosine: float) -> None:
    """So the wheel turns faster by what the encoder loses, and by turns faster and slower."""
    simulation = Simulation(vehicle_of(flawed(scale, cosine)))
    state, inputs = simulation.start(), simulation.inputs()
    inputs[at.COMMAND + 2] = 0.5
    shown, turned = [], []
    for _ in range(1200):
        out = simulation.advance(state, inputs)
        shown.append(out[at.OUT_HEADER + at.OUT_WHEEL + at.OUT_SHOWN])
        turned.append(out[at.OUT_HEADER + at.OUT_WHEEL + at.OUT_SPEED])
    asked = out[at.OUT_HEADER + at.OUT_WHEEL + at.OUT_ASKED]
    late = slice(500, None)
    assert shown[-1] == pytest.approx(asked, rel=0.02)
    rate = np.divide(turned[late], shown[late])
    assert 0.5 * (rate.max() + rate.min()) == pytest.approx(1.0 / scale, abs=0.01)
    assert np.ptp(rate) == pytest.approx(2.0 * cosine, abs=0.01)
    # What it counts is what it has shown.
    counted = simulation.of_wheels(state, at.TURNED)[1]
    period = simulation.period_s
    assert counted == pytest.approx(sum(shown) * period, rel=1e-6)


def test_the_simulation_begins_as_the_wheels_turn_and_not_as_they_show(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot, seen = shipped_robot("reference"), []
    half = {"sensor.encoder_scale": ({"scale": 0.5},) * 3}
    monkeypatch.setattr(CommandPath, "over", lambda self, tick, given: seen.append(given.twist))
    for model in (robot, evolve(robot, physics={**robot.physics, **half})):
        predictor = PowerPredictor(model)
        for at_ms in range(0, 400, 10):
            angle = 4e-3 * at_ms
            stamp = 1_700_000_000_000_000_000 + at_ms * 1_000_000
            predictor.encoders(stamp, (angle, angle, angle), (4.0, 4.0, 4.0))
            predictor.due()
    ideal, lossy = seen[len(seen) // 2 - 1], seen[-1]
    assert abs(ideal[2]) > 0.5
    assert lossy[2] == pytest.approx(2.0 * ideal[2], rel=1e-6)
