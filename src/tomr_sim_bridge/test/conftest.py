"""Robots and runs that the tests of the simulated robot share."""

from collections.abc import Callable, Iterable, Mapping
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
import yaml
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_sim_bridge.plant.samples import Sample
from tomr_sim_bridge.plant.simulation import Simulation

REFERENCE = "reference.yaml"
IDEAL_SENSORS = {
    "sensors.encoder_resolution": 0.0,
    "sensors.voltage_noise": 0.0,
    "sensors.current_noise": 0.0,
    "sensors.voltage_resolution": 0.0,
    "sensors.current_resolution": 0.0,
    "sensors.gyro_noise": 0.0,
    "sensors.accelerometer_noise": 0.0,
}


@frozen
class Drive:
    """Samples of a drive as arrays, one row per stamp."""

    samples: list[Sample]

    def fields(self, topic: str) -> list[Mapping[str, Any]]:
        return [sample.message.fields for sample in self.samples if sample.topic == topic]

    def stamps(self, topic: str) -> NDArray[np.int64]:
        return np.array([sample.stamp_ns for sample in self.samples if sample.topic == topic])

    def joints(self, field: str = "velocity") -> NDArray[np.float64]:
        """Wheel angles or speeds, shape (n, 3)."""
        return np.array([fields[field] for fields in self.fields("joint_states")])

    def supply(self, topic: str, field: str) -> NDArray[np.float64]:
        """Voltage or current of a BatteryState topic, shape (n,)."""
        return np.array([fields[field] for fields in self.fields(topic)])

    def power(self, topic: str) -> NDArray[np.float64]:
        """Power drawn, shape (n,)."""
        return -self.supply(topic, "voltage") * self.supply(topic, "current")

    def motors(self) -> NDArray[np.float64]:
        """Power drawn by the three drivers, shape (n, 3)."""
        return np.column_stack([self.power(f"wheel_{number}/power") for number in (1, 2, 3)])

    def twist(self, topic: str = "ground_truth/odom") -> NDArray[np.float64]:
        """Body twists, shape (n, 3)."""
        rows = []
        for fields in self.fields(topic):
            twist = fields["twist"].fields["twist"].fields
            linear, angular = twist["linear"].fields, twist["angular"].fields
            rows.append([linear["x"], linear["y"], angular["z"]])
        return np.array(rows)

    def place(self, topic: str = "ground_truth/odom") -> NDArray[np.float64]:
        """Positions x, y, shape (n, 2)."""
        points = [f["pose"].fields["pose"].fields["position"].fields for f in self.fields(topic)]
        return np.array([[point["x"], point["y"]] for point in points])

    def truth(self, fault_id: str) -> list[dict[str, float]]:
        """Values of a fault on ground_truth/faults."""
        found = []
        for fields in self.fields("ground_truth/faults"):
            status = next(s.fields for s in fields["status"] if s.fields["name"] == fault_id)
            pairs = (pair.fields for pair in status["values"])
            found.append({pair["key"]: float(pair["value"]) for pair in pairs})
        return found


def flatten(tree: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        flat.update(flatten(value, name + ".") if isinstance(value, Mapping) else {name: value})
    return flat


@pytest.fixture
def make_robot() -> Callable[..., Robot]:
    """`make_robot({"robot.mass": 20.0}, ideal=True)`: the reference robot, changed."""
    text = files("tomr_power_model").joinpath("robots").joinpath(REFERENCE).read_text()
    reference = flatten(yaml.safe_load(text)["/**"]["ros__parameters"])

    def make(changes: Mapping[str, object] | None = None, ideal: bool = False) -> Robot:
        sensors = IDEAL_SENSORS if ideal else {}
        return robot_from_parameters({**reference, **sensors, **(changes or {})}, REFERENCE)

    return make


@pytest.fixture
def drive() -> Callable[..., Drive]:
    """`drive(simulation, 2.0, (0.3, 0, 0), skip=1.0)`: run on; forget the first `skip` seconds."""

    def run(
        simulation: Simulation,
        duration: float,
        command: Iterable[float] | None = None,
        skip: float = 0.0,
    ) -> Drive:
        begin = simulation.stamp_ns
        if command is not None:
            simulation.command(*command)
        samples = simulation.step_to(begin + round(duration * NANOSECONDS))
        return Drive([s for s in samples if s.stamp_ns > begin + round(skip * NANOSECONDS)])

    return run
