"""Half widths of the bands around modelled values."""

from collections.abc import Sequence


def width(models: Sequence[float], least: float, relative: float, transient: float) -> float:
    """max(least, relative |model|) + transient * change, of the newest of some modelled values and
    how far they moved; what is not known moves nothing."""
    return max(least, relative * abs(models[-1])) + transient * _spread(models)


def _spread(models: Sequence[float]) -> float:
    known = [model for model in models if model == model]
    return max(known) - min(known) if known else 0.0
