"""How columns of one linearisation are used again in the next."""

from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomr_reality_gap.fit.jacobian import _all_varied, _moved


@given(
    nuisances=st.integers(0, 4),
    own=st.tuples(st.integers(0, 4), st.integers(0, 4)),
    sizes=st.lists(st.integers(1, 3), min_size=1, max_size=5),
    chosen=st.integers(0, 4),
)
def test_columns_come_through_a_move_whatever_lies_between(
    nuisances: int, own: tuple[int, int], sizes: list[int], chosen: int
) -> None:
    """One candidate leaves, the model's own columns before the candidates become more or fewer."""
    edges = nuisances + own[0] + np.cumsum([0, *sizes])
    rows = np.arange(float(edges[-1]))[:, None] * np.ones((1, 3))
    kept = [k for part in range(len(sizes)) if part != chosen for k in _rows(edges, part)]
    first = nuisances + own[1]
    count = first + len(kept)
    places = [*((k, k) for k in range(nuisances)), *zip(range(first, count), kept, strict=True)]
    found = _moved(rows, count, places)
    assert found.shape == (count, 3)
    assert found[:nuisances, 0].tolist() == list(range(nuisances))
    assert found[first:, 1].tolist() == kept


def test_their_memory_is_used_again_where_it_suffices() -> None:
    rows = np.zeros((5, 2))
    assert np.shares_memory(_moved(rows, 5, [(4, 0)]), rows)
    assert not np.shares_memory(_moved(rows, 6, [(4, 0)]), rows)


@pytest.mark.parametrize(("whole", "scales"), [(True, [2.0, 4.0, 8.0, 9.0]), (False, [2.0, 4.0])])
def test_candidates_alone_are_not_varied_anew(whole: bool, scales: list[float]) -> None:
    def parameter(prior_std: float) -> Any:
        return Mock(prior_std=prior_std, step=1.0, discrete_offset=None, step_at=lambda _: 1.0)

    described = Mock(values={})
    described.given.return_value = described
    model: Any = SimpleNamespace(
        described=described, nuisances=[parameter(2.0)], own=[parameter(4.0)], own_offsets=[0.0]
    )
    candidate: Any = SimpleNamespace(start={}, sizes=[parameter(8.0), parameter(9.0)])
    assert [scale for _, scale in _all_varied(model, [candidate], whole)] == scales


def _rows(edges: np.ndarray, part: int) -> range:
    return range(int(edges[part]), int(edges[part + 1]))
