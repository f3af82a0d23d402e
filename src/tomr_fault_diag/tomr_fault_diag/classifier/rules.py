"""What a window's log-likelihoods count for: named rules, one after the other.

The network sees 0.4 s of residuals and nothing else. Each rule corrects what it says by what the
motion can show, by a gyro, the forces of the contacts and the parity of the motors, by what acts on
the body, or by what a description that is off looks like. A rule is a function of log-likelihoods
and of what is known at that moment; a new one is a function and its name in `WINDOW_RULES` or
`STATE_RULES`.
"""

from collections.abc import Callable, Mapping

import numpy as np
from attrs import evolve, field, frozen
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
    WEAKS,
    of_states,
)
from tomr_fault_diag.classifier.evidence import ALONE, Beside, astray
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.outside import NOTHING_ACTS, Outside
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_fault_diag.residuals.frame import ENCODERS as DERIVED
from tomr_fault_diag.residuals.frame import MOTORS, SPEEDS, ResidualFrame

Array = NDArray[np.float64]

# A description that is off looks like these: what a window says only slightly is not counted, for
# it would say it again and again.
CREEPING = (DRAGS, WEAKS, METERS)
_SLIGHT = 1.0
# What a push leaves, small residuals within bands that are the robot's own, and slopes look like
# slip to the network: it says so much less where neither forces nor a gyro show one.
_DOUBTED = 2.0
# What is seen to act on the body for seconds is so much likelier than what a window looks like.
_SHARED, _LOADED = 10.0, 24.0
_HIDDEN = (CONTROLS, ENCODERS, DRAGS, WEAKS)  # faults that an idle wheel does not show
_FIRM = _HIDDEN[1:]  # faults that hold a wheel: one without its signal goes where others pull it
_OF_A_WHEEL = (*_HIDDEN, METERS)


@frozen
class Moment:
    """A tick, and what is known when it is weighed."""

    frame: ResidualFrame
    unseen: Unseen = field(factory=Unseen)
    beside: Beside = ALONE
    is_well: bool = True  # no fault led so far
    is_unaccused: bool = True  # no wheel was accused of late
    is_shaken: bool = False  # a push still shows
    commissioned: bool = False
    striking: float = 0.0  # log-likelihood ratio that a striking window reaches
    by_gyro: Array = field(factory=lambda: np.zeros(HYPOTHESES))  # what it says, (19,)
    by_forces: Array = field(factory=lambda: np.zeros(HYPOTHESES))
    by_parity: Array = field(factory=lambda: np.zeros(HYPOTHESES))


Rule = Callable[[Array, Moment], Array]


def _blind(likelihoods: Array, moment: Moment) -> Array:
    """Nobody accuses or clears a motor whose power is not known."""
    blind = [kind.start + wheel for wheel, _ in moment.unseen.blind for kind in _OF_A_WHEEL]
    if int(np.argmax(likelihoods)) in blind:
        return np.zeros_like(likelihoods)
    return _as_normal(likelihoods, blind)


def _idle(likelihoods: Array, moment: Moment) -> Array:
    """What an idle wheel hides it cannot refute either."""
    found = likelihoods.copy()
    faults = [kind.start + wheel for wheel in moment.unseen.wheels for kind in _HIDDEN]
    found[faults] = np.maximum(found[faults], found[NORMAL])
    return found


def _moved(likelihoods: Array, moment: Moment) -> Array:
    """No fault turns a wheel that stands: somebody pushes. Nor does one that is not known, where
    no wheel is to turn and those that do draw no more for it."""
    unseen = moment.unseen
    kinds = _FIRM if unseen.driven else _HIDDEN
    moved = [kind.start + wheel for wheel in unseen.moved for kind in kinds]
    found = _as_normal(likelihoods, moved)
    if moved and not unseen.driven and not any(_draws(moment.frame, i) for i in unseen.moved):
        found[OTHER] = min(found[OTHER], max(found[EXTERNAL], found[NORMAL]))
    return found


