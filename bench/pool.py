"""Work in processes side by side, with a bar."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any, TypeVar

from tqdm import tqdm

from tomr_power_model.dynamics.simulation import worker_count

Result = TypeVar("Result")


def each(
    work: Callable[..., Result],
    *columns: Sequence[Any],
    title: str = "",
    unit: str = "drive",
    jobs: int | None = None,
    at_a_time: int = 1,
) -> list[Result]:
    """Results of `work` for each row of some columns of one length, in their order.

    Args:
        work: may be pickled.
        columns: of its arguments.
        title: of the bar.
        unit: what a row is.
        jobs: processes; None: as many as `worker_count`.
        at_a_time: rows that a process takes at once.
    """
    with ProcessPoolExecutor(jobs or worker_count()) as pool:
        found = pool.map(work, *columns, chunksize=at_a_time)
        bar = tqdm(found, title, len(columns[0]), unit=unit, disable=None)
        return list(bar)
