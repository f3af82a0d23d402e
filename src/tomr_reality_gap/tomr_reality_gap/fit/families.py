"""How well families of terms predict what is left of recordings, each with its table.

A family is judged by what it predicts of stretches that it was not fitted to: the share of what the
named model leaves there. What changes with time alone can predict no stretch; it is judged by
moments left out between others.
"""

import math
from collections.abc import Sequence

from attrs import frozen

from tomr_power_model.effects.scales import Scales
from tomr_power_model.robot import Robot
from tomr_power_model.unmodelled import FAMILIES, Family, Motion
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.fit.remainder import Remainder, predicted

_NEAR = 0.5  # of the best share: worth a closer look


@frozen
class Tried:
    """A family and how well it predicts."""

    table: Table
    share: float  # of stretches left out; of moments if it is an event
    # Of moments left out, of a map: each stretch is on ground of its own.
    moments: float = -1.0
    size: float = 1.0  # of the table's prior, with which it predicts most

    @property
    def best(self) -> float:
        """The larger of the shares."""
        return max(self.share, self.moments)


def families_tried(
    rest: Remainder,
    robot: Robot,
    scales: Scales,
    motions: Sequence[Motion],
    *,
    least: float = -1.0,
    is_repeatable: bool = False,
) -> list[Tried]:
    """All families that the recordings can show, best first; none where only noise is left.

    Args:
        rest: what is left of the recordings.
        robot: of which it is left.
        scales: how large terms may be.
        motions: of the robot in the recordings.
        least: share that must show at a glance for a closer look.
        is_repeatable: none at all unless one that another drive would repeat shows as much.
    """
    # A map of the floor costs as much as all others, and no names are like it.
    first = [item for item in FAMILIES.values() if not (item.is_event or item.is_shared)]
    found = _at_a_glance(rest, robot, scales, motions, first)
    if is_repeatable and max((item.share for item in found), default=-1.0) < least:
        return []
    others = [item for item in FAMILIES.values() if item.is_event or item.is_shared]
    found += _at_a_glance(rest, robot, scales, motions, others)
    most = max((item.share for item in found), default=0.0)
    for number, item in enumerate(found):
        if item.table.family.acts == "torque" and item.share > max(most - _NEAR, least):
            found[number] = predicting(rest, item.table, robot, motions)
    return sorted(found, key=lambda item: -item.share)


def _at_a_glance(
    rest: Remainder,
    robot: Robot,
    scales: Scales,
    motions: Sequence[Motion],
    families: Sequence[type[Family]],
) -> list[Tried]:
    """Some families, what one wheel's torque does to the others left out."""
    kinds, found = {channel.kind for channel in rest.dataset.channels}, []
    for family in families:
        seen = {"driver": "power", "supply": "total"}.get(family.acts)
        table = Table.over(family, motions, scales)
        if table is None or (seen is not None and seen not in kinds):
            continue
        tried = predicting(rest, table, robot, motions, is_exact=False)
        if not math.isnan(tried.share):
            found.append(tried)
    return found


def predicting(
    rest: Remainder,
    table: Table,
    robot: Robot,
    motions: Sequence[Motion],
    *,
    is_exact: bool = True,
) -> Tried:
    """A family and what it predicts: of moments what says when, of stretches all else."""
    columns = table.columns(rest.dataset, robot, motions, is_exact=is_exact)
    stretch, moment = rest.blocks
    family = table.family
    found = predicted(rest, columns, moment if family.is_event else stretch)
    if not family.is_shared:
        return Tried(table, found.share, size=found.size)
    again = predicted(rest, columns, moment)
    # What holds where nobody has been matters more than what holds between two moments.
    size = found.size if found.share > 0.0 else again.size
    return Tried(table, found.share, again.share, size)
