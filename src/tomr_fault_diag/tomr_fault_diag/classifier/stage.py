"""The classifier stage: residual frames in, diagnoses out at 1 Hz and at once on a change."""

import math
from functools import lru_cache

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.states import NORMAL, STATES, UNKNOWN, State
from tomr_fault_diag.residuals.frame import INPUT_ORDERS, MOTORS, TOTAL, ResidualFrame

Array = NDArray[np.float64]


@frozen
class Diagnosis:
    """What the classifier says at one tick."""

    stamp_ns: int
    state: State
    since_ns: int
    probabilities: tuple[float, ...]  # of STATES, smoothed; empty where nothing is known
    frame: ResidualFrame
    changed: bool


class FaultClassifier:
    """Streaming core of the classifier; driven by stamps, the same online and offline.

    The network's probabilities pass a first-order filter; a fault is named when it leads for
    `confirm_time`, normal again when it leads for `recovery_time`: a fault that shows only while
    its wheel turns does not blink.
    """

    def __init__(self, network: Network, settings: ClassifierSettings | None = None) -> None:
        self.settings = settings or ClassifierSettings()
        order = list(INPUT_ORDERS[self.settings.input_order])
        # Few of the 3^10 inputs occur, and most of them again and again.
        self._answer = lru_cache(maxsize=4096)(
            lambda codes: network.probabilities(np.array(codes, dtype=np.float64)[order])
        )
        self.clear()

    def clear(self) -> None:
        """Start afresh."""
        self._stamp = 0
        self._smoothed: Array | None = None
        self._state: State | None = None
        self._since = 0
        self._candidate = UNKNOWN
        self._candidate_since = 0

    def classify(self, frame: ResidualFrame) -> Diagnosis | None:
        """Take a frame; returns a diagnosis when one is to be published.

        A frame that precedes the last one by more than a second starts afresh (a clock went
        back); one that merely repeats or precedes it is ignored.
        """
        if frame.stamp_ns <= self._stamp:
            if self._stamp - frame.stamp_ns < self.settings.report_period:
                return None
            self.clear()
        elapsed = frame.stamp_ns - self._stamp if self._stamp else 0
        self._stamp = frame.stamp_ns
        before = self._state
        self._decide(frame, elapsed)
        assert self._state is not None
        changed = self._state != before
        if not changed and not self._is_periodic(frame.stamp_ns, elapsed):
            return None
        shares = () if self._smoothed is None else tuple(float(p) for p in self._smoothed)
        return Diagnosis(frame.stamp_ns, self._state, self._since, shares, frame, changed)

    def _is_periodic(self, stamp: int, elapsed: int) -> bool:
        """Whether a multiple of the report period lies since the last frame: no timer needed."""
        period = self.settings.report_period
        return stamp // period != (stamp - elapsed) // period

    def _decide(self, frame: ResidualFrame, elapsed: int) -> None:
        if not _is_decidable(frame):
            self._smoothed = None
            self._enter(UNKNOWN, frame.stamp_ns)
            return
        now = self._answer(frame.codes)
        if self._smoothed is None or not elapsed:
            self._smoothed = now
        else:
            kept = math.exp(-elapsed / max(self.settings.filter_time, 1))
            self._smoothed = kept * self._smoothed + (1.0 - kept) * now
        leading = STATES[int(np.argmax(self._smoothed))]
        if leading != self._candidate:
            self._candidate, self._candidate_since = leading, frame.stamp_ns
        if self._state in (None, UNKNOWN) and leading is STATES[NORMAL]:
            self._enter(leading, frame.stamp_ns)
        elif leading != self._state and self._leads_long_enough(frame.stamp_ns):
            self._enter(leading, self._candidate_since)
        elif self._state is None:
            self._enter(UNKNOWN, frame.stamp_ns)

    def _leads_long_enough(self, stamp: int) -> bool:
        is_normal = self._candidate is STATES[NORMAL]
        wanted = self.settings.recovery_time if is_normal else self.settings.confirm_time
        return stamp - self._candidate_since >= wanted

    def _enter(self, state: State, since: int) -> None:
        if state != self._state:
            self._state, self._since = state, since


def _is_decidable(frame: ResidualFrame) -> bool:
    """Whether any motor's power, or the total, can be compared at all."""
    return any(not frame.residuals[index].stale for index in (TOTAL, *MOTORS))
