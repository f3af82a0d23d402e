"""Where a law is taken before a table that predicts more."""

from types import SimpleNamespace

import pytest

from tomr_power_model.unmodelled import FAMILIES
from tomr_reality_gap.fit import unmodelled
from tomr_reality_gap.fit.families import Tried

PLACE, SPEED, SIGNED, DRIVER = "force.place", "torque.speed", "torque.signed_speed", "driver.speed"


@pytest.mark.parametrize(
    ("laws", "explained", "narrower"),
    [((), 0.96, True), ((), 0.94, False), (("a law",), 0.96, False)],
)
def test_a_law_of_speed_is_taken_before_a_table_of_signed_speed_without_one(
    monkeypatch: pytest.MonkeyPatch, laws: tuple[str, ...], explained: float, narrower: bool
) -> None:
    """If it explains 0.95 as much; however little a table of speed predicts."""
    found = SimpleNamespace(family=FAMILIES[SIGNED], laws=laws, explained=1.0)
    law = SimpleNamespace(laws=("a law",), explained=explained)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: law)
    tried = [
        Tried(SimpleNamespace(family=FAMILIES[name]), share)  # type: ignore[arg-type]
        for name, share in ((SIGNED, 0.8), (DRIVER, 0.7), (SPEED, 0.1))
    ]
    taken = unmodelled._by_law(None, found, tried, None, ())  # type: ignore[arg-type]
    assert taken is (law if narrower else found)
    assert unmodelled._by_law(None, found, tried[:2], None, ()) is found  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("share", "explained", "is_lawful"),
    [(0.31, 0.91, True), (0.29, 0.91, False), (0.31, 0.89, False)],
)
def test_a_law_of_speed_that_explains_more_than_a_table_over_time_is_no_event(
    monkeypatch: pytest.MonkeyPatch, share: float, explained: float, is_lawful: bool
) -> None:
    """Stretches of other speeds hardly predict each other, a law does."""
    comes = SimpleNamespace(laws=(), explained=0.9)
    law = SimpleNamespace(laws=("a law",), explained=explained)
    monkeypatch.setattr(unmodelled, "fitted", lambda *_: law)
    tried = [Tried(SimpleNamespace(family=FAMILIES[SPEED]), share)]  # type: ignore[arg-type]
    taken = unmodelled._lawful(None, comes, tried, None, ())  # type: ignore[arg-type]
    assert taken is (law if is_lawful else comes)


def test_of_laws_the_one_that_explains_most_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    comes = SimpleNamespace(laws=(), explained=0.9)
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
