"""Typical sizes of one robot in one recording: how large an effect on it may reasonably be."""

from attrs import frozen


@frozen
class Scales:
    """Typical sizes of one robot in one recording."""

    torque: float  # N m at a wheel
    speed: float  # rad/s of a wheel, while it moves
    current: float  # A of a motor
    power: float  # W of a motor
    copper: float  # W of a motor
    load: float  # N on a wheel
    radius: float  # m, of a wheel
    arm: float  # m, robot radius
    mass: float  # kg
    gear: float
    voltage: float  # V
    duration: float  # s
    period: float  # of the drivers [s]
    traction_ratios: tuple[float, ...] = ()  # traction over load of a contact: most, and less
