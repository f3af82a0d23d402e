"""Whether the drivers hold what learnt terms do.

A torque that answers a change of a wheel's speed, or of its motor's current, more strongly than the
drivers do makes the simulated loop run away, or rattle from tick to tick, in which terms are held.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tomr_power_model.unmodelled import LearntTerm

Array = NDArray[np.float64]

# Unit of the slope over what answers to a torque or a force, by the unit of that.
_SLOPES = {"rad/s": "N m s/rad", "A": "N m/A", "m/s": "N s/m"}


def too_steep(
    term: LearntTerm,
    *,
    constants: Sequence[float],
    resistances: Sequence[float],
    proportional: float,
    wheel_radius: float,
) -> str:
    """Why a term's curve is too steep for a robot's drivers, in words; empty if it is not.

    Args:
        term: that was learnt.
        constants: torque at each wheel per motor current [N m/A].
        resistances: of each motor [ohm].
        proportional: gain of the drivers [V s/rad].
        wheel_radius: m.
    """
    if not term.family.is_coupled:
        return ""
    unit = _SLOPES[term.family.axes[0].unit]
    # Torque with which motor and driver resist a change of speed, per rad/s.
    stiff = [k * (proportional + k) / r for k, r in zip(constants, resistances, strict=True)]
    bounds = list(constants) if unit == "N m/A" else stiff
    holds = min(bounds[wheel] for wheel in term.wheels or range(len(bounds)))
    if term.family.acts == "force":
        holds *= 1.5 / wheel_radius**2  # three wheels in the plane
    slope = _steepest(term)
    if slope < holds:
        return ""
    return f"its curve is as steep as {slope:.3g} {unit}, and the drivers hold {holds:.3g}"


def _steepest(term: LearntTerm) -> float:
    """Largest slope of a table: norm of the derivative, by its axes.

    That with which it fades does not count: it jumps by no more than the last value, and laws end
    far beyond where their robot was.
    """
    shape = [len(points) for points in term.knots]
    table = np.stack([row.reshape(shape) for row in term.values])
    steps = [float(points[1] - points[0]) for points in term.knots]
    if len(shape) == 1:
        return float(np.abs(np.diff(table, axis=1)).max()) / steps[0]
    along = np.diff(table, axis=1)[:, :, :-1] / steps[0]
    across = np.diff(table, axis=2)[:, :-1, :] / steps[1]
    rates: Array = np.stack([along, across], axis=-1).transpose(1, 2, 0, 3)
    return float(np.linalg.norm(rates, ord=2, axis=(-2, -1)).max())