def _draws(frame: ResidualFrame, wheel: int) -> bool:
    """Whether a motor draws more than it should, as far as its power is known."""
    paths = frame.residuals[MOTORS[wheel]], frame.residuals[DERIVED[wheel]]
    return any(item.residual > item.band for item in paths)


def _speedless(likelihoods: Array, moment: Moment) -> Array:
    """Where no speed is known it does not show whose encoder is lost."""
    found = likelihoods.copy()
    if all(moment.frame.residuals[channel].stale for channel in SPEEDS):
        found[ENCODERS] = found[ENCODERS].max()
    return found


def _astray(likelihoods: Array, moment: Moment) -> Array:
    """No power sensor makes a wheel turn otherwise."""
    found = likelihoods.copy()
    meters = [METERS.start + number for number in astray(moment.frame)]
    found[meters] = np.minimum(found[meters], found[NORMAL])
    return found


def _standing(likelihoods: Array, moment: Moment) -> Array:
    """A robot that stands says the same again and again."""
    if not moment.unseen.everything:
        return likelihoods
    slight = likelihoods - likelihoods[NORMAL] < moment.striking
    return np.where(slight, likelihoods[NORMAL], likelihoods)


def _creeping(likelihoods: Array, moment: Moment) -> Array:
    """What a description that is off says all the time, and slightly, is not counted."""
    found = likelihoods.copy()
    for kind in CREEPING:
        over = found[kind] - found[NORMAL]
        plain = np.sign(over) * np.maximum(np.abs(over) - _SLIGHT, 0.0)
        found[kind] = found[NORMAL] + plain
    return found


def _gripping(likelihoods: Array, moment: Moment) -> Array:
    """Wheels that grip do not slip, nor does a robot that was pushed, unless a gyro or forces say
    so. Where it is not commissioned, forces alone do not show that wheels grip."""
    contacts = moment.beside.contacts
    grips = contacts.calm or (contacts.grips and moment.is_well)
    known = moment.commissioned or (contacts.felt and not contacts.calm)
    is_slip = moment.by_gyro[SLIP] + moment.by_forces[SLIP] > 0.0
    if is_slip or not (moment.is_shaken or (grips and known)):
        return likelihoods
    return _less(likelihoods, SLIP, _SHARED if grips and contacts.felt else _DOUBTED)


def _shaken(likelihoods: Array, moment: Moment) -> Array:
    """A driver that lets go of what a push left in its integral looks as if without a signal."""
    if moment.is_shaken and moment.is_well:
        return _less(likelihoods, CONTROLS, _DOUBTED)
    return likelihoods


def _lasting(likelihoods: Array, moment: Moment) -> Array:
    """Small faults that last: a window that does not show them says nothing against them."""
    if moment.is_shaken:
        return likelihoods
    lasting = moment.beside.lasting
    unseen = (lasting > 0.0) & (likelihoods < likelihoods[NORMAL])
    return np.asarray(np.where(unseen, likelihoods[NORMAL], likelihoods) + lasting)


def _gyro(likelihoods: Array, moment: Moment) -> Array:
    """What the body's yaw rate says."""
    return likelihoods + moment.by_gyro


def _forces(likelihoods: Array, moment: Moment) -> Array:
    """What the forces of the contacts say."""
    return likelihoods + moment.by_forces


def _parity(likelihoods: Array, moment: Moment) -> Array:
    """What motors draw at their voltages and speeds."""
    return likelihoods + moment.by_parity


def _outside(moment: Moment) -> Outside:
    """What acts on the body; nothing that is known where a motor's parity breaks."""
    return NOTHING_ACTS if moment.beside.parity.broke.any() else moment.beside.outside


def _load(likelihoods: Array, moment: Moment) -> Array:
    """What stays and drags is a load, and soon over is none."""
    outside, found = _outside(moment), likelihoods.copy()
    if outside.load:
        found[LOADED] = likelihoods.max() + _LOADED
    elif outside.may_be_push:
        found[LOADED] -= _SHARED
    return found


