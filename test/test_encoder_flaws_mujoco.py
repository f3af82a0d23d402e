"""A robot with flawed encoders and a flawed supply sensor in MuJoCo, diagnosed with a description
that holds the flaws and with one that does not."""

from collections.abc import Mapping

import numpy as np
import pytest
from attrs import evolve
from numpy.typing import NDArray

from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, TOTAL
from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions.mission import Mission
from tomr_sim_bridge.missions.schema import TwistPhase
from tomr_training.drives import Drive
from tomr_training.simulated_drive import simulated_drive

TURNS = ((0.4, 0.0, 0.3), (-0.1, 0.35, -0.6), (0.0, -0.4, 0.5), (0.3, 0.2, -0.2))


def flawed(effect: str, values: Mapping[str, float]) -> Robot:
    robot = shipped_robot("reference")
    per_wheel = (values,) * 3 if effect == "sensor.supply_scale" else (None, values, None)
    return evolve(robot, physics={**robot.physics, effect: per_wheel})


def residuals(plant: Robot, believed: Robot) -> NDArray[np.float64]:
    """RMS of the ten residuals over a drive of some seconds."""
    phases = [TwistPhase((0.0, 0.0, 0.0), 1.0), *(TwistPhase(turn, 2.0) for turn in TURNS)]
    mission = Mission(
        name="flawed",
        floor_friction=0.8,
        seed=3,
        phases=tuple(phases),
    )
    frames = simulated_drive(Drive(3, plant, believed, mission)).frames
    values = np.array([[item.residual for item in frame.residuals] for frame in frames])
    return np.asarray(np.sqrt(np.nanmean(np.square(values), axis=0)))


@pytest.mark.parametrize(
    ("effect", "values", "shows_in"),
    [
        ("sensor.encoder_scale", {"scale": 0.8}, MOTORS[1]),
        ("sensor.encoder_eccentricity", {"cosine": 0.2, "sine": -0.1}, ENCODERS[1]),
        ("sensor.supply_scale", {"scale": 1.2}, TOTAL),
    ],
)
def test_nodes_know_the_flaws_that_the_description_holds(
    effect: str, values: Mapping[str, float], shows_in: int
) -> None:
    healthy = shipped_robot("reference")
    plain = residuals(healthy, healthy)
    robot = flawed(effect, values)
    known, unknown = residuals(robot, robot), residuals(robot, healthy)
    assert (known < 1.3 * plain).all(), known / plain
    assert unknown[shows_in] > 2.0 * known[shows_in], unknown / known
