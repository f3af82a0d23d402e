"""What smooth torques of one variable would show: radial basis functions for unmodelled effects."""

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.noise import Local, rows_of
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Motion
from tomr_reality_gap.alignment.channels import MOTOR_KINDS
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.mismatch.probes import Family, families

Array = NDArray[np.float64]

_SIZE = 0.1  # of a typical torque: prior standard deviation of each basis function's weight


@frozen
class BasisResponses:
    """Families of torques and what they do to every channel."""

    families: tuple[Family, ...]
    responses: tuple[
        NDArray[np.float32], ...
    ]  # of each family, all wheels resisting at once, (n, k)
    size: float  # N m, of each basis function
    rows: tuple[NDArray[np.intp], ...]  # of each wheel's own channels; the total's without any

    @property
    def local(self) -> list[Local]:
        """All families' responses, each wheel by itself."""
        wheels = self.rows if len({tuple(rows[:1]) for rows in self.rows}) > 1 else self.rows[:1]
        return [
            Local(rows, np.concatenate([one[rows] for one in self.responses], axis=1))
            for rows in wheels
        ]


def basis_responses(
    dataset: Dataset,
    robot: Robot,
    torque: float,
    orders: Sequence[float] = (),
    *,
    only: Collection[str] | None = None,
) -> BasisResponses:
    """Simulate families of torques on a robot.

    Args:
        dataset: its recordings.
        robot: as described.
        torque: typical of it [N m].
        orders: at which its power swings with wheel angles [1/rev].
        only: names of variables; None: all.
    """
    motions = [motion_in(item, robot) for item in dataset.simulations]
    tried = tuple(
        family for family in families(motions, orders) if only is None or family.variable in only
    )
    size = _SIZE * torque
    response = dataset.changes(robot, [_torques(tried, one, size) for one in motions])
    edges = np.cumsum([0, *(len(item.knots) for item in tried)])
    parts = tuple(response[first:last].T for first, last in pairwise(edges))
    return BasisResponses(tried, parts, size, tuple(own_rows(dataset)))


def _torques(tried: Sequence[Family], motion: Motion, size: float) -> Iterator[Array]:
    """Family by family, (k, count, 3): memory holds one at a time."""
    for family in tried:
        yield size * family.torques(motion)


def own_rows(dataset: Dataset) -> Sequence[NDArray[np.intp]]:
    """Rows of each wheel's own channels; of the total where no wheel is measured by itself."""
    alone = not any(channel.kind in MOTOR_KINDS for channel in dataset.channels)
    found: list[list[NDArray[np.intp]]] = [[] for _ in range(WHEELS)]
    for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True):
        for wheel in range(WHEELS):
            if channel.kind == "total" if alone else channel.wheel == wheel:
                found[wheel].append(np.arange(part.start, part.stop))
    return [np.concatenate(rows) if rows else np.empty(0, dtype=np.intp) for rows in found]
