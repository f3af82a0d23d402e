"""What counts as measurable."""

import numpy as np
from attrs import evolve

from tomr_training.labels import GroundTruth, Noise, deviates, lasting


def test_what_differs_measurably() -> None:
    twin = GroundTruth(np.full((10, 3), 4.0), np.full((10, 3), 5.0), np.zeros((10, 3)))
    noise = Noise(0.1, 0.0)
    # 3 sigma and 15 % of 4 W: 0.9 W.
    more, less = twin.power.copy(), twin.power.copy()
    more[3:, 0], less[3:, 0] = 4.91, 4.89
    flags = deviates(evolve(twin, power=more), twin, noise)
    assert flags.tolist() == [False] * 3 + [True] * 7
    assert not deviates(evolve(twin, power=less), twin, noise).any()
    # 0.01 rad/s and 0.2 % of 5 rad/s: 0.02 rad/s.
    assert deviates(evolve(twin, speed=twin.speed + 0.021), twin, noise).all()
    assert not deviates(evolve(twin, speed=twin.speed + 0.019), twin, noise).any()
    assert lasting(flags).tolist() == [False] * 6 + [True] * 4
