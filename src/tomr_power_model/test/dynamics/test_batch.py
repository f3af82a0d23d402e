"""What sensors show of a drive: spans, scale, bias, lag and delay, worked by hand."""

import os
from collections.abc import Callable, Mapping

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.dynamics import batch
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.simulation import (
    Excitation,
    Readout,
    Variant,
    drive,
    predict,
    worker_count,
)
from tomr_power_model.dynamics.vehicle import Vehicle

MakeVehicle = Callable[..., Vehicle]


def excitation() -> Excitation:
    """A start and a stop."""
    inputs = np.tile(no_input(3), (400, 1))
    inputs[20:200, at.COMMAND : at.COMMAND + 3] = 0.4, 0.1, 0.5
    return Excitation(10.0, inputs, np.zeros(3), np.zeros(3), 0.0, np.zeros(3))


def shown(
    vehicle: Vehicle,
    kind: int,
    time: np.ndarray,
    span: float,
    later: tuple[float, ...] = (0.0,),
    wheel: int = 1,
) -> np.ndarray:
    """Of wheel 2 if not another, (delays, times); times from the start."""
    channels = np.array([[kind, wheel, 0, len(time)]])
    readout = Readout(channels, 10.0 + time, np.full(len(time), span))
    return np.asarray(next(predict([Variant(laid_out(vehicle), 0, later)], excitation(), readout)))


@pytest.mark.parametrize("kind", ["SPEED", "POWER", "TOTAL", "SUPPLY_VOLTAGE", "YAW", "CURRENT"])
def test_spans_are_means_over_whole_steps(make_vehicle: MakeVehicle, kind: str) -> None:
    vehicle = make_vehicle(further={"electrical.supply_sag": {"resistance": 0.2}})
    steps = drive(Variant(laid_out(vehicle)), excitation())
    expected = {
        "SPEED": steps.speed[:, 1],
        "POWER": steps.power[:, 1],
        "TOTAL": steps.power.sum(axis=1) + 12.0,
        "SUPPLY_VOLTAGE": steps.voltage,
        "YAW": steps.yaw_rate,
        "CURRENT": steps.current[:, 1],
    }[kind]
    time = np.array([0.3, 0.6, 1.1, 1.5])
    found = shown(vehicle, getattr(batch, kind), time, 0.1)[0]
    means = [expected[round(200 * t) - 20 : round(200 * t)].mean() for t in time]
    np.testing.assert_allclose(found, means, rtol=1e-9)


def test_parts_of_a_step_of_all_wheels_add_up_to_the_total(make_vehicle: MakeVehicle) -> None:
    time = np.linspace(0.101, 0.2, 20)  # while power changes within the steps
    motors = sum(shown(make_vehicle(), batch.POWER, time, 0.002, wheel=i)[0] for i in range(3))
    total = shown(make_vehicle(), batch.TOTAL, time, 0.002)[0]
    np.testing.assert_allclose(total, motors + 12.0, rtol=1e-9)


def test_power_rises_within_a_step_as_the_simulation_says(make_vehicle: MakeVehicle) -> None:
    steps = drive(Variant(laid_out(make_vehicle())), excitation())
    half = shown(make_vehicle(), batch.POWER, np.array([0.1525]), 0.0025)[0]
    assert abs(steps.tilt[30, 1]) > 0.04
    np.testing.assert_allclose(half, steps.power[30, 1] - 0.25 * steps.tilt[30, 1], rtol=1e-9)


def test_an_instant_is_read_as_a_mean_around_it(make_vehicle: MakeVehicle) -> None:
    steps = drive(Variant(laid_out(make_vehicle())), excitation())
    found = shown(make_vehicle(), batch.SPEED, np.array([0.1525, 0.155]), 0.0)[0]
    between = 0.5 * (steps.speed[30, 1] + steps.speed[31, 1])
    np.testing.assert_allclose(found, [steps.speed[30, 1], between], rtol=1e-9)


def test_a_lagging_sensor_shows_what_its_lag_left(make_vehicle: MakeVehicle) -> None:
    vehicle = make_vehicle(further={"sensor.power_lag": {"time_constant": 0.1}})
    expected = drive(Variant(laid_out(vehicle)), excitation()).power[:, 1].copy()
    batch.follow(expected, np.zeros(400), 0.05)
    found = shown(vehicle, batch.POWER, np.array([0.3, 0.6, 1.1]), 0.005)[0]
    np.testing.assert_allclose(found, expected[[59, 119, 219]], rtol=1e-9)


