"""Where a mismatch is, and what depends on what: on series made by hand."""

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.robot import shipped_robot
from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.alignment.forward import Forward
from tomr_reality_gap.fit.leftover import leftovers
from tomr_reality_gap.fit.study import columns_at
from tomr_reality_gap.mismatch.locate import located
from tomr_reality_gap.mismatch.orders import ripple_orders

from .test_alignment import _recorded as recorded_drive
from .test_alignment import forward  # noqa: F401 -- the fixture
from .test_search import searched

POWER_TIME = np.arange(0.02, 60.0, 0.02)


def _channel(value: np.ndarray) -> Channel:
    span = np.full(len(POWER_TIME), 0.005)
    return Channel("wheel_1/power", "power", 0, "W", POWER_TIME, span, value)


def test_the_regime_and_the_intervals_are_where_the_change_is() -> None:
    speed = 6.0 * np.abs(np.sin(0.3 * POWER_TIME))
    shows = (POWER_TIME > 20.0) & (POWER_TIME < 23.0) & (speed < 2.0)
    found = located(
        [_channel(speed)],
        1.0 * shows,
        np.full(len(speed), 10.0),
        0.8,
        {"|omega| [rad/s]": speed, "load [W]": np.cos(POWER_TIME)},
    )
    assert "|omega|" in found.regime
    assert found.intervals
    assert all(start >= 20.0 and end <= 23.0 for start, end in found.intervals)
    assert found.channels == {"wheel_1/power": pytest.approx(1.0)}


def test_a_ripple_is_found_by_its_order_and_noise_has_none() -> None:
    speed = 5.0 + 3.0 * np.sin(0.4 * POWER_TIME)
    angle = np.cumsum(speed) * 0.02
    noise = np.random.default_rng(1).standard_normal(len(angle))
    made: Recorded = evolve(
        recorded_drive(shipped_robot("reference")),
        encoder_time=POWER_TIME - 0.0025,
        position=np.stack([angle] * 3, axis=1),
    )
    channels = (_channel(noise),)
    swinging = 0.1 * speed * np.sin(7.0 * angle + 0.4) + 0.2 * noise
    assert ripple_orders(made, channels, [swinging], [speed])[0] == pytest.approx(7.0, abs=0.02)
    assert ripple_orders(made, channels, [0.2 * noise], [speed]) == ()


def test_what_has_no_name_is_found_with_its_wheel_and_variable(
    forward: Forward,  # noqa: F811
) -> None:
    """A torque with a peak at one speed of wheel 3, outside the vocabulary."""
    robot = forward.robot
    speed = forward.run(robot)["speed"]
    torque = np.zeros((1, *speed.shape))
    moving = np.tanh(speed[:, 2] / 0.1)
    torque[0, :, 2] = 0.15 * np.exp(-(((np.abs(speed[:, 2]) - 4.0) / 1.5) ** 2)) * moving
    study, found = searched(forward, forward.respond(robot, torque)[0], ())
    columns = columns_at(study, found.best.model, ())
    first, *others = leftovers(study, found.best, columns, found, robot, 0.3)
    assert first.family.variable == "wheel speed [rad/s]"
    assert first.wheels == (2,)
    assert first.evidence > max(20.0, 1.2 * others[0].evidence)
    peak = first.shapes[0].at[np.argmax(first.shapes[0].value)]
    assert peak == pytest.approx(4.0, abs=1.0)
