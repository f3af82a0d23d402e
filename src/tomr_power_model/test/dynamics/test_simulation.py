"""Properties that any vehicle with any effects must keep, and compiled code against plain."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from effect_samples import LARGE
from hypothesis import given, settings
from hypothesis import strategies as st

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, no_input
from tomr_power_model.dynamics.simulation import Excitation, Simulation, Steps, Variant, drive
from tomr_power_model.dynamics.vehicle import Vehicle
from tomr_power_model.effects import EFFECTS

MakeVehicle = Callable[..., Vehicle]
DriveVehicle = Callable[..., Any]
Physics = Mapping[str, Mapping[str, float]]

KINDS = st.sampled_from(["three_omni", "four_omni", "four_mecanum", "two_driven"])
SPEED = st.floats(-0.8, 0.8)
TWISTS = st.tuples(SPEED, SPEED, st.floats(-3.0, 3.0))
FEW = settings(max_examples=12, deadline=None)

EFFECT_IDS = st.sets(st.sampled_from(sorted(LARGE)), max_size=8)


def chosen(effect_ids: set[str]) -> Physics:
    return {effect_id: LARGE[effect_id] for effect_id in sorted(effect_ids)}


def legs(twists: list[tuple[float, float, float]], periods: int = 60) -> np.ndarray:
    return np.repeat(np.array(twists), periods, axis=0)


def compiled_drive(vehicle: Vehicle, commands: np.ndarray, late: int = 0) -> Steps:
    n = vehicle.count
    inputs = np.tile(no_input(n), (len(commands), 1))
    inputs[:, at.COMMAND : at.COMMAND + 3] = commands
    rest = np.zeros(3)
    excitation = Excitation(0.0, inputs, rest, rest, 0.0, np.zeros(n))
    return drive(Variant(laid_out(vehicle), late), excitation, n)


@given(twists=st.lists(TWISTS, min_size=2, max_size=2), effect_ids=EFFECT_IDS)
@FEW
def test_a_turn_by_120_degrees_only_moves_the_labels(
    make_vehicle: MakeVehicle,
    drive_vehicle: DriveVehicle,
    twists: list[tuple[float, float, float]],
    effect_ids: set[str],
) -> None:
    physics = chosen(effect_ids - {"body.slope", "body.mass_center_offset"})
    vehicle = make_vehicle(physics=physics)
    third = 2.0 * math.pi / 3.0
    cos, sin = math.cos(third), math.sin(third)
    commands = legs(twists)
    turned = commands @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    straight = drive_vehicle(vehicle, commands).steps.power
    other = drive_vehicle(vehicle, turned).steps.power
    # Holding forces are swept wheel by wheel: their order shows where they are not settled.
    assert np.abs(other - np.roll(straight, 1, axis=1)).mean() < 0.01
    assert np.abs(straight).max() > 1.0 or not np.abs(commands).max() > 0.1


@given(kind=KINDS, twists=st.lists(TWISTS, min_size=3, max_size=3))
@FEW
def test_energy_is_conserved(
    make_vehicle: MakeVehicle,
    drive_vehicle: DriveVehicle,
    kind: str,
    twists: list[tuple[float, float, float]],
) -> None:
    """Electrical energy = copper + friction + kinetic energy, over starts, turns and stops."""
    physics = {"friction.coulomb": {"torque": 0.06}, "friction.viscous": {"coefficient": 0.004}}
    vehicle = make_vehicle(kind, physics=physics, mass_center=(0.02, 0.0, 0.1))
    driven = drive_vehicle(vehicle, legs(twists, 100))
    steps, axle = driven.steps, 6.0e-4 + 20.0**2 * 5.0e-6
    electrical = 0.005 * float(steps.power.sum())
    copper = 0.005 * float(steps.copper.sum())
    friction = 0.005 * float((0.06 * np.abs(steps.speed) + 0.004 * steps.speed**2).sum())
    vx, vy, wz = driven.twist[-1]
    kinetic = 0.5 * 15.0 * (vx**2 + (vy + 0.02 * wz) ** 2) + 0.5 * 0.35 * wz**2
    kinetic += 0.5 * axle * float((driven.wheels[-1, :, at.SPEED] ** 2).sum())
    moved = 0.005 * float(np.abs(steps.torque * steps.speed).sum())
    assert electrical == pytest.approx(copper + friction + kinetic, abs=0.01 * moved + 1e-3)


@given(kind=KINDS, twists=st.lists(TWISTS, min_size=3, max_size=3), effect_ids=EFFECT_IDS)
@FEW
def test_compiled_is_plain(
    make_vehicle: MakeVehicle,
    drive_vehicle: DriveVehicle,
    kind: str,
    twists: list[tuple[float, float, float]],
    effect_ids: set[str],
) -> None:
    vehicle = make_vehicle(kind, physics=chosen(effect_ids), encoder_quantum=1e-3)
    plain = drive_vehicle(vehicle, legs(twists)).steps
    fast = compiled_drive(vehicle, legs(twists))
    for name in ("voltage", "yaw_rate", "speed", "power", "tilt", "current", "torque", "gap"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(plain, name), err_msg=name)


@given(kind=KINDS, seed=st.integers(0, 99), effect_ids=EFFECT_IDS)
@settings(max_examples=25, deadline=None)
def test_minutes_of_random_driving_stay_bounded(
    make_vehicle: MakeVehicle, kind: str, seed: int, effect_ids: set[str]
) -> None:
    """Three minutes, ten commands a second, stops among them; nothing runs away."""
    chance = np.random.default_rng(seed)
    twists = chance.uniform(-1.0, 1.0, (1800, 3)) * (1.0, 1.0, 4.0)
    twists[chance.random(1800) < 0.2] = 0.0
    vehicle = make_vehicle(kind, physics=chosen(effect_ids))
    steps = compiled_drive(vehicle, np.repeat(twists, 20, axis=0))
    assert np.isfinite(steps.power).all()
    assert np.abs(steps.speed).max() < 1.5 * 24.0 / 0.7  # free speed, and what braking adds
    assert np.abs(steps.current).max() < 2.5 * 24.0 / 0.8
    assert steps.voltage.min() > 11.9
    assert np.abs(steps.yaw_rate).max() < 12.0


def test_a_state_streamed_in_pieces_is_one_run(make_vehicle: MakeVehicle) -> None:
    vehicle = make_vehicle(physics=LARGE)
    commands = legs([(0.4, 0.1, 0.5), (-0.3, 0.0, 0.0), (0.0, 0.0, 0.0)])
    whole = compiled_drive(vehicle, commands)
    power, state = [], Simulation(vehicle).start()
    for first in range(0, len(commands), 7):
        simulation = Simulation(vehicle)  # anew each time: all memory is in the state
        asked = simulation.inputs()
        for command in commands[first : first + 7].tolist():
            asked[at.COMMAND : at.COMMAND + 3] = command
            out = Steps.of(np.array(simulation.advance(state, asked)), 3)
            power.append(out.power[0])
    np.testing.assert_array_equal(power, whole.power)


@pytest.mark.parametrize("effect_id", sorted(LARGE))
def test_neutral_parameters_are_the_effect_left_out(
    make_vehicle: MakeVehicle, drive_vehicle: DriveVehicle, effect_id: str
) -> None:
    parameters = EFFECTS[effect_id].parameters
    large = LARGE[effect_id]
    shapes = {"speed", "order", "phase", "azimuth", "time_constant", "slip"}
    neutral = {
        name: large[name] if name in shapes else parameter.neutral
        for name, parameter in parameters.items()
    }
    commands = legs([(0.4, 0.1, 0.5), (-0.3, 0.0, 0.0), (0.0, 0.0, 0.0)])
    without, idle, present = (
        drive_vehicle(make_vehicle(mass_center=(0.0,) * 3, physics=physics), commands).steps.power
        for physics in (
            {"friction.coulomb": {"torque": 0.06}},
            {"friction.coulomb": {"torque": 0.06}, effect_id: neutral},
            {"friction.coulomb": {"torque": 0.06}, effect_id: large},
        )
    )
    if effect_id != "friction.coulomb":
        np.testing.assert_allclose(idle, without, atol=1e-9)
    assert np.abs(present - without).max() > 0.02


def test_a_late_command_is_an_early_drive_shifted(make_vehicle: MakeVehicle) -> None:
    commands = legs([(0.0, 0.0, 0.0), (0.4, 0.1, 0.5), (0.0, 0.0, 0.0)])
    prompt, late = (compiled_drive(make_vehicle(), commands, late).power for late in (0, 13))
    np.testing.assert_allclose(late[13:], prompt[:-13], atol=1e-12)
    np.testing.assert_allclose(late[:60], prompt[:1].repeat(60, axis=0), atol=1e-12)


@given(kind=KINDS, twist=TWISTS)
@FEW
def test_a_drive_that_begins_steadily_goes_on_so(
    make_vehicle: MakeVehicle,
    drive_vehicle: DriveVehicle,
    kind: str,
    twist: tuple[float, float, float],
) -> None:
    vehicle = make_vehicle(kind, further={"electrical.supply_sag": {"resistance": 0.2}})
    if kind == "two_driven":
        twist = (twist[0], 0.0, twist[2])
    state = Simulation(vehicle).start(twist)
    wheels = Simulation(vehicle).start(twist)[at.STATE_HEADER + at.SPEED :: at.STATE_WHEEL]
    driven = drive_vehicle(vehicle, legs([twist], 40), state)
    moving = np.abs(wheels) > 0.5
    np.testing.assert_allclose(driven.twist[-1], twist, atol=0.01)
    np.testing.assert_allclose(driven.steps.voltage, driven.steps.voltage[-1], atol=0.01)
    np.testing.assert_allclose(
        driven.steps.power[0][moving], driven.steps.power[-1][moving], atol=0.3
    )
