"""Tables of terms without a name: over what they reach, and how fine they are."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.effects.scales import Scales
from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_power_model.unmodelled.term import smoothness
from tomr_reality_gap.fit.learnt import Table

SCALES = Scales(
    torque=0.2, speed=5.0, current=1.0, power=2.0, copper=1.0, load=20.0, radius=0.05, arm=0.2,
    mass=6.0, gear=20.0, voltage=24.0, duration=60.0, period=0.01,
)  # fmt: skip


def _table(family: str, *motions: SimpleNamespace) -> Table | None:
    return Table.over(FAMILIES[family], motions, SCALES)  # type: ignore[arg-type]


def _contacts(low: float, high: float) -> SimpleNamespace:
    """Three wheels somewhere between, one sample of a thousand at either end."""
    x = np.full((1000, 3), 0.5 * (low + high))
    x[0, 0], x[-1, 2] = low, high
    return SimpleNamespace(contact_x=x, contact_y=x[::-1])


def test_a_table_reaches_over_all_that_any_recording_shows() -> None:
    table = _table("torque.place", _contacts(-1.0, 0.5), _contacts(0.0, 2.0))
    assert table is not None
    for points in table.knots:
        assert (points[0], points[-1]) == (-1.0, 2.0)
        assert np.diff(points).max() == pytest.approx(0.25, rel=0.1)


def test_a_map_of_a_large_floor_is_as_fine_as_its_knots_allow() -> None:
    table = _table("torque.place", _contacts(-6.0, 6.0))
    assert table is not None
    assert [len(points) for points in table.knots] == [24, 24]


@pytest.mark.parametrize(("reach", "is_seen"), [(0.19, False), (0.21, True)])
def test_who_goes_nowhere_sees_no_floor(reach: float, is_seen: bool) -> None:
    assert (_table("torque.place", _contacts(0.0, reach)) is not None) == is_seen


@pytest.mark.parametrize(
    ("family", "size"),
    [("torque.time", 0.2), ("force.time", 12.0), ("driver.time", 2.0), ("supply.time", 6.0)],
)
def test_values_are_as_large_as_what_they_act_on_makes_likely(family: str, size: float) -> None:
    """0.2 N m at each of three wheels of 0.05 m; 2 W at each of three drivers."""
    table = _table(family, SimpleNamespace(time=np.arange(0.0, 30.0, 0.1)[:, None]))
    assert table is not None
    values = np.linalg.norm(table.root, axis=1)
    np.testing.assert_allclose(values, size, rtol=0.02)  # but for shapes that are too rough
    assert len(table.knots[0]) == 31


@pytest.mark.parametrize("family", ["torque.time", "torque.angle", "force.place"])
def test_the_shapes_of_a_table_make_up_its_smooth_values(family: str) -> None:
    """Fewer than knots; what is left out of the prior is next to nothing of its largest."""
    around = np.linspace(-3.0, 3.0, 300)[:, None]
    motion = SimpleNamespace(time=around + 3.0, angle=around, x=around, y=around)
    table = _table(family, motion)
    assert table is not None
    known, knots, size = FAMILIES[family], table.knots, float(np.linalg.norm(table.root[0]))
    prior = smoothness(known, knots, 1.5)
    lacking = prior - table.root @ table.root.T / size**2
    assert np.linalg.norm(lacking, 2) < 0.02 * np.linalg.norm(prior, 2)
    assert table.root.shape[1] < 0.9 * len(table.root)


def test_units_of_a_term_are_those_that_it_was_made_of() -> None:
    table = _table("torque.time", SimpleNamespace(time=np.arange(0.0, 30.0, 0.1)[:, None]))
    assert table is not None
    units = np.random.default_rng(1).standard_normal((2, table.root.shape[1]))
    np.testing.assert_allclose(table.units_of(table.term(units, (0, 2))), units, atol=1e-9)


@pytest.mark.parametrize(
    ("family", "wheels", "rows"),
    [
        ("torque.place", (0, 1, 2), [0]),  # one map for all
        ("torque.time", (0, 2), [0, 2]),
        ("force.time", (), [0, 1]),
        ("supply.time", (), [0]),
    ],
)
def test_a_term_has_rows_of_its_own_wheels_or_of_all(
    family: str, wheels: tuple[int, ...], rows: list[int]
) -> None:
    known = FAMILIES[family]
    table = Table(known, (np.arange(2.0),) * len(known.axes), np.eye(2 ** len(known.axes)))
    term = LearntTerm(known, wheels, table.knots, np.zeros((len(rows), len(table.root))))
    assert list(table.rows_of(term)) == rows
    assert table.wheels(rows) == wheels
