"""Which family is taken for what no name explains, from what each of them predicts."""

from collections.abc import Mapping
from types import MappingProxyType, SimpleNamespace

import pytest

from tomr_power_model.unmodelled import FAMILIES
from tomr_reality_gap import explain
from tomr_reality_gap.fit import unmodelled
from tomr_reality_gap.fit.forward_selection import Selection, first_names
from tomr_reality_gap.fit.unmodelled import Tried, unmodelled_effect

PLACE, SPEED, TIME = "force.place", "torque.speed", "supply.time"
SIGNED = "torque.signed_speed"
FLOOR = "torque.place"
DRIVER, DRAWS = "driver.speed", "driver.time"


def _chosen(
    monkeypatch: pytest.MonkeyPatch,
    shares: dict[str, float],
    *,
    law: float = 0.0,
    timed: float = 0.0,
    is_sure: bool = False,
    moments: Mapping[str, float] = MappingProxyType({}),
    explained: Mapping[str, float] = MappingProxyType({}),
    is_supplied: bool = True,
) -> str | None:
    """The family that is fitted; what depends on place is a law that explains `law`, what depends
    on time one that explains `timed`.
    """

    class Tabled(SimpleNamespace):
        def columns(self, *_: object) -> list[object]:
            return []

    def fitted(rest: object, item: SimpleNamespace, *_: object) -> SimpleNamespace:
        family = item.table.family
        own = timed if family.is_event else law
        laws = ("a law",) if own and (family.is_strange or family.is_event) else ()
        shown = explained.get(family.family_id, own)
        return SimpleNamespace(family=family, laws=laws, explained=shown, share=item.share)

    tried = [
        Tried(Tabled(family=FAMILIES[name]), share, moments.get(name, -1.0))  # type: ignore[arg-type]
        for name, share in sorted(shares.items(), key=lambda item: -item[1])
    ]
    monkeypatch.setattr(unmodelled, "families_tried", lambda *_, **__: tried)
    monkeypatch.setattr(unmodelled, "fitted", fitted)
    monkeypatch.setattr(unmodelled, "is_supplied", lambda *_: is_supplied)
    rest = SimpleNamespace(dataset=SimpleNamespace(simulations=()))
    found = unmodelled_effect(rest, None, None, is_sure=is_sure)  # type: ignore[arg-type]
    return None if found is None else found.family.family_id


@pytest.mark.parametrize(
    ("shares", "expected"),
    [
        ({PLACE: 0.9, SPEED: 0.8, TIME: 0.95}, PLACE),  # what predicts a stretch comes first
        ({PLACE: 0.55, TIME: 0.9}, PLACE),  # 0.6 of what time explains: repeatable
        ({PLACE: 0.53, TIME: 0.9}, TIME),
        ({PLACE: 0.29, TIME: 0.31}, TIME),  # too little to be named
        ({PLACE: 0.29, TIME: 0.29}, None),
        ({SPEED: 0.31}, SPEED),
        ({SPEED: 0.59, SIGNED: 0.61}, SPEED),  # the way it turns predicts no more
        ({SPEED: 0.57, SIGNED: 0.61}, SIGNED),
        ({SPEED: 0.61, SIGNED: 0.59}, SPEED),
        ({SIGNED: 0.61, PLACE: 0.6}, SIGNED),
        ({SPEED: 0.29}, None),
        ({TIME: 0.31}, TIME),
        ({}, None),
    ],
)
def test_what_predicts_stretches_is_repeatable_and_what_only_follows_time_is_not(
    monkeypatch: pytest.MonkeyPatch, shares: dict[str, float], expected: str | None
) -> None:
    assert _chosen(monkeypatch, shares) == expected


@pytest.mark.parametrize(
    ("shares", "is_supplied", "expected"),
    [
        ({DRAWS: 0.9}, True, DRAWS),
        ({DRAWS: 0.9}, False, None),  # sensors show what nobody draws
        ({TIME: 0.9}, False, TIME),  # what the total alone shows
    ],
)
def test_what_drivers_draw_now_and_then_the_supply_gives(
    monkeypatch: pytest.MonkeyPatch,
    shares: dict[str, float],
    is_supplied: bool,
    expected: str | None,
) -> None:
    assert _chosen(monkeypatch, shares, is_supplied=is_supplied) == expected


