"""Laws behind learnt tables, from normal equations made by hand."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_power_model.unmodelled.term import value_at
from tomr_reality_gap.fit import laws, polish
from tomr_reality_gap.fit.law_forms import LAWS
from tomr_reality_gap.fit.laws import Evidence, LawAt, laws_of, words_of
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.fit.remainder import Remainder


def _table(family: str, *knots: np.ndarray) -> Table:
    count = int(np.prod([len(points) for points in knots]))
    return Table(FAMILIES[family], knots, np.eye(count))


def _evidence(values: np.ndarray, exact: float = 1e4) -> Evidence:
    """Each value of a table measured by itself."""
    units = values.ravel()
    return Evidence(exact * np.eye(len(units)), exact * units, 1.0)


def _laws(table: Table, values: np.ndarray) -> dict[str, tuple[dict[str, float], LearntTerm]]:
    term = LearntTerm(table.family, (), table.knots, np.atleast_2d(values))
    return {
        item.law.name: (
            {name: estimate.value for name, estimate in item.fitted.parameters.items()},
            item.term,
        )
        for item in laws_of(table, term, _evidence(np.atleast_2d(values)))
    }


def _spring(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """4 N/m beyond 0.5 m from (0.3, -0.2)."""
    away = np.stack([0.3 - x, -0.2 - y])
    far = np.hypot(*away)
    return 4.0 * np.maximum(far - 0.5, 0.0) / far * away


def test_a_spring_is_named_with_its_anchor_and_reaches_beyond_the_table() -> None:
    line = np.linspace(-1.0, 1.0, 7)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    found, term = _laws(_table("force.place", line, line), _spring(x, y))["spring"]
    expected = {"stiffness": 4.0, "slack": 0.5, "x": 0.3, "y": -0.2}
    assert found == pytest.approx(expected, abs=0.02)
    assert [(points[0], points[-1]) for points in term.knots] == [
        (-3.0, pytest.approx(3.0, abs=0.2))
    ] * 2
    far = np.array([2.5, 2.5])
    at = np.argmin([np.hypot(a - far[0], b - far[1]) for a in term.knots[0] for b in term.knots[1]])
    place = np.array([(a, b) for a in term.knots[0] for b in term.knots[1]])[at]
    np.testing.assert_allclose(term.values[:, at], _spring(*place), rtol=0.02)


@pytest.mark.parametrize(
    ("family", "law", "values", "parameters"),
    [
        ("torque.since_stand", "exponential", lambda t: 0.3 * np.exp(-t / 0.9),
         {"size": 0.3, "decay": 0.9}),
        ("driver.speed", "step", lambda w: 2.0 * (w > 4.2), {"size": 2.0}),
        ("torque.speed", "power law", lambda w: 0.01 * w**3, {"size": 0.01, "exponent": 3.0}),
        ("driver.current", "square beyond a threshold", lambda i: 0.5 * i**2 * (i > 4.2),
         {"size": 0.5}),
        ("driver.current", "square of the excess", lambda i: 0.5 * np.maximum(i - 3.0, 0.0) ** 2,
         {"size": 0.5, "threshold": 3.0}),
        ("torque.tight_angle", "bump", lambda a: 0.2 * np.exp(-((a - 2.0) / 0.4) ** 2),
         {"size": 0.2, "width": 0.4, "place": 2.0}),
        ("torque.angle", "periodic", lambda a: 0.2 * np.sin(3.0 * a + 1.0),
         {"size": 0.2, "order": 3.0, "phase": 1.0}),
    ],
)  # fmt: skip
def test_curves_are_named_as_the_laws_that_they_are(
    family: str, law: str, values: object, parameters: dict[str, float]
) -> None:
    knots = np.linspace(0.0, 8.0, 24)
    if FAMILIES[family].axes[0].is_periodic:
        knots = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    found = _laws(_table(family, knots), values(knots))  # type: ignore[operator]
    fitted, _ = found[law]
    for name, value in parameters.items():
        assert fitted[name] == pytest.approx(value, rel=0.03, abs=0.02)


def test_the_order_of_a_periodic_law_is_a_whole_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing keeps the fit from drifting within it: a start beside it stays there."""
    beside = evolve(LAWS["periodic"], starts=lambda at, values: [[0.1, 3.3, 0.8]])
    monkeypatch.setattr(laws, "LAWS", {"periodic": beside})
    knots = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    fitted, _ = _laws(_table("torque.angle", knots), 0.2 * np.sin(3.0 * knots + 1.0))["periodic"]
    assert fitted["order"] == 3.0


