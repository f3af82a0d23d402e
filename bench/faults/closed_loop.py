"""What `tomr_gap` itself predicts of a recording's motor power.

The only place here that knows how its forward simulation is called.
"""

from pathlib import Path

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.drive.cut import names_of
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.robot import WHEELS
from tomr_reality_gap.prepared import prepared
from tomr_reality_gap.request import Request

Array = NDArray[np.float64]

_FOREVER = 1e9  # s


@frozen
class MotorPower:
    """Power samples of one motor."""

    time_ns: NDArray[np.int64]  # stamps, (n,)
    measured: Array  # W, (n,)
    predicted: Array  # W, (n,)

    @property
    def residual(self) -> Array:
        """Measured - predicted [W]."""
        return self.measured - self.predicted


@frozen
class Prediction:
    """One recording: its motors' power, and the wheel angles that were measured."""

    motors: tuple[MotorPower, ...]
    encoder_ns: NDArray[np.int64]  # (m,)
    angle: Array  # rad, (m, 3)


def closed_loop(bag: Path, robot: Path, seconds: float = float("inf")) -> Prediction:
    """Predict the motor power of a recording, or of its first seconds, from its commands.

    Raises InputError for a recording that `tomr_gap` refuses.
    """
    skips = {names_of((bag,))[0]: ((seconds, _FOREVER),)} if np.isfinite(seconds) else {}
    ready = prepared(Request(robot=robot, real=(bag,), skips=skips))
    simulation = ready.real[0]
    values = simulation.predict([ready.base.robot])[0]
    recorded = simulation.recorded
    motors = {
        channel.wheel: MotorPower(
            _stamps(recorded.start_ns, channel.time), channel.value, values[part]
        )
        for channel, part in zip(simulation.channels, rows_of(simulation.channels), strict=True)
        if channel.kind == "power"
    }
    return Prediction(
        tuple(motors[wheel] for wheel in range(WHEELS)),
        _stamps(recorded.start_ns, recorded.encoder_time),
        recorded.position,
    )


def _stamps(start_ns: int, seconds: Array) -> NDArray[np.int64]:
    return start_ns + np.round(1e9 * seconds).astype(np.int64)
