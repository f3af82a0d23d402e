"""What a fit leaves open: values that the drives do not tell, and the drives that would."""

from collections.abc import Iterable, Sequence

import numpy as np

from tomr_power_model.calibration.fit import Fit
from tomr_power_model.calibration.parameters import Free
from tomr_power_model.calibration.priors import drive_for

HARDLY = 0.5  # of the belief's spread is left: the value counts as not determined
_TOGETHER = 0.95  # correlation
_AT_BOUND = 1e-3  # of the belief's spread


def warnings_of(free: Sequence[Free], fitted: Fit, wheels: Sequence[str]) -> list[str]:
    """One line per kind of value that the data do not determine, with the drive that would."""
    at_end, untold = [], []
    for item, learned, number in zip(free, fitted.spread.learned, fitted.numbers, strict=True):
        near = _AT_BOUND * item.spread
        if number - item.lower < near or item.upper - number < near:
            at_end.append(item)
        elif learned > HARDLY:
            untold.append(item)
    found = [
        f"{name} is at the end of its range: the drives do not show it, or other physics is missing"
        for name, _ in _by_kind(at_end, wheels)
    ]
    found += [
        f"{name}: not determined, it stays near the description. To tell it: {drive_for(general)}"
        for name, general in _by_kind(untold, wheels)
    ]
    found += _pairs(free, fitted, wheels)
    if not fitted.converged:
        found.append("the fit did not converge: fit fewer values, or start nearer in robot.yaml")
    return found


def _by_kind(items: Iterable[Free], wheels: Sequence[str]) -> list[tuple[str, str]]:
    """(what to call it, general key) of each kind of value, its wheels named together."""
    kinds: dict[str, list[str]] = {}
    for item in items:
        names = kinds.setdefault(item.general, [])
        if item.wheel is not None:
            names.append(wheels[item.wheel])
    return [(_named(general, names, wheels), general) for general, names in kinds.items()]


def _named(general: str, names: Sequence[str], wheels: Sequence[str]) -> str:
    if not names:
        return general
    return f"{general} of {'every wheel' if len(names) == len(wheels) else ', '.join(names)}"


def _pairs(free: Sequence[Free], fitted: Fit, wheels: Sequence[str]) -> list[str]:
    """Values that the data tell only together."""
    kinds: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for second, other in enumerate(free):
        for first, one in enumerate(free[:second]):
            together = float(fitted.spread.correlation[first, second])
            # Values that are each well known may be correlated: nobody is misled by that.
            open_ = max(fitted.spread.learned[first], fitted.spread.learned[second]) > 0.1
            if np.isfinite(together) and abs(together) > _TOGETHER and open_:
                names = [wheels[item.wheel] for item in (one, other) if item.wheel is not None]
                where = "-".join(dict.fromkeys(names))
                kinds.setdefault((one.general, other.general), []).append((where, together))
    return [
        f"{one} and {other} are told only together, correlation "
        f"{max((value for _, value in pairs), key=abs):.2f}"
        + (f" ({', '.join(where for where, _ in pairs if where)})" if pairs[0][0] else "")
        + f". To tell them apart: {drive_for(other)}"
        for (one, other), pairs in kinds.items()
    ]
