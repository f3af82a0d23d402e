"""A description and what has been changed in it so far."""

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.estimation.parameter import Parameter, ParameterisedRobot, bounds
from tomr_reality_gap.hypotheses.hypothesis import Hypothesis

Array = NDArray[np.float64]

_FRICTION = ("friction.coulomb", "friction.viscous")


@frozen
class Model:
    """A description and what has been changed in it so far."""

    base: ParameterisedRobot
    nuisances: tuple[Parameter, ...]
    nuisance_offsets: tuple[float, ...]
    hypotheses: tuple[Hypothesis, ...] = ()
    offsets: tuple[tuple[float, ...], ...] = ()  # of each hypothesis' parameters

    @property
    def described(self) -> ParameterisedRobot:
        """The description with all offsets."""
        start: dict[str, float] = {}
        for hypothesis in self.hypotheses:
            start.update(hypothesis.start)
        changed = self.base.given(start).offset(self.nuisances, self.nuisance_offsets)
        for hypothesis, offsets in zip(self.hypotheses, self.offsets, strict=True):
            changed = changed.offset(hypothesis.parameters, offsets)
        return changed

    @property
    def own(self) -> tuple[Parameter, ...]:
        """Parameters of the hypotheses, in order."""
        return tuple(item for hypothesis in self.hypotheses for item in hypothesis.parameters)

    @property
    def own_offsets(self) -> tuple[float, ...]:
        return tuple(offset for offsets in self.offsets for offset in offsets)

    @property
    def names(self) -> frozenset[str]:
        """Names of the hypotheses."""
        return frozenset(hypothesis.name for hypothesis in self.hypotheses)

    @property
    def findings(self) -> int:
        """How many hypotheses; Coulomb and viscous friction of one place are one finding."""
        parts = [item.where for item in self.hypotheses if item.effect in _FRICTION]
        return len(self.hypotheses) - len(parts) + len(set(parts))

    @property
    def weight(self) -> int:
        """Effects whose evidence it must bring."""
        return sum(max(1, len(hypothesis.stands_for)) for hypothesis in self.hypotheses)

    def joined(self, hypothesis: Hypothesis) -> "Model":
        """With one more hypothesis, at no offset yet."""
        return evolve(
            self,
            hypotheses=(*self.hypotheses, hypothesis),
            offsets=(*self.offsets, (0.0,) * len(hypothesis.parameters)),
        )

    def without(self, number: int) -> "Model":
        """With one hypothesis less."""
        return self.kept([index != number for index in range(len(self.hypotheses))])

    def kept(self, wanted: Sequence[bool]) -> "Model":
        """With some of its hypotheses."""
        keep = [index for index, is_wanted in enumerate(wanted) if is_wanted]
        return evolve(
            self,
            hypotheses=tuple(self.hypotheses[index] for index in keep),
            offsets=tuple(self.offsets[index] for index in keep),
        )

    def swapped(self, number: int, hypothesis: Hypothesis, offsets: tuple[float, ...]) -> "Model":
        """With another hypothesis in the place of one."""
        hypotheses, all_offsets = list(self.hypotheses), list(self.offsets)
        hypotheses[number], all_offsets[number] = hypothesis, offsets
        return evolve(self, hypotheses=tuple(hypotheses), offsets=tuple(all_offsets))

    def exchanged(
        self,
        names: Collection[str],
        given: Iterable[Hypothesis],
        sizes: Mapping[str, tuple[float, ...]],
    ) -> "Model":
        """With some hypotheses in the place of those of some names.

        Their offsets are those that they have here, or else of `sizes`, or nothing.
        """
        own = {**sizes, **dict(zip((h.name for h in self.hypotheses), self.offsets, strict=True))}
        model = self.kept([item.name not in names for item in self.hypotheses])
        for item in given:
            offsets = own.get(item.name, (0.0,) * len(item.parameters))
            model = model.joined(item)
            model = model.swapped(len(model.hypotheses) - 1, item, offsets)
        return model

    def moved(self, nuisance: Array, own: Array) -> "Model":
        """With all parameters at new offsets, within their bounds."""
        nuisance = np.clip(nuisance, *bounds(self.nuisances))
        own, offsets, at = np.clip(own, *bounds(self.own)), [], 0
        for hypothesis in self.hypotheses:
            part = own[at : (at := at + len(hypothesis.parameters))]
            offsets.append(tuple(part.tolist()))
        return evolve(self, nuisance_offsets=tuple(nuisance.tolist()), offsets=tuple(offsets))
