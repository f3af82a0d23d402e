"""The paper's coefficients for a robot, as parameters of the model stage."""

from collections.abc import Sequence
from pathlib import Path

from attrs import fields
from wang2024 import samples_of

from tomr_power_model.robot import Robot
from tomr_power_model.wang2024 import Coefficients
from tomr_power_model.wang2024.fit import fit_wang2024


def fitted(robot: Robot, bags: Sequence[Path]) -> Coefficients:
    """Wang 2024 fitted to healthy recordings of a robot."""
    return fit_wang2024(robot, samples_of(bags, robot))


def parameters(coefficients: Coefficients) -> dict[str, object]:
    """Parameters that choose the paper's model with these coefficients."""
    values: dict[str, object] = {"power_model": "wang2024"}
    for key in fields(Coefficients):
        value = getattr(coefficients, key.name)
        values[f"wang2024.{key.name}"] = list(value) if isinstance(value, tuple) else value
    return values