@pytest.mark.parametrize(
    ("family", "law", "parameters"),
    [
        ("force.velocity", "wind", {"coefficient": 5.0, "x": 0.5, "y": -0.3}),
        ("force.place", "steady force", {"x": 2.0, "y": -1.0}),
        ("torque.place", "patch", {"size": 0.3, "radius": 0.6, "x": -0.2, "y": 0.3}),
        (
            "torque.place",
            "stripes",
            {"size": 0.3, "width": 0.7, "azimuth": 0.4, "phase": 1.0},
        ),
        ("torque.place", "edge", {"size": 0.3, "azimuth": 0.4, "distance": 0.2}),
    ],
)
def test_maps_are_named_as_the_laws_that_they_are(
    family: str, law: str, parameters: dict[str, float]
) -> None:
    """Values worked out here, by the words that the law is described with."""
    line = np.linspace(-1.0, 1.0, 9)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    p = parameters
    if law == "wind":
        past = np.stack([p["x"] - x, p["y"] - y])
        values = p["coefficient"] * np.hypot(*past) * past
    elif law == "steady force":
        values = np.stack([np.full_like(x, p["x"]), np.full_like(x, p["y"])])
    else:
        values = p["size"] * _on_it(law, p, x, y)[None]
    found = _laws(_table(family, line, line), values)
    fitted, _ = found[law]
    assert fitted == pytest.approx(parameters, abs=0.01)


@pytest.mark.parametrize(("width", "azimuth"), [(0.87, 0.31), (1.4, 2.6), (0.75, 1.1)])
def test_stripes_are_found_on_a_large_floor(width: float, azimuth: float) -> None:
    """Ten of them: half a stripe more or less at the other end is another fit altogether."""
    line = np.linspace(-4.0, 4.0, 24)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    p = {"size": 0.3, "width": width, "azimuth": azimuth, "phase": 1.0}
    soft = 0.25 * float(line[1] - line[0])
    values = p["size"] * _on_it("stripes", p, x, y, soft)[None]
    fitted, _ = _laws(_table("torque.place", line, line), values)["stripes"]
    assert fitted == pytest.approx(p, abs=0.01)


