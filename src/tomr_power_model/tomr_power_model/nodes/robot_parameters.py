"""Parameters of a node, declared from the same tables that check robot.yaml."""

import math
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from attrs import evolve
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_power_model.robot.description import effect_spec
from tomr_power_model.robot.parameters import ParameterSpec, Value
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS

GROUPS = (
    "robot",
    "motor",
    "controller",
    "supply",
    "physics",
    "sensors",
    "measurement",
    "unmodelled",
)
_ROS_OWN = ("use_sim_time", "qos_overrides", "start_type_description_service")


def given_parameters(node: Node) -> dict[str, object]:
    """All parameters that were given to a node made with
    `automatically_declare_parameters_from_overrides=True`."""
    # Typed as plain values, but in Jazzy these are Parameter objects.
    found: Mapping[str, Any] = dict(node.get_parameters_by_prefix(""))
    values: dict[str, object] = {}
    for name, item in found.items():
        plain = _plain(getattr(item, "value", item))
        meant = as_written(name)
        values[meant] = plain
        if meant != name:
            node.undeclare_parameter(name)
            node.declare_parameter(meant, plain, ignore_override=True)
    return values


def as_written(name: str) -> str:
    """The name of an effect's parameter as the file has it.

    rcl's parser of parameter files takes one part off its prefix where a key with a dot ends, so
    the second of two effects arrives as physics.friction.friction.viscous.coefficient.
    """
    if name.startswith("physics."):
        for effect_id in EFFECTS:
            place = name.rfind(f".{effect_id}.")
            if place >= 0:
                return "physics" + name[place:]
    return name


def _plain(value: Any) -> object:
    return (
        list(value) if not isinstance(value, str | bytes) and hasattr(value, "__len__") else value
    )


def declare_robot(node: Node) -> Robot:
    """The robot that a node's parameters describe; each gets its type, unit and bounds.

    Raises InputError as `load_robot` does.
    """
    place = node.get_name()
    given = {
        name: value
        for name, value in given_parameters(node).items()
        if name.partition(".")[0] in GROUPS
    }
    if not given:
        raise InputError(f"{place}: no robot description: start it with --params-file robot.yaml")
    robot = robot_from_parameters(given, place)
    for spec in ROBOT_PARAMETERS:
        value = given.get(spec.name, spec.default)
        if value is not None:
            redeclare(node, spec, spec.check(value, place))
    for name in given:
        extra = _spec_of(name, robot.wheel_names)
        if extra is not None:
            redeclare(node, extra, extra.check(given[name], place))
    return robot


def _spec_of(name: str, wheels: tuple[str, str, str]) -> ParameterSpec | None:
    """What is known of a parameter that only some robots have."""
    key = name.rpartition(".")[2]
    for effect_id in EFFECTS:
        if name.startswith(f"physics.{effect_id}."):
            return effect_spec(effect_id, key, name)
    for wheel in wheels:
        if name.startswith(f"motor.{wheel}."):
            spec = next(s for s in MOTOR_PARAMETERS if s.name == f"motor.{key}")
            return evolve(spec, name=name)
    return None


def declare_specs(
    node: Node, specs: Iterable[ParameterSpec], fallback: Mapping[str, object] | None = None
) -> dict[str, Value]:
    """Declare a node's own parameters; returns their checked values by name.

    `fallback`: values of parameters that are not given to the node, in place of their defaults.
    """
    table = {spec.name: spec for spec in specs}
    place = node.get_name()
    given = {**(fallback or {}), **given_parameters(node)}
    values: dict[str, Value] = {}
    for name, spec in table.items():
        if name not in given and spec.default is None:
            raise InputError(f"{place}: {name} is missing: give it ({spec.description})")
        value = spec.check(given.get(name, spec.default), place)
        redeclare(node, spec, value)
        values[name] = value
    for name in given:
        if name not in table and name.partition(".")[0] not in (*GROUPS, *_ROS_OWN):
            node.get_logger().warning(f"parameter {name} is not known here: ignored")
    node.add_on_set_parameters_callback(_checker(table))
    return values


def redeclare(node: Node, spec: ParameterSpec, value: Value) -> None:
    """Declare a parameter with its descriptor in place of what an override declared bare."""
    if node.has_parameter(spec.name):
        node.undeclare_parameter(spec.name)
    plain = list(value) if isinstance(value, tuple) else value
    node.declare_parameter(spec.name, plain, descriptor(spec), ignore_override=True)


def descriptor(spec: ParameterSpec) -> ParameterDescriptor:
    """A ROS descriptor of a parameter: description with unit, bounds, whether it may change."""
    unit = f" [{spec.unit}]" if spec.unit else ""
    described = ParameterDescriptor(
        name=spec.name,
        description=spec.description + unit,
        additional_constraints=spec.bounds,
        read_only=spec.read_only,
    )
    low = max(spec.minimum, spec.above)
    if not (math.isfinite(low) or math.isfinite(spec.maximum)):
        return described
    if spec.kind == "float":
        biggest = sys.float_info.max
        described.floating_point_range = [
            FloatingPointRange(
                from_value=float(max(low, -biggest)),
                to_value=float(min(spec.maximum, biggest)),
                step=0.0,
            )
        ]
    elif spec.kind == "int":
        described.integer_range = [
            IntegerRange(
                from_value=int(max(low, -(2**31))), to_value=int(min(spec.maximum, 2**31)), step=0
            )
        ]
    return described


def _checker(table: Mapping[str, ParameterSpec]) -> Any:
    def check(parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            spec = table.get(parameter.name)
            if spec is None:
                continue
            try:
                spec.check(_plain(parameter.value), "parameter")
            except InputError as error:
                return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    return check
