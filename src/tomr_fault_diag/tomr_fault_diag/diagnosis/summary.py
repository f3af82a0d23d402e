"""What a whole recording amounts to: shares of states, and the episodes of each."""

from collections import Counter
from collections.abc import Collection

from attrs import evolve, field, frozen

from tomr_fault_diag.classifier.severity import Severity
from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import (
    FAULTLESS,
    NOT_ENOUGH,
    NOT_OBSERVABLE,
    STALE,
    WAITING,
)
from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame
from tomr_power_model.model.ticks import to_ns

# States in which nothing was decided, not even that all is well.
UNDECIDED = frozenset({NOT_OBSERVABLE.name, STALE.name, WAITING.name, NOT_ENOUGH.name})
# Of these, the ones in which data was missing that should have been there.
LACKING = frozenset({STALE.name, NOT_ENOUGH.name})
_LEAST_NS = to_ns(1.0)  # every start at rest is called normal for a moment


@frozen
class Episode:
    """One state from its naming to the last tick at which it stood; episodes do not overlap."""

    state: str
    start_ns: int  # tick that named it
    end_ns: int
    since_ns: int  # when its evidence began, mostly before it was named
    wheel: int | None = None  # 1..3
    joint: str = ""  # of that wheel
    evidence: tuple[str, ...] = ()
    severity: Severity | None = None  # as last known

    @property
    def words(self) -> str:
        """The state, and which wheel's joint it concerns, as the status on /diagnostics says it."""
        return f"{self.state} ({self.joint})" if self.joint else self.state

    @property
    def is_fault(self) -> bool:
        return self.state not in FAULTLESS


@frozen
class Summary:
    """Counts over a recording."""

    ticks: int
    shares: dict[str, float]  # of the ticks, by state
    stale_shares: tuple[float, ...]  # of the ticks, by residual
    episodes: tuple[Episode, ...]
    missing: str = ""  # what was missing most often of what a residual needs
    conditions: tuple[Severity, ...] = ()  # what had changed slowly at the end

    @property
    def has_fault(self) -> bool:
        """Whether anything was named that is wrong."""
        return any(name not in FAULTLESS for name in self.shares)

    def is_decided(self, lacking: Collection[str] = LACKING) -> bool:
        """Whether enough was said of the robot: a fault, or for a second at least, and for longer
        than `lacking` states stood, that all is well."""
        stood: Counter[str] = Counter()
        for episode in self.episodes:
            stood[episode.state] += episode.end_ns - episode.start_ns
        decided = sum(time for name, time in stood.items() if name not in UNDECIDED)
        missed = sum(stood[name] for name in lacking)
        return self.has_fault or decided >= max(_LEAST_NS, missed)

    @property
    def faults(self) -> tuple[Episode, ...]:
        """The episodes in which something was wrong."""
        return tuple(episode for episode in self.episodes if episode.is_fault)


@frozen
class Summariser:
    """Gathers frames and diagnoses as they come."""

    joints: tuple[str, ...]  # of the wheels
    _counts: Counter[str] = field(factory=Counter)
    _stale: Counter[int] = field(factory=Counter)
    _missing: Counter[str] = field(factory=Counter)
    _episodes: list[Episode] = field(factory=list)
    _conditions: list[Severity] = field(factory=list)

    def frame(self, frame: ResidualFrame) -> None:
        """Count a tick; its diagnosis, if there is one, comes before it."""
        for index, residual in enumerate(frame.residuals):
            if residual.stale:
                self._stale[index] += 1
                self._missing[residual.missing] += 1
        if self._episodes:
            last = self._episodes[-1]
            self._counts[last.state] += 1
            self._episodes[-1] = evolve(last, end_ns=frame.stamp_ns)

    def diagnosis(self, diagnosis: Diagnosis, evidence: list[str]) -> None:
        """Note a diagnosis; only a change starts a new episode."""
        if not self._episodes or diagnosis.changed:
            wheel = diagnosis.wheel
            self._episodes.append(
                Episode(
                    diagnosis.state.name,
                    diagnosis.stamp_ns,
                    diagnosis.stamp_ns,
                    diagnosis.since_ns,
                    None if wheel is None else wheel + 1,
                    "" if wheel is None else self.joints[wheel],
                    tuple(evidence),
                )
            )
        self._conditions[:] = diagnosis.conditions
        if diagnosis.severity is not None:
            self._episodes[-1] = evolve(self._episodes[-1], severity=diagnosis.severity)

    def summary(self) -> Summary:
        """All that was gathered."""
        ticks = sum(self._counts.values())
        missing = [reason for reason, _ in self._missing.most_common() if reason]
        return Summary(
            ticks,
            {name: count / ticks for name, count in self._counts.most_common()},
            tuple(self._stale[index] / max(ticks, 1) for index in range(RESIDUALS)),
            tuple(self._episodes),
            missing[0] if missing else "",
            tuple(self._conditions),
        )
