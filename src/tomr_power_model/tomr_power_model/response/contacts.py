"""Dry friction of many robots at once: what brings a contact to rest, as far as its limit goes."""

from typing import Self

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SWEEPS = 2  # of Gauss-Seidel; the last step's friction is the first guess


@frozen
class Contacts:
    """Dry friction at the axles, and of the rollers along them, as one complementarity problem.

    u = S (free - G S^T f) with S = [I; D], D the sliding of each contact along its axle per wheel
    speed; each f is the force within its limit that brings its u to rest if it can.
    """

    slides: Array  # S^T, (v, 3, k)
    moves: Array  # (G S^T)^T, (v, k, 3)
    coupling: Array  # columns of S G S^T, (k, k, v, 1): [column, row]
    own: Array  # its diagonal, (k, v, 1)

    @classmethod
    def of(cls, gain: Array, to_twist: Array, axles: Array | None) -> Self:
        """Three rows; six where rollers drag along axles (3, 2). Gain and twist are transposed."""
        gain = gain.transpose(0, 2, 1)
        rows = np.broadcast_to(np.eye(3), gain.shape)
        if axles is not None:
            along = axles @ to_twist.transpose(0, 2, 1)[:, :2]
            rows = np.concatenate([rows, along], axis=1)
        moves = gain @ rows.transpose(0, 2, 1)
        coupling = np.ascontiguousarray((rows @ moves).transpose(2, 1, 0))[..., None]
        return cls(
            np.ascontiguousarray(rows.transpose(0, 2, 1)),
            np.ascontiguousarray(moves.transpose(0, 2, 1)),
            coupling,
            np.stack([coupling[row, row] for row in range(len(coupling))]),
        )

    @property
    def count(self) -> int:
        return int(self.slides.shape[2])

    def effect(self, forces: Array) -> Array:
        """Change of wheel speeds [rad/s], (v, c, 3)."""
        return np.asarray(forces @ self.moves)

    def solve(self, free: Array, limits: Array, guess: Array) -> Array:
        """Forces and torques after projected Gauss-Seidel from the last ones, (v, c, k)."""
        moving = np.ascontiguousarray(
            ((free - self.effect(guess)) @ self.slides).transpose(2, 0, 1)
        )
        forces = np.ascontiguousarray(guess.transpose(2, 0, 1))
        most = np.ascontiguousarray(np.broadcast_to(limits, guess.shape).transpose(2, 0, 1))
        least = -most
        for row in [*range(self.count)] * _SWEEPS:
            wanted = forces[row] + moving[row] / self.own[row]
            np.maximum(wanted, least[row], out=wanted)
            np.minimum(wanted, most[row], out=wanted)
            moving -= self.coupling[row] * (wanted - forces[row])
            forces[row] = wanted
        return np.asarray(forces.transpose(1, 2, 0))
