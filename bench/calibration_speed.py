"""How fast the model is: vectorised over samples, and step by step."""

import time
from functools import partial
from typing import Any

import numpy as np
from attrs import evolve
from dynamics import REPEATS, fastest
from rich.console import Console

from tomr_power_model.dynamics.drives import InverseDynamics, WheelMotion
from tomr_power_model.dynamics.simulation import Simulation
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import Robot, load_robot

_ROWS = 200_000
_STEPS = 5_000
_TICKS = 1_000
_S = 1_000_000_000


def _with_drag(robot: Robot) -> Robot:
    drag = {"coefficient": 0.05, "slip": 0.4}
    return evolve(robot, physics={**robot.physics, "contact.roller_drag": (drag, drag, drag)})


def _streaming(robot: Robot) -> float:
    """Microseconds per decision of the whole predictor, encoders at 100 Hz and commands at 20."""
    predictor = PowerPredictor(robot)
    begin = time.process_time()
    count = 0
    for step in range(5 * _TICKS):
        stamp = _S + step * _S // 100
        if step % 5 == 0:
            predictor.command(stamp, (0.3, 0.1, 0.2))
        angle = 0.05 * step
        predictor.encoders(stamp, (angle, -angle, 0.5 * angle), (5.0, -5.0, 2.5))
        count += len(predictor.due())
    return 1e6 * (time.process_time() - begin) / count


def measure_speed() -> dict[str, Any]:
    """Speeds for the reference robot, plain and with a roller drag."""
    found: dict[str, Any] = {}
    random = np.random.default_rng(0)
    for name, robot in (
        ("reference", load_robot("reference")),
        ("reference with roller drag", _with_drag(load_robot("reference"))),
    ):
        model = InverseDynamics.of(robot)
        many = WheelMotion(random.normal(0, 5, (_ROWS, 3)), random.normal(0, 20, (_ROWS, 3)))
        one = WheelMotion(many.speed[:1], many.acceleration[:1])
        simulation = Simulation(vehicle_of(robot))

        def steps(simulation: Simulation = simulation) -> None:
            state, inputs = simulation.start(), simulation.inputs()
            inputs[:3] = (0.3, 0.1, 0.2)
            for _ in range(_STEPS):
                simulation.advance(state, inputs)

        def single(model: InverseDynamics = model, one: WheelMotion = one) -> None:
            for _ in range(_STEPS):
                model.power(one)

        found[name] = {
            "samples_per_second": _ROWS / fastest(partial(model.power, many)),
            "microseconds_per_sample": 1e6 * fastest(single) / _STEPS,
            "microseconds_per_control_step": 1e6 * fastest(steps) / _STEPS,
            "microseconds_per_decision": min(_streaming(robot) for _ in range(REPEATS)),
        }
    return found


def print_speed(console: Console, found: dict[str, Any]) -> None:
    """A line per robot."""
    for name, figures in found.items():
        console.print(
            f"{name}: {figures['samples_per_second'] / 1e6:.2f} million samples of three wheels "
            f"per second vectorised; one at a time {figures['microseconds_per_sample']:.0f} us; "
            f"a step of the closed loop {figures['microseconds_per_control_step']:.0f} us; a "
            f"decision of the streaming predictor, command and encoders, "
            f"{figures['microseconds_per_decision']:.0f} us"
        )
