"""What a gyro, the forces of the contacts and the parity of the motors say of a tick, beside what
the network makes of it.

Log-likelihoods (19,) of its hypotheses over those if all wheels roll as they show, and nobody
pushes.
"""

import math

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from tomr_fault_diag.classifier.belief import (
    CONTROLS,
    DRAGS,
    ENCODERS,
    EXTERNAL,
    HYPOTHESES,
    OTHER,
    WEAKS,
)
from tomr_fault_diag.classifier.contacts import NOTHING, Contacts
from tomr_fault_diag.classifier.misfit import is_far
from tomr_fault_diag.classifier.outside import NOTHING_ACTS, Outside
from tomr_fault_diag.classifier.parity import NOT_KNOWN, Parity
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_fault_diag.residuals.frame import SPEEDS, ResidualFrame

Array = NDArray[np.float64]

_PER_BAND = 8.0  # that a gyro says for slip, for each band beyond the first
_PER_ODDS = 3.0  # times the log odds of a slide, that forces say for it
_PER_BEYOND = 20.0  # that a parity that broke says, by how far it is off beyond what is allowed
_MOST = 10.0  # that any of them says in a tick
_LEAST_DOUBT = 1e-6  # of a slide
_MISCOUNTS = 0.7  # of what forces say for slip: for an encoder that loses counts
_CERTAIN = 24.0  # against all that leaves a wheel turning


@frozen
class Beside:
    """What is known of a tick beside its residuals."""

    contacts: Contacts = NOTHING
    outside: Outside = NOTHING_ACTS
    lasting: Array = field(factory=lambda: np.zeros(HYPOTHESES))  # by small faults that last
    parity: Parity = NOT_KNOWN


ALONE = Beside()  # a tick is judged


def astray(frame: ResidualFrame) -> list[int]:
    """Wheels whose speeds are far out of their bands."""
    return [wheel for wheel, index in enumerate(SPEEDS) if is_far(frame.residuals[index])]


def said_by_gyro(frame: ResidualFrame) -> Array:
    """Of the body's yaw rate; 0 within the band, and without a gyro.

    Slip makes it another one, and need not; so does an encoder that shows too little, by turning
    the body on as its wheel does. Where an encoder shows what it should not the others are not in
    doubt: a wheel that is slow in truth turns the body as it shows.
    """
    said, yaw = np.zeros(HYPOTHESES), frame.yaw
    beyond = abs(yaw.residual) / yaw.band - 1.0
    if not beyond > 0.0:  # nor where it is NaN
        return said
    most, doubted = min(_PER_BAND * beyond, _MOST), astray(frame)
    if not doubted:
        said[[SLIP, OTHER]] = most
    for wheel in doubted or range(len(SPEEDS)):
        # A wheel that turns forwards turns the body clockwise (ros2_controllers' omni wheels).
        if frame.residuals[SPEEDS[wheel]].modelled * yaw.residual < 0.0:
            said[ENCODERS.start + wheel] = most
    return said


def said_by_parity(parity: Parity) -> Array:
    """Of what motors draw at their voltages and speeds.

    Where that agrees neither the signal of the motor nor its encoder is lost. Where it does not it
    is no slip; where it did until then something is wrong, and it is not that axle's friction. A
    loss that alone explains what all motors draw leaves nothing else but a winding that takes more.
    """
    said = np.zeros(HYPOTHESES)
    for kind in (CONTROLS, ENCODERS):
        said[kind] = np.where(parity.holds, -_MOST, 0.0)
    if parity.broken.any():
        said[SLIP] = -_MOST
    if parity.broke.any():
        most = min(_PER_BEYOND * parity.beyond, _MOST)
        said[[NORMAL, EXTERNAL]] = -most
        said[DRAGS][parity.broke] = -most
    losses = parity.losses
    for lost, kind in ((losses.signal, CONTROLS), (losses.counts, ENCODERS)):
        if lost.any():
            said[[NORMAL, EXTERNAL]] = -_CERTAIN
            left = np.full(HYPOTHESES, -_MOST)
            left[OTHER] = 0.0
            left[kind][lost] = left[WEAKS][lost] = 0.0
            said = np.minimum(said, left)
    return said


def said_by_forces(frame: ResidualFrame, contacts: Contacts, parity: Parity = NOT_KNOWN) -> Array:
    """Of what the contacts hand on: 0 up to even odds of a slide.

    An encoder that shows too little looks much like one. What one wheel bears alone is no force on
    the body, and what also shows no motion has lost its encoder, or is stuck. Of a slide nothing
    where an encoder shows what it should not: then the motion is in doubt. Where a motor's parity
    is broken only an encoder explains what looks like a slide.
    """
    said, slides = np.zeros(HYPOTHESES), contacts.slides
    if slides > 0.5 and not astray(frame):  # nor where it is NaN
        odds = slides / max(1.0 - slides, _LEAST_DOUBT)
        said[SLIP] = min(_PER_ODDS * math.log(odds), _MOST)
        said[ENCODERS] = _MISCOUNTS * said[SLIP]
        if parity.broken.any():
            said[SLIP] = 0.0
    if contacts.lone is not None:
        said[EXTERNAL] = -_MOST
    if contacts.unmoved is not None:
        said[:] = -_CERTAIN
        said[[kind.start + contacts.unmoved for kind in (ENCODERS, DRAGS)]] = 0.0
        said[OTHER] = 0.0
    return said
