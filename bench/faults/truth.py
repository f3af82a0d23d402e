"""The true value of what an explanation found."""

from collections.abc import Mapping, Sequence
from typing import Any

_WHEELS = 3
_HEATING = ("electrical.winding_heating", ("thermal_resistance", "time_constant"))


def true_value(
    real: Mapping[str, Any], effect: str, where: Sequence[str], parameter: str
) -> float | None:
    """True value of a finding's parameter, mean over its wheels; None for what is not there.

    Args:
        real: of `Recordings.real`.
        effect: id, e.g. friction.stribeck or parameter.robot.mass.
        where: wheel names, all_wheels, body or supply.
        parameter: name among the effect's parameters.
    """
    wheels = _wheels(real, where)
    if effect.startswith("parameter."):
        return described_value(real, effect.removeprefix("parameter."), wheels)
    known = [
        float(item["parameters"][parameter])
        for item in real["effects"]
        if item["effect"] == effect
        and parameter in item["parameters"]
        and set(_wheels(real, item["where"])) & set(wheels)
    ]
    if known:
        return sum(known) / len(known)
    if effect == _HEATING[0] and parameter in _HEATING[1] and real.get("heating"):
        return float(real["heating"][_HEATING[1].index(parameter)])
    return described_value(real, f"physics.{effect}.{parameter}", wheels)


def described_value(
    real: Mapping[str, Any], key: str, wheels: Sequence[int] = range(_WHEELS)
) -> float | None:
    """True value of a number in the description, mean over wheels; None if it is not there."""
    nominal = _nominal(real["nominal"], key)
    if nominal is None:
        return None
    deviation = real["deviations"].get(key, 1.0)
    if isinstance(deviation, list):
        deviation = sum(deviation[wheel] for wheel in wheels) / len(wheels)
    return float(nominal * deviation)


def ratios(real: Mapping[str, Any], values: Mapping[str, object]) -> dict[str, list[float]]:
    """Values of a description over the true ones, by key: of each wheel where they differ.

    Args:
        real: of `Recordings.real`.
        values: by dotted key, as `read_description` gives them.
    """
    found = {}
    for key, deviation in real["deviations"].items():
        group, _, name = key.rpartition(".")
        wheels = real["nominal"]["robot"]["wheel_names"] if isinstance(deviation, list) else [None]
        own = []
        for number, wheel in enumerate(wheels):
            value = values.get(f"{group}.{wheel}.{name}", values.get(key))
            true = described_value(real, key, [number])
            if isinstance(value, int | float) and true:
                own.append(float(value) / true)
        found[key] = own
    return found


def _nominal(nominal: Mapping[str, Any], key: str) -> float | None:
    """A number by its dotted key; names of effects have dots themselves."""
    group, _, rest = key.partition(".")
    values = nominal.get(group, {})
    if group == "physics":
        effect, _, rest = rest.rpartition(".")
        values = values.get(effect, {})
    found = values.get(rest)
    return float(found) if isinstance(found, int | float) else None


def _wheels(real: Mapping[str, Any], where: Sequence[str]) -> tuple[int, ...]:
    """Wheels 0..2 that a place means; what is no wheel concerns all."""
    names = real["nominal"]["robot"]["wheel_names"]
    return tuple(names.index(name) for name in where if name in names) or tuple(range(_WHEELS))


def missed(real: Mapping[str, Any], found: Sequence[str]) -> list[str]:
    """Effects of the real robot, none of its description, that were not named."""
    effects = {item["effect"] for item in real["effects"]}
    if real.get("heating"):
        effects.add(_HEATING[0])
    return sorted(effects - set(found))
