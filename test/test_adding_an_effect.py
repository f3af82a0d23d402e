"""An effect is one file: this one defines rolling resistance that grows with speed.

Nothing else is touched, and every tool knows it: descriptions, simulation, inverse dynamics,
calibration, hypotheses, reports, nodes.
"""

import math
from collections.abc import Iterator
from types import MappingProxyType

import numpy as np
import pytest
import rclpy
import yaml
from attrs import evolve
from effect_samples import SCALES
from rclpy.node import Node
from rclpy.parameter import Parameter

from tomr_power_model.calibration.parameters import Choice, choose
from tomr_power_model.calibration.priors import drive_for
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import compiled, plain
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.simulation import Simulation, Steps
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.effects import EFFECTS, Effect, EffectParameter, HypothesisPrior, Wheel
from tomr_power_model.effects.missions import SPEEDS
from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import per_wheel
from tomr_power_model.nodes.robot_parameters import declare_robot
from tomr_power_model.robot import GRAVITY, Robot, load_robot, robot_from_parameters, shipped_robot
from tomr_power_model.robot.files import read_description
from tomr_reality_gap.hypotheses.catalogue import catalogue
from tomr_reality_gap.report.words import effect_words

EFFECT = "contact.rolling_growth"
KEY = f"physics.{EFFECT}.coefficient"
COEFFICIENT = 5e-4  # s^2/rad^2
WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")


class RollingGrowth(Effect):
    """tau = coefficient * N_i * wheel_radius * omega * |omega|."""

    effect_id = EFFECT
    label = "Rolling resistance grows with speed"
    parameters = MappingProxyType(
        {"coefficient": EffectParameter("s^2/rad^2", maximum=0.1, prior_std=1e-3)}
    )
    prior = HypothesisPrior({"coefficient": lambda scales: 1e-3})
    shown_by = "fast drives, empty and with a payload"
    mission = SPEEDS
    needs_load = True

    @staticmethod
    def moving_torque(coefficient: float, wheel: Wheel) -> float:
        """Torque against positive motion [N m]."""
        return coefficient * wheel.load * wheel.radius * wheel.speed * abs(wheel.speed)


# ------------------------------------------------------------------- the effect ends here


@pytest.fixture(autouse=True)
def _effect() -> Iterator[None]:
    EFFECTS.register(RollingGrowth)
    yield
    EFFECTS.remove(EFFECT)


@pytest.fixture
def values() -> dict[str, object]:
    """The reference robot's description with the effect."""
    return {**read_description("reference"), KEY: COEFFICIENT}


@pytest.fixture
def robot(tmp_path_factory: pytest.TempPathFactory, values: dict[str, object]) -> Robot:
    file = tmp_path_factory.mktemp("robot") / "robot.yaml"
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    return load_robot(file)


def steady_current() -> float:
    """Of wheel 2 along x at 1 m/s, a wheel speed of 17.32 rad/s: friction over k."""
    speed, load = math.sqrt(0.75) / 0.05, 15.0 * GRAVITY / 3.0
    return (0.06 + 0.004 * speed + COEFFICIENT * load * 0.05 * speed**2) / 0.7


def test_a_description_may_have_it(robot: Robot, values: dict[str, object]) -> None:
    assert robot.everywhere(EFFECT, "coefficient") == (COEFFICIENT,) * 3
    with pytest.raises(InputError, match=r"rolling_growth\.coefficient = 0\.5 .*at most 0\.1"):
        robot_from_parameters({**values, KEY: 0.5}, "robot.yaml")


def test_the_dynamics_simulate_it(robot: Robot) -> None:
    flat = evolve(robot, mass_center=(0.0, 0.0, 0.0))
    simulation = Simulation(vehicle_of(flat))
    state, asked = simulation.start(), simulation.inputs()
    asked[at.COMMAND] = 1.0
    out = [simulation.advance(state, asked) for _ in range(800)]
    current = Steps.of(np.array(out[-1]), 3).current[0]
    assert current[1:] == pytest.approx([steady_current(), -steady_current()], rel=1e-3)


@pytest.mark.parametrize("dynamics", ["plain", "compiled"])
def test_inverse_dynamics_see_it(robot: Robot, dynamics: str) -> None:
    bound = compiled() if dynamics == "compiled" else plain(tuple(robot.physics))
    motion = np.zeros((1, at.MOTION_HEADER + 3 * at.MOTION_WHEEL))
    motion[0, : at.MOTION_HEADER] = np.nan
    speed = math.sqrt(0.75) / 0.05
    motion[0, at.MOTION_HEADER + at.MOTION_SPEED :: at.MOTION_WHEEL] = 0.0, speed, -speed
    power = np.zeros((1, 3 * at.POWER_WHEEL))
    bound.drive_powers(laid_out(vehicle_of(robot)), motion, power, 3)
    assert power[0, at.POWER_WHEEL + at.POWER_CURRENT] == pytest.approx(steady_current(), rel=1e-6)


def test_calibration_fits_it_by_default(values: dict[str, object]) -> None:
    chosen = choose(values, WHEELS, Choice(), "robot.yaml")
    free = [item for item in chosen if EFFECT in item.keys[0]]
    assert [item.keys[0] for item in free] == [f"physics.{EFFECT}.{w}.coefficient" for w in WHEELS]
    assert {(item.unit, item.lower, item.upper) for item in free} == {("s^2/rad^2", 0.0, 0.1)}
    assert drive_for(KEY) == RollingGrowth.shown_by


def test_the_gap_tool_offers_it_as_a_hypothesis() -> None:
    base = per_wheel(read_description("reference"), WHEELS, "robot.yaml")
    found = [item for item in catalogue(base, WHEELS, SCALES, 0.02) if item.effect == EFFECT]
    assert [item.where for item in found] == [("all_wheels",), *((wheel,) for wheel in WHEELS)]
    (size,) = found[0].parameters
    assert (size.unit, size.lower, size.upper) == ("s^2/rad^2", 0.0, 0.1)
    assert base.given(found[1].start).offset(found[1].parameters, [1e-3]).robot.effect(
        EFFECT, 0
    ) == {"coefficient": 1e-3}
    assert effect_words(EFFECT) == "Rolling resistance grows with speed"


def test_a_node_declares_it(values: dict[str, object]) -> None:
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node(
        "stage",
        context=context,
        parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
        automatically_declare_parameters_from_overrides=True,
    )
    try:
        assert declare_robot(node).effect(EFFECT) == {"coefficient": COEFFICIENT}
        described = node.describe_parameter(KEY)
        assert described.floating_point_range[0].to_value == 0.1
        assert "s^2/rad^2" in described.description
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def test_without_it_nothing_is_left(values: dict[str, object]) -> None:
    EFFECTS.remove(EFFECT)
    with pytest.raises(InputError, match="rolling_growth"):
        robot_from_parameters(values, "robot.yaml")
    vehicle = vehicle_of(shipped_robot("reference"))
    assert Simulation(vehicle).start()[at.TWIST] == 0.0
    EFFECTS.register(RollingGrowth)
