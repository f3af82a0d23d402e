"""What no named effect explains: which variable it depends on, at which wheels, in what shape."""

from collections.abc import Sequence

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS, Robot
from tomr_reality_gap.explanation import Shape
from tomr_reality_gap.fit.linear import Gram, solve
from tomr_reality_gap.fit.noise import rows_of
from tomr_reality_gap.fit.search import Fitted, Found
from tomr_reality_gap.fit.study import Columns, Study
from tomr_reality_gap.mismatch.probes import Family, families

Array = NDArray[np.float64]

_SIZE = 0.1  # of a typical torque, belief about each bump
_POINTS = 80
_NEEDED = 10.0  # log evidence that a named finding must bring beside an unnamed one
_NEEDED_SHARE = 0.3  # or this part of what the unnamed one brings


@frozen
class Leftover:
    """The family of torques that explains most of what is left."""

    family: Family
    evidence: float  # log, against nothing but the named model, of all wheels that have it
    wheels: tuple[int, ...]
    by_wheel: tuple[float, ...]
    columns: Array  # of its bumps at those wheels, weighted (n, k)
    shapes: tuple[Shape, ...]


def leftovers(
    study: Study, fitted: Fitted, columns: Columns, found: Found, robot: Robot, torque: float
) -> list[Leftover]:
    """Each family with its evidence, best first."""
    groups = _families(study, robot)
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    weight = found.noise.weight
    base = columns.matrix[:, :kept] * weight[:, None]
    residual = (study.value - fitted.value) * weight
    results = []
    value = study.predict([robot])[0]
    for number in range(len(groups[0])):
        family = groups[0][number]
        size = _SIZE * torque
        response = study.respond(robot, [group[number].torque * size for group in groups]) - value
        results.append(_result(study, family, size, base, residual, response.T, weight))
    return sorted(results, key=lambda item: -item.evidence)


def _families(study: Study, robot: Robot) -> list[tuple[Family, ...]]:
    """Of each recording; those that only some recordings have are left out."""
    groups = [families(item, robot, item.run(robot)) for item in study.forwards]
    fewest = min(len(group) for group in groups)
    return [group[:fewest] for group in groups]


def _result(
    study: Study,
    family: Family,
    size: float,
    base: Array,
    residual: Array,
    response: Array,
    weight: Array,
) -> Leftover:
    parts = [_at_wheel(study, response, wheel) * weight[:, None] for wheel in range(WHEELS)]
    alone = solve(Gram.of(base, residual), range(base.shape[1])).evidence
    gains = []
    for part in parts:
        both = np.concatenate([base, part], axis=1)
        gains.append(solve(Gram.of(both, residual), range(both.shape[1])).evidence - alone)
    most = max(gains)
    wheels = tuple(wheel for wheel in range(WHEELS) if gains[wheel] > max(0.2 * most, 10.0))
    if not wheels:
        wheels = (int(np.argmax(gains)),)
    chosen = np.concatenate([parts[wheel] for wheel in wheels], axis=1)
    both = np.concatenate([base, chosen], axis=1)
    whole = solve(Gram.of(both, residual), range(both.shape[1]))
    shapes = []
    for place, wheel in enumerate(wheels):
        rows = base.shape[1] + place * response.shape[1] + np.arange(response.shape[1])
        shapes.append(_shape(study, family, size, wheel, whole.mean[rows], whole.covariance, rows))
    return Leftover(family, whole.evidence - alone, wheels, tuple(gains), chosen, tuple(shapes))


def _at_wheel(study: Study, response: Array, wheel: int) -> Array:
    """Rows of one wheel's own channels; of the total where no wheel is measured by itself."""
    kept = np.zeros_like(response)
    alone = not any(channel.kind == "power" for channel in study.channels)
    for channel, part in zip(study.channels, rows_of(study.channels), strict=True):
        if channel.wheel == wheel or (alone and channel.kind == "total"):
            kept[part] = response[part]
    return kept


def _shape(
    study: Study,
    family: Family,
    size: float,
    wheel: int,
    mean: Array,
    covariance: Array,
    rows: Array,
) -> Shape:
    names = study.forwards[0].robot.wheel_names
    if len(np.unique(family.knots)) < len(family.knots):  # harmonics: a curve over the turn
        at = np.linspace(0.0, 2.0 * np.pi, _POINTS)
        orders = family.knots
        waves = [
            (np.cos if place % 2 == 0 else np.sin)(order * at) for place, order in enumerate(orders)
        ]
        basis = np.stack(waves, axis=1)
    else:
        at = np.linspace(family.knots[0], family.knots[-1], _POINTS)
        width = max(float(family.knots[1] - family.knots[0]), 1e-9)
        basis = np.exp(-0.5 * ((at[:, None] - family.knots) / width) ** 2)
    part = covariance[np.ix_(rows, rows)]
    curve = size * basis @ mean
    half = 1.96 * size * np.sqrt(np.einsum("ij,jk,ik->i", basis, part, basis))
    return Shape(family.variable, names[wheel], at, curve, curve - half, curve + half)


def still_needed(
    study: Study, fitted: Fitted, columns: Columns, found: Found, leftover: Leftover
) -> list[bool]:
    """Whether each named finding is needed once the leftover's torques are there."""
    weight = found.noise.weight
    kept = columns.instruments.stop + sum(part.stop - part.start for part in columns.own)
    base = columns.matrix[:, :kept] * weight[:, None]
    own = [
        turn / knob.spread
        for knob, turn in zip(fitted.model.own, fitted.model.own_turns, strict=True)
    ]
    first = columns.instruments.stop
    residual = (study.value - fitted.value) * weight + base[:, first:] @ np.array(own)
    both = np.concatenate([base, leftover.columns], axis=1)
    gram = Gram.of(both, residual)
    everything = list(range(both.shape[1]))
    whole = solve(gram, everything).evidence
    least = max(_NEEDED, _NEEDED_SHARE * leftover.evidence)
    needed = []
    for part in columns.own:
        rest = [row for row in everything if not part.start <= row < part.stop]
        needed.append(whole - solve(gram, rest).evidence > least)
    return needed


def names(wheels: Sequence[int], robot: Robot) -> tuple[str, ...]:
    """Wheels as a report names them."""
    return ("all_wheels",) if len(wheels) == WHEELS else tuple(robot.wheel_names[w] for w in wheels)
