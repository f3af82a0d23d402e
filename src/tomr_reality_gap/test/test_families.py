"""Which families of terms are looked at, closely, and what the map of a floor is judged by."""

from collections.abc import Mapping
from types import SimpleNamespace

import pytest

from tomr_power_model.unmodelled import FAMILIES, Family
from tomr_reality_gap.fit import families
from tomr_reality_gap.fit.families import Tried
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.fit.remainder import Prediction

SPEED, TIME, FLOOR = "torque.speed", "supply.time", "torque.place"
STRETCHES, MOMENTS = "stretches", "moments"


def _glanced(
    monkeypatch: pytest.MonkeyPatch, shares: Mapping[str, float], *, is_repeatable: bool
) -> tuple[list[str], list[str]]:
    """Families that were looked at, and those that were looked at closely."""
    glanced: list[str] = []
    closely: list[str] = []

    def at_a_glance(*given: object) -> list[Tried]:
        asked: list[type[Family]] = given[-1]  # type: ignore[assignment]
        glanced.extend(item.family_id for item in asked)
        return [
            Tried(
                SimpleNamespace(family=item),  # type: ignore[arg-type]
                shares.get(item.family_id, 0.0),
            )
            for item in asked
        ]

    def closer(_: object, table: Table, *__: object) -> Tried:
        closely.append(table.family.family_id)
        return Tried(table, 0.0)

    monkeypatch.setattr(families, "_at_a_glance", at_a_glance)
    monkeypatch.setattr(families, "predicting", closer)
    rest = SimpleNamespace()
    families.families_tried(
        rest,
        None,
        None,
        (),
        least=0.1,
        is_repeatable=is_repeatable,  # type: ignore[arg-type]
    )
    return glanced, closely


def test_nothing_but_a_hint_is_looked_into(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closely: within 0.5 of the best, and 0.1 at least."""
    shares = {SPEED: 0.3, "torque.current": 0.11, "torque.angle": 0.09}
    glanced, closely = _glanced(monkeypatch, shares, is_repeatable=False)
    assert sorted(glanced) == sorted(FAMILIES)
    assert sorted(closely) == ["torque.current", SPEED]
    _, closely = _glanced(monkeypatch, {SPEED: 0.8, "torque.current": 0.29}, is_repeatable=False)
    assert closely == [SPEED]
    _, closely = _glanced(monkeypatch, {SPEED: 0.8, "torque.current": 0.31}, is_repeatable=False)
    assert sorted(closely) == ["torque.current", SPEED]


@pytest.mark.parametrize(("share", "is_looked_on"), [(0.09, False), (0.11, True)])
def test_maps_and_events_are_looked_at_where_a_law_may_stand_behind_names(
    monkeypatch: pytest.MonkeyPatch, share: float, is_looked_on: bool
) -> None:
    glanced, _ = _glanced(monkeypatch, {SPEED: share, FLOOR: 0.9}, is_repeatable=True)
    assert (FLOOR in glanced) == is_looked_on
    assert (TIME in glanced) == is_looked_on


@pytest.mark.parametrize(
    ("family", "share", "expected"),
    [
        (SPEED, 0.4, (0.4, -1.0, 0.1)),
        (TIME, 0.4, (0.8, -1.0, 1.0)),
        (FLOOR, 0.4, (0.4, 0.8, 0.1)),
        (FLOOR, -0.1, (-0.1, 0.8, 1.0)),
    ],
)
def test_a_map_is_as_large_as_it_predicts_where_nobody_has_been(
    monkeypatch: pytest.MonkeyPatch,
    family: str,
    share: float,
    expected: tuple[float, float, float],
) -> None:
    """Unless it predicts nothing there at all."""
    predictions = {STRETCHES: Prediction(share, 0.1), MOMENTS: Prediction(0.8, 1.0)}
    monkeypatch.setattr(families, "predicted", lambda rest, columns, labels: predictions[labels])
    table = SimpleNamespace(family=FAMILIES[family], columns=lambda *_, is_exact: [])
    rest = SimpleNamespace(blocks=(STRETCHES, MOMENTS), dataset=None)
    tried = families.predicting(rest, table, None, ())  # type: ignore[arg-type]
    assert (tried.share, tried.moments, tried.size) == expected
