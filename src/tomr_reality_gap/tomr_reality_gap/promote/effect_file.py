"""The text of an effect's file, and of its test, from a law and its parameters."""

import math
import re
from collections.abc import Mapping
from string import Template

from attrs import frozen

from tomr_power_model.errors import InputError
from tomr_reality_gap.explanation import Estimate
from tomr_reality_gap.fit.law_forms import SMOOTH
from tomr_reality_gap.promote.learnt_law import LearntLaw

_REACH = 10.0  # half-widths of an interval to either side: what an effect's parameter may be
_EXACT = 0.02  # relative: no parameter is known better


@frozen
class _Hook:
    """How an effect acts as a family does: which law of it, and what the law's variable is."""

    law: str
    given: str  # what the law gets besides its parameters
    variable: str
    factor: str  # of the value
    words: str
    mission: str
    in_currents: bool = True


_HOOKS: Mapping[str, _Hook] = {
    "torque.speed": _Hook(
        "moving_torque",
        "wheel: Wheel",
        "abs(wheel.speed)",
        " * math.tanh(wheel.speed / MOVING)",
        "speed",
        "SPEEDS",
    ),
    "torque.angle": _Hook(
        "moving_torque",
        "wheel: Wheel",
        # None where the angle is not known.
        "wheel.angle if wheel.angle == wheel.angle else 0.0",
        "",
        "angle",
        "SPEEDS",
    ),
    "torque.tight_angle": _Hook(
        "moving_torque",
        "wheel: Wheel",
        "wheel.angle if wheel.angle == wheel.angle else 0.0",
        " * math.tanh(wheel.speed / MOVING)",
        "tight angle",
        "SPEEDS",
    ),
    "driver.current": _Hook(
        "driver_power", "current: float", "abs(current)", "", "current", "VARIED", False
    ),
}

_FILE = Template('''\
"""$headline, learnt from recordings."""

import math
from types import MappingProxyType

from tomr_power_model.effects import Effect, EffectParameter, HypothesisPrior, Wheel, effect
from tomr_power_model.effects.missions import $mission

MOVING = 0.1  # rad/s: the sign of slower motion is not sure
WIDTH = $width  # of the variable, over which a step is smooth


@effect
class $name(Effect):
    """$formula, x the $variable_words.

    As it was learnt, with 95 % intervals:
$learnt
    """

    effect_id = "$effect_id"
    label = "$headline"
    parameters = MappingProxyType(
        {
$parameters
        }
    )
    prior = HypothesisPrior(
        {"size": lambda scales: $size},
        lambda scales: [{$shapes}],
        sign=$sign,
    )
    mission = $mission
    in_currents = $in_currents

    @staticmethod
    def $law($arguments, $given) -> float:
        """$returns"""
        x = $variable
        return $formula$factor
''')

_TEST = Template('''\
"""$headline: the law as it was learnt. Add what else is known of it."""

from pathlib import Path

import pytest

from tomr_power_model.effects import EFFECTS, Wheel
from tomr_power_model.effects.user import load_effects

EFFECT = "$effect_id"
LEARNT = $values
load_effects(Path(__file__).parent)


def at(x: float) -> float:
    """The law as it was learnt."""
    wheel = Wheel(speed=x, load=50.0, transmitted=0.0, angle=x, radius=0.05, gear_ratio=20.0)
    return float(EFFECTS[EFFECT].$law(*LEARNT.values(), $passed))


@pytest.mark.parametrize(("x", "expected"), $points)
def test_the_law_is_as_it_was_learnt(x: float, expected: float) -> None:
    assert at(x) == pytest.approx(expected, rel=1e-4, abs=1e-9)


def test_what_was_learnt_is_within_the_ranges() -> None:
    for name, value in LEARNT.items():
        parameter = EFFECTS[EFFECT].parameters[name]
        assert parameter.minimum <= value <= parameter.maximum
''')


