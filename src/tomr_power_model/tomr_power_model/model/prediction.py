"""What the model stage says at one tick."""

from attrs import frozen

from tomr_power_model.messages.readings import NAN, SupplyReading

Triple = tuple[float, float, float]
Readings = tuple[SupplyReading, SupplyReading, SupplyReading]


@frozen
class Prediction:
    """Means over the window that ends at the stamp; NaN where an input is missing."""

    stamp_ns: int
    speed: Triple  # expected from the command [rad/s]
    torque: Triple  # of the motors, at the wheel [N m]
    motors: Readings  # from the command
    total: SupplyReading  # from the command, with auxiliary power
    from_encoders: Readings  # from the measured wheel speeds
    # Of the drivers [V]: as simulated, and as they say or their law has it on the measured speeds.
    voltage: Triple = (NAN, NAN, NAN)
    held: Triple = (NAN, NAN, NAN)
