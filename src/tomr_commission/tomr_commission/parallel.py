"""Work for all cores."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

from tomr_power_model.dynamics.simulation import worker_count

Job = TypeVar("Job")
Result = TypeVar("Result")


def on_all_cores(
    work: Callable[[Job], Result], jobs: Sequence[Job], at_a_time: int = 1
) -> list[Result]:
    """Results of jobs in their order; where there is one core, or one job, in this process."""
    workers = min(worker_count(), len(jobs))
    if workers < 2:
        return [work(job) for job in jobs]
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(work, jobs, chunksize=at_a_time))
