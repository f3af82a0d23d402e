"""What is the matter, given all that was seen so far: a hidden Markov model over the states.

    predicted_k = sum_j belief_j P(j -> k);   belief_k ~ predicted_k exp(weight l_k)

with l_k the log-likelihood of the newest window if k holds, relative to the likeliest. Windows
overlap and so say the same several times over: `weight` < 1. That a fault comes on within a tick is
10^-caution likely, and no likelier beside another: so many decades of evidence must speak for it
before it is believed. What cannot be distinguished from normal in this motion has l = 0 and leaves
the belief as it is.

A force from outside is one hypothesis of the network and two states here: pushes are frequent and
soon over, loads are as rare as faults and stay. What looks like one fault now and like another
then is none that is known: `OTHER` takes each window as any of the faults. When a motor obeys
again its wheel has to catch up, which for a second looks like any fault of that wheel: `ENDED`.
"""

import numpy as np
from numpy.typing import NDArray

from tomr_fault_diag.classifier.states import (
    BURDENED,
    CONTROL,
    DEGRADED,
    DRAGGING,
    MOTOR,
    NORMAL,
    POWER_SENSOR,
    PUSHED,
    SLIP,
    STATES,
    UNKNOWN,
    State,
)

Array = NDArray[np.float64]

# What the window network distinguishes: normal, slip, and of wheels 1-3 each: signal lost, encoder
# lost, axle dragging, motor weak, power sensor wrong; a force from outside; anything else.
HYPOTHESES = 19
CONTROLS = slice(2, 5)
ENCODERS = slice(5, 8)
DRAGS = slice(8, 11)
WEAKS = slice(11, 14)
METERS = slice(14, 17)
EXTERNAL = 17  # a push, while it is young
OTHER = 18
LOADED = 19  # the same force, here to stay
# A lost signal or encoder is back, and its wheel catches up, tick by tick: 0.4 s at most, and as
# long until the last is out of the window.
ENDED = slice(20, 36)
_STATES = ENDED.stop
_FAULTS = slice(SLIP, METERS.stop)
_CATCHES_UP = [*range(CONTROLS.start, ENCODERS.stop)]  # after the fault, the wheel
# What each is called.
STATE_OF: tuple[State, ...] = (
    *STATES[:CONTROL], *(STATES[CONTROL],) * 3, *STATES[MOTOR:], *DRAGGING, *DEGRADED,
    *POWER_SENSOR, PUSHED, UNKNOWN, BURDENED, *(STATES[NORMAL],) * (ENDED.stop - ENDED.start),
)  # fmt: skip
_CLIP = 24.0  # no window says more than so much against anything
_ENDING = 1e-4  # likelihood that a fault ends within a tick ...
_SLIP_ENDING = 5e-3  # ... and that a slippery place is left
_CAUGHT_UP = 0.15  # ... and that the wheel has caught up
_PUSH = 1e-3  # that somebody pushes, and ...
_PUSH_ENDING = 0.15  # ... that it is over: a push of 6 s is as unlikely as a load
_STRANGE = 1e-2  # of a fault of no known kind, over that of a known one
_SLIPPERY = 1e5  # of slip, over that of other faults: it may be over soon
_SLOW = 1e-4  # of what a description that is off looks like, all the time
_GUESSED = np.log(2.5)  # what a wheel that catches up looks like is not known as a fault is
_LEAST = 1e-60  # far below the rarest onset that `caution` allows, or that would count for more


class Belief:
    """Probabilities of the states, tick by tick."""

    def __init__(self, weight: float, caution: float) -> None:
        """`weight` of the evidence of one window, `caution` in decades."""
        self._weight = weight
        self._moves = _transitions(10.0**-caution)
        self.clear()

    def clear(self) -> None:
        """Start afresh, believing that all is well."""
        self.shares: Array = np.zeros(_STATES)
        self.shares[NORMAL] = 1.0

    def update(self, likelihoods: Array) -> Array:
        """Take the log-likelihoods of a window, as `of_states`; returns the probabilities."""
        relative = np.maximum(likelihoods - likelihoods.max(), -_CLIP)
        shares = (self.shares @ self._moves) * np.exp(self._weight * relative)
        self.shares = np.asarray(np.maximum(shares / shares.sum(), _LEAST))
        return self.shares


def of_states(likelihoods: Array) -> Array:
    """Log-likelihoods of the states from those of the network's hypotheses (19,)."""
    found = np.append(likelihoods, likelihoods[EXTERNAL])
    faults = found[_FAULTS]
    most = faults.max()
    any_fault = most + np.log(np.mean(np.exp(faults - most)))
    found[OTHER] = np.logaddexp(found[OTHER], any_fault) - np.log(2.0)
    # The other wheels feel it as well.
    ended = max(found[CONTROLS.start : WEAKS.stop].max(), found[NORMAL]) - _GUESSED
    return np.concatenate([found, np.full(ENDED.stop - ENDED.start, ended)])


def _transitions(onset: float) -> Array:
    """P(j -> k)."""
    onset = min(onset, _PUSH)  # a fault, slip as well, is no likelier than a push
    # What shows more of itself was there from the first: one fault does not become another, and a
    # second one is as rare as the first.
    moves = np.full((_STATES, _STATES), onset)
    moves[:, LOADED] *= onset / _PUSH  # as rare beside a push as it is without a fault
    moves[:, NORMAL] = _ENDING
    moves[SLIP, NORMAL] = _SLIP_ENDING
    moves[[NORMAL, EXTERNAL]] = onset
    moves[[NORMAL, EXTERNAL], SLIP] = min(_SLIPPERY * onset, _PUSH)
    for kind in (DRAGS, WEAKS, METERS):
        moves[[NORMAL, EXTERNAL, SLIP, LOADED, *_CATCHES_UP], kind] *= _SLOW
    moves[:, OTHER] *= _STRANGE
    moves[NORMAL, EXTERNAL] = _PUSH
    moves[EXTERNAL, NORMAL] = _PUSH_ENDING
    _let_catch_up(moves)
    np.fill_diagonal(moves, 0.0)
    np.fill_diagonal(moves, 1.0 - moves.sum(axis=1))
    return moves


def _let_catch_up(moves: Array) -> None:
    """From a lost signal or encoder back to normal by way of `ENDED`, a tick after the other."""
    ticks = np.arange(ENDED.start, ENDED.stop)
    moves[_CATCHES_UP, NORMAL] = 0.0
    moves[:, ENDED] = 0.0
    moves[_CATCHES_UP, ticks[0]] = _ENDING
    moves[ENDED] = moves[NORMAL]
    moves[ENDED, NORMAL] = _CAUGHT_UP
    moves[ticks[:-1], ticks[1:]] = 1.0 - moves[ticks[:-1]].sum(axis=-1)
    moves[ticks[-1], NORMAL] += 1.0 - moves[ticks[-1]].sum(axis=-1)


def named_of(shares: Array) -> Array:
    """Probabilities (..., 18) of `states.NAMED`: of a lost signal the wheel does not matter."""
    control = shares[..., CONTROLS].sum(axis=-1, keepdims=True)
    well = shares[..., [NORMAL]] + shares[..., ENDED].sum(axis=-1, keepdims=True)
    slip, last = shares[..., [SLIP]], shares[..., EXTERNAL : EXTERNAL + 1]
    middle = shares[..., ENCODERS.start : METERS.stop]
    return np.concatenate(
        [well, slip, control, middle, last, shares[..., [LOADED, OTHER]]], axis=-1
    )
