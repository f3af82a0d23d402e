"""Benches' work in processes side by side."""

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent / "bench"))

import pool
from pool import each


def test_results_come_in_the_order_of_the_rows() -> None:
    assert each(pow, (2, 3, 5), (3, 2, 1), jobs=2, at_a_time=2) == [8, 9, 5]


def test_as_many_processes_as_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    class Counted(pool.ProcessPoolExecutor):
        def __init__(self, workers: int, **settings: Any) -> None:
            asked.append(workers)
            super().__init__(1, **settings)

    monkeypatch.setattr(pool, "ProcessPoolExecutor", Counted)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    for jobs in (5, None):
        each(abs, (-1,), jobs=jobs)
    assert asked == [5, 3]
