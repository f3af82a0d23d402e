"""The power models to choose from, by name: the parameter `power_model`."""

from collections.abc import Callable, Mapping

from attrs import frozen

from tomr_power_model.physics.model import PhysicalModel, PowerModel
from tomr_power_model.robot import Robot
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.wang2024 import WANG2024_PARAMETERS, Coefficients, Wang2024Model

Maker = Callable[[Robot, Mapping[str, object]], PowerModel]


@frozen
class Kind:
    """A power model: how it is made, and the parameters that are its own."""

    make: Maker
    parameters: tuple[ParameterSpec, ...] = ()


POWER_MODELS: dict[str, Kind] = {}


def power_model(name: str, *parameters: ParameterSpec) -> Callable[[Maker], Maker]:
    """Register a maker of a power model; it gets the robot and checked parameters."""

    def register(make: Maker) -> Maker:
        POWER_MODELS[name] = Kind(make, parameters)
        return make

    return register


@power_model("physical")
def physical(robot: Robot, values: Mapping[str, object]) -> PowerModel:
    """Inverse dynamics, DC motors and the effects of robot.yaml."""
    return PhysicalModel.of(robot)


@power_model("wang2024", *WANG2024_PARAMETERS)
def wang2024(robot: Robot, values: Mapping[str, object]) -> PowerModel:
    """The paper's energy model, with coefficients fitted to a healthy drive."""
    return Wang2024Model.of(robot, Coefficients.of(values))


def own_parameters() -> tuple[ParameterSpec, ...]:
    """The parameters of all power models."""
    return tuple(spec for kind in POWER_MODELS.values() for spec in kind.parameters)
