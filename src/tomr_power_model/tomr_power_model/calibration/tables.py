"""The figures of a calibration as rows of text, for the terminal and the page."""

import numpy as np
from attrs import frozen

from tomr_power_model.calibration.calibrate import Result
from tomr_power_model.calibration.identify import HARDLY
from tomr_power_model.calibration.scoring import median_energy

_MOST_LINES = 20  # drives in a table


@frozen
class Line:
    """Figures of one drive, by column."""

    name: str
    seconds: float
    values: tuple[float, ...]  # accuracy
    nrmse: tuple[float, ...] | None = None


@frozen
class Row:
    """One fitted value, ready to be shown."""

    key: str
    unit: str
    prior: str
    fitted: str
    half: str  # of the 95 % interval
    left: str  # of the uncertainty before
    open: bool  # not determined


def tables(result: Result) -> list[tuple[str, list[Line]]]:
    """Titled tables of the figures, held-out drives first."""
    found = []
    for title, scores, before in (
        ("held out, not fitted", result.held_out_scores, result.held_out_scores_before),
        ("fitted", result.scores, result.scores_before),
    ):
        if scores.whole is None or before.whole is None:
            continue
        whole = scores.whole
        shown = sorted(scores.drives, key=lambda item: np.nanmin(item.accuracy))[:_MOST_LINES]
        listed = [item for item in scores.drives if item in shown]
        lines = [Line(item.name, item.seconds, item.accuracy, item.nrmse) for item in listed]
        if len(scores.drives) > len(shown):
            title = f"{title}, the {len(shown)} worst of {len(scores.drives)}"
        lines += [
            Line("all", whole.seconds, whole.accuracy, whole.nrmse),
            Line("all, before the fit", whole.seconds, before.whole.accuracy, before.whole.nrmse),
            Line("all, what noise would leave", whole.seconds, whole.reachable),
            Line("energy of a drive, median", whole.seconds, median_energy(scores)),
        ]
        found.append((title, lines))
    return found


def rows(result: Result) -> list[Row]:
    """The table of fitted values."""
    found = []
    for item, number, half, shrinkage in zip(
        result.parameters,
        result.fitted.numbers,
        result.half_widths,
        result.fitted.uncertainty.shrinkage,
        strict=True,
    ):
        found.append(
            Row(
                key=item.keys[0],
                unit=item.unit or "-",
                prior=f"{item.prior_mean:.4g} ± {1.96 * item.prior_std:.2g}",
                fitted=f"{number:.4g}",
                half=f"± {half:.2g}",
                left=f"{100 * shrinkage:.0f} %",
                open=shrinkage > HARDLY,
            )
        )
    return found
