"""Pictures of what has no name: what they show of a table and its law."""

import base64
from io import BytesIO

import matplotlib.image
import numpy as np
import pytest

from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_reality_gap.explanation import Estimate, FittedLaw, Learnt, Shape
from tomr_reality_gap.report.unnamed import law_values, unnamed_picture

LINE = np.linspace(-1.0, 1.0, 9)
AT = np.linspace(0.0, 1.0, 5)
SHAPE = Shape("x", "wheel_1_joint", AT, AT, AT - 0.1, AT + 0.1)


def _law(name: str, **values: float) -> FittedLaw:
    exact = {key: Estimate(value, value, value, "") for key, value in values.items()}
    return FittedLaw(name, "", exact, 1.0)


PATCH = _law("patch", size=0.3, radius=0.5, x=0.2, y=-0.1)
SPRING = _law("spring", stiffness=4.0, slack=0.5, x=0.0, y=0.0)


def _map(family: str, *laws: FittedLaw, sigma: np.ndarray | None = None) -> Learnt:
    acts = FAMILIES[family]
    wheels = (0, 1, 2) if acts.acts == "torque" else ()
    rows = LearntTerm.rows(acts, len(wheels))
    values = np.ones((rows, 81))
    term = LearntTerm(acts, wheels, (LINE, LINE), values)
    return Learnt(term, np.ones((rows, 81)) if sigma is None else sigma, 1.0, True, laws)


def _pixels(picture: str) -> np.ndarray:
    data = BytesIO(base64.b64decode(picture.split(",")[1]))
    return np.asarray(matplotlib.image.imread(data, format="png"))


def test_a_law_is_drawn_with_its_own_parameters() -> None:
    """4 N/m beyond 0.5 m, 1 m away; the patch is all there inside and half at its edge."""
    at = np.array([[1.0, 0.0], [0.0, -1.0]])
    np.testing.assert_allclose(law_values(SPRING, at), [[-2.0, 0.0], [0.0, 2.0]], atol=1e-9)
    inside, edge, _ = law_values(PATCH, np.array([[0.2, -0.1], [0.2, 0.4], [0.3, 0.0]]))[0]
    assert (inside, edge) == pytest.approx((0.3, 0.15), rel=1e-3)


def test_what_no_wheel_has_met_is_left_blank() -> None:
    known = np.full((1, 81), 0.1)
    half = known.copy()
    half[:, :45] = 1.0  # the five lowest of nine values of x
    whole, part = (_pixels(unnamed_picture(SHAPE, _map("torque.place", sigma=item)))
                   for item in (np.append(known[:, :80], [[1.0]], axis=1), half))  # fmt: skip
    blank = [(item[..., :3].min(axis=-1) > 0.99).mean() for item in (whole, part)]
    assert blank[1] > blank[0] + 0.05


def test_the_law_that_comes_first_is_drawn_over_the_curve_and_beside_the_map() -> None:
    """Whoever moves it sees it move."""
    family = FAMILIES["torque.speed"]
    term = LearntTerm(family, (0,), (AT,), AT[None])
    powers = [_law("power law", size=size, exponent=2.0) for size in (0.5, 1.0)]
    curves = [Learnt(term, np.ones((1, 5)), 1.0, True, (law,)) for law in powers]
    moved = _law("patch", size=0.3, radius=0.5, x=-0.6, y=0.6)
    sigma = np.append(np.full((1, 80), 0.1), [[1.0]], axis=1)
    maps = [_map("torque.place", law, sigma=sigma) for law in (PATCH, moved)]
    for pair in (curves, maps):
        one, other = (_pixels(unnamed_picture(SHAPE, item)) for item in pair)
        assert one.shape == other.shape
        assert (np.abs(one - other) > 0.1).any(axis=-1).mean() > 0.001


@pytest.mark.parametrize(
    "learnt",
    [None, _map("torque.place", PATCH), _map("torque.place"), _map("force.place", SPRING)],
    ids=["a curve", "a map and its law", "a map", "arrows"],
)
def test_every_shape_gives_a_picture(learnt: Learnt | None) -> None:
    sigma = None if learnt is None else np.append(0.1 * learnt.sigma[:, 1:], learnt.sigma[:, :1], 1)
    known = None if learnt is None or sigma is None else Learnt(
        learnt.term, sigma, 1.0, True, learnt.laws
    )  # fmt: skip
    pixels = _pixels(unnamed_picture(SHAPE, known))
    assert pixels[..., :3].std() > 0.01
