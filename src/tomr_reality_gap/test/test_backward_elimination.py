"""Backward elimination of findings, by a table of what each set of them is worth."""

from collections.abc import Callable, Mapping, Sequence
from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot
from tomr_reality_gap.fit import backward_elimination
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.refine import FittedModel
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

WORTH: Mapping[str, float] = {
    "": 0.0,
    "a": 500.0,
    "b": 300.0,
    "c": 200.0,
    "d": 250.0,
    "ab": 900.0,
    "ac": 905.0,
    "bc": 400.0,
    "abc": 910.0,
    "ae": 700.0,
    "be": 700.0,
    "abe": 1000.0,
    "bw": 990.0,
    "ad": 1000.0,
    "bd": 310.0,
}
EMPTY = Model(ParameterisedRobot({}, "made"), (), ())


def _model(names: str) -> Model:
    model = EMPTY
    for name in names:
        parameter = Parameter("size", (name,), "", 1.0)
        model = model.joined(Hypothesis(name, ("body",), (parameter,)))
    return model


def _letters(model: Model) -> str:
    return "".join(item.effect for item in model.hypotheses)


def _fitted(model: Model) -> FittedModel:
    worth = WORTH["".join(sorted(_letters(model)))]
    none = np.empty(0)
    return FittedModel(model, worth, 0.0, none, none, none)


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> object:
    """`second(best, rounds)`: what is left; rounds as (so far, tried together)."""

    def refine(
        dataset: object, states: Sequence[tuple[Model, object]], *rest: object, tick: object
    ) -> list[FittedModel]:
        return [_fitted(model) for model, _ in states]

    monkeypatch.setattr(backward_elimination, "refine", refine)
    dataset = SimpleNamespace(value=np.zeros(1000))

    def think(best: str, *rounds: tuple[str, str]) -> Selection:
        steps = tuple(
            SimpleNamespace(
                jacobian=SimpleNamespace(model=_model(so_far)),
                tried=tuple(_fitted(_model(so_far + letter)) for letter in tried),
            )
            for so_far, tried in rounds
        )
        start = Selection(_fitted(_model(best)), _fitted(EMPTY), steps, None)  # type: ignore[arg-type]
        return backward_elimination.backward_elimination(dataset, start)  # type: ignore[arg-type]

    return think


def test_a_finding_that_later_ones_made_needless_goes(second) -> None:  # type: ignore[no-untyped-def]
    """Of abc = 910 the weakest is b: ac alone is worth 905, less than the cost of 20 apart."""
    found = second("abc", ("", "ab"), ("a", "b"), ("ab", "c"))
    assert _letters(found.best.model) == "ac"


def test_what_a_finding_displaced_may_take_its_place(second) -> None:  # type: ignore[no-untyped-def]
    """d lost against b beside nothing, but beside a it is worth more."""
    found = second("ab", ("", "ab"), ("a", "bd"))
    assert _letters(found.best.model) == "ad"
    assert [_letters(item.model) for item in found.alternatives[1]] == ["ad", "ab"]


def test_needed_findings_stay_and_their_rivals_are_named(second) -> None:  # type: ignore[no-untyped-def]
    found = second("ab", ("", "ab"), ("a", "bc"))
    assert _letters(found.best.model) == "ac"  # 905 against 900
    assert _letters(found.alternatives[0][0].model) == "ac"


@pytest.fixture
def near(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., list[Model]]], None]:
    """Sets what `nearest(best, *numbers)` gives; w is the one candidate."""
    monkeypatch.setattr(backward_elimination, "_together", lambda *given: ())

    def answer(nearest: Callable[..., list[Model]]) -> None:
        def responses(dataset: object, found: Selection, candidates: object) -> SimpleNamespace:
            return SimpleNamespace(
                dataset=dataset, found=found, candidates=_model("w").hypotheses, nearest=nearest
            )

        monkeypatch.setattr(backward_elimination, "Responses", responses)

    return answer


def test_one_effect_may_do_the_work_of_any_two_findings(second, near) -> None:  # type: ignore[no-untyped-def]
    """w does nearly what a and e do together, and two findings cost less than three."""
    asked = []

    def nearest(best: FittedModel, *numbers: int) -> list[Model]:
        asked.append((_letters(best.model), numbers))
        letters = list(_letters(best.model))
        pair = sorted(letters[number] for number in numbers)
        rest = [letter for letter in letters if letter not in pair]
        return [_model("".join(["w", *rest]))] if pair == ["a", "e"] else []

    near(nearest)
    found = second("abe", ("", "a"), ("a", "b"), ("ab", "e"))
    assert _letters(found.best.model) == "wb"
    assert {("abe", pair) for pair in ((0, 1), (0, 2), (1, 2))} <= set(asked)


