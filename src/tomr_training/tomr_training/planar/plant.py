"""A robot in a training drive: the planar dynamics of the power model, disturbed and on a floor."""

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import batch
from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.numbers import laid_out, timing_of
from tomr_power_model.dynamics.simulation import Excitation, Readout, Steps, Variant, drive, shown
from tomr_power_model.dynamics.vehicle import Vehicle, vehicle_of
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive
from tomr_training.labels import GroundTruth
from tomr_training.planar.faults import CHANGES, DRAG, number
from tomr_training.planar.schedule import (
    TICK,
    counted_shares,
    disturbed,
    end_of,
    period_at,
    tick_count,
)

Array = NDArray[np.float64]

_CREEP = 0.05  # m/s: slower motion is resisted by less than the whole drag of a load


@frozen
class Motion:
    """What a robot did in a drive, in m steps of the simulation."""

    variant: Variant
    excitation: Excitation
    steps: Steps
    step: float  # s
    ticks: int

    @property
    def reported(self) -> Array:
        """Angles that encoders without quanta report at the ends of the steps [rad], (m + 1, 3)."""
        shares = counted_shares(self.excitation.inputs)
        shares = np.repeat(shares, len(self.steps.shown) // len(shares), axis=0)
        return integral(self.steps.shown * shares, self.step)

    @property
    def truth(self) -> GroundTruth:
        """Power, reported speed and slip in each tick, (ticks, 3)."""
        return GroundTruth(
            power=self.tick_means(self.steps.power),
            speed=self._tick_changes(self.reported) / TICK,
            slip=self.tick_means(np.abs(self.steps.gap)),
        )

    def tick_means(self, values: Array) -> Array:
        """Means in each tick of what has a mean for each step, (ticks, 3)."""
        return self._tick_changes(integral(values, self.step)) / TICK

    def _tick_changes(self, ends: Array) -> Array:
        edges = np.arange(self.ticks + 1, dtype=np.float64) * TICK
        return np.diff(at_times(ends, self.step, edges), axis=0)

    def monitored(self, time: Array, span: float) -> tuple[Array, Array]:
        """What power sensors average over the span before some times (k,).

        Returns power of the drivers [W], (k, 3), and the supply's voltage [V], (k,).
        """
        count = len(time)
        kinds = [(batch.POWER, wheel) for wheel in range(WHEELS)] + [(batch.SUPPLY_VOLTAGE, 0)]
        rows = [(*kind, k * count, (k + 1) * count) for k, kind in enumerate(kinds)]
        readout = Readout(
            np.array(rows), np.tile(time, len(kinds)), np.full(count * len(kinds), span)
        )
        values = shown(self.variant, self.excitation, self.steps, readout)
        values = values.reshape(len(kinds), count)
        return values[:WHEELS].T, values[WHEELS]


def run_plant(chosen: Drive) -> Motion:
    """Drive the robot as it really is, with all that befalls it."""
    inputs = disturbed(chosen, chosen.plant)
    vehicle = _on_its_floor(chosen)
    for fault in chosen.mission.faults:
        if DRAG in fault.settings:
            free = _run(vehicle, inputs, chosen.plant, chosen)
            inputs[:, at.PUSH : at.PUSH + 2] += _drag(chosen, fault, free)
    return _run(vehicle, inputs, chosen.plant, chosen, _changes(chosen))


def _changes(chosen: Drive) -> list[tuple[int, Array]]:
    """Periods from which on faults make another robot of it, and that robot's numbers."""
    faults = [fault for fault in chosen.mission.faults if fault.fault_id in CHANGES]
    edges = {edge for fault in faults for edge in (fault.start, end_of(fault, chosen))}
    period = timing_of(chosen.plant.controller.rate).period
    found = []
    for edge in sorted(edge for edge in edges if edge < chosen.length - period):
        robot = chosen.plant
        for fault in faults:
            if fault.start <= edge < end_of(fault, chosen):
                robot = CHANGES[fault.fault_id](robot, fault)
        changed = laid_out(_on_its_floor(evolve(chosen, plant=robot)))
        found.append((period_at(edge, period), changed))
    return found


def _drag(chosen: Drive, fault: PlannedFault, free: Motion) -> Array:
    """Dry drag against the motion that there would be without it [N], (periods, 2)."""
    rolling = free.steps.speed - free.steps.gap / chosen.plant.wheel_radius
    twist = rolling @ wheels_to_twist(chosen.plant).T
    heading = integral(free.steps.yaw_rate[:, None], free.step)[:-1, 0]
    cos, sin = np.cos(heading), np.sin(heading)
    velocity = np.stack(
        [cos * twist[:, 0] - sin * twist[:, 1], sin * twist[:, 0] + cos * twist[:, 1]], axis=1
    )
    speed = np.hypot(np.hypot(*velocity.T), _CREEP)
    force = -number(fault, DRAG) * velocity / speed[:, None]
    start, end = fault.start, end_of(fault, chosen)
    time = free.step * np.arange(len(force))
    force[(time < start) | (time >= end)] = 0.0
    per_period = len(force) // len(free.excitation.inputs)
    return np.asarray(force.reshape(-1, per_period, 2).mean(axis=1))


def _on_its_floor(chosen: Drive) -> Vehicle:
    mission, robot = chosen.mission, chosen.plant
    friction = {"friction": mission.floor_friction}
    physics = {**robot.physics, "contact.slip": (friction, friction, friction)}
    loaded = evolve(robot, mass=robot.mass + mission.payload, physics=physics)
    return evolve(vehicle_of(loaded), encoder_quantum=robot.sensors.encoder_resolution)


def _run(
    vehicle: Vehicle,
    inputs: Array,
    robot: Robot,
    chosen: Drive,
    changes: Sequence[tuple[int, Array]] = (),
) -> Motion:
    excitation, variant = from_rest(inputs), Variant(laid_out(vehicle))
    steps = drive(variant, excitation, changes=changes)
    step = timing_of(robot.controller.rate).step
    return Motion(variant, excitation, steps, step, tick_count(chosen))


def from_rest(inputs: Array) -> Excitation:
    """A drive that begins at rest, by the inputs of its periods."""
    return Excitation(0.0, inputs, np.zeros(3), np.zeros(3), 0.0, np.zeros(WHEELS))


def integral(means: Array, step: float) -> Array:
    """Integral of what has a mean for each step, at the ends of the steps, (m + 1, ...)."""
    found = np.zeros((len(means) + 1, *means.shape[1:]))
    np.cumsum(means * step, axis=0, out=found[1:])
    return found


def at_times(ends: Array, step: float, time: Array) -> Array:
    """Values at the ends of the steps (m + 1, c), read at times (k,), linear between."""
    place = time / step
    low = np.clip(place.astype(np.int64), 0, len(ends) - 2)
    share = (place - low)[:, None]
    return np.asarray(ends[low] + share * (ends[low + 1] - ends[low]))
