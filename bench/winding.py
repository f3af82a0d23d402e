"""Drives that never stay the same: all three parts of the command wind, each at its own rate."""

from collections.abc import Iterator

import numpy as np

from tomr_power_model.model.ticks import to_ns
from tomr_sim_bridge.plant.samples import Sample, command_sample
from tomr_sim_bridge.plant.simulation import Simulation

_PERIOD = 0.05  # s between commands
_SPEED, _YAW = (0.1, 0.5), (0.0, 1.0)  # m/s and rad/s, at most
_RATE = (0.5, 3.0)  # rad/s of each part
_REST = 0.5  # s, at first


def winding(simulation: Simulation, seed: int, seconds: float) -> Iterator[list[Sample]]:
    """Drive so long; yields the samples command by command, cmd_vel among them."""
    random, start_ns = np.random.default_rng(seed), simulation.stamp_ns
    rate, phase = random.uniform(*_RATE, 3), random.uniform(0.0, 2.0 * np.pi, 3)
    speed, yaw = random.uniform(*_SPEED), random.uniform(*_YAW)
    most = np.array([speed, speed, yaw])
    for time in np.arange(0.0, seconds, _PERIOD).tolist():
        stamp = start_ns + to_ns(time)
        samples = simulation.step_to(stamp)
        twist = most * np.sin(rate * time + phase) * (time > _REST)
        v_x, v_y, omega_z = twist.tolist()
        simulation.command(v_x, v_y, omega_z, stamp_ns=stamp)
        yield [*samples, command_sample(stamp, v_x, v_y, omega_z)]