def _shared(likelihoods: Array, moment: Moment) -> Array:
    """All wheels feel a force on the body: none is accused."""
    outside = _outside(moment)
    if outside.push or outside.load:
        return _less(likelihoods, slice(CONTROLS.start, METERS.stop), _SHARED)
    return likelihoods


def _pushed_grip(likelihoods: Array, moment: Moment) -> Array:
    """Who leans on a robot whose wheels grip does not make it slip."""
    if moment.beside.outside.may_be_push and moment.beside.contacts.grips:
        return _less(likelihoods, SLIP, _SHARED)
    return likelihoods


def _slope(likelihoods: Array, moment: Moment) -> Array:
    """What a slope explains accuses no wheel; one that is accused already stays so."""
    contacts = moment.beside.contacts
    is_slope = contacts.force or (contacts.slopes and contacts.hides_slopes)
    if is_slope and moment.is_unaccused:
        return _less(likelihoods, slice(CONTROLS.start, WEAKS.stop), _SHARED)
    return likelihoods


def _lost(likelihoods: Array, moment: Moment) -> Array:
    """What breaks a motor's parity is not over."""
    return _less(likelihoods, ENDED, _LOADED) if moment.beside.parity.breaks.any() else likelihoods


def _misled(likelihoods: Array, moment: Moment) -> Array:
    """Drivers that obeyed what is not known: what their wheels do accuses none that was well."""
    if moment.is_well and moment.is_unaccused and moment.beside.parity.misled:
        likelihoods = _less(likelihoods, OTHER, _SHARED)
        return _less(likelihoods, slice(CONTROLS.start, METERS.stop), _SHARED)
    return likelihoods


# Of the network's hypotheses, (19,), in this order.
WINDOW_RULES: Mapping[str, Rule] = {
    "a blind motor": _blind,
    "an idle wheel": _idle,
    "a wheel that is moved": _moved,
    "no speeds": _speedless,
    "a speed far off": _astray,
    "standing": _standing,
    "a description that is off": _creeping,
    "wheels that grip": _gripping,
    "a signal after a push": _shaken,
    "small faults that last": _lasting,
    "gyro": _gyro,
    "forces": _forces,
    "parity of the motors": _parity,
}
# Of the states of the belief, (36,), in this order.
STATE_RULES: Mapping[str, Rule] = {
    "a load": _load,
    "a force on the body": _shared,
    "a push and wheels that grip": _pushed_grip,
    "a slope": _slope,
    "a parity that breaks": _lost,
    "commands that are not known": _misled,
}


@frozen
class Rules:
    """The rules that a judge goes by."""

    window: Mapping[str, Rule] = field(factory=lambda: WINDOW_RULES)
    state: Mapping[str, Rule] = field(factory=lambda: STATE_RULES)

    def without(self, name: str) -> "Rules":
        """All but one; raises KeyError for a name that none has."""
        if name not in {**self.window, **self.state}:
            raise KeyError(name)
        window, state = (
            {key: rule for key, rule in rules.items() if key != name}
            for rules in (self.window, self.state)
        )
        return evolve(self, window=window, state=state)

    def weigh(self, likelihoods: Array, moment: Moment) -> Array:
        """Log-likelihoods of the states (36,) from those of the network's hypotheses (19,)."""
        for rule in self.window.values():
            likelihoods = rule(likelihoods, moment)
        found = of_states(likelihoods)
        for rule in self.state.values():
            found = rule(found, moment)
        return found


ALL_RULES = Rules()


def _as_normal(likelihoods: Array, places: list[int]) -> Array:
    found = likelihoods.copy()
    found[places] = found[NORMAL]
    return found


def _less(likelihoods: Array, places: int | slice, nats: float) -> Array:
    found = likelihoods.copy()
    found[places] -= nats
    return found
