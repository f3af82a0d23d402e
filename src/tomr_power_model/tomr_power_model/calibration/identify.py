"""What a fit leaves open: values that the drives do not determine, and the drives that would."""

from collections.abc import Iterable, Sequence

import numpy as np

from tomr_power_model.calibration.fit import Fit
from tomr_power_model.calibration.parameters import wheel_of
from tomr_power_model.calibration.priors import drive_for
from tomr_power_model.estimation.parameter import Parameter

HARDLY = 0.5  # of the prior's deviation is left: the value counts as not determined
_TOGETHER = 0.95  # correlation
_AT_BOUND = 1e-3  # prior standard deviations
_FAR = 3.0  # prior standard deviations


def warnings_of(parameters: Sequence[Parameter], fitted: Fit, wheels: Sequence[str]) -> list[str]:
    """One line per kind of value that the data do not determine, with the drive that would."""
    at_end: list[Parameter] = []
    open_ones: list[Parameter] = []
    strayed: list[Parameter] = []
    for item, shrinkage, number in zip(
        parameters, fitted.uncertainty.shrinkage, fitted.numbers, strict=True
    ):
        near = _AT_BOUND * item.prior_std
        if number - item.lower < near or item.upper - number < near:
            at_end.append(item)
        elif shrinkage > HARDLY:
            far = abs(number - item.prior_mean) > _FAR * item.prior_std
            (strayed if far else open_ones).append(item)
    found = [
        f"{name} is at the end of its range: the drives do not show it, or other physics is missing"
        for name, _ in _by_kind(at_end, wheels)
    ]
    found += [
        f"{name}: not determined, it stays near the description. To determine it: "
        f"{drive_for(general)}"
        for name, general in _by_kind(open_ones, wheels)
    ]
    found += [
        f"{name}: not determined, and yet far from the description: something else that it holds "
        "is wrong, as a gear ratio or a radius, or physics is missing: run tomr_gap explain"
        for name, _ in _by_kind(strayed, wheels)
    ]
    found += _pairs(parameters, fitted, wheels)
    if not fitted.converged:
        found.append("the fit did not converge: fit fewer values, or start nearer in robot.yaml")
    return found


def _by_kind(items: Iterable[Parameter], wheels: Sequence[str]) -> list[tuple[str, str]]:
    """(what to call it, general key) of each kind of value, its wheels named together."""
    kinds: dict[str, list[str]] = {}
    for item in items:
        names = kinds.setdefault(item.name, [])
        if wheel := wheel_of(item, wheels):
            names.append(wheel)
    return [(_named(general, names, wheels), general) for general, names in kinds.items()]


def _named(general: str, names: Sequence[str], wheels: Sequence[str]) -> str:
    if not names:
        return general
    return f"{general} of {'every wheel' if len(names) == len(wheels) else ', '.join(names)}"


def _pairs(parameters: Sequence[Parameter], fitted: Fit, wheels: Sequence[str]) -> list[str]:
    """Values that the data determine only together."""
    kinds: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for second, other in enumerate(parameters):
        for first, one in enumerate(parameters[:second]):
            together = float(fitted.uncertainty.correlation[first, second])
            # Values that are each well known may be correlated: nobody is misled by that.
            open_ = (
                max(fitted.uncertainty.shrinkage[first], fitted.uncertainty.shrinkage[second]) > 0.1
            )
            if np.isfinite(together) and abs(together) > _TOGETHER and open_:
                names = [name for item in (one, other) if (name := wheel_of(item, wheels))]
                where = "-".join(dict.fromkeys(names))
                kinds.setdefault((one.name, other.name), []).append((where, together))
    return [
        f"{one} and {other} are determined only together, correlation "
        f"{max((value for _, value in pairs), key=abs):.2f}"
        + (f" ({', '.join(where for where, _ in pairs if where)})" if pairs[0][0] else "")
        + f". To separate them: {drive_for(other)}"
        for (one, other), pairs in kinds.items()
    ]
