"""The classifiers to choose from, by name: the parameter `classifier`.

A judge looks at one frame after the other and says how likely each state is, and whether it is sure
enough of the likeliest for that to be named.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Protocol

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import CONTROLS, ENCODERS, Belief, six_of
from tomr_fault_diag.classifier.features import CHANNELS, WINDOW, channels_of
from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.states import CONTROL, NORMAL, STATES
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import INPUT_ORDERS, ResidualFrame
from tomr_power_model.model.ticks import to_ns

Array = NDArray[np.float64]

_SURE = 0.99
_STRIKING_TICKS = 10  # in which one window must have been so
_TICK = to_ns(0.05)
_TOO_LONG = to_ns(0.5)  # between two frames that belong to one window
_OF_A_WHEEL = (CONTROLS.start, ENCODERS.start)  # faults of wheel 0; the others' follow


@frozen
class Opinion:
    """Probabilities of STATES (6,), whether to name the likeliest, and its wheel if it has one."""

    probabilities: Array
    sure: bool
    wheel: int | None = None


class Judge(Protocol):
    """One way to tell states from residuals."""

    settings: ClassifierSettings

    def clear(self) -> None:
        """Forget what was seen."""
        ...

    def interrupt(self) -> None:
        """What comes next does not join up with what was seen."""
        ...

    def judge(self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen) -> Opinion:
        """Look at the newest frame, so long after the one before, and what it cannot show."""
        ...


class WindowJudge:
    """Continuous residuals of a window, and a belief that gathers what they say.

    A fault is named when the belief is sure of it and one window of the last half second was
    `striking` by itself: an error of the description says little, but says it for as long as the
    motion lasts. The network knows ticks of 50 ms: of faster ones it sees the last in each 50 ms,
    slower ones it sees again.
    """

    def __init__(self, network: WindowNetwork, settings: ClassifierSettings) -> None:
        self.settings = settings
        self._network = network
        self._belief = Belief(settings.evidence_weight, settings.caution)
        self.clear()

    def clear(self) -> None:
        """Forget what was seen: as if the robot had stood still."""
        self._window = np.zeros((WINDOW, CHANNELS))
        self._slot: int | None = None
        self._lacking = WINDOW
        self._opinion = Opinion(np.eye(len(STATES))[NORMAL], sure=False)
        self._recent: deque[Array] = deque(maxlen=_STRIKING_TICKS)
        self._belief.clear()

    def interrupt(self) -> None:
        """Say nothing new until the window holds no other than joined frames."""
        self._slot, self._lacking = None, WINDOW

    def judge(self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen) -> Opinion:
        """Look at the newest frame."""
        if elapsed_ns > _TOO_LONG:
            self.interrupt()
        slot = frame.stamp_ns // _TICK
        count = 1 if self._slot is None else slot - self._slot
        self._slot = slot
        for _ in range(count):
            self._opinion = self._step(channels_of(frame), unseen)
        return self._opinion

    def _step(self, seen: Array, unseen: Unseen) -> Opinion:
        """Opinion after one more tick of the network."""
        self._window[:-1] = self._window[1:]
        self._window[-1] = seen
        self._lacking = max(self._lacking - 1, 0)
        if self._lacking:
            return self._opinion
        likelihoods = self._network.log_likelihoods(self._window)
        blind = [start + wheel for wheel, _ in unseen.blind for start in _OF_A_WHEEL]
        if int(np.argmax(likelihoods)) in blind:
            likelihoods[:] = 0.0
        likelihoods[blind] = likelihoods[NORMAL]
        for idle in unseen.wheels:  # what an idle wheel hides it cannot refute either
            faults = [CONTROLS.start + idle, ENCODERS.start + idle]
            likelihoods[faults] = np.maximum(likelihoods[faults], likelihoods[NORMAL])
        self._recent.append(likelihoods - likelihoods[NORMAL])
        shares = self._belief.update(likelihoods)
        six, best = six_of(shares), int(np.argmax(shares))
        leading = int(np.argmax(six))
        striking = any(window[best] > self.settings.striking for window in reversed(self._recent))
        concerned = best - CONTROLS.start if leading == CONTROL else STATES[leading].wheel
        return Opinion(six, bool(six[leading] > _SURE and striking), concerned)


class CodeJudge:
    """The paper's network on three-level codes, its probabilities smoothed in time.

    A first-order filter; a state that leads for `confirm_time` is named.
    """

    def __init__(self, network: Network, settings: ClassifierSettings) -> None:
        self.settings = settings
        order = list(INPUT_ORDERS[settings.input_order])
        # Few of the 3^10 inputs occur, and most of them again and again.
        self._answer = lru_cache(maxsize=4096)(
            lambda codes: network.probabilities(np.array(codes, dtype=np.float64)[order])
        )
        self.clear()

    def clear(self) -> None:
        """Forget what was seen."""
        self._smoothed: Array | None = None
        self._leading = -1
        self._led = 0

    def interrupt(self) -> None:
        """What leads has to lead anew."""
        self._smoothed, self._led = None, 0

    def judge(self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen) -> Opinion:
        """Look at the newest frame."""
        now = self._answer(frame.codes)
        if self._smoothed is None or not elapsed_ns:
            self._smoothed = now
        else:
            kept = math.exp(-elapsed_ns / max(self.settings.filter_time, 1))
            self._smoothed = kept * self._smoothed + (1.0 - kept) * now
        leading = int(np.argmax(self._smoothed))
        self._led = self._led + elapsed_ns if leading == self._leading else 0
        self._leading = leading
        return Opinion(
            self._smoothed, self._led >= self.settings.confirm_time, STATES[leading].wheel
        )


JUDGES: Mapping[str, Callable[[ClassifierSettings], Judge]] = {
    "window": lambda settings: WindowJudge(WindowNetwork.load(settings.weights), settings),
    "wang2024": lambda settings: CodeJudge(Network.load(settings.weights), settings),
}


def make_judge(settings: ClassifierSettings) -> Judge:
    """The classifier that the settings ask for; raises InputError for weights that do not fit."""
    return JUDGES[settings.classifier](settings)
