"""One recording of a robot as typed samples: where every tool that reads recordings starts."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

Array = NDArray[np.float64]


@frozen
class Drive:
    """One recording; times in seconds since its first encoder sample, NaN where nothing is known.

    Power is what the robot publishes: W for `measurement.quantity: power` and `supply_current`
    (times the nominal voltage), A for `motor_current`. See `drive.sources` for missing voltages.
    """

    name: str
    encoder_time: Array  # (n,)
    position: Array  # rad, (n, 3)
    velocity: Array  # rad/s, (n, 3)
    power_time: Array  # (m,)
    power: Array  # W or A drawn, (m, 3)
    reading: Array  # as the sensor says it: A, or W where it gives no current, (m, 3)
    total_time: Array  # (l,)
    total: Array  # W drawn by the whole robot, (l,)
    command_time: Array  # (c,)
    command: Array  # m/s, m/s, rad/s in base_link, (c, 3)
    voltage: Array  # of each driver's supply [V], NaN where not given, (m, 3)
    total_voltage: Array  # V, (l,)
    imu_time: Array  # (g,)
    inertial: Array  # angular rates [rad/s] and specific forces [m/s^2], x, y and z each, (g, 6)
    start_ns: int = 0  # stamp of time 0
    notes: tuple[str, ...] = ()

    def command_at(self, time: Array) -> Array:
        """The command in force at some times [s], NaN before the first, (m, 3)."""
        latest = np.searchsorted(self.command_time, time, side="right")
        return np.concatenate([np.full((1, 3), np.nan), self.command])[latest]

    @property
    def yaw_rate(self) -> Array:
        """Of the gyro [rad/s], (g,)."""
        return self.inertial[:, 2]

    @property
    def duration(self) -> float:
        """From the first to the last encoder sample [s]."""
        return float(self.encoder_time[-1] - self.encoder_time[0])