def test_threads_are_as_many_as_the_environment_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert worker_count() == 3
    monkeypatch.setenv("OMP_NUM_THREADS", "")
    assert worker_count() == len(os.sched_getaffinity(0))


def test_all_of_a_drive_read_later(make_vehicle: MakeVehicle) -> None:
    time = np.linspace(0.4, 1.6, 30)
    found = shown(make_vehicle(), batch.POWER, time, 0.02, (0.0, 0.013))
    np.testing.assert_allclose(
        found[1], shown(make_vehicle(), batch.POWER, time - 0.013, 0.02)[0], atol=1e-9
    )


@pytest.mark.parametrize(
    ("sensor", "expected"),
    [
        ({"sensor.power_scale": {"scale": 1.1}, "sensor.power_bias": {"power": 0.5}}, 0.0),
        ({"sensor.clock_offset": {"delay": 0.03}}, 0.03),
        ({"sensor.clock_offset": {"delay": -0.02}}, -0.02),
    ],
)
def test_scale_bias_and_delay_are_the_power_sensors(
    make_vehicle: MakeVehicle, sensor: Mapping[str, Mapping[str, float]], expected: float
) -> None:
    true, flawed, time = make_vehicle(), make_vehicle(further=sensor), np.linspace(0.4, 1.6, 30)
    power = shown(true, batch.POWER, time - expected, 0.02)[0]
    scaled = 1.1 * power + 0.5 if expected == 0.0 else power
    np.testing.assert_allclose(shown(flawed, batch.POWER, time, 0.02)[0], scaled, atol=1e-9)
    for kind in (batch.SPEED, batch.TOTAL):
        untouched = (shown(item, kind, time, 0.02) for item in (true, flawed))
        np.testing.assert_array_equal(*untouched)


def test_a_lag_by_hand() -> None:
    # A step from 0 to 1 W at 1/10 of the time constant a step: 1 - e^(-k / 10).
    value = np.array([0.0] + [1.0] * 20)
    tilt = np.ones(21)
    batch.follow(value, tilt, 0.1)
    np.testing.assert_allclose(value, 1.0 - np.exp(-0.1 * np.arange(21)))
    assert not tilt.any()


def test_within_a_step_a_quantity_runs_straight() -> None:
    # A step of 0.1 s with mean 2 that rises by 4: from 0 to 4; at half time 0.05 s * mean 1.
    value, tilt, total = np.array([2.0, 5.0]), np.array([4.0, 0.0]), np.array([0.0, 0.2, 0.7])
    found = [batch.integral_at(value, tilt, total, 0.1, t) for t in (0.0, 0.05, 0.1, 0.15)]
    np.testing.assert_allclose(found, [0.0, 0.05, 0.2, 0.45])


def test_variants_do_not_know_of_each_other(make_vehicle: MakeVehicle) -> None:
    light, heavy = make_vehicle(), make_vehicle(mass=30.0)
    time = np.linspace(0.05, 1.95, 60)
    channels = np.array([[batch.POWER, wheel, 20 * wheel, 20 * wheel + 20] for wheel in range(3)])
    readout = Readout(channels, 10.0 + time, np.full(60, 0.02))
    variants = [Variant(laid_out(item)) for item in (light, heavy, light)]
    done: list[int] = []
    together = list(predict(variants, excitation(), readout, tick=done.append))
    alone = [next(predict([item], excitation(), readout)) for item in variants]
    np.testing.assert_array_equal(together, alone)
    assert not np.allclose(alone[0], alone[1])
    assert done == [1, 1, 1]


def test_torques_that_resist_besides(make_vehicle: MakeVehicle) -> None:
    """0.07 N m at wheel 2 take 0.1 A more."""
    numbers, given = laid_out(make_vehicle()), excitation()
    inputs = given.inputs.copy()
    inputs[20:, at.COMMAND : at.COMMAND + 3] = 0.4, 0.0, 0.0
    given = evolve(given, inputs=inputs)
    resisting = np.zeros((400, 3))
    resisting[:, 1] = 0.07
    free, braked = (
        drive(Variant(numbers, resisting=extra), given).current[-1] for extra in (None, resisting)
    )
    np.testing.assert_allclose(braked - free, [0.0, 0.1, 0.0], atol=1e-3)
