"""What no named effect explains: what it acts on, what it depends on, and its table or law.

`families` says what each family of terms predicts. What changes with time alone predicts no other
drive: it is called not repeatable.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.effects.scales import Scales
from tomr_power_model.estimation.linear_gaussian import Gram, Matrix, product, solve
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Family, LearntTerm, Motion
from tomr_reality_gap.alignment.channels import DRAWN_KINDS
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.explanation import FittedLaw, Shape
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.families import Tried, families_tried, predicting
from tomr_reality_gap.fit.law_forms import TINY
from tomr_reality_gap.fit.laws import AS_WELL, Evidence, LawAt, laws_of
from tomr_reality_gap.fit.learnt import Table, with_terms
from tomr_reality_gap.fit.polish import best_law, changes_of
from tomr_reality_gap.fit.remainder import Remainder, inflations, whitened
from tomr_reality_gap.fit.supplied import is_supplied

Array = NDArray[np.float64]

_CLEARLY = 0.005  # of the squares that are left, that another term must explain
_MORE = 0.01  # the same, of what is explained where that is little
_WHEEL_SHARE = 0.1  # of the wheel that shows most
_MAYBE = 0.75  # of what a table explains: a law that may explain as much at its best
_NAMED = 0.3  # share of what is left that a term must predict
_LITTLE = 0.1  # the same where something is there for sure: with less it would say nothing
_SMALL = 0.02  # of a channel's standard deviation: less is not worth a word
_LAW = 0.8  # of the squares that are left: a law that explains so much is no chance
_AS_MUCH = 0.95  # of what a wider family predicts
_ALIKE = 0.02  # shares that say no more for one family than for another
_HINT = 0.1  # share that shows at a glance of what will predict `_NAMED`: no closer look gave less
_EVENT = 0.6  # of what a term of time explains: as much of it, and it is repeatable


@frozen
class Unmodelled:
    """A term that explains what is left."""

    table: Table
    learnt: LearntTerm  # the table
    laws_at: tuple[LawAt, ...]  # that explain about as much, the first at its best
    share: float  # see `predicted_share`
    is_repeatable: bool
    evidence: float  # log, correlation of what is left accounted for
    is_large: bool  # in some channel, against what it shows in all
    change: Array  # what it adds to every value, (n,)
    explained: float  # of the squares that are left without it, those of noise included
    sigma: Array  # of the term's values, like them

    @property
    def family(self) -> type[Family]:
        """Of the term."""
        return self.table.family

    @property
    def law(self) -> LawAt | None:
        """The first."""
        return self.laws_at[0] if self.laws_at else None

    @property
    def laws(self) -> tuple[FittedLaw, ...]:
        """As a report has them."""
        return tuple(law.fitted for law in self.laws_at)

    @property
    def term(self) -> LearntTerm:
        """What is simulated: the first law, or else the table."""
        return self.learnt if self.law is None else self.law.term


def unmodelled_effect(
    rest: Remainder,
    robot: Robot,
    scales: Scales,
    *,
    is_sure: bool = False,
    is_repeatable: bool = False,
) -> Unmodelled | None:
    """The term that predicts most of what is left, if any predicts enough of it.

    `is_sure`: something is there, a term that predicts little is taken as well; `is_repeatable`:
    what another drive would not repeat is not asked for.
    """
    motions = [motion_in(item, robot) for item in rest.dataset.simulations]
    least = -1.0 if is_sure else _HINT
    tried = families_tried(rest, robot, scales, motions, least=least, is_repeatable=is_repeatable)
    if not tried:
        return None
    event = next((item for item in tried if item.table.family.is_event), None)
    # A map of ground that is never met again follows what only changes with time.
    lasting = _narrowest(
        [
            item
            for item in tried
            if not item.table.family.is_event
            and not (event and item.table.family.is_shared and item.moments <= event.share)
        ]
    )
    events = _by_moments(tried, event)
    best = lasting or events
    if lasting and events and lasting.share < max(_EVENT * events.share, _NAMED):
        best = events
    if best is None or best.share < (_LITTLE if is_sure else _NAMED):
        return None
    if best is not events:
        alike = [item for item in tried if not item.table.family.is_event and item is not best]
        alike = [item for item in alike if item.share > best.share - _ALIKE]
        found = _most(rest, [best, *alike], robot, motions)
        return _timed(rest, _lawful(rest, found, tried, robot, motions), event, robot, motions)
    found = fitted(rest, best, robot, motions)
    if found.family.acts == "driver":
        drawn = best.table.columns(rest.dataset, robot, motions)
        if not is_supplied(rest, [whitened(best.size * part, rest.weight) for part in drawn]):
            return None  # sensors show what nobody draws
    return _lawful(rest, found, tried, robot, motions)


def _lawful(
    rest: Remainder,
    found: Unmodelled,
    tried: Sequence[Tried],
    robot: Robot,
    motions: Sequence[Motion],
) -> Unmodelled:
    """The term, or another one with a law that explains more.

    A law knows what lies beyond a stretch, a table does not; few stretches of one drive may meet
    again. In the place of an event it has to explain nearly all, in that of a table about as much.
    """
    comes_and_goes, lawful = found.family.is_event, []
    for item in tried:
        family = item.table.family
        is_news = comes_and_goes and family.is_strange
        if family.is_event or family is found.family or not (is_news or item.share > _NAMED):
            continue
        other = fitted(rest, evolve(item, share=item.best), robot, motions)
        # A map follows much, and what names depend on as well is no news: these must explain more.
        least = 0.0 if is_news and not family.is_shared else found.explained
        if comes_and_goes:
            least = max(least, _LAW)
        elif not found.laws:
            least -= _CLEARLY  # a table has many values to do with
        if other.laws and other.explained > least:
            lawful.append(other)
    return max(lawful, key=lambda item: item.explained, default=found)


def _timed(
    rest: Remainder,
    found: Unmodelled,
    event: Tried | None,
    robot: Robot,
    motions: Sequence[Motion],
) -> Unmodelled:
    """The term, or one over time whose law explains more: friction that dies out as it runs in.

    A drive passes most headings and places but a few times, at times of their own.
    """
    if event is None or event.share < found.share:
        return found
    other = fitted(rest, event, robot, motions)
    return other if other.laws and other.explained > found.explained else found


def _most(
    rest: Remainder, tried: Sequence[Tried], robot: Robot, motions: Sequence[Motion]
) -> Unmodelled:
    """The first, or another that acts elsewhere, predicts as much, and explains clearly more.

    Of two with laws the one whose law fits better.
    """
    found = fitted(rest, tried[0], robot, motions)
    for item in tried[1:]:
        if item.table.family.acts != found.family.acts:
            other = fitted(rest, item, robot, motions)
            least = 0.0 if other.laws and found.laws else min(_CLEARLY, _MORE * found.explained)
            if other.explained > found.explained + least:
                found = other
    return found


def _by_moments(tried: Sequence[Tried], event: Tried | None) -> Tried | None:
    """The best event, or a map that explains more moments: a drive shows most places but once."""
    mapped = max(tried, key=lambda item: item.moments)
    if mapped.moments <= max(event.share if event else 0.0, _NAMED):
        return event
    return evolve(mapped, share=mapped.moments)


def _narrowest(tried: Sequence[Tried]) -> Tried | None:
    """The best, or the family within it that predicts as much."""
    best = tried[0] if tried else None
    for item in tried:
        if best is not None and item.table.family.family_id == best.table.family.holds:
            return item if item.share > _AS_MUCH * best.share else best
    return best


def refitted(rest: Remainder, effect: Unmodelled, robot: Robot) -> Unmodelled:
    """The same term, fitted anew to what another model leaves, a coupled one in its own motion."""
    terms = (effect.term,) if effect.family.is_coupled else ()
    simulations = [with_terms(item, robot, terms) for item in rest.dataset.simulations]
    motions = [motion_in(item, robot) for item in simulations]
    found = predicting(rest, effect.table, robot, motions)
    return fitted(rest, evolve(found, share=found.best), robot, motions, effect.law)


def fitted(
    rest: Remainder,
    best: Tried,
    robot: Robot,
    motions: Sequence[Motion],
    known: LawAt | None = None,
) -> Unmodelled:
    """A family's table at the wheels that show it, or at all where its law holds for them too.

    `known`: a law that was found before.
    """
    columns: list[Matrix] = [
        whitened(part, rest.weight) for part in best.table.columns(rest.dataset, robot, motions)
    ]
    every = list(range(len(columns)))
    rows = _rows_shown(rest, best, columns)
    shown = [columns[row] for row in rows]
    found = _fitted_at(rest, best, robot, motions, shown, rows, known)
    if not found.laws or len(rows) == len(every):
        return found
    # A wheel that turned slower than the others shows little of what grows with its speed.
    term = found.term
    wide = evolve(
        term, wheels=best.table.wheels(every), values=np.tile(term.values[:1], (WHEELS, 1))
    )
    change = changes_of(rest.dataset, robot, motions, [wide])[0]
    if rest.explained(change) <= found.explained:
        return found
    return _fitted_at(rest, best, robot, motions, columns, every, known or found.law)


def _rows_shown(rest: Remainder, best: Tried, columns: Sequence[Matrix]) -> list[int]:
    """Rows of a table at the wheels that show it; all where it acts elsewhere."""
    rows = list(range(len(columns)))
    if not best.table.wheels(rows) or best.table.family.is_shared:
        return rows
    units, _, _ = _solved(rest, columns, best.size)
    energy = [float((product(c, u) ** 2).sum()) for c, u in zip(columns, units, strict=True)]
    return [row for row in rows if energy[row] > _WHEEL_SHARE * max(energy)]


def _fitted_at(
    rest: Remainder,
    best: Tried,
    robot: Robot,
    motions: Sequence[Motion],
    columns: Sequence[Matrix],
    rows: Sequence[int],
    known: LawAt | None,
) -> Unmodelled:
    """Of some rows, whose whitened columns are given."""
    table, count = best.table, best.table.root.shape[1]
    units, covariance, change = _solved(rest, columns, best.size)
    left = rest.residual - change
    sigma = [
        np.sqrt(np.einsum("ij,jk,ik->i", table.root, covariance[part, part], table.root))
        for part in (slice(n * count, (n + 1) * count) for n in range(len(units)))
    ]
    own = sum(product(part, row) for part, row in zip(columns, units, strict=True))
    term, change = table.term(units, table.wheels(rows)), own / rest.weight
    equations = _normal_equations(rest, columns, left)
    near = laws_of(table, term, equations, _MAYBE)
    laws = [law for law in near if law.share > AS_WELL]
    # What a strong drag does no table adds up to: a law that was found before may fit better.
    tried = [*([evolve(known, table=table, learnt=term)] if known else []), *(laws or near)]
    if tried:
        table_share = rest.explained(change)
        first, shown, law_share = best_law(
            rest,
            tried,
            robot,
            motions,
            inflation=equations.inflation,
            enough=table_share - _CLEARLY,
        )
        if laws or law_share > AS_WELL * table_share:
            first = evolve(first, share=law_share / max(table_share, TINY))
            others = [law for law in laws if law.law.name != first.law.name]
            laws, change = [first, *others], shown
    return Unmodelled(
        table,
        term,
        tuple(laws),
        best.share,
        not table.family.is_event or (bool(laws) and len(motions) > 1),
        _evidence(rest.dataset, rest.alone, rest.left(change)),
        _is_large(rest.dataset, change),
        change,
        rest.explained(change),
        np.stack(sigma),
    )


def _normal_equations(rest: Remainder, columns: Sequence[Matrix], left: Array) -> Evidence:
    """Of columns, what is not exactly known otherwise eliminated."""
    gram, q = Gram.of(rest.beside(columns), rest.residual), rest.base.shape[1]
    inner, cross = gram.matrix[:q, :q] + np.eye(q), gram.matrix[:q, q:]
    known = np.linalg.solve(inner, np.column_stack([cross, gram.vector[:q]]))
    return Evidence(
        gram.matrix[q:, q:] - cross.T @ known[:, :-1],
        gram.vector[q:] - cross.T @ known[:, -1],
        max(float(np.mean([factor for _, factor in inflations(rest.dataset, left)])), 1.0),
    )


def _evidence(dataset: Dataset, before: Array, after: Array) -> float:
    """Log likelihood gained, each sample counted by what of it is not known from the last ones."""
    return sum(
        0.5 * float(before[part] @ before[part] - after[part] @ after[part]) / factor
        for part, factor in inflations(dataset, after)
    )


def _is_large(dataset: Dataset, change: Array) -> bool:
    return any(
        float(np.std(change[part])) > _SMALL * float(np.std(channel.value))
        for channel, part in zip(dataset.channels, rows_of(dataset.channels), strict=True)
        if channel.kind in DRAWN_KINDS
    )


def _solved(
    rest: Remainder, columns: Sequence[Matrix], size: float
) -> tuple[list[Array], Array, Array]:
    """Units of each block of whitened columns, their covariance, and all that is explained.

    `size`: standard deviation of the units' prior.
    """
    joined, q = rest.beside(columns), rest.base.shape[1]
    scale = np.where(np.arange(joined.shape[1]) < q, 1.0, size)
    found = solve(Gram.of(joined, rest.residual).scaled(scale), range(joined.shape[1]))
    mean, covariance = scale * found.mean, found.covariance * np.outer(scale, scale)
    units = np.split(mean[q:], len(columns))
    return units, covariance[q:, q:], product(joined, mean)


def shape_of(effect: Unmodelled, robot: Robot) -> Shape:
    """Its curve with an interval; of a table of two variables what it is along the first."""
    family, term = effect.family, effect.learnt
    count = len(term.knots[0])
    values, sigma = (item[0].reshape(count, -1) for item in (term.values, effect.sigma))
    across = int(np.argmin(sigma.sum(axis=0)))
    value, half = values[:, across], 1.96 * sigma[:, across]
    title = " and ".join(axis.title for axis in family.axes)
    where = robot.wheel_names[term.wheels[0]] if term.wheels else wheels_of(term, robot)[0]
    return Shape(title, where, term.knots[0], value, value - half, value + half, term.unit)


def wheels_of(term: LearntTerm, robot: Robot) -> tuple[str, ...]:
    """Where a term acts, as a report names it."""
    if term.family.acts in ("force", "supply"):
        return ("body",) if term.family.acts == "force" else ("supply",)
    return names(term.wheels, robot)


def names(wheels: Sequence[int], robot: Robot) -> tuple[str, ...]:
    """Wheels as a report names them."""
    return ("all_wheels",) if len(wheels) == WHEELS else tuple(robot.wheel_names[w] for w in wheels)
