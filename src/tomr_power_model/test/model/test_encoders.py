"""Samples of encoders that cannot be."""

import math

import numpy as np
import pytest

from tomr_power_model.model.encoders import UNKNOWN, EncoderSample, EncoderWindow, Triple

MS = 1_000_000
FASTEST = 40.0  # rad/s
SPEED = (4.0, -2.0, 1.0)


def _angles(at_ms: int) -> Triple:
    a, b, c = (speed * 1e-3 * at_ms for speed in SPEED)
    return a, b, c


def _taken(every_ms: int, velocity: Triple, *, angles: bool) -> tuple[set[bool], np.ndarray]:
    """Whether samples were taken, and the speeds at the end of 400 ms."""
    window = EncoderWindow(70 * MS, 50 * MS, 200 * MS, FASTEST)
    stamps = range(every_ms, 401, every_ms)
    samples = [(t, _angles(t) if angles else UNKNOWN) for t in stamps]
    found = {window.add(EncoderSample(t * MS, position, velocity)) for t, position in samples}
    return found, window.at(400 * MS).speed


@pytest.mark.parametrize("every_ms", [10, 40])
def test_speeds_that_cannot_be_are_left_out_beside_angles(every_ms: int) -> None:
    """In revolutions per minute, say: angles tell more anyway."""
    taken, speed = _taken(every_ms, (38.2, -19.1, 400.0), angles=True)
    assert taken == {True}
    np.testing.assert_allclose(speed, SPEED, atol=1e-9)


def test_speeds_that_cannot_be_are_refused_where_they_are_all_there_is() -> None:
    """However many there are: an encoder that counts anew has angles that leap."""
    taken, speed = _taken(10, (0.0, 0.0, -41.0), angles=False)
    assert taken == {False}
    assert np.isnan(speed).all()
    assert _taken(10, (0.0, 0.0, -39.0), angles=False)[0] == {True}


def test_two_angles_are_too_few_for_a_speed_and_speeds_that_cannot_be_are_none() -> None:
    for velocity, seen in ((SPEED, SPEED), ((38.2, -19.1, 400.0), UNKNOWN)):
        window = EncoderWindow(70 * MS, 50 * MS, 200 * MS, FASTEST)
        for t in (10, 20):
            assert window.add(EncoderSample(t * MS, _angles(t), velocity))
        np.testing.assert_allclose(window.at(20 * MS).speed, seen)


@pytest.mark.parametrize("wheel", [0, 1, 2])
def test_a_wheel_without_an_angle_has_its_speed_alone(wheel: int) -> None:
    window = EncoderWindow(70 * MS, 50 * MS, 200 * MS, FASTEST)
    position = [0.0, 0.0, 0.0]
    position[wheel] = math.nan
    a, b, c = position
    assert not window.add(EncoderSample(MS, (a, b, c), (41.0, 0.0, 0.0)))
    assert window.add(EncoderSample(2 * MS, (a, b, c), (39.0, 0.0, 0.0)))