def test_a_parameter_more_must_bring_its_price(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two forms that fit alike: the one with less to choose is named first."""
    short = LAWS["power law"]
    long = evolve(
        short,
        name="long",
        units={**short.units, "idle": ""},
        starts=lambda at, values: [[*start, 0.0] for start in short.starts(at, values)],
    )
    monkeypatch.setattr(laws, "LAWS", {"long": long, "power law": short})
    knots = np.linspace(0.0, 8.0, 24)
    assert list(_laws(_table("torque.speed", knots), 0.01 * knots**2)) == ["power law", "long"]


def test_a_law_of_the_floor_is_drawn_finer_than_its_table_and_little_beyond_it() -> None:
    """Four knots for one, and a quarter of the map to either side; an edge is softer else."""
    line = np.linspace(-1.0, 1.0, 9)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    p = {"size": 0.3, "radius": 0.6, "x": -0.2, "y": 0.3}
    _, term = _laws(_table("torque.place", line, line), 0.3 * _on_it("patch", p, x, y)[None])[
        "patch"
    ]
    for points in term.knots:
        assert np.diff(points) == pytest.approx(np.full(len(points) - 1, 0.25 / 4))
        assert (points[0], points[-1]) == (-1.5, pytest.approx(1.5, abs=0.07))


def _on_it(
    law: str, p: dict[str, float], x: np.ndarray, y: np.ndarray, soft: float = 0.25 * 0.25
) -> np.ndarray:
    """How far a place is on what resists; its edges are `soft` [m]: a quarter of a table's step."""
    if law == "patch":
        inside = p["radius"] - np.hypot(p["x"] - x, p["y"] - y)
    else:
        along = x * np.cos(p["azimuth"]) + y * np.sin(p["azimuth"])
        inside = along - p.get("distance", 0.0)
    if law == "stripes":
        turns = np.pi / p["width"]
        inside = np.sin(turns * along + p["phase"]) / turns
    return np.asarray(1.0 / (1.0 + np.exp(-inside / soft)))


def test_every_law_belongs_to_families_that_are_known_and_states_all_its_parameters() -> None:
    for law in LAWS.values():
        assert set(law.families) <= set(FAMILIES)
        assert {name for name in law.units if f"{{{name}}}" in law.words} == set(law.units)


def test_the_law_that_fits_best_for_its_length_comes_first_and_three_are_listed() -> None:
    knots = np.linspace(0.0, 8.0, 24)
    table, values = _table("torque.speed", knots), 0.01 * knots
    assert next(iter(_laws(table, values))) == "power law"
    term = LearntTerm(table.family, (), table.knots, values[None])
    assert len(laws_of(table, term, _evidence(values[None]), -np.inf)) == 3


@pytest.mark.parametrize("sigma", [0.1, 1e-3])
def test_intervals_are_as_wide_as_the_data_are_inexact(sigma: float) -> None:
    """Four times the noise, correlation included; 2 % of a value is never known."""
    knots = np.linspace(0.0, 8.0, 24)
    table, values = _table("torque.speed", knots), 0.01 * knots[None] ** 2
    term = LearntTerm(table.family, (), table.knots, values)
    # Each value is known to sigma: what is known of the parameters by their own derivatives.
    slopes = np.stack([knots**2, 0.01 * knots**2 * np.log(np.maximum(knots, 1e-9))], axis=1)
    known = sigma**2 * np.linalg.inv(slopes.T @ slopes)
    never = 0.02 * np.array([0.01, 2.0])
    tied = never[::-1] * known[0, 1] / np.diag(known)[::-1]  # by the other, as the data tie them
    for inflation in (1.0, 16.0):
        evidence = evolve(_evidence(values, exact=sigma**-2), inflation=inflation)
        laws_found = {item.law.name: item.fitted for item in laws_of(table, term, evidence)}
        fitted = laws_found["power law"].parameters
        widths = [fitted[name].high - fitted[name].low for name in ("size", "exponent")]
        expected = 3.92 * np.sqrt(inflation * np.diag(known) + never**2 + tied**2)
        assert widths == pytest.approx(expected, rel=0.02)


def test_what_cannot_be_negative_has_no_interval_below_nothing() -> None:
    knots = np.linspace(0.0, 8.0, 24)
    table, values = _table("torque.since_stand", knots), 0.3 * np.exp(-knots[None] / 0.9)
    term = LearntTerm(table.family, (), table.knots, values)
    (law, *_) = laws_of(table, term, _evidence(values, exact=10.0))
    fitted = law.fitted.parameters
    assert fitted["decay"].low == 0.0 < fitted["decay"].value
    assert fitted["size"].low < 0.0


def test_a_curve_that_is_no_law_stays_a_table() -> None:
    knots = np.linspace(0.0, 8.0, 24)
    values = np.random.default_rng(1).standard_normal(24)
    assert _laws(_table("torque.speed", knots), values) == {}


def test_a_threshold_that_was_never_met_is_none() -> None:
    """A parabola about -20 rad/s, at speeds from 0 on."""
    knots = np.linspace(0.0, 8.0, 24)
    found = _laws(_table("torque.speed", knots), 1e-3 * (knots + 20.0) ** 2)
    assert "square of the excess" not in found


def test_a_law_is_stated_in_words_with_its_numbers() -> None:
    knots = np.linspace(0.0, 8.0, 24)
    table = _table("torque.since_stand", knots)
    values = 0.3 * np.exp(-knots / 0.9)
    term = LearntTerm(table.family, (), table.knots, values[None])
    found = [item.fitted for item in laws_of(table, term, _evidence(values[None]))]
    assert words_of(found[0]) == "0.3 N m that dies out over 0.9 s"


@pytest.mark.parametrize("factors", [(1.2, 0.95), (0.3, 0.8)])
def test_a_law_is_brought_to_its_best_however_small_its_size_is(
    monkeypatch: pytest.MonkeyPatch, factors: tuple[float, float]
) -> None:
    """From close by, and from where the first steps are too long.

    A wheel that answers to 0.1 N m at most: a step of 0.005 of N m at 1 rad/s is 0.6 at 5.
    """
    knots = np.linspace(0.0, 8.0, 12)
    table, true = _table("torque.speed", knots), 3e-4 * knots[None] ** 3
    term = LearntTerm(table.family, (), table.knots, true)
    law = laws_of(table, term, _evidence(true))[0]
    speed = np.random.default_rng(3).uniform(0.0, 5.0, (2000, 1))

    def shown(_: object, __: object, ___: object, terms: list[LearntTerm]) -> np.ndarray:
        torques = [value_at(item.family, item.knots, item.values[0], speed) for item in terms]
        return 0.1 * np.tanh(np.array(torques) / 0.1)

    monkeypatch.setattr(polish, "changes_of", shown)
    (residual,) = shown(None, None, None, [law.term])
    off = evolve(law, parameters=law.parameters * factors)
    rest = Remainder(None, 1e3 * residual, np.empty((len(speed), 0)), np.full(len(speed), 1e3))  # type: ignore[arg-type]
    (best, change), (wide, _) = (
        polish.polished(off, rest, None, (), inflation=inflation)  # type: ignore[arg-type]
        for inflation in (1.0, 4.0)
    )
    np.testing.assert_allclose(wide.covariance, 4.0 * best.covariance)
    assert best.parameters == pytest.approx(law.parameters, rel=0.01)
    np.testing.assert_allclose(change, residual, atol=1e-3)
    # Of laws the first that explains enough, or else the one that explains most.
    other = evolve(law, law=LAWS["step"], parameters=np.array([0.05, 2.0]))
    for enough, name in ((0.3, "step"), (0.9999, "power law"), (2.0, "power law")):
        tried = [other, off]
        taken, change, share = polish.best_law(rest, tried, None, (), inflation=1.0, enough=enough)  # type: ignore[arg-type]
        assert taken.law.name == name
        assert share == pytest.approx(1.0 - ((residual - change) ** 2).sum() / (residual**2).sum())


def test_a_law_comes_to_its_best_along_a_bent_valley_and_stops_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Wheels that turn at 8 to 12 rad/s alone: size and exponent of a drag trade places."""
    table = _table("torque.speed", np.linspace(0.0, 14.0, 24))
    term = LearntTerm(table.family, (), table.knots, np.zeros((1, 24)))
    start = LawAt(LAWS["power law"], np.array([0.0046, 2.53]), np.eye(2), 1.0, table, term)
    random = np.random.default_rng(3)
    speed, rounds = random.uniform(8.0, 12.0, (2000, 1)), []

    def shown(_: object, __: object, ___: object, terms: list[LearntTerm]) -> np.ndarray:
        rounds.append(terms)
        torques = [value_at(item.family, item.knots, item.values[0], speed) for item in terms]
        return np.array(torques) * (np.nan if len(rounds) == 3 else 1.0)

    monkeypatch.setattr(polish, "changes_of", shown)
    true = evolve(start, parameters=np.array([1e-3, 3.0])).term
    (torque,) = shown(None, None, None, [true])
    rest = Remainder(
        None,  # type: ignore[arg-type]
        1e3 * torque + random.standard_normal(2000),
        np.empty((2000, 0)),
        np.full(2000, 1e3),
    )
    best, _ = polish.polished(start, rest, None, (), inflation=1.0)  # type: ignore[arg-type]
    assert best.parameters == pytest.approx([1e-3, 3.0], rel=2e-3)
    assert len(rounds) < 10  # nothing is to be had any more; the third was a step too long
