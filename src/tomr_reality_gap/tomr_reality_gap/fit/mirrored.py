"""What the same estimate makes of the user's simulation, in which nothing is concealed.

Whatever size a finding has there is the difference of two simulators, not of simulation and
reality: it is taken off, and a finding of which half or more is so is none.
"""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from tomr_power_model.robot import Robot
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.fit.leftover import Leftover
from tomr_reality_gap.fit.linear import Gram, Matrix, solve
from tomr_reality_gap.fit.noise import Noise, rows_of
from tomr_reality_gap.fit.probed import Probed, own_rows
from tomr_reality_gap.fit.refine import Tick, refine
from tomr_reality_gap.fit.search import Found
from tomr_reality_gap.fit.study import Model, Study, columns_at
from tomr_reality_gap.mismatch.probes import motion_of

Array = NDArray[np.float64]
Turns = tuple[tuple[float, ...], ...]  # of each hypothesis' knobs

_HALF = 0.5  # of a finding


@frozen
class Mirror:
    """Recordings of the user's simulation, weighed as the real ones are."""

    study: Study
    weight: Array  # (n,)
    described: Robot
    residual: Array = field(init=False)  # recorded - ours, as described, (n,)

    def __attrs_post_init__(self) -> None:
        value = self.study.predict([self.described])[0]
        object.__setattr__(self, "residual", self.study.value - value)

    @classmethod
    def of(
        cls, simulations: Sequence[RecordingSimulation], real: Study, noise: Noise, described: Robot
    ) -> "Mirror | None":
        """None without simulations; noise is that of the real recordings."""
        if not simulations:
            return None
        usual = {
            channel.name: float(np.median(noise.weight[part]))
            for channel, part in zip(real.channels, rows_of(real.channels), strict=True)
        }
        study = Study(tuple(simulations))
        weight = np.concatenate(
            [np.full(len(item.time), usual.get(item.name, 0.0)) for item in study.channels]
        )
        return cls(study, weight, described)

    def turns(self, model: Model) -> Turns:
        """Turns that a model's hypotheses have in the simulation, all else fitted with them."""
        columns = columns_at(self.study, model, ())
        mean = self._fitted(columns.matrix)
        own = mean[columns.instruments.stop :] * np.array([knob.spread for knob in model.own])
        found, at = [], 0
        for hypothesis in model.hypotheses:
            count = len(hypothesis.knobs)
            found.append(tuple(own[at : at + count].tolist()))
            at += count
        return tuple(found)

    def shows(self, leftover: Leftover, model: Model, nameless: Probed) -> bool:
        """Whether half of an effect without a name, or more, is in the simulation too."""
        robot, places = self.described, [family.variable for family in nameless.families]
        motions = [motion_of(item, robot, item.run(robot)) for item in self.study.simulations]
        family = nameless.families[places.index(leftover.family.variable)]
        torques = [family.torques(motion) * nameless.size for motion in motions]
        response = (self.study.respond(robot, torques) - self.study.predict([robot])[0]).T
        parts = []
        for wheel in leftover.wheels:
            rows = own_rows(self.study)[wheel]
            part = np.zeros_like(response)
            part[rows] = response[rows]
            parts.append(part)
        columns = columns_at(self.study, model, ())
        mean = self._fitted(np.concatenate([columns.matrix, *parts], axis=1))
        count = len(family.knots)
        theirs = evolve(
            leftover,
            turns=tuple(
                nameless.size * part
                for part in np.split(mean[columns.matrix.shape[1] :], len(parts))
            ),
        )
        assert all(len(turns) == count for turns in theirs.turns)
        both = [
            np.concatenate([item.torque(motion).ravel() for motion in motions])
            for item in (theirs, leftover)
        ]
        return float(both[0] @ both[1]) > _HALF * float(both[1] @ both[1])

    def _fitted(self, columns: Matrix) -> Array:
        gram = Gram.of(columns, self.residual, self.weight)
        return solve(gram, range(columns.shape[1])).mean


def beyond(
    study: Study, found: Found, mirror: Mirror | None, tick: Tick = lambda done: None
) -> tuple[Found, Turns]:
    """Findings that the simulation does not show as well, and what it shows of each of them."""
    nothing = tuple((0.0,) * len(turns) for turns in found.best.model.turns)
    if mirror is None or not found.best.model.hypotheses:
        return found, nothing
    while True:
        model = found.best.model
        theirs = mirror.turns(model)
        shares = [
            other[0] / turns[0] if turns[0] else 0.0
            for other, turns in zip(theirs, model.turns, strict=True)
        ]
        if not shares or max(shares) < _HALF:
            return found, theirs
        worst = int(np.argmax(shares))
        last = found.rounds[-1]
        states = [(model.without(worst), found.best.timing)]
        best = refine(study, states, last.columns, found.noise, tick)[0]
        groups = found.alternatives
        kept = groups if best.model.hypotheses else ()
        found = evolve(found, best=best, alternatives=(*kept[:worst], *kept[worst + 1 :]))
