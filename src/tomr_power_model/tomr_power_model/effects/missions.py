"""Phases of the drives that show an effect, as mission files write them."""

from tomr_power_model.effects.base import Phase

PAUSE: Phase = {"pause": 2.0}


def move(heading: float, speed: float, seconds: float) -> Phase:
    """Straight on: heading [deg], speed [m/s], duration [s]."""
    return {"move": {"heading_deg": heading % 360.0, "speed": speed, "duration": seconds}}


def spin(rate: float, seconds: float) -> Phase:
    """On the spot: rate [rad/s], duration [s]."""
    return {"twist": [0.0, 0.0, rate], "duration": seconds}


SPEEDS = tuple(move(20.0, 0.05 * 2.0**k, 4.0) for k in range(4))
HEADINGS = tuple(move(60.0 * k, 0.4, 1.2) for k in range(12))
CRAWL = tuple(move(20.0 * k, 0.01 * (k + 1), 6.0) for k in range(6))
FINE_HEADINGS = tuple(move(15.0 * k, 0.2, 2.5) for k in range(24))
BOTH_WAYS = tuple(move(180.0 * (k % 2) + 40.0 * (k // 2), 0.3, 3.0) for k in range(8))
HARD_SPINS = (*(spin(2.0 * (-1.0) ** k, 1.0) for k in range(40)), PAUSE)
STAND: tuple[Phase, ...] = ({"pause": 15.0},)
VARIED = (spin(1.0, 3.0), move(0.0, 0.4, 2.0), move(180.0, 0.4, 2.0), move(90.0, 0.1, 5.0))
INERTIAL = (*HEADINGS, spin(1.5, 1.5), spin(-1.5, 1.5))