def effect_files(found: LearntLaw) -> dict[str, str]:
    """Texts by file name: the effect and its test. Raises InputError where no effect can act so."""
    hook = _HOOKS.get(found.family.family_id)
    if hook is None or not found.law.formula:
        able = ", ".join(_HOOKS)
        raise InputError(
            f"{found.family.family_id}, {found.law.name}: no effect acts on that: what can be "
            f"promoted depends on {able}; the table itself runs as it stands in the description"
        )
    _check_shapes(found)
    words = f"{found.law.name} by {hook.words}"
    stem = re.sub(r"\W+", "_", words)
    shared = {
        "effect_id": f"learnt.{stem}",
        "headline": f"{words[0].upper()}{words[1:]}",
        "law": hook.law,
    }
    return {
        f"{stem}.py": _FILE.substitute(shared, **_of_file(found, hook, stem)),
        f"test_{stem}.py": _TEST.substitute(shared, **_of_test(found, hook)),
    }


def _check_shapes(found: LearntLaw) -> None:
    """Raise InputError for a shape that could be tried neither larger nor smaller by a share."""
    for name, item in found.parameters.items():
        if name != "size" and item.unit != "rad" and item.value <= 0.0:
            raise InputError(
                f"{found.law.name}: its {name} is {item.value:g} {item.unit}: an effect is tried "
                "around a positive one: choose another law"
            )


def _of_file(found: LearntLaw, hook: _Hook, stem: str) -> dict[str, object]:
    size = found.parameters["size"].value
    shapes = {name: item for name, item in found.parameters.items() if name != "size"}
    return {
        "mission": hook.mission,
        "width": f"{SMOOTH * found.spacing:.6g}",
        "name": "".join(part.capitalize() for part in stem.split("_")),
        "formula": found.law.formula,
        "variable_words": found.family.axes[0].title,
        "learnt": "\n".join(f"    {_line(name, item)}" for name, item in found.parameters.items()),
        "parameters": "\n".join(
            f'            "{name}": {_parameter(name, item)},'
            for name, item in found.parameters.items()
        ),
        "size": f"{abs(size):.6g}",
        "shapes": ", ".join(f'"{name}": {item.value:.6g}' for name, item in shapes.items()),
        "sign": 1 if size > 0.0 else -1,
        "in_currents": hook.in_currents,
        "arguments": ", ".join(f"{name}: float" for name in found.parameters),
        "given": hook.given,
        "variable": hook.variable,
        "factor": hook.factor,
        "returns": "Torque against positive motion [N m]."
        if hook.law == "moving_torque"
        else "Lost in the driver [W].",
    }


def _line(name: str, item: Estimate) -> str:
    return f"{name} {item.value:.4g} [{item.low:.4g}, {item.high:.4g}] {item.unit}".rstrip()


def _parameter(name: str, item: Estimate) -> str:
    """Its range and prior from the interval; an angle may be anything, and nothing is none."""
    half = max(0.5 * (item.high - item.low), _EXACT * abs(item.value))
    low, high = item.value - _REACH * half, item.value + _REACH * half
    if name == "size":
        low, high, neutral = min(low, 0.0), max(high, 0.0), 0.0
        low, high = (0.0, high) if item.value > 0.0 else (low, 0.0)
    elif item.unit == "rad":
        low, high, neutral = -1e2, 1e2, item.value
    else:
        low, neutral = max(low, 0.1 * item.value), item.value
        high = min(high, 6.0) if name == "exponent" else high
    numbers = ", ".join(f"{number:.6g}" for number in (low, high))
    return (
        f'EffectParameter("{item.unit}", {numbers}, neutral={neutral:.6g}, '
        f"start={item.value:.6g}, prior_std={half:.6g})"
    )


def _of_test(found: LearntLaw, hook: _Hook) -> dict[str, object]:
    values = {name: float(f"{item.value:.6g}") for name, item in found.parameters.items()}
    knots = [found.spacing * number for number in (2, 5, 9)]
    points = [(float(f"{x:.6g}"), float(f"{_value(found, hook, values, x):.6g}")) for x in knots]
    return {
        "values": repr(values),
        "passed": "wheel" if hook.law == "moving_torque" else "x",
        "points": repr(points),
    }


def _value(found: LearntLaw, hook: _Hook, values: Mapping[str, float], x: float) -> float:
    """The law from its table in `laws`, not from its formula: the test holds one to the other."""
    import numpy as np

    grid = np.array([0.0, found.spacing, x])[:, None]
    value = float(np.ravel(found.law.value(np.array(list(values.values())), grid))[-1])
    return value * math.tanh(x / 0.1) if hook.factor else value
