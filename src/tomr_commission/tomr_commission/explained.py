"""The explained robot: what `tomr_gap explain` finds in the fitting drives."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from tomr_commission.request import CommissionRequest
from tomr_power_model.drive.cut import names_of
from tomr_power_model.robot import shipped_robots
from tomr_reality_gap.explain import explain
from tomr_reality_gap.report.html import channel_lines
from tomr_reality_gap.report.json import report_fields
from tomr_reality_gap.report.write import EXPLAINED, report_files
from tomr_reality_gap.request import Request

Progress = Callable[[str, float], None]
FOLDER = "gap"
__all__ = ["EXPLAINED", "FOLDER", "Split", "explain_drives"]
_REST = 1e9  # s: to the end of a recording


@frozen
class Split:
    """Which drives are fitted and which are held out; of a single drive the last third is."""

    fitted: tuple[Path, ...]
    held: tuple[Path, ...]
    cut: float | None = None  # s of the single drive from which on it is held out

    @classmethod
    def of(cls, bags: Sequence[Path], durations: Sequence[float], least: float) -> "Split":
        """The last drive is held out, or as many of the last as last so long [s] together.

        Of a single one of a duration [s] the last third.
        """
        if len(bags) == 1:
            return cls((bags[0],), (bags[0],), 2.0 / 3.0 * durations[0])
        from_last = np.cumsum(durations[:0:-1])  # without the first
        count = min(int(np.searchsorted(from_last, least)) + 1, len(bags) - 1)
        return cls(tuple(bags[:-count]), tuple(bags[-count:]))


def explain_drives(asked: CommissionRequest, split: Split, progress: Progress) -> Any:
    """Run the search; a plain value that holds the report, its files, and levels by channel.

    Raises InputError for recordings that it refuses.
    """
    skips = dict(asked.skips)
    if split.cut is not None:
        (name,) = names_of(split.fitted)
        skips[name] = (*skips.get(name, ()), (split.cut, _REST))
    request = Request(
        robot=asked.robot,
        real=split.fitted,
        holdout=() if split.cut is not None else split.held,
        tolerance=asked.tolerance,
        skips=skips,
    )
    found = explain(request, progress)
    source = asked.robot if asked.robot in shipped_robots() else Path(asked.robot).name
    return {
        "report": report_fields(found),
        "explained": found.explained,
        "files": report_files(found, source),
        "levels": [
            {
                "recording": line.recording,
                "held_out": line.held_out,
                "channel": line.channel,
                "unit": line.unit,
                "rms": line.rms[1],
                "level": line.level[1],
                "level_before": line.level[0],
            }
            for line in channel_lines(found.comparisons)
        ],
    }
