"""What is concealed in a case, with its values, and the real robot that has it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from concealed.beyond import OUTSIDE
from concealed.catalogue import ALL, BODY, ONE, SIZES, SUPPLY, Concealed, Where
from concealed.recipes import RECIPES
from concealed.robots import (
    WHEEL_JOINTS,
    Deviations,
    Nested,
    by_wheel,
    deviating,
    is_parameter,
    nominal_value,
)
from concealed.scales import Scales
from tomr_power_model.effects import EFFECTS
from tomr_power_model.estimation.parameter import unit_of
from tomr_power_model.robot import Robot, robot_from_parameters
from tomr_sim_bridge.plant.effects import PlantEffect


@frozen
class Hidden:
    """One concealed effect with its values."""

    effect: str  # of the vocabulary, parameter.*, or x.* for one outside of it
    wheels: tuple[int, ...]  # 0..2; empty: body or supply
    where: tuple[str, ...]
    size: float  # in the unit of its recipe; of a parameter the relative error
    size_name: str
    values: Mapping[str, float]


def hidden_of(item: Concealed, nominal: Nested, random: np.random.Generator) -> Hidden:
    """Draw place and values of an effect."""
    wheels, where = _place(item.where, random)
    if is_parameter(item.effect):
        error = float(item.size)
        return Hidden(item.effect, wheels, where, error, f"{error:+.0%}", {"error": error})
    outside = OUTSIDE.get(item.effect)
    recipe = RECIPES[item.effect] if outside is None else outside.recipe
    size = recipe.sizes[SIZES.index(item.size)] if isinstance(item.size, str) else item.size
    values = recipe.make(size, Scales.of(nominal), random)
    name = item.size if isinstance(item.size, str) else f"{size:g}"
    return Hidden(item.effect, wheels, where, size, name, values)


def rescaled(hidden: Hidden, factor: float) -> Hidden:
    """The same effect, all its values times a factor."""
    values = {key: value * factor for key, value in hidden.values.items()}
    size = hidden.size * factor
    name = f"{size:+.0%}" if is_parameter(hidden.effect) else f"{size:.3g}"
    return evolve(hidden, values=values, size=size, size_name=name)


def _place(where: Where, random: np.random.Generator) -> tuple[tuple[int, ...], tuple[str, ...]]:
    if where == ONE:
        wheel = int(random.integers(len(WHEEL_JOINTS)))
        return (wheel,), (WHEEL_JOINTS[wheel],)
    places: dict[Where, tuple[int, ...]] = {ALL: (0, 1, 2), BODY: (), SUPPLY: ()}
    return places[where], (where,)


def real_parameters(
    nominal: Nested, deviations: Deviations, hidden: Sequence[Hidden]
) -> dict[str, Any]:
    """Flat parameters of the real robot with what the vocabulary can say of the concealed."""
    real = deviating(nominal, deviations)
    for item in hidden:
        if is_parameter(item.effect):
            for key in _keys(item):
                real[key] = float(real[key]) * (1.0 + item.size)
        elif item.effect in EFFECTS:
            wheels: tuple[int | None, ...] = item.wheels or (None,)
            for wheel in wheels:
                for name, value in item.values.items():
                    key = f"physics.{item.effect}.{name}"
                    real[key if wheel is None else by_wheel(key, wheel)] = value
    return real


def _keys(item: Hidden) -> list[str]:
    key = item.effect.removeprefix("parameter.")
    return [by_wheel(key, wheel) for wheel in item.wheels] or [key]


def robot_of(parameters: Mapping[str, Any], **sensors: float) -> Robot:
    """The plant's robot; `sensors` are set on top."""
    extra = {f"sensors.{key}": value for key, value in sensors.items()}
    return robot_from_parameters({**parameters, **extra}, "concealed case")


def beyond_effects(hidden: Sequence[Hidden], robot: Robot) -> list[PlantEffect]:
    """Plant effects of what lies outside the vocabulary."""
    found: list[PlantEffect] = []
    for item in hidden:
        if item.effect in OUTSIDE:
            present = np.isin(np.arange(len(WHEEL_JOINTS)), item.wheels).astype(float)
            found.append(OUTSIDE[item.effect].effect(robot, present, item.values))
    return found


def truth_of(
    hidden: Sequence[Hidden], nominal: Nested, deviations: Deviations
) -> list[dict[str, Any]]:
    """The concealed effects as the truth file states them."""
    return [
        {"id": f"e{number}", **_truth(item, nominal, deviations)}
        for number, item in enumerate(hidden, start=1)
    ]


def _truth(item: Hidden, nominal: Nested, deviations: Deviations) -> dict[str, Any]:
    stated: dict[str, Any] = {"effect": item.effect, "where": list(item.where)}
    outside = OUTSIDE.get(item.effect)
    if is_parameter(item.effect):
        stated["parameters"] = _wrong_value(item, nominal, deviations)
    elif outside is None:
        units = EFFECTS[item.effect].parameters
        stated["parameters"] = {
            key: {"value": value, "unit": units[key].unit} for key, value in item.values.items()
        }
    else:
        stated |= {"effect": "unknown", "nature": item.effect, "shape": outside.shape}
        stated["parameters"] = {
            key: {"value": value, "unit": outside.units[key]} for key, value in item.values.items()
        }
    return stated | {"size": item.size_name, "amount": item.size}


def _wrong_value(item: Hidden, nominal: Nested, deviations: Deviations) -> dict[str, Any]:
    """What the part really is, the mean over its wheels, and what the description says."""
    key = item.effect.removeprefix("parameter.")
    node = nominal_value(nominal, key)
    factor = deviations.get(key, 1.0)
    if isinstance(factor, list):
        factor = float(np.mean([factor[wheel] for wheel in item.wheels]))
    unit = unit_of(key)
    return {
        "value": {"value": node * factor * (1.0 + item.size), "unit": unit},
        "nominal": {"value": node, "unit": unit},
    }
