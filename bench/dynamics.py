"""What the dynamics cost: whole drives compiled, single periods in plain Python, compilation.

    .venv/bin/python bench/dynamics.py [--seconds 60]

Periods of 5 ms a second on one core, closed loop, for the reference robot as shipped, with every
effect but sliding, and with wheels that may slide; the same on four wheels. In plain Python the
microseconds of a period and of the ten periods between two ticks of a node. Times are
CPU times, the least of several, since other programs run as well.
"""

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from attrs import evolve

from tomr_power_model.cli import run_main
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.simulation import Excitation, Simulation, Variant, drive
from tomr_power_model.dynamics.vehicle import Vehicle, omni_wheel, vehicle_of
from tomr_power_model.robot import shipped_robot

PERIOD = 0.005  # s
TICK = 10  # periods
REPEATS = 5
HEAT = {"thermal_resistance": 2.0, "time_constant": 100.0, "initial": 0.0}
ROLLING: Mapping[str, Mapping[str, float]] = {
    "friction.stribeck": {"torque": 0.02, "speed": 0.5},
    "friction.load_dependent": {"coefficient": 0.05},
    "friction.quadratic": {"coefficient": 1e-4},
    "drivetrain.torque_ripple": {"torque": 0.01, "order": 7.0, "phase": 0.0},
    "contact.roller_drag": {"coefficient": 0.02, "slip": 0.0},
    "contact.rolling_resistance": {"coefficient": 0.01},
    "electrical.winding_heating": HEAT,
    "electrical.supply_sag": {"resistance": 0.05},
    "electrical.switching_loss": {"coefficient": 0.1},
    "electrical.regeneration_loss": {"efficiency": 0.7},
    "electrical.iron_loss": {"hysteresis": 1e-4, "eddy": 1e-6},
    "body.slope": {"angle": 0.01, "azimuth": 0.0},
}
SLIDING: Mapping[str, Mapping[str, float]] = {"contact.slip": {"friction": 0.15}}
COMPILE = """
import time
import numpy as np
from tomr_power_model.dynamics import simulation
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.robot import shipped_robot

variant = simulation.Variant(laid_out(vehicle_of(shipped_robot("reference"))))
rest = np.zeros(3)
inputs = np.tile(no_input(3), (10, 1))
excitation = simulation.Excitation(0.0, inputs, rest, rest, 0.0, rest)
channel = np.array([[1, 0, 0, 1]])
readout = simulation.Readout(channel, np.array([0.02]), np.array([0.01]))
begin = time.process_time()
simulation.predict([variant], excitation, readout)
print(time.process_time() - begin)
"""


def vehicle(count: int, further: Mapping[str, Mapping[str, float]]) -> Vehicle:
    """The reference robot on three or four omni wheels with further effects."""
    three = vehicle_of(shipped_robot("reference"))
    physics = {name: (given[0],) * count for name, given in three.physics.items()}
    physics |= {name: (given,) * count for name, given in further.items()}
    if count == 3:
        return evolve(three, physics=physics)
    angles = [math.pi * (0.25 + 0.5 * wheel) for wheel in range(count)]
    wheels = [omni_wheel(0.2 * math.cos(a), 0.2 * math.sin(a), a + 0.5 * math.pi) for a in angles]
    motors = (three.motors[0],) * count
    return evolve(three, physics=physics, wheels=tuple(wheels), motors=motors)


def excitation(count: int, seconds: float) -> Excitation:
    """Random twists, two a second."""
    periods = round(seconds / PERIOD)
    chance = np.random.default_rng(1)
    twists = chance.uniform(-0.5, 0.5, (periods // 100 + 1, 3)) * (1.0, 1.0, 4.0)
    inputs = np.tile(no_input(count), (periods, 1))
    inputs[:, at.COMMAND : at.COMMAND + 3] = np.repeat(twists, 100, axis=0)[:periods]
    return Excitation(0.0, inputs, np.zeros(3), np.zeros(3), 0.0, np.zeros(count))


def fastest(run: Callable[[], object]) -> float:
    """Least CPU time of several calls [s], after one that may compile."""
    run()
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    return min(times)


def plain_period(robot: Vehicle, given: Excitation) -> float:
    """Time of a period in plain Python [s]."""
    simulation = Simulation(robot)
    rows = given.inputs[: 40 * TICK].tolist()

    def run() -> None:
        state = simulation.start()
        for row in rows:
            simulation.advance(state, row)

    return fastest(run) / len(rows)


def compile_time(folder: str) -> float:
    """CPU time of a process's first prediction [s]."""
    environment = {**os.environ, "TOMR_CACHE_DIR": folder}
    command = [sys.executable, "-c", COMPILE]
    found = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return float(found.stdout)


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=60.0, help="of a drive (default 60)")
    options = parser.parse_args(arguments)
    cases: Mapping[str, Mapping[str, Mapping[str, float]]] = {
        "as shipped": {},
        "all effects, rolling": ROLLING,
        "may slide": SLIDING,
    }
    print(f"{'':32}{'M periods/s':>13}{'plain us':>10}{'us a tick':>11}{'compiled/plain':>16}")
    for count in (3, 4):
        given = excitation(count, options.seconds)
        for name, further in cases.items():
            robot = vehicle(count, further)
            variant = Variant(laid_out(robot))
            fast = fastest(partial(drive, variant, given, count)) / len(given.inputs)
            slow = plain_period(robot, given)
            title = f"{count} wheels, {name}"
            print(
                f"{title:32}{1e-6 / fast:13.2f}{1e6 * slow:10.1f}{1e6 * TICK * slow:11.0f}"
                f"{slow / fast:16.0f}"
            )
    with tempfile.TemporaryDirectory() as folder:
        cold, kept = compile_time(folder), compile_time(folder)
    print(f"first prediction of a process: {cold:.1f} s compiled anew, {kept:.2f} s from the cache")
    return 0


if __name__ == "__main__":
    sys.exit(run_main(_main))
