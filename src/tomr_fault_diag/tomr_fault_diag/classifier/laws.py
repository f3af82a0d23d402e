"""Laws that the motors' residuals may follow over seconds, and what each leaves unexplained.

Residuals are torques of motors beyond what is expected, in bands; each law is fitted by least
squares, and what it leaves is a sum of squared bands.
"""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.robot import WHEELS

Array = NDArray[np.float64]

# Of what an encoder shows, what it may lack besides.
_LACKS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.5, 1.8, 2.2, 2.7, 3.3, 4.0)
_CREEP = 0.02  # m/s: a hitch that moves slower is hardly dragged
_RIDGE = 1e-6  # of a normal matrix


@frozen
class Window:
    """Ticks of a motion."""

    shown: Array  # torques beyond what is expected, in bands, (n, 3)
    seen: Array  # bands per N m, 0 of a wheel that stands, (n, 3)
    powers: Array  # the same per W, negative where a power brakes, (n, 3)
    twist: Array  # m/s, m/s and rad/s, (n, 3)
    yaw: Array  # since some instant [rad], (n,)
    torques: Array  # of 1 N/kg along x and y of base_link and 1 N m/kg [N m], (3, 3)

    @property
    def sum_of_squares(self) -> float:
        """Of all residuals."""
        return float((self.shown**2).sum())

    @property
    def moving(self) -> float:
        """Share of the ticks in which every wheel turned."""
        return float((self.seen > 0.0).all(axis=1).mean())

    @property
    def shares(self) -> Array:
        """Of 1 N/kg along x and y and 1 N m/kg in the residuals [bands], (n, 3, 3)."""
        return self.seen[:, :, None] * self.torques

    def left_by_torques(self) -> float:
        """Sum of squares that constant torques leave, of each motor its own: nothing that fits as
        well has been tried by the motion."""
        squares = (self.seen**2).sum(axis=0) + _RIDGE
        return self.sum_of_squares - float(
            ((self.seen * self.shown).sum(axis=0)) ** 2 @ (1.0 / squares)
        )

    def left_by_power(self) -> float:
        """Sum of squares that a constant power leaves, the same of every driver."""
        explained = float((self.powers * self.shown).sum())
        return self.sum_of_squares - explained**2 / (float((self.powers**2).sum()) + _RIDGE)

    def left_by_encoder(self, to_twist: Array) -> float:
        """Least sum of squares that one wheel leaves which explains all of its own, and what the
        others feel where its encoder shows too little: it turns the body on, and that needs a
        force to keep on its way. `to_twist`: of wheel speeds, (3, 3)."""
        speed = np.linalg.solve(to_twist, self.twist.T).T
        return min(
            self._left_by_miscount(wheel, speed[:, wheel, None] * to_twist[:, wheel])
            for wheel in range(WHEELS)
        )

    def _left_by_miscount(self, wheel: int, more: Array) -> float:
        """That of one wheel, which turns the body on by some share of `more` beyond what it shows,
        (n, 3): what the others feel is quadratic in that share."""
        rest = [other for other in range(WHEELS) if other != wheel]
        both = _turned(self.twist, more) + _turned(more, self.twist)
        once, twice = (
            np.einsum("nij,nj->ni", self.shares[:, rest], felt).ravel()
            for felt in (both, _turned(more, more))
        )
        shown = self.shown[:, rest].ravel()
        lacks = np.array(_LACKS)
        left = (
            shown @ shown
            - 2.0 * lacks * (shown @ once)
            + lacks**2 * (once @ once - 2.0 * (shown @ twice))
            + 2.0 * lacks**3 * (once @ twice)
            + lacks**4 * (twice @ twice)
        )
        return float(left.min())

    def left_by_drag(self, hitches: Array) -> tuple[float, float]:
        """Sum of squares that the best of the hitches, (m, 2), leaves, and its drag [N/kg]."""
        across = np.column_stack([-hitches[:, 1], hitches[:, 0]])
        velocity = self.twist[:, None, :2] + self.twist[:, None, 2:] * across
        ways = velocity / np.sqrt((velocity**2).sum(axis=-1, keepdims=True) + _CREEP**2)
        moments = (across * ways).sum(axis=-1, keepdims=True)
        effects = np.einsum("nij,nhj->hni", self.shares, np.concatenate([ways, moments], axis=-1))
        flat = effects.reshape(len(hitches), -1)
        shown = self.shown.ravel()
        squares = (flat**2).sum(axis=1) + _RIDGE
        drags = np.maximum(flat @ shown / squares, 0.0)
        left = ((shown - drags[:, None] * flat) ** 2).sum(axis=1)
        best = int(np.argmin(left))
        return float(left[best]), float(drags[best])

    def left_by_push(self, *, turns: bool = True) -> tuple[float, float]:
        """Sum of squares that the best force and moment of one direction leave, in the world or in
        the body, steady, growing or ceasing, and its force if steady, else 0 [N/kg]. One that
        `turns` nothing passes the centre, as a slope's does."""
        time, columns = np.linspace(0.0, 1.0, len(self.yaw)), 3 if turns else 2
        # The axes of the world, and those of the body.
        angles = (self.yaw, np.zeros(len(self.yaw)))
        shares = [self._shares_at(angle)[:, :, :columns] for angle in angles]
        steady, growing, ceasing = (
            [_left(self.shown, axes * course[:, None, None]) for axes in shares]
            for course in (np.ones(len(time)), time, 1.0 - time)
        )
        left, size = min(steady, key=lambda fit: fit[0])
        changing = min(fit[0] for fit in (*growing, *ceasing))
        return (left, float(np.hypot(*size[:2]))) if left <= changing else (changing, 0.0)

    def _shares_at(self, angle: Array) -> Array:
        """Shares of forces along axes at an angle to those of base_link, (n, 3, 3)."""
        x, y, moment = np.moveaxis(self.shares, 2, 0)
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        return np.stack([x * cos - y * sin, x * sin + y * cos, moment], axis=-1)


def _turned(twist: Array, other: Array) -> Array:
    """Force per mass that keeps one motion on its way while another turns it [N/kg], (n, 3)."""
    return np.column_stack(
        [-other[:, 2] * twist[:, 1], other[:, 2] * twist[:, 0], np.zeros(len(twist))]
    )


def _left(shown: Array, shares: Array) -> tuple[float, Array]:
    """Sum of squares that a force, and a moment, leave, and these, (2,) or (3,)."""
    design = shares.reshape(shown.size, -1)
    normal = design.T @ design
    ridge = _RIDGE * (np.trace(normal) + 1.0) * np.eye(len(normal))
    size = np.linalg.solve(normal + ridge, design.T @ shown.ravel())
    return float(((shown.ravel() - design @ size) ** 2).sum()), size
