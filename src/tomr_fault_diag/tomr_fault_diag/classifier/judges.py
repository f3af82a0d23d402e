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
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    ENDED,
    EXTERNAL,
    HYPOTHESES,
    LOADED,
    METERS,
    OTHER,
    STATE_OF,
    WEAKS,
    Belief,
    named_of,
)
from tomr_fault_diag.classifier.evidence import (
    ALONE,
    Beside,
    said_by_forces,
    said_by_gyro,
    said_by_parity,
)
from tomr_fault_diag.classifier.features import CHANNELS, WINDOW, channels_of, turning
from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.rules import ALL_RULES, CREEPING, Moment, Rules
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.states import (
    CONTROL,
    DEGRADED,
    DRAGGING,
    NAMED,
    NORMAL,
    SLIP,
    STATES,
    STUCK,
    State,
)
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import INPUT_ORDERS, ResidualFrame
from tomr_power_model.model.ticks import to_ns
from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]

_SURE = 0.99
_STRIKING_TICKS = 10  # in which one window must have been so
_TICK = to_ns(0.05)
_TOO_LONG = to_ns(0.5)  # between two frames that belong to one window
_STAYS = 0.1  # of the share of a likelier fault of the same kind
_STANDING = 6  # ticks
_STILL = 0.2  # of the expected speed: a slower wheel stands
# Hypotheses that are named together.
_GROUPS: tuple[list[int], ...] = (
    [NORMAL, EXTERNAL, *range(ENDED.start, ENDED.stop)],
    [SLIP],
    list(range(CONTROLS.start, CONTROLS.stop)),
    *([kind.start + wheel for kind in (ENCODERS, DRAGS, WEAKS)] for wheel in range(WHEELS)),
    *([METERS.start + wheel] for wheel in range(WHEELS)),
    [LOADED],
    [OTHER],
)
_CAUSES = (*DRAGGING, *DEGRADED, *STUCK)  # of a fault of a motor system
_SLIP_MARGIN = 4.0  # that slip need be less striking: a short one shows in few windows
_SHAKEN = 12  # ticks, for which a push still shows
_REMEMBERED = 60  # ticks, in which a fault of a wheel that was named may be so again on a slope
_MOST_GATHERED = 24.0  # nats: what ended long ago must not count for long
GATHERED = 12.0  # nats, that small faults which last have shown, in place of a striking window


@frozen
class Opinion:
    """Probabilities of NAMED, or of as many as a judge knows, and what leads.

    `sure`: whether to name it; `wheel`: that it concerns, if it has one; `state`: what leads, where
    that is not just the likeliest.
    """

    probabilities: Array
    sure: bool
    wheel: int | None = None
    state: State | None = None

    @property
    def leading(self) -> State:
        """The state that leads."""
        return self.state or NAMED[int(np.argmax(self.probabilities))]


class Judge(Protocol):
    """One way to name states from residuals."""

    settings: ClassifierSettings

    def clear(self) -> None:
        """Forget what was seen."""
        ...

    def interrupt(self) -> None:
        """What comes next does not join up with what was seen."""
        ...

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        """Look at the newest frame, so long after the one before, what it cannot show, and
        what is known beside."""
        ...


