"""How columns of one linearisation are used again in the next."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tomr_reality_gap.fit.jacobian import _moved


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


def _rows(edges: np.ndarray, part: int) -> range:
    return range(int(edges[part]), int(edges[part + 1]))
