"""Where a law is taken before a table that predicts more, and what a small table shows."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_reality_gap.fit import unmodelled
from tomr_reality_gap.fit.families import Tried
from tomr_reality_gap.fit.remainder import Remainder

PLACE, SPEED, SIGNED, DRIVER = "force.place", "torque.speed", "torque.signed_speed", "driver.speed"
TIME = "supply.time"


@pytest.mark.parametrize(
    ("laws", "known", "explained", "is_taken"),
    [
        ((), 0.85, 0.86, True),
        ((), 0.85, 0.846, True),  # about as much: a table has many values to do with
        ((), 0.85, 0.844, False),
        ((), 0.6, 0.61, True),
        (("a law",), 0.5, 0.51, True),  # of two laws the one that fits better
        (("a law",), 0.5, 0.49, False),
    ],
)
def test_a_law_of_speed_is_taken_before_a_table_of_signed_speed_that_explains_less(
    monkeypatch: pytest.MonkeyPatch,
    laws: tuple[str, ...],
    known: float,
    explained: float,
    is_taken: bool,
) -> None:
    """However much less a table of speed predicts."""
    found = SimpleNamespace(family=FAMILIES[SIGNED], laws=laws, explained=known)
    law = SimpleNamespace(laws=("a law",), explained=explained)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: law)
    tried = [
        Tried(SimpleNamespace(family=FAMILIES[name]), share)  # type: ignore[arg-type]
        for name, share in ((SIGNED, 0.8), (SPEED, 0.31), (PLACE, 0.29))
    ]
    taken = unmodelled._lawful(None, found, tried, None, ())  # type: ignore[arg-type]
    assert taken is (law if is_taken else found)
    assert unmodelled._lawful(None, found, tried[::2], None, ()) is found  # type: ignore[arg-type]


@pytest.mark.parametrize("laws", [(), ("a law",)])
@pytest.mark.parametrize(
    ("share", "explained", "is_lawful"),
    [(0.31, 0.91, True), (0.29, 0.91, False), (0.31, 0.89, False)],
)
def test_a_law_of_speed_that_explains_more_than_a_table_over_time_is_no_event(
    monkeypatch: pytest.MonkeyPatch,
    laws: tuple[str, ...],
    share: float,
    explained: float,
    is_lawful: bool,
) -> None:
    """Stretches of other speeds hardly predict each other, a law does."""
    comes = SimpleNamespace(family=FAMILIES[TIME], laws=laws, explained=0.9)
    law = SimpleNamespace(laws=("a law",), explained=explained)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: law)
    tried = [Tried(SimpleNamespace(family=FAMILIES[SPEED]), share)]  # type: ignore[arg-type]
    taken = unmodelled._lawful(None, comes, tried, None, ())  # type: ignore[arg-type]
    assert taken is (law if is_lawful else comes)


def test_of_laws_the_one_that_explains_most_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    comes = SimpleNamespace(family=FAMILIES[TIME], laws=(), explained=0.9)
    laws = {DRIVER: 0.95, SPEED: 0.96, PLACE: 0.94}
    monkeypatch.setattr(
        unmodelled,
        "fitted",
        lambda rest, item, *_: SimpleNamespace(
            laws=("a law",), explained=laws[item.table.family.family_id]
        ),
    )
    tried = [Tried(SimpleNamespace(family=FAMILIES[name]), 0.5) for name in laws]  # type: ignore[arg-type]
    taken = unmodelled._lawful(None, comes, tried, None, ())  # type: ignore[arg-type]
    assert taken.explained == laws[SPEED]


@pytest.mark.parametrize(
    ("laws", "explained", "expected"),
    [
        (("a law",), 0.951, SPEED),
        (("a law",), 0.949, DRIVER),
        ((), 0.951, DRIVER),
        ((), 0.956, SPEED),
    ],
)
def test_of_two_laws_that_predict_alike_the_one_that_fits_better_is_taken(
    monkeypatch: pytest.MonkeyPatch, laws: tuple[str, ...], explained: float, expected: str
) -> None:
    """A table has to explain clearly more."""
    explains = {DRIVER: 0.95, SPEED: explained}

    def fitted(rest: object, item: Tried, *_: object) -> SimpleNamespace:
        family = item.table.family
        return SimpleNamespace(family=family, laws=laws, explained=explains[family.family_id])

    monkeypatch.setattr(unmodelled, "fitted", fitted)
    tried = [Tried(SimpleNamespace(family=FAMILIES[name]), 1.0) for name in explains]  # type: ignore[arg-type]
    taken = unmodelled._most(None, tried, None, ())  # type: ignore[arg-type]
    assert taken.family.family_id == expected


@pytest.mark.parametrize(("explained", "is_taken"), [(0.81, True), (0.79, False)])
def test_what_comes_and_goes_by_a_law_gives_way_to_a_stand_only_if_that_explains_nearly_all(
    monkeypatch: pytest.MonkeyPatch, explained: float, is_taken: bool
) -> None:
    """Friction that runs in is no grease that holds until the wheel has turned."""
    runs_in = SimpleNamespace(family=FAMILIES[TIME], laws=("a law",), explained=0.95)
    stand = SimpleNamespace(laws=("a law",), explained=explained)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: stand)
    tried = [Tried(SimpleNamespace(family=FAMILIES["torque.turned"]), 0.1)]  # type: ignore[arg-type]
    taken = unmodelled._lawful(None, runs_in, tried, None, ())  # type: ignore[arg-type]
    assert taken is (stand if is_taken else runs_in)


def _rest(residual: np.ndarray) -> Remainder:
    count = len(residual)
    dataset = SimpleNamespace(simulations=())
    return Remainder(dataset, residual, np.empty((count, 0)), np.ones(count))  # type: ignore[arg-type]


@pytest.mark.parametrize(("size", "rows"), [(1.0, [0, 1]), (0.01, [0])])
def test_a_small_table_does_not_show_at_a_wheel_that_only_large_values_could(
    size: float, rows: list[int]
) -> None:
    first, second = np.random.default_rng(7).standard_normal((2, 4000))
    table = SimpleNamespace(family=FAMILIES[SPEED], wheels=tuple)
    tried = Tried(table, 1.0, size=size)  # type: ignore[arg-type]
    columns = [first[:, None], 0.03 * second[:, None]]
    assert unmodelled._rows_shown(_rest(3.0 * (first + second)), tried, columns) == rows


def test_the_total_is_asked_for_a_term_as_large_as_it_predicts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[np.ndarray] = []
    family = FAMILIES["driver.time"]
    table = SimpleNamespace(family=family, columns=lambda *_: [np.ones((2, 1))])
    tried = [Tried(table, 0.9, size=0.1)]  # type: ignore[arg-type]
    monkeypatch.setattr(unmodelled, "families_tried", lambda *_, **__: tried)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: SimpleNamespace(family=family))
    monkeypatch.setattr(unmodelled, "is_supplied", lambda rest, columns: asked.extend(columns))
    assert unmodelled.unmodelled_effect(_rest(np.zeros(2)), None, None) is None  # type: ignore[arg-type]
    np.testing.assert_allclose(asked, [[[0.1], [0.1]]])


@pytest.mark.parametrize(("everywhere", "expected"), [(0.901, "all wheels"), (0.899, "two wheels")])
def test_a_law_that_explains_no_less_at_all_wheels_is_one_for_all(
    monkeypatch: pytest.MonkeyPatch, everywhere: float, expected: str
) -> None:
    """It is fitted to all of them from where it was at those that show it."""
    begun: list[object] = []

    def fitted_at(*arguments: object) -> SimpleNamespace:
        *_, rows, known = arguments
        begun.append(known)
        at = "all wheels" if rows == [0, 1, 2] else "two wheels"
        term = LearntTerm(FAMILIES[SPEED], (1, 2), (np.array([0.0, 1.0]),), np.ones((2, 2)))
        return SimpleNamespace(laws=("a law",), law="found", explained=0.9, term=term, at=at)

    table = SimpleNamespace(columns=lambda *_: [np.ones((2, 1))] * 3, wheels=tuple)
    rest = SimpleNamespace(weight=np.ones(2), dataset=None, explained=lambda _: everywhere)
    monkeypatch.setattr(unmodelled, "_rows_shown", lambda *_: [1, 2])
    monkeypatch.setattr(unmodelled, "_fitted_at", fitted_at)
    monkeypatch.setattr(unmodelled, "changes_of", lambda *_: [None])
    found = unmodelled.fitted(rest, Tried(table, 1.0), None, ())  # type: ignore[arg-type]
    assert found.at == expected  # type: ignore[attr-defined]
    assert begun == [None, "found"][: len(begun)]
