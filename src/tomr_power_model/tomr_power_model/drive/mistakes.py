"""Gross mistakes in a description that encoders against commands show: which, and what to mend.

The order, directions, places and radius of the wheels. What is a little off is for `radii`; here a
value is twice what it should be, in other units, or belongs to another wheel.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import chain, permutations

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.sources import ENCODER_TOPIC
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import WHEELS, Robot

Array = NDArray[np.float64]

_GROSS = 1.6  # of sizes: what is nearer to 1 is for `radii`
_LAG, _ABOVE = 0.12, 0.03  # relative: a factor seems smaller, for wheels lag behind commands
_ROUND = (2.0, 0.5)  # a diameter for a radius, a radius for a diameter
_UNITS: Mapping[str, float] = {
    "degrees in place of radians": 180.0 / math.pi,
    "revolutions per minute in place of rad/s": 30.0 / math.pi,
    "revolutions in place of radians": 0.5 / math.pi,
}
_MOST_ALIKE = 30.0  # how much more of one direction of twists there may be than of another
_OFF = 0.3  # relative error of the answers as described from which on something is wrong
_FITS = 0.15  # and with the mistake mended
_LEAST = 200  # samples
_CLOSER = 0.4  # of what a sample is off as described, at which it is as mistaken
_MOST = 0.7


@frozen
class _Mistake:
    """How wheels would answer to commands if the description had one mistake."""

    seen: str
    remedy: str
    matrix: Array  # wheel speeds by twist, (3, 3)
    is_slower: bool = False  # all wheels, as if something limited the commands


def gross_mistake(
    asked: Array, speed: Array, robot: Robot, *, slower: bool = True
) -> tuple[str, str]:
    """What is seen where wheels answer to commands as another description says, and what to mend;
    empty where they do not, or where it does not show.

    Args:
        asked: twists [m/s, m/s, rad/s], (n, 3), NaN where unknown.
        speed: of the wheels [rad/s], (n, 3), the same.
        robot: the description.
        slower: look for wheels that turn slower throughout as well, as if something limited them.
    """
    known = np.isfinite(asked).all(axis=1) & np.isfinite(speed).all(axis=1)
    known &= np.abs(asked).any(axis=1)
    if np.count_nonzero(known) < _LEAST:
        return "", ""
    # In m/s all three, turning at the wheels.
    scale = np.array([1.0, 1.0, robot.robot_radius])
    asked, speed = asked[known] * scale, speed[known]
    seen, shown = _answers(asked, speed)
    if seen is None:
        return "", ""
    expected = twist_to_wheels(robot, nominal=True) / scale
    error = _distance(seen, expected @ shown)
    if error < _OFF:
        return "", ""
    scales = _scales(robot, expected, _factor(seen, expected @ shown))
    # Of mistakes that look alike the first is the likeliest.
    found = sorted(
        (
            (round(_distance(seen, mistake.matrix @ shown), 3), mistake)
            for mistake in chain(_mistakes(robot, expected), scales)
            if slower or not mistake.is_slower
        ),
        key=lambda item: item[0],
    )
    (left, best), (next_best, _) = found[:2]
    is_ambiguous = shown.shape[1] < WHEELS and next_best < _FITS
    if left >= _FITS or is_ambiguous or not _is_better(asked, speed, best.matrix, expected):
        return "", ""
    return (
        f"{best.seen}: encoders against commands are {100 * error:.0f} % off as described, "
        f"{100 * left:.0f} % so",
        best.remedy,
    )


def _answers(asked: Array, speed: Array) -> tuple[Array | None, Array]:
    """Wheel speeds by the directions of twists that are shown, (3, k), and these, (3, k); None
    where fewer than two are, or no wheel answers."""
    _, sizes, directions = np.linalg.svd(asked, full_matrices=False)
    shown = directions[sizes > sizes[0] / _MOST_ALIKE].T
    found, *_ = np.linalg.lstsq(asked @ shown, speed, rcond=None)
    seen = np.asarray(found.T)
    return (seen if shown.shape[1] > 1 and seen.any() else None), shown


def _is_better(asked: Array, speed: Array, mistaken: Array, described: Array) -> bool:
    """Whether most of what is not as described is as mistaken: not a mixture of what is and wheels
    that stand."""
    as_described, as_mistaken = asked @ described.T, asked @ mistaken.T
    off, others = (np.linalg.norm(speed - to, axis=1) for to in (as_described, as_mistaken))
    strays = off > _OFF * np.linalg.norm(as_described, axis=1)
    # A wheel that stands is near to what turns slowly.
    near = _CLOSER * np.minimum(off, 2.0 * np.linalg.norm(as_mistaken, axis=1))
    return bool(np.mean((others < near)[strays]) > _MOST) if strays.any() else False


def _factor(seen: Array, expected: Array) -> float:
    """How many times what is expected is seen."""
    return float(np.sum(seen * expected) / np.sum(expected**2))


def _distance(seen: Array, expected: Array) -> float:
    """Relative difference; answers that lag seem a little small, so their size is free by 15 %."""
    scale = float(np.clip(_factor(seen, expected), 0.85, 1.05))
    return float(np.linalg.norm(seen - scale * expected) / np.linalg.norm(seen))


def _mistakes(robot: Robot, expected: Array) -> Iterator[_Mistake]:
    names = robot.wheel_names
    for order in permutations(range(WHEELS)):
        if order != (0, 1, 2):
            # The wheel called names[i] turns as the one in place order[i] should.
            right = [names[order.index(position)] for position in range(WHEELS)]
            yield _Mistake(
                "the order of the wheels is wrong",
                f"write robot.wheel_names: [{', '.join(right)}]",
                expected[list(order)],
            )
    for wheel, name in enumerate(names):
        signs = np.ones((WHEELS, 1))
        signs[wheel] = -1.0
        yield _Mistake(
            f"the encoder of {name} counts against its sense",
            "change its sign in the driver",
            signs * expected,
        )
    yield _Mistake(
        "all wheels turn against their sense", "change the signs in the driver", -expected
    )
    for degrees in range(30, 360, 30):
        angle = math.radians(degrees)
        turned = expected.copy()
        turned[:, :2] = expected[:, :2] @ _rotation(angle)
        offset = round(math.remainder(robot.wheel_offset + angle, 2.0 * math.pi), 4) + 0.0
        yield _Mistake(
            f"the wheels stand {degrees} degrees further around than described",
            f"write robot.wheel_offset: {offset:g}, or this robot.yaml belongs to another robot",
            turned,
        )
    for axis, what in ((1, "linear.y"), (2, "angular.z")):
        flipped = expected.copy()
        flipped[:, axis] *= -1.0
        yield _Mistake(
            f"{what} of the commands has the wrong sign",
            "commands are in base_link with y to the left and z up (REP 103): mend what sends them",
            flipped,
        )


def _scales(robot: Robot, expected: Array, factor: float) -> Iterator[_Mistake]:
    """Sizes that are off; `factor`: by which all wheels seem to be faster than expected."""
    if factor > _GROSS or 0.0 < factor < 1.0 / _GROSS:
        factor = next((much for much in _ROUND if _is_about(factor, much)), factor)
        seen = f"the wheels turn {factor:.3g} times as fast as described"
        matrix, is_slower = factor * expected, factor < 1.0
        yield _Mistake(seen, _remedy(robot, factor), matrix, is_slower=is_slower)
    for far in _ROUND:
        wide = expected.copy()
        wide[:, 2] *= far
        yield _Mistake(
            f"the wheels stand {far:g} times as far out as described",
            f"write robot.robot_radius: {far * robot.robot_radius:g}",
            wide,
            is_slower=far < 1.0,
        )


def _remedy(robot: Robot, factor: float) -> str:
    shaft = ("the motor's shaft in place of the wheel", robot.motors[0].gear_ratio)
    for name, much in (shaft, *_UNITS.items()):
        if _is_about(factor, much):
            return f"{ENCODER_TOPIC} seems to give {name}: mend the driver that sends it"
    return (
        f"write robot.wheel_radius: {robot.wheel_radius / factor:.3g}, or mend the gear ratio "
        "by which the driver counts, or see what changes the commands on their way"
    )


def _is_about(factor: float, much: float) -> bool:
    return -_LAG < factor / much - 1.0 < _ABOVE


def _rotation(angle: float) -> Array:
    """Takes a twist's linear part to that seen from axes turned by an angle [rad], (2, 2)."""
    return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