def test_shapes_are_tried_for_each_of_two_findings(
    second,  # type: ignore[no-untyped-def]
    near,  # type: ignore[no-untyped-def]
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def reshaped(responses: object, model: Model, number: int, needless: int) -> list[Model]:
        asked.append((number, needless))
        return [_model("bw")] if (number, needless) == (2, 0) else []

    near(lambda best, *numbers: [])
    monkeypatch.setattr(backward_elimination, "_reshaped", reshaped)
    found = second("abe", ("", "a"), ("a", "b"), ("ab", "e"))
    assert _letters(found.best.model) == "bw"
    assert set(permutations(range(3), 2)) <= set(asked)


def test_another_shape_of_a_finding_may_do_without_a_second() -> None:
    """It is tried as large as the finding is, whichever of the two that comes after."""
    size, slip = Parameter("size", ("made",), "", 1.0), Parameter("slip", ("slip",), "", 1.0)
    plain = Hypothesis("a", ("body",), (size,))
    shaped = Hypothesis("a", ("body",), (size, slip), start={"slip": 0.4})
    elsewhere = Hypothesis("a", ("supply",), (size, slip), start={"slip": 0.4})
    responses = SimpleNamespace(candidates=(plain, shaped, elsewhere, *_model("b").hypotheses))
    for model, number in ((_model("b").joined(plain), 1), (EMPTY.joined(plain).joined(plain), 0)):
        model = model.moved(np.empty(0), np.array([0.5, 0.5]))
        (found,) = backward_elimination._reshaped(responses, model, number, 1 - number)  # type: ignore[arg-type]
        assert found.hypotheses == (shaped,)
        assert found.offsets == ((0.5, 0.0),)


@pytest.mark.parametrize(
    ("known", "expected"),
    [
        ("c", ["cv"]),  # a part: all of them
        ("i", ["cv"]),  # what does the work of all
        ("cv", ["i"]),  # all of them: what does their work
        ("ac", ["acv"]),
        ("a", []),
    ],
)
def test_what_does_the_work_of_several_stands_in_for_them_together(
    known: str, expected: list[str]
) -> None:
    """i does that of c and v, at one place alone; what was tried starts from where it came to."""
    parameter = Parameter("size", ("made",), "", 1.0)
    here, there = ("body",), ("supply",)
    candidates = (
        *(Hypothesis(name, here, (parameter,)) for name in "acv"),
        Hypothesis("i", here, (parameter,), stands_for=("c", "v")),
        Hypothesis("i", there, (parameter,), stands_for=("c", "v")),
    )
    model = EMPTY
    for name in known:
        model = model.joined(next(item for item in candidates if item.effect == name))
        model = model.moved(np.empty(0), np.full(len(model.hypotheses), 0.7))
    tried = _model("v").moved(np.empty(0), np.array([0.3]))
    responses = SimpleNamespace(
        candidates=candidates,
        found=SimpleNamespace(rounds=(SimpleNamespace(tried=(SimpleNamespace(model=tried),)),)),
    )
    last = len(model.hypotheses) - 1
    found = list(backward_elimination._together(responses, model, last))  # type: ignore[arg-type]
    assert ["".join(sorted(_letters(item))) for item in found] == expected
    for item in found:
        sizes = dict(zip(_letters(item), (own[0] for own in item.offsets), strict=True))
        assert sizes == {
            name: 0.7 if name in known else {"v": 0.3}.get(name, 0.0) for name in sizes
        }


def test_the_second_part_of_friction_at_a_place_costs_the_least() -> None:
    """Coulomb and viscous friction of one wheel; iron loss costs as two findings."""
    price = backward_elimination.Price(usual=100.0, least=20.0)

    def worth(*effects: tuple[str, str]) -> float:
        model = EMPTY
        for effect, where in effects:
            whole = ("friction.coulomb", "friction.viscous") if effect == "iron" else ()
            model = model.joined(Hypothesis(effect, (where,), (), stands_for=whole))
        none = np.empty(0)
        return price.worth(FittedModel(model, 0.0, 0.0, none, none, none))

    coulomb, viscous = ("friction.coulomb", "wheel_1"), ("friction.viscous", "wheel_1")
    assert worth(coulomb) == -100.0
    assert worth(coulomb, viscous) == -120.0
    assert worth(coulomb, ("friction.viscous", "wheel_2")) == -200.0
    assert worth(coulomb, viscous, ("a", "body")) == -220.0
    assert worth(("iron", "wheel_1")) == -200.0


def test_friction_of_one_place_is_one_finding() -> None:
    coulomb, viscous, other = (
        Hypothesis(effect, (where,), ())
        for effect, where in (
            ("friction.coulomb", "all_wheels"),
            ("friction.viscous", "all_wheels"),
            ("friction.viscous", "wheel_1"),
        )
    )
    model = EMPTY.joined(coulomb).joined(viscous)
    assert (EMPTY.findings, model.findings, model.joined(other).findings) == (0, 1, 2)
