"""Terms without a name as columns: what each value of their table does to every channel."""

from collections.abc import Iterator, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.effects.scales import Scales
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Actions, Family, LearntTerm, Motion
from tomr_power_model.unmodelled.term import smoothness, value_at
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.basis_responses import own_rows
from tomr_reality_gap.fit.dataset import Dataset

Array = NDArray[np.float64]
Columns = NDArray[np.float32]  # memory counts: a map has hundreds

_MOST_KNOTS = {1: 90, 2: 24}  # by the number of variables
_LENGTH = 1.5  # knots over which a table is smooth
_ROUGH = 1e-3  # of the variance of its smoothest shape: shapes with less are left out
_AT_ONCE = 32  # torques that are kept in memory at a time
_LEAST_FLOOR = 0.2  # m: who goes no farther sees no floor
_PASSES = 2  # to the motion that a coupled term leaves: a drag slows the wheels it depends on
_SMALL = 1e-9
_ALL = -1  # wheels at once


def with_terms(
    simulation: RecordingSimulation, robot: Robot, terms: Sequence[LearntTerm]
) -> RecordingSimulation:
    """The recording, simulated with learnt terms besides; `robot` determines the motion."""
    for term in terms:
        motion = motion_in(simulation, robot)
        for _ in range(_PASSES if term.family.is_coupled else 0):
            motion = motion_in(_with(simulation, term.actions(motion)), robot)
        simulation = _with(simulation, term.actions(motion))
    return simulation


def _with(simulation: RecordingSimulation, actions: Actions) -> RecordingSimulation:
    before = 0.0 if simulation.resisting is None else simulation.resisting
    drawn = 0.0 if simulation.drawn is None else simulation.drawn
    return evolve(
        simulation,
        resisting=before + actions.torque,
        drawn=drawn + power_rows(simulation, actions),
    )


def power_rows(simulation: RecordingSimulation, actions: Actions) -> Array:
    """What power drawn besides adds to each value of a recording, (rows,)."""
    line, found = simulation.timeline, []
    for channel in simulation.channels:
        index = ((channel.time - 0.5 * channel.span - line.start) / line.period).astype(np.intp)
        index = np.clip(index, 0, line.count - 1)
        drawn = np.zeros(len(index))
        if channel.kind == "power":
            drawn = actions.driver[index, channel.wheel or 0]
        elif channel.kind == "total":
            drawn = actions.driver[index].sum(axis=1) + actions.supply[index]
        found.append(drawn)
    return np.concatenate(found)


