"""Cases at a time on Dask: on this machine's cores, or on a cluster."""

import logging
import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tomr_power_model.errors import InputError
from tomr_reality_gap.fleet.cases import Case
from tomr_reality_gap.fleet.outcome import FAILED, Outcome

LOCAL = "local"
_ANSWERS_WITHIN = "10 s"


def outcomes(
    work: Callable[[Case], Outcome], cases: Sequence[Case], scheduler: str
) -> Iterator[Outcome]:
    """What comes of each case, in the order in which they are done.

    Args:
        work: done to each case, on a worker.
        cases: all of them.
        scheduler: LOCAL or the address of a Dask scheduler. Its workers need this package and
            see the recordings under the same paths.

    Raises:
        InputError: Dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import as_completed
    except ImportError:
        raise InputError(
            "tomr_gap fleet needs Dask: pip install distributed, or -r requirements-fleet.txt"
        ) from None
    with ExitStack() as opened:
        client = opened.enter_context(_client(scheduler, len(cases), opened))
        futures = client.map(work, cases, key=[f"explain-{case.name}" for case in cases])
        owner = dict(zip(futures, cases, strict=True))
        del futures
        for future in as_completed(list(owner)):
            case = owner.pop(future)
            if future.status == "finished":
                yield future.result()
            else:  # a defect, or a worker that was killed: the others go on
                yield Outcome(case.name, FAILED, _words(future), 0.0)


def _client(scheduler: str, count: int, opened: ExitStack) -> Any:
    from distributed import Client, LocalCluster

    if scheduler != LOCAL:
        try:
            return Client(scheduler, timeout=_ANSWERS_WITHIN)
        except (OSError, ValueError):
            raise InputError(
                f"--scheduler {scheduler}: no Dask scheduler answers there: give its address, "
                f"e.g. tcp://host:8786, or `{LOCAL}`"
            ) from None
    cluster = LocalCluster(
        n_workers=max(1, min(len(os.sched_getaffinity(0)), count)),
        threads_per_worker=1,
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    )
    return Client(opened.enter_context(cluster))


def _words(future: Any) -> str:
    """One line about an error that is not the input's, and where it was raised."""
    error = future.exception()
    text = " ".join(str(error).split())
    frames = traceback.extract_tb(future.traceback())
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text}{place}"