class WindowJudge:
    """Continuous residuals of a window, and a belief that gathers what they say.

    A fault is named when the belief is sure of it and one window of the last half second was
    `striking` by itself: an error of the description says little, but says it for as long as the
    motion lasts. The network knows ticks of 50 ms: of faster ones it sees the last in each 50 ms,
    slower ones it sees again. Until a motor has been accused for a window no cause is named.
    """

    def __init__(
        self, network: WindowNetwork, settings: ClassifierSettings, rules: Rules = ALL_RULES
    ) -> None:
        self.settings = settings
        self._network = network
        self._rules = rules
        self._belief = Belief(settings.evidence_weight, settings.caution)
        self.clear()

    def clear(self) -> None:
        """Forget what was seen: as if the robot had stood still."""
        self._window = np.zeros((WINDOW, CHANNELS))
        self._slot: int | None = None
        self._lacking = WINDOW
        self._opinion = Opinion(np.eye(len(NAMED))[NORMAL], sure=False)
        self._recent: deque[Array] = deque(maxlen=_STRIKING_TICKS)
        self._best = NORMAL
        self._accused, self._led = _GROUPS[0], 0  # what was last, and for how many ticks
        self._calm = 0  # ticks since
        self._since_accused = _REMEMBERED + 1  # ticks since it was sure of a fault of a wheel
        self._shaken = 0  # ticks in which a push still shows
        self._gathered = np.zeros(HYPOTHESES)  # what small faults that last have shown
        self._belief.clear()

    def interrupt(self) -> None:
        """Say nothing new until the window holds no other than joined frames."""
        self._slot, self._lacking = None, WINDOW

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        """Look at the newest frame."""
        if elapsed_ns > _TOO_LONG:
            self.interrupt()
        slot = frame.stamp_ns // _TICK
        count = 1 if self._slot is None else slot - self._slot
        self._slot = slot
        moment = Moment(
            frame,
            unseen,
            beside,
            commissioned=bool(self.settings.commissioned),
            striking=self.settings.striking,
            by_gyro=said_by_gyro(frame),
            by_forces=said_by_forces(frame, beside.contacts, beside.parity),
            by_parity=said_by_parity(beside.parity),
        )
        for _ in range(count):
            self._opinion = self._step(self._so_far(moment))
            # A size is fitted to what is new in a tick, however long it stands for.
            moment = evolve(moment, beside=evolve(beside, lasting=np.zeros(HYPOTHESES)))
        return self._opinion

    def _so_far(self, moment: Moment) -> Moment:
        """With what was concluded so far."""
        is_well = self._best in _GROUPS[0]
        accuses_none = is_well or self._best == OTHER
        return evolve(
            moment,
            is_well=is_well,
            is_unaccused=accuses_none and self._since_accused > _REMEMBERED,
            is_shaken=self._shaken > 0,
        )

    def _step(self, moment: Moment) -> Opinion:
        """Opinion after one more tick of the network."""
        self._window[:-1] = self._window[1:]
        self._window[-1] = channels_of(moment.frame)
        self._lacking = max(self._lacking - 1, 0)
        if self._lacking:
            return self._opinion
        likelihoods = self._rules.weigh(self._network.log_likelihoods(self._window), moment)
        if not moment.is_shaken:
            counted = self.settings.evidence_weight * moment.beside.lasting
            self._gathered = np.clip(self._gathered + counted, 0.0, _MOST_GATHERED)
        shares = self._belief.update(likelihoods)
        self._shaken = _SHAKEN if shares[EXTERNAL] > 0.5 else max(self._shaken - 1, 0)
        striking = _ratios(likelihoods)
        said = moment.by_gyro + moment.by_forces
        striking[ENCODERS] -= np.maximum(said[ENCODERS], 0.0)  # which alone accuses no encoder
        self._recent.append(striking)
        group = max(_GROUPS, key=lambda group: float(shares[group].sum()))
        best = self._kept(shares, group)
        self._accuse(group)
        state = STATE_OF[best]
        wheel = best - CONTROLS.start if state is STATES[CONTROL] else state.wheel
        if state in DRAGGING and _stands(self._window, best - DRAGS.start):
            state = STUCK[best - DRAGS.start]
        if state in _CAUSES and self._led < WINDOW and state.paper is not None:
            state = STATES[state.paper]  # its cause shows when the window holds nothing older
        sure = bool(shares[group].sum() > _SURE) and self._is_striking(best)
        is_accused = sure and CONTROLS.start <= best < METERS.start
        self._since_accused = 0 if is_accused else self._since_accused + 1
        return Opinion(named_of(shares), sure, wheel, state)

    def _accuse(self, group: list[int]) -> None:
        """Note what leads; a moment of normal in between does not make a fault a new one."""
        if group is _GROUPS[0]:
            self._calm += 1
            return
        goes_on = group is self._accused and self._calm < WINDOW
        self._led = self._led + 1 if goes_on else 1
        self._accused, self._calm = group, 0

    def evidence(self) -> float:
        """Log odds of the likeliest fault against none, without the prior [decades].

        0 where it would not be named with however little caution: no window is striking, or
        another fault may be it. Exact where the caution in use is far beyond.
        """
        shares = self._belief.shares
        faults = _GROUPS[1:]
        sums = [float(shares[group].sum()) for group in faults]
        most = max(sums)
        group = faults[sums.index(most)]
        striking = self._is_striking(group[int(np.argmax(shares[group]))])
        if not striking or most < _SURE * sum(sums):
            return 0.0
        odds = most / float(shares[_GROUPS[0]].sum())
        return max(self.settings.caution + math.log10(odds), 0.0)

    @property
    def gathered(self) -> float:
        """What the likeliest small fault that lasts has gathered so far [nats]."""
        return float(self._gathered.max())

    def _is_striking(self, state: int) -> bool:
        """Whether a window of the last half second spoke for a state by itself, or many little."""
        if state < HYPOTHESES and self._gathered[state] > GATHERED:
            return True
        return any(window[state] > self.settings.striking for window in self._recent)

    def _kept(self, shares: Array, group: list[int]) -> int:
        """The likeliest of a group; the one before stays while it is not unlikely."""
        best = group[int(np.argmax(shares[group]))]
        if self._best in group and shares[self._best] > _STAYS * shares[best]:
            best = self._best
        self._best = best
        return best


def _ratios(likelihoods: Array) -> Array:
    """How much a window says for each state, over what a healthy robot explains of it.

    Of what a description that is off looks like, a push explains the rest.
    """
    ratios = likelihoods - likelihoods[NORMAL]
    for kind in CREEPING:
        ratios[kind] -= max(likelihoods[EXTERNAL] - likelihoods[NORMAL], 0.0)
    ratios[SLIP] += _SLIP_MARGIN
    return np.asarray(ratios)


def _stands(window: Array, wheel: int) -> bool:
    """Whether a wheel that should turn has been standing."""
    expected, measured = turning(window[-_STANDING:], wheel)
    return bool((np.abs(measured) < _STILL * np.abs(expected)).all() and (expected != 0.0).all())


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

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
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
