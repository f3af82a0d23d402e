"""Short laws by what they depend on: adding one is one entry of `_FORMS`."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZES = ("size", "coefficient", "stiffness")  # first parameters, that a law is proportional to
TINY = 1e-9
SMOOTH = 0.25  # of the distance between knots, of a step


@frozen
class Law:
    """A short law: its parameters with units (`*` is the table's), starts, and values at places."""

    name: str
    words: str  # with the parameters by name
    families: tuple[str, ...]
    units: Mapping[str, str]
    starts: Callable[[Array, Array], Sequence[Sequence[float]]]  # places (k, axes), values (c, k)
    value: Callable[[Array, Array], Array]  # of parameters and places: (c, k) or (k,)
    # The same of one variable x as an effect's file has it; WIDTH: over which a step is smooth.
    formula: str = ""


def _apart(p: Array, at: Array) -> tuple[Array, Array]:
    away = p[-2:] - at
    return away, np.maximum(np.hypot(away[:, 0], away[:, 1]), TINY)


def _spring(p: Array, at: Array) -> Array:
    away, distance = _apart(p, at)
    return np.asarray(p[0] * np.maximum(distance - abs(p[1]), 0.0) / distance * away.T)


def _spring_starts(at: Array, values: Array) -> list[list[float]]:
    """Anchors inside and around; the stiffness from the largest force over the largest distance."""
    middle, reach = at.mean(axis=0), np.ptp(at, axis=0)
    stiff = float(np.abs(values).max()) / max(float(reach.max()), TINY)
    shifts = product((-0.3, 0.0, 0.3), repeat=2)
    return [[2 * stiff, 0.2 * float(reach.max()), *(middle + reach * s)] for s in shifts]


def _wind(p: Array, at: Array) -> Array:
    away, speed = _apart(p, at)
    return np.asarray(p[0] * speed * away.T)


def _wind_starts(at: Array, values: Array) -> list[list[float]]:
    fast = max(float(np.ptp(at, axis=0).max()), TINY)
    size = float(np.abs(values).max()) / fast**2
    return [[size, x * fast, y * fast] for x, y in product((-1.0, -0.3, 0.3, 1.0), repeat=2)]


def _patch(p: Array, at: Array) -> Array:
    _, distance = _apart(p, at)
    return np.asarray(p[0] * _risen(abs(p[1]) - distance, _cell(at)))


def _patch_starts(at: Array, values: Array) -> list[list[float]]:
    """Around the largest values, their size."""
    mean = values.mean(axis=0)
    size, reach = _extreme(values), float(np.ptp(at, axis=0).max())
    most = [at[number] for number in np.argsort(-mean * np.sign(size))[:4]]
    return [[size, part * reach, *place] for part in (0.07, 0.15, 0.3) for place in most]


def _stripes(p: Array, at: Array) -> Array:
    across = at[:, 0] * np.cos(p[2]) + at[:, 1] * np.sin(p[2])
    width = max(abs(p[1]), TINY)
    edge = np.pi / width * _cell(at)
    return np.asarray(p[0] * _risen(np.sin(np.pi * across / width + p[3]), edge))


def _stripes_starts(at: Array, values: Array) -> list[list[float]]:
    """Close by each other: who is off by half a stripe at the other end finds no way."""
    size, widths = _extreme(values), np.geomspace(2.0, 8.0, 24) * _cell(at)
    azimuths, phases = np.arange(24) * np.pi / 24, np.arange(8) * np.pi / 4
    return [[size, *start] for start in product(widths, azimuths, phases)]


def _edge(p: Array, at: Array) -> Array:
    across = at[:, 0] * np.cos(p[1]) + at[:, 1] * np.sin(p[1])
    return np.asarray(p[0] * _risen(across - p[2], _cell(at)))


def _edge_starts(at: Array, values: Array) -> list[list[float]]:
    size, azimuths = _extreme(values), np.arange(12) * np.pi / 6
    return [
        [size, azimuth, middle + shift]
        for azimuth in azimuths
        for middle in [at.mean(axis=0) @ (np.cos(azimuth), np.sin(azimuth))]
        for shift in (-0.5, 0.0, 0.5)
    ]


def _cell(at: Array) -> float:
    """Least distance between knots."""
    steps = np.diff(np.unique(at[:, 0]))
    return float(steps[steps > TINY].min(initial=np.inf))


def _risen(beyond: Array, cell: float) -> Array:
    """A step from 0 to 1, as smooth as the table."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(beyond / (SMOOTH * cell), -50.0, 50.0))))


def _bump(p: Array, at: Array) -> Array:
    away = np.angle(np.exp(1j * (at[:, 0] - p[2])))
    return np.asarray(p[0] * np.exp(-((away / max(abs(p[1]), TINY)) ** 2)))


def _bump_starts(at: Array, values: Array) -> list[list[float]]:
    mean = values.mean(axis=0)
    place = float(at[int(np.argmax(np.abs(mean))), 0])
    return [[_extreme(values), width, place] for width in (0.1, 0.3, 0.8)]


def _extreme(values: Array) -> float:
    mean = values.mean(axis=0)
    return float(mean[int(np.argmax(np.abs(mean)))])


def _curve_starts(*shapes: float) -> Callable[[Array, Array], list[list[float]]]:
    """Size from the values, the shape from parts of the variable's range."""

    def starts(at: Array, values: Array) -> list[list[float]]:
        low, reach = float(at.min()), float(np.ptp(at))
        return [[_extreme(values), low + part * reach] for part in shapes]

    return starts


def _harmonic_starts(at: Array, values: Array) -> list[list[float]]:
    size = float(np.abs(values).max())
    return [[size, float(n), q] for n, q in product(range(1, 13), (0.0, 2.0, 4.0))]


_SPEEDS = ("torque.speed", "driver.speed", "driver.current", "torque.current", "supply.current")
_MEMORY = ("torque.since_stand", "torque.turned", "torque.from_rest", "torque.time")
_STEP = "/ (1.0 + math.exp(min((threshold - x) / WIDTH, 50.0)))"
_X, _Y = {"x": "m", "y": "m"}, {"x": "m/s", "y": "m/s"}
_FORMS = (
    Law(
        "spring",
        "pulled to a point at ({x}, {y}) from the start with {stiffness} beyond {slack}",
        ("force.place",),
        {"stiffness": "N/m", "slack": "m", **_X},
        _spring_starts,
        _spring,
    ),
    Law(
        "wind",
        "pushed as by a wind of ({x}, {y}) in the world, {coefficient} times the square",
        ("force.velocity",),
        {"coefficient": "N s^2/m^2", **_Y},
        _wind_starts,
        _wind,
    ),
    Law(
        "steady force",
        "pushed with ({x}, {y}) in the world, everywhere",
        ("force.place", "force.velocity"),
        {"x": "N", "y": "N"},
        lambda at, values: [values.mean(axis=1).tolist()],
        lambda p, at: np.repeat(p[:, None], len(at), axis=1),
    ),
    Law(
        "patch",
        "resists with {size} within {radius} of ({x}, {y}) from the start",
        ("torque.place",),
        {"size": "*", "radius": "m", **_X},
        _patch_starts,
        _patch,
    ),
    Law(
        "stripes",
        "resists with {size} on stripes {width} wide, as far apart, across {azimuth} from the start"
        " (phase {phase})",
        ("torque.place",),
        {"size": "*", "width": "m", "azimuth": "rad", "phase": "rad"},
        _stripes_starts,
        _stripes,
    ),
    Law(
        "edge",
        "resists with {size} beyond a line {distance} from the start towards {azimuth}",
        ("torque.place",),
        {"size": "*", "azimuth": "rad", "distance": "m"},
        _edge_starts,
        _edge,
    ),
    Law(
        "power law",
        "{size} times the variable to the power of {exponent}",
        _SPEEDS,
        {"size": "*", "exponent": ""},
        lambda at, values: [[_extreme(values) / at.max() ** n, n] for n in (0.5, 1.0, 2.0, 3.0)],
        lambda p, at: p[0] * np.maximum(at[:, 0], TINY) ** np.clip(p[1], 0.0, 6.0),
        "size * x**exponent",
    ),
    Law(
        "square beyond a threshold",
        "{size} times the square of the variable beyond {threshold}",
        _SPEEDS,
        {"size": "*", "threshold": "variable"},
        lambda at, values: [
            [_extreme(values) / at.max() ** 2, part * at.max()] for part in (0.1, 0.3, 0.5, 0.7)
        ],
        lambda p, at: p[0] * at[:, 0] ** 2 * _above(at[:, 0], p[1]),
        f"size * x * x {_STEP}",
    ),
    Law(
        "square of the excess",
        "{size} times the square of the variable's excess over {threshold}",
        _SPEEDS,
        {"size": "*", "threshold": "variable"},
        lambda at, values: [
            [_extreme(values) / ((1.0 - part) * at.max()) ** 2, part * at.max()]
            for part in (0.05, 0.2, 0.4, 0.6)
        ],
        lambda p, at: p[0] * np.maximum(at[:, 0] - p[1], 0.0) ** 2,
        "size * max(x - threshold, 0.0) ** 2",
    ),
    Law(
        "bump",
        "{size} at one angle, {place}, {width} to either side",
        ("torque.angle", "torque.tight_angle"),
        {"size": "*", "width": "rad", "place": "rad"},
        _bump_starts,
        _bump,
        "size * math.exp(-((math.remainder(x - place, math.tau) / width) ** 2))",
    ),
    Law(
        "step",
        "{size} beyond {threshold}",
        (*_SPEEDS, *_MEMORY),
        {"size": "*", "threshold": "variable"},
        _curve_starts(0.1, 0.3, 0.5, 0.7),
        lambda p, at: p[0] * _above(at[:, 0], p[1]),
        f"size {_STEP}",
    ),
    Law(
        "exponential",
        "{size} that dies out over {decay}",
        (*_MEMORY, *_SPEEDS),
        {"size": "*", "decay": "variable"},
        _curve_starts(0.05, 0.15, 0.4),
        lambda p, at: p[0] * np.exp(-np.clip(at[:, 0] / max(abs(p[1]), TINY), -50.0, 50.0)),
        "size * math.exp(-max(min(x / decay, 50.0), -50.0))",
    ),
    Law(
        "periodic",
        "{size} that comes {order} times a turn, at {phase}",
        ("torque.angle", "torque.tight_angle", "torque.direction", "torque.heading"),
        {"size": "*", "order": "1/rev", "phase": "rad"},
        _harmonic_starts,
        lambda p, at: p[0] * np.sin(round(p[1]) * at[:, 0] + p[2]),
        "size * math.sin(order * x + phase)",
    ),
)


LAWS: Mapping[str, Law] = {law.name: law for law in _FORMS}


def _above(values: Array, threshold: float) -> Array:
    """Whether a variable is beyond a threshold, as smooth as the table."""
    return _risen(values - threshold, _cell(values[:, None]))
