"""What the diagnosis said tick by tick, and what it said it from."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from attrs import define, field, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Level

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


class Said(NamedTuple):
    """What stands at a tick: a state and the wheel 1..3 that it concerns, 0 where it is none."""

    state: str
    wheel: int


class Health(NamedTuple):
    """How an input does from a stamp [ns] on."""

    stamp_ns: int
    level: Level
    words: str


@frozen
class Track:
    """A recording in n ticks."""

    stamp_ns: Stamps  # (n,)
    said: tuple[Said, ...]  # n of them
    probability: Array  # of the state that stands, as last published, (n,); NaN: none
    residual: Array  # measured - modelled, (n, 10)
    band: Array  # (n, 10)
    modelled: Array  # (n, 10)
    inputs: Mapping[str, tuple[Health, ...]] = field(factory=dict)  # each change, by topic


@define
class Tracker:
    """Gathers a track; without `detail` only what was said."""

    detail: bool
    _said: Said | None = None
    _probability: float = float("nan")
    _stamps: list[int] = field(factory=list)
    _states: list[Said] = field(factory=list)
    _probabilities: list[float] = field(factory=list)
    _rows: list[list[tuple[float, float, float]]] = field(factory=list)
    _inputs: dict[str, list[Health]] = field(factory=dict)

    def diagnosis(self, diagnosis: Diagnosis, probability: float) -> None:
        """Note a diagnosis and the probability of its state; its frame comes after it."""
        wheel = 0 if diagnosis.wheel is None else diagnosis.wheel + 1
        self._said = Said(diagnosis.state.name, wheel)
        self._probability = probability

    def frame(self, frame: ResidualFrame) -> None:
        """Note a tick."""
        if self._said is None:
            return
        self._stamps.append(frame.stamp_ns)
        self._states.append(self._said)
        if self.detail:
            self._probabilities.append(self._probability)
            self._rows.append([(r.residual, r.band, r.modelled) for r in frame.residuals])

    def report(self, message: DiagnosticMessage) -> None:
        """Note how inputs do; only a change of the level counts."""
        for status in message.statuses if self.detail else ():
            changes = self._inputs.setdefault(status.name.removeprefix("inputs: "), [])
            if not changes or changes[-1].level != status.level:
                changes.append(Health(message.stamp_ns, status.level, status.message))

    def track(self) -> Track:
        """All that was gathered."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, RESIDUALS, 3)
        return Track(
            np.array(self._stamps, dtype=np.int64),
            tuple(self._states),
            np.array(self._probabilities, dtype=np.float64),
            rows[..., 0],
            rows[..., 1],
            rows[..., 2],
            {topic: tuple(changes) for topic, changes in self._inputs.items()},
        )