def test_where_something_is_there_for_sure_little_is_named_as_well(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert _chosen(monkeypatch, {SPEED: 0.1}, is_sure=True) == SPEED
    assert _chosen(monkeypatch, {TIME: 0.05}, is_sure=True) is None
    assert _chosen(monkeypatch, {}, is_sure=True) is None


@pytest.mark.parametrize(("law", "expected"), [(0.81, PLACE), (0.79, TIME)])
def test_a_law_of_place_that_explains_nearly_all_is_no_event(
    monkeypatch: pytest.MonkeyPatch, law: float, expected: str
) -> None:
    """Few stretches of one drive meet again."""
    assert _chosen(monkeypatch, {PLACE: 0.1, TIME: 0.9}, law=law) == expected


@pytest.mark.parametrize(
    ("time", "timed", "expected"),
    [
        (0.9, 0.81, TIME),  # friction that dies out: few headings, each at a time of its own
        (0.9, 0.79, PLACE),
        (0.9, 0.0, PLACE),  # a table over time explains whatever there is
        (0.69, 0.81, PLACE),
    ],
)
def test_a_law_of_time_that_explains_more_than_a_law_of_place_is_taken(
    monkeypatch: pytest.MonkeyPatch, time: float, timed: float, expected: str
) -> None:
    shares, explained = {PLACE: 0.7, TIME: time}, {TIME: timed or 0.95}
    found = _chosen(monkeypatch, shares, law=0.8, timed=timed, explained=explained)
    assert found == expected


@pytest.mark.parametrize(
    ("stretches", "moments", "expected"),
    [
        (-0.5, 0.91, FLOOR),  # new ground all along, but the same for all wheels
        (-0.5, 0.89, TIME),
        (0.7, 0.89, TIME),  # it only follows time
        (0.7, 0.9, TIME),
        (0.95, 0.91, FLOOR),
    ],
)
def test_a_map_of_the_floor_is_one_where_it_predicts_more_than_time_does(
    monkeypatch: pytest.MonkeyPatch, stretches: float, moments: float, expected: str
) -> None:
    shares = {FLOOR: stretches, TIME: 0.9}
    assert _chosen(monkeypatch, shares, moments={FLOOR: moments}) == expected


@pytest.mark.parametrize(("time", "expected"), [(0.9, FLOOR), (0.96, TIME)])
def test_a_law_of_the_floor_that_explains_more_than_a_table_over_time_is_no_event(
    monkeypatch: pytest.MonkeyPatch, time: float, expected: str
) -> None:
    found = _chosen(
        monkeypatch,
        {FLOOR: -0.5, TIME: 0.9},
        law=0.95,
        moments={FLOOR: 0.8},
        explained={FLOOR: 0.95, TIME: time},
    )
    assert found == expected


def test_a_law_of_place_that_explains_more_is_taken_before_a_table_of_speed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shares, explained = {SIGNED: 0.8, PLACE: 0.4}, {SIGNED: 0.85, PLACE: 0.9}
    assert _chosen(monkeypatch, shares, law=0.9, explained=explained) == PLACE
    assert _chosen(monkeypatch, shares, explained=explained) == SIGNED
    # Of a table with its many values a law has to explain about as much.
    for least, expected in ((0.846, PLACE), (0.844, SIGNED)):
        explained = {SIGNED: 0.85, PLACE: least}
        assert _chosen(monkeypatch, shares, law=0.9, explained=explained) == expected


@pytest.mark.parametrize(
    ("share", "driver", "speed", "expected"),
    [
        (0.98, 0.8, 0.9, SPEED),
        (0.98, 0.8, 0.8, DRIVER),
        (0.96, 0.8, 0.9, DRIVER),
        (0.98, 0.8, 0.803, DRIVER),
        (0.98, 0.08, 0.081, SPEED),  # most of what is left is noise
        (0.98, 0.08, 0.0805, DRIVER),
    ],
)
def test_of_families_that_predict_alike_the_one_that_explains_clearly_more_is_taken(
    monkeypatch: pytest.MonkeyPatch, share: float, driver: float, speed: float, expected: str
) -> None:
    """What a driver draws by speed and what resists by speed: power distinguishes them in turns."""
    explained = {DRIVER: driver, SPEED: speed}
    assert _chosen(monkeypatch, {DRIVER: 0.99, SPEED: share}, explained=explained) == expected


@pytest.mark.parametrize(("keeps", "names"), [(True, "with"), (False, "without")])
def test_names_that_take_the_law_from_a_term_are_dropped(
    monkeypatch: pytest.MonkeyPatch, keeps: bool, names: str
) -> None:
    """A term that was fitted without any name; beside names it may have no law any more."""
    law = SimpleNamespace(laws=("a law",), evidence=9.0)
    again = law if keeps else SimpleNamespace(laws=())
    states = {
        key: SimpleNamespace(model=SimpleNamespace(described=SimpleNamespace(robot=key)), key=key)
        for key in ("with", "without")
    }
    made = Selection(states["with"], states["without"], (), None)  # type: ignore[arg-type]
    monkeypatch.setattr(explain, "_with_term", lambda *_: "data")
    monkeypatch.setattr(explain, "_refitted", lambda *_: again)
    plain = SimpleNamespace(simulations=(SimpleNamespace(robot=None),))
    search = SimpleNamespace(named=lambda *_: made)
    _, found, effect = explain._settled(plain, law, search)  # type: ignore[arg-type]
    assert found.best.key == names  # type: ignore[attr-defined]
    assert effect.laws == ("a law",)


def _selection(names: int, places: int = 2) -> Selection:
    """Of so many names, at so many places."""
    hypotheses = tuple(SimpleNamespace(where=f"wheel {n % places}") for n in range(names))
    model = SimpleNamespace(hypotheses=hypotheses, findings=names)
    bare = SimpleNamespace(described=SimpleNamespace(robot=None))
    best, without = (SimpleNamespace(model=item) for item in (model, bare))
    noise = SimpleNamespace(sigma=None)
    return Selection(best, without, (), noise)  # type: ignore[arg-type]


def _instead(
    monkeypatch: pytest.MonkeyPatch,
    *,
    names: int = 3,
    places: int = 2,
    beside: int = 0,
    left: float = 200.0,
    then: float = 110.0,
    effect: SimpleNamespace | None,
    seen: SimpleNamespace | None = None,
) -> bool:
    """Whether a term takes the place of `names` that leave `left` of 100 values; with it `then`."""
    made = [_selection(count, places) for count in (names, beside)]
    plain = SimpleNamespace(value=(0.0,) * 100)
    monkeypatch.setattr(explain, "_remainder", lambda *_: None)
    monkeypatch.setattr(explain, "unmodelled_effect", lambda *_, is_repeatable: effect)
    monkeypatch.setattr(explain, "_at_its_best", lambda _, __, alone, ___: ("at its best", alone))
    monkeypatch.setattr(explain, "_settled", lambda _, best, __: (None, made[1], best))
    monkeypatch.setattr(explain, "_left", lambda data, *_: left if data is plain else then)
    beside_names = None if seen is None else explain._Seen(seen, is_much=False)  # type: ignore[arg-type]
    tried = explain._instead(plain, made[0], None, None, beside_names)  # type: ignore[arg-type]
    assert tried is None or tried[2] == ("at its best", effect)
    return tried is not None


LAW = SimpleNamespace(laws=("a law",), is_repeatable=True, share=0.4)


@pytest.mark.parametrize(
    ("names", "beside", "left", "then", "expected"),
    [
        (3, 0, 200.0, 110.0, True),
        (3, 1, 200.0, 110.0, True),
        (3, 2, 200.0, 110.0, True),  # as many in all
        (3, 3, 200.0, 110.0, False),
        (1, 0, 200.0, 110.0, True),
        (0, 0, 200.0, 110.0, False),
        (3, 0, 104.0, 60.0, False),  # they leave hardly more than noise
        (3, 0, 106.0, 60.0, True),
        (3, 0, 200.0, 166.0, True),  # a sixth less
        (3, 0, 200.0, 167.0, False),
        (1, 0, 90.0, 87.0, True),  # a single name, noise with either: a thirtieth less
        (1, 0, 90.0, 88.0, False),
        (1, 1, 90.0, 80.0, False),
        (2, 0, 90.0, 80.0, False),
        (1, 0, 104.0, 100.5, False),
        (3, 0, 106.0, 100.0, True),
    ],
)
def test_one_law_takes_the_place_of_names_if_it_leaves_much_less(
    monkeypatch: pytest.MonkeyPatch,
    names: int,
    beside: int,
    left: float,
    then: float,
    expected: bool,
) -> None:
    found = _instead(monkeypatch, names=names, beside=beside, left=left, then=then, effect=LAW)
    assert found == expected


@pytest.mark.parametrize(
    "effect",
    [
        None,
        SimpleNamespace(laws=(), is_repeatable=True, share=0.94),
        SimpleNamespace(laws=("a law",), is_repeatable=False, share=1.0),
    ],
)
def test_what_is_no_law_or_not_repeatable_takes_no_names_place(
    monkeypatch: pytest.MonkeyPatch, effect: SimpleNamespace | None
) -> None:
    assert not _instead(monkeypatch, effect=effect)


def test_names_at_one_place_that_leave_little_may_stand_in_for_what_has_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Friction and braking energy of one wheel for what its driver draws by speed."""
    for places, expected in ((1, True), (2, False)):
        found = _instead(monkeypatch, names=3, places=places, left=96.0, then=86.0, effect=LAW)
        assert found == expected


@pytest.mark.parametrize("is_repeatable", [True, False])
def test_what_shows_beside_names_that_leave_little_is_tried_in_their_place(
    monkeypatch: pytest.MonkeyPatch, is_repeatable: bool
) -> None:
    """If another drive would repeat it."""
    seen = SimpleNamespace(is_repeatable=is_repeatable)
    found = _instead(monkeypatch, left=104.0, then=80.0, effect=LAW, seen=seen)
    assert found == is_repeatable


def test_a_table_that_predicts_nearly_all_needs_no_law(monkeypatch: pytest.MonkeyPatch) -> None:
    effect = SimpleNamespace(laws=(), is_repeatable=True, share=0.96)
    assert _instead(monkeypatch, effect=effect)


@pytest.mark.parametrize(
    ("family", "law", "names", "left", "first"),
    [
        ("force.place", "", 1, 90.0, True),  # sought without any name: fewer names leave less
        ("force.place", "", 2, 90.0, False),
        ("force.place", "", 1, 100.0, False),
        ("torque.speed", "", 1, 90.0, True),  # what names depend on too is taken as it was found
        ("torque.speed", "alone", 1, 90.0, True),  # unless it is a law only without them
        ("torque.speed", "both", 1, 90.0, True),
    ],
)
def test_a_term_is_sought_without_names_that_stood_in_for_it(
    monkeypatch: pytest.MonkeyPatch, family: str, law: str, names: int, left: float, first: bool
) -> None:
    """Two names leave 100; a term sought without them has some beside it."""
    found, fewer = _selection(2), _selection(names)
    laws = ("a law",) if law else ()
    beside = SimpleNamespace(key="beside", laws=laws if law == "both" else ())
    alone = SimpleNamespace(key="alone", family=FAMILIES[family], laws=laws)
    settled: list[tuple[str, bool]] = []

    def _settled(_: object, effect: SimpleNamespace, *rest: object) -> tuple[object, ...]:
        settled.append((effect.key, len(rest) == 1))
        return "data", fewer, effect

    monkeypatch.setattr(explain, "_remainder", lambda *_: None)
    monkeypatch.setattr(explain, "unmodelled_effect", lambda *_: alone)
    monkeypatch.setattr(
        explain,
        "_at_its_best",
        lambda _, __, effect, ___: SimpleNamespace(key=effect.key + " at its best"),
    )
    monkeypatch.setattr(explain, "_settled", _settled)
    monkeypatch.setattr(explain, "_left", lambda data, *_: left if data == "data" else 100.0)
    *_, effect = explain._beside(None, found, beside, None, None)  # type: ignore[arg-type]
    own = "alone" if FAMILIES[family].is_strange or law == "alone" else "beside"
    best = (f"{own} at its best", True)
    assert effect.key == (best[0] if first else own)
    assert settled == ([best] if first else [best, (own, False)])


@pytest.mark.parametrize(
    ("share", "size", "has_names", "looked"),
    [
        (0.5, 0.03, True, True),  # names that leave much are doubted, however little that is
        (0.5, 0.03, False, False),
        (0.2, 0.03, True, False),
        (0.2, 0.16, False, True),
        (0.2, 0.14, True, False),
    ],
)
def test_what_is_left_is_looked_into_where_it_is_large_or_names_leave_much(
    monkeypatch: pytest.MonkeyPatch, share: float, size: float, has_names: bool, looked: bool
) -> None:
    asked = []
    model = SimpleNamespace(
        described=SimpleNamespace(robot=None), hypotheses=("a name",) * has_names
    )
    best = SimpleNamespace(model=model, evidence=0.0)
    found = SimpleNamespace(best=best, without=best)
    dataset = SimpleNamespace(predict=lambda _: (None, None), value=())
    ready = SimpleNamespace(base=SimpleNamespace(robot=None), scales=None)
    monkeypatch.setattr(explain, "residuals_of", lambda *_: ())
    monkeypatch.setattr(explain, "unexplained", lambda _: (share, size))
    monkeypatch.setattr(explain, "_remainder", lambda *_: None)
    monkeypatch.setattr(explain, "unmodelled_effect", lambda *_, is_sure: asked.append(is_sure))
    assert explain._unmodelled(dataset, found, ready) is None  # type: ignore[arg-type]
    assert asked == [False] * looked


@pytest.mark.parametrize(
    ("share", "has_names", "is_repeatable", "named"),
    [
        (0.02, True, False, False),  # names explain nearly all
        (0.04, True, False, True),
        (0.02, True, True, True),
        (0.02, False, False, True),
    ],
)
def test_a_little_that_comes_and_goes_beside_names_is_no_finding(
    monkeypatch: pytest.MonkeyPatch,
    share: float,
    has_names: bool,
    is_repeatable: bool,
    named: bool,
) -> None:
    found = _selection(int(has_names))
    for state in (found.best, found.without):
        state.evidence = 0.0  # type: ignore[misc]
    found.best.model.described = SimpleNamespace(robot=None)  # type: ignore[misc]
    effect = SimpleNamespace(is_repeatable=is_repeatable, is_large=True, evidence=1e6)
    dataset = SimpleNamespace(predict=lambda _: (None, None), value=())
    ready = SimpleNamespace(base=SimpleNamespace(robot=None), scales=None)
    monkeypatch.setattr(explain, "residuals_of", lambda *_: ())
    monkeypatch.setattr(explain, "unexplained", lambda _: (share, 0.5))
    monkeypatch.setattr(explain, "_remainder", lambda *_: None)
    monkeypatch.setattr(explain, "unmodelled_effect", lambda *_, is_sure: effect)
    seen = explain._unmodelled(dataset, found, ready)  # type: ignore[arg-type]
    assert (seen is not None) == named
    assert seen is None or (seen.effect, seen.is_much) == (effect, True)
    effect.evidence = 10.0
    seen = explain._unmodelled(dataset, found, ready)  # type: ignore[arg-type]
    assert seen is None or not seen.is_much


@pytest.mark.parametrize(
    ("names", "left", "then", "after", "taken"),
    [
        (2, 186.0, 100.0, 2, True),  # a wheel radius and an inertia for a payload and a resistance
        (2, 186.0, 100.0, 3, False),
        (2, 186.0, 160.0, 2, False),  # a sixth less is asked for where more than noise is left
        (2, 106.0, 100.0, 1, True),
        (2, 104.0, 90.0, 2, False),  # hardly more than noise
        (3, 186.0, 100.0, 2, False),
        (0, 186.0, 100.0, 0, False),
    ],
)
def test_names_that_leave_more_than_noise_are_sought_again_without_the_first(
    monkeypatch: pytest.MonkeyPatch, names: int, left: float, then: float, after: int, taken: bool
) -> None:
    first, second = _selection(names), _selection(after)
    barred: list[object] = []

    def forward(*_: object, **settings: object) -> Selection:
        barred.append(settings["barred"])
        return second if settings["barred"] else first

    monkeypatch.setattr(explain, "forward_selection", forward)
    monkeypatch.setattr(explain, "backward_elimination", lambda _, found, *__: found)
    monkeypatch.setattr(explain, "first_names", lambda _: {"a wheel radius"})
    monkeypatch.setattr(explain, "_left", lambda _, found, __: left if found is first else then)
    search = explain._Search(None, (), None, lambda _: None)  # type: ignore[arg-type]
    found = search.named(SimpleNamespace(value=(0.0,) * 100))  # type: ignore[arg-type]
    assert found is (second if taken else first)
    assert barred in ([()], [(), {"a wheel radius"}])


def test_the_first_names_are_all_that_would_have_done_as_well() -> None:
    tried = [
        SimpleNamespace(
            evidence=evidence,
            model=SimpleNamespace(hypotheses=[SimpleNamespace(name=name) for name in together]),
        )
        for evidence, together in ((-10.0, ("a", "b")), (-14.9, ("c",)), (-15.1, ("d",)))
    ]
    found = SimpleNamespace(rounds=(SimpleNamespace(tried=tried), SimpleNamespace(tried=[])))
    assert first_names(found) == {"a", "c"}  # type: ignore[arg-type]


def test_a_term_is_fitted_beside_what_is_not_exactly_known_fitted_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(explain, "_with_term", lambda *item: item)
    monkeypatch.setattr(explain, "_refitted", lambda *item: item)
    search = SimpleNamespace(unnamed=lambda data: ("fitted to", data))
    bare = SimpleNamespace(described=SimpleNamespace(robot="robot"))
    found = explain._at_its_best("plain", bare, "term", search)  # type: ignore[arg-type]
    assert found == ("plain", ("fitted to", ("plain", "robot", "term")), "term")
