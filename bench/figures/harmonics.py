"""How power depends on the direction of motion: symmetry of 60 degrees and what is left."""

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from scipy.stats import t as student

Array = NDArray[np.float64]

SECTORS = 6  # of 60 degrees
HIGHEST = 12  # harmonic that is reported; what is above and not symmetric counts as noise
_SIXTH = 6


@frozen
class Harmonics:
    """Power over all headings, above that of standing; amplitudes and remainder as shares of it."""

    mean: float  # W
    amplitudes: tuple[float, ...]  # of harmonics 1 to 12
    sixth: float  # amplitude of the 6th, the first with a symmetry of 60 degrees
    interval: float  # half of the 95 % interval of an amplitude
    most: float  # heading of most power by the 6th [deg], 0 to 60
    remainder: float  # RMS of what does not repeat every 60 degrees

    @property
    def numbers(self) -> dict[str, object]:
        return {
            "mean_above_standing_W": self.mean,
            "sixth_harmonic": self.sixth,
            "amplitude_95_percent": self.interval,
            "heading_of_most_power_deg_mod_60": self.most,
            "asymmetric_remainder_rms": self.remainder,
            "harmonics_1_to_12": list(self.amplitudes),
        }


def harmonics(power: Array, standing: float = 0.0) -> Harmonics:
    """Harmonics of powers [W] at equidistant headings from 0 to 360 degrees, (6 k,).

    The interval is that of a least-squares fit of the harmonics: the asymmetric ones above the
    12th, which no part of a robot of three wheels makes, are its noise.
    """
    count = len(power)
    if count % SECTORS or count < 4 * HIGHEST:
        raise ValueError(f"{count} headings: a multiple of {SECTORS} from {4 * HIGHEST} is needed")
    mean = float(power.mean()) - standing
    spectrum = 2.0 * np.fft.rfft(power) / count
    above = [k for k in range(HIGHEST + 1, (count + 1) // 2) if k % _SIXTH]
    noise = np.sqrt(np.mean(np.abs(spectrum[above]) ** 2) / 2.0)
    by_sector = power.reshape(SECTORS, -1)
    return Harmonics(
        mean=mean,
        amplitudes=tuple(float(abs(value)) / mean for value in spectrum[1 : HIGHEST + 1]),
        sixth=float(abs(spectrum[_SIXTH])) / mean,
        interval=float(student.ppf(0.975, 2 * len(above)) * noise) / mean,
        most=float(-np.degrees(np.angle(spectrum[_SIXTH])) / _SIXTH) % 60.0,
        remainder=float(np.sqrt(np.mean((by_sector - by_sector.mean(axis=0)) ** 2))) / mean,
    )
