"""Learnt terms as they stand in robot.yaml: flat parameters `unmodelled.<name>.<field>`."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.unmodelled.base import FAMILIES
from tomr_power_model.unmodelled.term import LearntTerm

Array = NDArray[np.float64]

PREFIX = "unmodelled."
VERSION = 2  # of what the fields mean
_FIELDS = ("version", "robot", "family", "wheels", "unit", "knots_1", "knots_2", "values")
_OWNER = ("robot.mass", "robot.robot_radius", "robot.wheel_radius")
_ALIKE = 0.1  # relative: a robot that was measured anew is the same
_DIGITS = 6
_UNEVEN = 1e-3  # of the spacing


def terms_of(
    values: Mapping[str, object], names: Sequence[str], place: str
) -> tuple[LearntTerm, ...]:
    """All learnt terms among a description's flat parameters, `names` those of the wheels.

    Raises InputError for what is missing, unknown, or does not fit together.
    """
    found: dict[str, dict[str, object]] = {}
    for key, value in values.items():
        if key.startswith(PREFIX):
            name, _, field = key.removeprefix(PREFIX).rpartition(".")
            if field not in _FIELDS or not name:
                raise InputError(f"{place}: {key} is unknown: give {', '.join(_FIELDS)}")
            found.setdefault(name, {})[field] = value
    for name, fields in found.items():
        _check_owner(fields, _owner(values), f"{place}: {PREFIX}{name}")
    return tuple(_term(fields, names, f"{place}: {PREFIX}{name}") for name, fields in found.items())


def _owner(values: Mapping[str, object]) -> list[float]:
    """What distinguishes robots: mass, their radius and that of the wheels [kg, m, m]."""
    return [float(values[key]) for key in _OWNER]  # type: ignore[arg-type]


def _check_owner(fields: Mapping[str, object], owner: Sequence[float], place: str) -> None:
    """Raise InputError for a table of another version, or of another robot."""
    if fields.get("version") != VERSION:
        raise InputError(
            f"{place}.version = {fields.get('version')!r}: only {VERSION} is understood: "
            "learn it anew with tomr_gap explain"
        )
    learnt_on = _numbers(fields, "robot", place)
    if len(learnt_on) != len(owner) or not np.allclose(learnt_on, owner, rtol=_ALIKE, atol=0.0):
        raise InputError(
            f"{place}.robot = {learnt_on.tolist()} is not this one, {list(owner)} (mass, radius, "
            "wheel radius): learn it anew with tomr_gap explain, or remove it"
        )


def _term(fields: Mapping[str, object], names: Sequence[str], place: str) -> LearntTerm:
    family = FAMILIES.get(str(fields.get("family")))
    if family is None:
        raise InputError(
            f"{place}.family = {fields.get('family')!r}: give one of {', '.join(FAMILIES)}"
        )
    listed = fields.get("wheels", ())
    wheels = [str(item) for item in listed] if isinstance(listed, list | tuple) else [str(listed)]
    unknown = [wheel for wheel in wheels if wheel not in names]
    if unknown:
        raise InputError(f"{place}.wheels: {unknown[0]} is no wheel: give some of {list(names)}")
    at_wheels = family.acts in ("torque", "driver")
    if at_wheels != bool(wheels):
        remedy = "name them" if at_wheels else "remove it"
        raise InputError(f"{place}.wheels = {wheels}: {family.family_id} acts elsewhere: {remedy}")
    knots = tuple(
        _knots(_numbers(fields, f"knots_{number}", place), f"{place}.knots_{number}")
        for number in range(1, len(family.axes) + 1)
    )
    rows = LearntTerm.rows(family, len(wheels))
    table = _numbers(fields, "values", place)
    count = rows * int(np.prod([len(points) for points in knots]))
    if len(table) != count:
        raise InputError(f"{place}.values: has {len(table)} numbers: give {count}")
    term = LearntTerm(
        family, tuple(list(names).index(wheel) for wheel in wheels), knots, table.reshape(rows, -1)
    )
    if fields.get("unit", term.unit) != term.unit:
        raise InputError(f"{place}.unit = {fields['unit']!r}: give {term.unit}")
    return term


def _numbers(fields: Mapping[str, object], field: str, place: str) -> Array:
    given = fields.get(field)
    try:
        numbers = np.array(given, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if given is None or not np.isfinite(numbers).all():
        raise InputError(f"{place}.{field} = {given!r}: give a list of finite numbers")
    return numbers


def _knots(points: Array, place: str) -> Array:
    steps = np.diff(points)
    if len(points) < 2 or steps.min() <= 0.0 or np.ptp(steps) > _UNEVEN * steps.mean():
        raise InputError(f"{place}: give two knots or more, evenly spaced and rising")
    return points


def parameters_of(
    name: str, term: LearntTerm, names: Sequence[str], values: Mapping[str, object]
) -> dict[str, object]:
    """The flat parameters of a term; `values` are those of the robot that it was learnt on."""

    def rounded(numbers: Array) -> list[float]:
        return [float(f"{number:.{_DIGITS}g}") for number in numbers.ravel()]

    found: dict[str, object] = {
        "version": VERSION,
        "robot": _owner(values),
        "family": term.family.family_id,
    }
    if term.wheels:
        found["wheels"] = [names[wheel] for wheel in term.wheels]
    found["unit"] = term.unit
    for number, points in enumerate(term.knots, start=1):
        found[f"knots_{number}"] = rounded(points)
    found["values"] = rounded(term.values)
    return {f"{PREFIX}{name}.{field}": value for field, value in found.items()}