@frozen
class Table:
    """A family over the motions of some recordings, and how large its values may be."""

    family: type[Family]
    knots: tuple[Array, ...]
    root: Array  # values = root @ units of N(0, 1), smooth ones, (k, r)

    @classmethod
    def over(
        cls, family: type[Family], motions: Sequence[Motion], scales: Scales
    ) -> "Table | None":
        """None where the motions hardly vary in it."""
        parts = [family.coordinates(motion) for motion in motions]
        knots = []
        for number, axis in enumerate(family.axes):
            values = np.concatenate([part[..., number].ravel() for part in parts])
            count, low, high = axis.knots, 0.0, 2.0 * np.pi
            if not axis.is_periodic:
                low, high = float(values.min()), float(values.max())
            if axis.spacing:
                count = min(int(np.ptp(values) / axis.spacing) + 2, _MOST_KNOTS[len(family.axes)])
            if high - low < (_LEAST_FLOOR if axis.unit == "m" else _SMALL):
                return None
            knots.append(np.linspace(low, high, count, endpoint=not axis.is_periodic))
        size = {
            "torque": scales.torque,
            "force": 3.0 * scales.torque / scales.radius,
            "driver": scales.power,
            "supply": 3.0 * scales.power,
        }[family.acts]
        found = tuple(knots)
        variance, modes = np.linalg.eigh(smoothness(family, found, _LENGTH))
        kept = variance > _ROUGH * variance[-1]
        root = size * modes[:, kept] * np.sqrt(variance[kept])
        return cls(family, found, np.asarray(root, dtype=np.float64))

    @property
    def rows(self) -> int:
        """Rows of values: of the wheels, one for all, components of a force, or one."""
        return LearntTerm.rows(self.family, WHEELS)

    def wheels(self, rows: Sequence[int]) -> tuple[int, ...]:
        """Where a term of some rows acts; none: body or supply."""
        if self.family.acts not in ("torque", "driver"):
            return ()
        return tuple(range(WHEELS)) if self.family.is_shared else tuple(rows)

    def rows_of(self, term: LearntTerm) -> list[int]:
        """The rows that a term has."""
        return list(range(self.rows) if self.family.is_shared or not term.wheels else term.wheels)

    def term(self, units: Sequence[Array], wheels: tuple[int, ...]) -> LearntTerm:
        """The term of some units, of each row."""
        values = np.stack([self.root @ part for part in units])
        return LearntTerm(self.family, wheels, self.knots, values)

    def columns(
        self,
        dataset: Dataset,
        robot: Robot,
        motions: Sequence[Motion],
        *,
        is_exact: bool = True,
    ) -> list[Columns]:
        """What the units of each row do to every value, (n, r) each.

        Unless exact, torques of each wheel are simulated at all wheels at once, and what one
        wheel's do to the others is left out.
        """
        if self.family.acts in ("driver", "supply"):
            return [self._drawn(dataset, motions, row) for row in range(self.rows)]
        if self.family.is_shared:
            return [self._responses(dataset, robot, motions, _ALL)]
        if self.family.acts == "force" or is_exact:
            return [self._responses(dataset, robot, motions, row) for row in range(self.rows)]
        together = self._responses(dataset, robot, motions, _ALL)
        found = []
        for rows in own_rows(dataset):
            part = np.zeros_like(together)
            part[rows] = together[rows]
            found.append(part)
        return found

    def units_of(self, term: LearntTerm) -> Array:
        """Units of each row of a term that was made of them, (rows, r)."""
        return np.asarray(term.values @ np.linalg.pinv(self.root).T)

    def _drawn(self, dataset: Dataset, motions: Sequence[Motion], place: int) -> Columns:
        found = []
        for simulation, motion in zip(dataset.simulations, motions, strict=True):
            none, rows = np.zeros_like(motion.speed), []
            for column in self._shapes(motion, place, self.root).T:
                driver, supply = none.copy(), np.zeros(len(none))
                if self.family.acts == "driver":
                    driver[:, place] = column
                else:
                    supply = column
                rows.append(power_rows(simulation, Actions(none, driver, supply)))
            found.append(np.stack(rows, axis=1).astype(np.float32))
        return np.concatenate(found)

    def _responses(
        self, dataset: Dataset, robot: Robot, motions: Sequence[Motion], row: int
    ) -> Columns:
        """Simulated: of a component of a force, of a wheel, or (`_ALL`) of all wheels at once."""
        torques = [self._torques(motion, row) for motion in motions]
        return np.ascontiguousarray(dataset.changes(robot, torques).T)

    def _torques(self, motion: Motion, row: int) -> Iterator[Array]:
        """Those of each unit in each driver period, some units at a time, (any, count, 3)."""
        for first in range(0, self.root.shape[1], _AT_ONCE):
            part = self.root[:, first : first + _AT_ONCE]
            if self.family.acts == "force":
                forces = self._shapes(motion, 0, part).T
                pairs = [(x, 0.0 * x) if row == 0 else (0.0 * x, x) for x in forces]
                yield np.stack([motion.resisting(*pair) for pair in pairs])
                continue
            found = np.zeros((part.shape[1], *motion.speed.shape))
            for wheel in range(WHEELS) if row == _ALL else (row,):
                found[..., wheel] = self._shapes(motion, wheel, part).T
            yield found

    def _shapes(self, motion: Motion, place: int, root: Array) -> Array:
        """What some units do there in each driver period, (count, any)."""
        coordinates, factor = self.family.coordinates(motion), self.family.factor(motion)
        at = coordinates[:, min(place, coordinates.shape[1] - 1)]
        values = value_at(self.family, self.knots, root, at)
        return np.asarray(values * factor[:, [min(place, factor.shape[1] - 1)]])
