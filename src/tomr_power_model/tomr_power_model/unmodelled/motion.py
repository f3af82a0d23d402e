"""The motion that a term without a name may depend on, by driver periods."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOVING = 0.1  # rad/s: the sign of slower motion is not sure
STANDING = 0.05  # rad/s
RESTED = 0.25  # s: shorter stands are none to what must settle
_SPAN = 0.02  # s, to either side, of a measured speed
LONG_AGO = 60.0  # s or rad since a stand that was never seen


@frozen
class Motion:
    """A robot's motion in a drive, n driver periods; wheels (n, 3), body (n, 1)."""

    time: Array  # since the drive's start [s]
    speed: Array  # rad/s
    current: Array  # of the motors [A]
    angle: Array  # of the wheels as joint_states count them [rad]
    heading: Array  # against the start [rad]
    x: Array  # in the world, which is base_link at the start [m]
    y: Array
    contact_x: Array  # of the wheels' contacts with the floor, in the world [m]
    contact_y: Array
    velocity_x: Array  # in the world [m/s]
    velocity_y: Array
    direction: Array  # of travel in base_link [rad]
    since_stand: Array  # time that a wheel has turned since it last stood or turned about [s]
    turned: Array  # angle that it has turned since it last rested [rad]
    from_rest: Array  # angle between where it stands and where it last rested [rad]
    to_wheels: Array  # torques that drive as a unit of force in base_link does, (3, 3)

    @property
    def sign(self) -> Array:
        """Of the wheels' speeds, fading at standstill."""
        return np.asarray(np.tanh(self.speed / MOVING))

    def resisting(self, force_x: Array, force_y: Array) -> Array:
        """Torques that resist at the wheels as forces in the world push [N m], (n, 3)."""
        cos, sin = np.cos(self.heading[:, 0]), np.sin(self.heading[:, 0])
        along, across = cos * force_x + sin * force_y, cos * force_y - sin * force_x
        return -np.stack([along, across], axis=1) @ self.to_wheels[:, :2].T


def contacts_at(inverse: Array, x: Array, y: Array, heading: Array) -> tuple[Array, Array]:
    """The wheels' contacts with the floor [m], (n, 3) each, of a body at places (n,).

    A wheel rolls across the line from the body's centre to its contact.

    Args:
        inverse: twist of the body per wheel speed, (3, 3).
        x: of the body's centre in the world [m], (n,).
        y: likewise.
        heading: rad, (n,).
    """
    rolls = np.linalg.inv(inverse)  # along x, along y, and its lever arm times both
    arm = rolls[:, 2] / (rolls[:, :2] ** 2).sum(axis=1)
    own_x, own_y = arm * rolls[:, 1], -arm * rolls[:, 0]
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    return x[:, None] + cos * own_x - sin * own_y, y[:, None] + sin * own_x + cos * own_y


def motion_of(inverse: Array, time: Array, *, speed: Array, current: Array, angle: Array) -> Motion:
    """The motion in even periods.

    Args:
        inverse: twist of the body per wheel speed, (3, 3).
        time: s, (n,).
        speed: of the wheels as simulated [rad/s], (n, 3).
        current: of the motors as simulated [A], (n, 3).
        angle: of the wheels as measured [rad], (n, 3): simulated ones drift away.
    """
    period = float(time[1] - time[0])
    twist = speed @ inverse.T
    moved = np.diff(angle, axis=0, prepend=angle[:1]) @ inverse.T
    heading = np.cumsum(moved[:, 2])
    middle = heading - 0.5 * moved[:, 2]
    cos, sin = np.cos(middle), np.sin(middle)
    x = np.cumsum(cos * moved[:, 0] - sin * moved[:, 1])
    y = np.cumsum(sin * moved[:, 0] + cos * moved[:, 1])
    contact_x, contact_y = contacts_at(inverse, x, y, heading)
    # As measured as well: friction that is not known holds a wheel that simulated ones have left.
    measured = _rate(angle, period, max(round(_SPAN / period), 1))
    slow = np.abs(measured) < STANDING
    sign = np.sign(measured)
    about = np.diff(sign, axis=0, prepend=sign[:1]) != 0.0
    steps = np.full_like(speed, period)
    rests = _since(~slow, steps) >= RESTED
    return Motion(
        time=time[:, None],
        speed=speed,
        current=current,
        angle=angle,
        heading=heading[:, None],
        x=x[:, None],
        y=y[:, None],
        contact_x=contact_x,
        contact_y=contact_y,
        velocity_x=(cos * twist[:, 0] - sin * twist[:, 1])[:, None],
        velocity_y=(sin * twist[:, 0] + cos * twist[:, 1])[:, None],
        direction=np.arctan2(twist[:, 1], twist[:, 0])[:, None],
        since_stand=_since(slow | about, steps),
        turned=_since(rests, np.abs(measured) * period),
        from_rest=_from_rest(rests, angle),
        to_wheels=inverse.T,
    )


def _from_rest(rests: NDArray[np.bool_], angle: Array) -> Array:
    """Angle to where a wheel last rested, (n, 3); far where it did not yet."""
    last = np.maximum.accumulate(np.where(rests, np.arange(len(rests))[:, None], -1), axis=0)
    away = np.abs(angle - np.take_along_axis(angle, np.maximum(last, 0), axis=0))
    return np.where(last < 0, LONG_AGO, np.minimum(away, LONG_AGO))


def _rate(angle: Array, period: float, half: int) -> Array:
    """Speed over `half` periods to either side."""
    padded = np.concatenate([angle[:1].repeat(half, 0), angle, angle[-1:].repeat(half, 0)])
    return np.asarray((padded[2 * half :] - padded[: -2 * half]) / (2 * half * period))


def _since(began: NDArray[np.bool_], steps: Array) -> Array:
    """Sum of steps since something last was so, (n, 3); far where it was not yet."""
    total = np.cumsum(steps, axis=0)
    then = np.where(began, total, -LONG_AGO)
    return np.minimum(total - np.maximum.accumulate(then, axis=0), LONG_AGO)
