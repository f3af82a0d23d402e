"""What a whole recording amounts to: shares of states, and the spells of each."""

from collections import Counter

from attrs import field, frozen

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import FAULTLESS
from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame


@frozen
class Spell:
    """One state from a stamp to another [ns]."""

    state: str
    start_ns: int
    end_ns: int
    evidence: tuple[str, ...] = ()


@frozen
class Summary:
    """Counts over a recording."""

    ticks: int
    shares: dict[str, float]  # of the ticks, by state
    stale_shares: tuple[float, ...]  # of the ticks, by residual
    spells: tuple[Spell, ...]

    @property
    def has_fault(self) -> bool:
        """Whether anything was named that is wrong."""
        return any(name not in FAULTLESS for name in self.shares)


@frozen
class Summariser:
    """Gathers frames and diagnoses as they come."""

    _counts: Counter[str] = field(factory=Counter)
    _stale: Counter[int] = field(factory=Counter)
    _spells: list[Spell] = field(factory=list)

    def frame(self, frame: ResidualFrame) -> None:
        """Count a tick; its diagnosis, if there is one, comes before it."""
        for index, residual in enumerate(frame.residuals):
            if residual.stale:
                self._stale[index] += 1
        if self._spells:
            last = self._spells[-1]
            self._counts[last.state] += 1
            self._spells[-1] = Spell(last.state, last.start_ns, frame.stamp_ns, last.evidence)

    def diagnosis(self, diagnosis: Diagnosis, evidence: list[str]) -> None:
        """Note a diagnosis; only a change starts a new spell."""
        if not self._spells or diagnosis.changed:
            self._spells.append(
                Spell(
                    diagnosis.state.name,
                    diagnosis.since_ns,
                    diagnosis.stamp_ns,
                    tuple(evidence),
                )
            )

    def summary(self) -> Summary:
        """All that was gathered."""
        ticks = sum(self._counts.values())
        return Summary(
            ticks,
            {name: count / ticks for name, count in self._counts.most_common()},
            tuple(self._stale[index] / max(ticks, 1) for index in range(RESIDUALS)),
            tuple(self._spells),
        )
