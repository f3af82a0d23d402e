"""Terms without a name as columns: what each value of their table does to every channel."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.effects.scales import Scales
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Actions, Family, LearntTerm, Motion
from tomr_power_model.unmodelled.term import basis_at, smoothness
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.basis_responses import own_rows
from tomr_reality_gap.fit.dataset import Dataset

Array = NDArray[np.float64]

_EDGE = 0.005  # quantile of a variable at which its table begins
_MOST_KNOTS = 90
_LENGTH = 1.5  # knots over which a table is smooth
_LEAST_FLOOR = 0.2  # m: who goes no farther sees no floor
_SMALL = 1e-9


def with_terms(
    simulation: RecordingSimulation, robot: Robot, terms: Sequence[LearntTerm]
) -> RecordingSimulation:
    """The recording, simulated with learnt terms besides; `robot` tells the motion."""
    for term in terms:
        found = term.actions(motion_in(simulation, robot))
        before = 0.0 if simulation.resisting is None else simulation.resisting
        drawn = 0.0 if simulation.drawn is None else simulation.drawn
        simulation = evolve(
            simulation,
            resisting=before + found.torque,
            drawn=drawn + power_rows(simulation, found),
        )
    return simulation


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
    root: Array  # values = root @ units of N(0, 1), (k, k)

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
                low, high = np.quantile(values, [_EDGE, 1.0 - _EDGE]).tolist()
            if axis.spacing:
                count = min(int(np.ptp(values) / axis.spacing) + 2, _MOST_KNOTS)
                low, high = float(values.min()), float(values.max())
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
        root = np.linalg.cholesky(smoothness(family, found, _LENGTH))
        return cls(family, found, np.asarray(size * root, dtype=np.float64))

    @property
    def places(self) -> int:
        """Wheels, components of a force, or one."""
        return {"torque": WHEELS, "driver": WHEELS, "force": 2, "supply": 1}[self.family.acts]

    def term(self, units: Sequence[Array], wheels: tuple[int, ...]) -> LearntTerm:
        """The term of some units, of each wheel or component."""
        values = np.stack([self.root @ part for part in units])
        return LearntTerm(self.family, wheels, self.knots, values)

    def columns(
        self,
        dataset: Dataset,
        robot: Robot,
        motions: Sequence[Motion],
        *,
        is_exact: bool = True,
    ) -> list[Array]:
        """What the units of each place do to every value, (n, k) each.

        Unless exact, torques are simulated at all wheels at once, and what one wheel's do to the
        others is left out.
        """
        if self.family.acts in ("driver", "supply"):
            return [self._drawn(dataset, motions, place) for place in range(self.places)]
        if self.family.acts == "force":
            return [self._responses(dataset, robot, motions, place) for place in range(2)]
        if is_exact:
            return [self._responses(dataset, robot, motions, place) for place in range(WHEELS)]
        together = self._responses(dataset, robot, motions, -1)
        found = []
        for rows in own_rows(dataset):
            part = np.zeros_like(together)
            part[rows] = together[rows]
            found.append(part)
        return found

    def _drawn(self, dataset: Dataset, motions: Sequence[Motion], place: int) -> Array:
        found = []
        for simulation, motion in zip(dataset.simulations, motions, strict=True):
            basis = self._basis(motion, place) @ self.root
            none = np.zeros_like(motion.speed)
            columns = []
            for column in basis.T:
                driver, supply = none.copy(), np.zeros(len(none))
                if self.family.acts == "driver":
                    driver[:, place] = column
                else:
                    supply = column
                columns.append(power_rows(simulation, Actions(none, driver, supply)))
            found.append(np.stack(columns, axis=1))
        return np.concatenate(found)

    def _responses(
        self, dataset: Dataset, robot: Robot, motions: Sequence[Motion], place: int
    ) -> Array:
        """Simulated: of a component of a force, of a wheel, or (-1) of all wheels at once."""
        torques = []
        for motion in motions:
            nothing = np.zeros(len(motion.time))
            if self.family.acts == "force":
                basis = (self._basis(motion, 0) @ self.root).T
                pairs = [(row, nothing) if place == 0 else (nothing, row) for row in basis]
                torques.append(np.stack([motion.resisting(*pair) for pair in pairs]))
                continue
            wheels = np.zeros((len(self.root), *motion.speed.shape))
            for wheel in range(WHEELS) if place < 0 else (place,):
                wheels[..., wheel] = (self._basis(motion, wheel) @ self.root).T
            torques.append(wheels)
        response = dataset.respond(robot, torques) - dataset.predict([robot])[0]
        return np.asarray(response.T)

    def _basis(self, motion: Motion, place: int) -> Array:
        coordinates, factor = self.family.coordinates(motion), self.family.factor(motion)
        at = coordinates[:, min(place, coordinates.shape[1] - 1)]
        column = factor[:, min(place, factor.shape[1] - 1)]
        return np.asarray(basis_at(self.family, self.knots, at) * column[:, None])
