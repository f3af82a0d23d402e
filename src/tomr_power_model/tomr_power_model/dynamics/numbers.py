"""A vehicle's numbers, discretised and laid out as the step reads them."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.contacts import SLIDING_PARTS
from tomr_power_model.dynamics.vehicle import Vehicle, WheelPlace, plant_numbers
from tomr_power_model.effects import EFFECTS, LAWS, NEVER_SLIDES, PlantNumbers
from tomr_power_model.robot import GRAVITY

Array = NDArray[np.float64]

COARSEST = 0.005  # s, of a step
_FAST = 0.4  # of it: drivers with a shorter period are taken as continuous
_SIDEWAYS = 1e-9  # cosine below which a wheel has no grip in its driving direction


@frozen
class Timing:
    """The drivers' period [s], in equal steps."""

    period: float
    steps: int
    continuous: bool

    @property
    def step(self) -> float:
        """Duration of a step [s]."""
        return self.period / self.steps


def timing_of(rate: float) -> Timing:
    """Periods of drivers of a rate [Hz]; far faster ones are continuous, in steps of COARSEST."""
    if rate * _FAST * COARSEST > 1.0:
        return Timing(COARSEST, 1, True)
    period = 1.0 / rate
    return Timing(period, max(1, math.ceil(period / COARSEST - 1e-9)), False)


def law_offsets() -> dict[str, int]:
    """Where the parameters of each effect with a law stand in a wheel's record.

    A flag that it is there comes first.
    """
    offsets, place = {}, at.LAWS_START
    for effect_id, effect in EFFECTS.items():
        if any(getattr(effect, law) is not None for law in LAWS):
            offsets[effect_id] = place
            place += 1 + len(effect.parameters)
    return offsets


def record_length() -> int:
    """Length of a wheel's record."""
    offsets = law_offsets()
    if not offsets:
        return at.LAWS_START
    last = max(offsets, key=lambda effect_id: offsets[effect_id])
    return offsets[last] + 1 + len(EFFECTS[last].parameters)


@frozen
class Geometry:
    """Rows of the wheels' contacts, (n, 3) each, per twist of the body."""

    roll: Array  # wheel speed, rolling
    along: Array  # sliding in the rollers' free direction
    grip: Array  # effective radius: speed of the gripping direction per wheel speed [m], (n,)
    places: Array  # of the contacts [m], (n, 2)

    @classmethod
    def of(cls, wheels: Sequence[WheelPlace], radii: Sequence[float]) -> "Geometry":
        """From places and effective radii [m]."""
        rows = [_rows(wheel, radius) for wheel, radius in zip(wheels, radii, strict=True)]
        return cls(
            roll=np.array([row[0] for row in rows]),
            along=np.array([row[1] for row in rows]),
            grip=np.array([row[2] for row in rows]),
            places=np.array([[wheel.x, wheel.y] for wheel in wheels]),
        )


def _rows(wheel: WheelPlace, radius: float) -> tuple[Array, Array, float]:
    """Rolling row, free row, and effective radius of a wheel.

    Along the direction that its rollers do not give, contact and rim move as one:
    a . (v + omega x p) = r omega_wheel a . t.
    """
    free = wheel.drive + 0.5 * math.pi if wheel.roller is None else wheel.roller
    held = free - 0.5 * math.pi

    def row(angle: float) -> Array:
        x, y = math.cos(angle), math.sin(angle)
        return np.array([x, y, wheel.x * y - wheel.y * x])

    share = math.cos(held - wheel.drive)
    if share < 0.0:  # grip counts forwards
        held, share = held + math.pi, -share
    if share < _SIDEWAYS:
        raise ValueError(f"a wheel at ({wheel.x:g}, {wheel.y:g}) m drives along its rollers")
    return row(held) / (radius * share), row(free), radius * share


def wheel_records(p: Array) -> Array:
    """The part of a layout that has one row for each wheel, a view, (n, stride)."""
    return p[at.HEADER : int(p[at.COUPLING])].reshape(-1, int(p[at.STRIDE]))


def laid_out(vehicle: Vehicle) -> Array:
    """All numbers of a vehicle as `layout` has them."""
    n, effects = vehicle.count, plant_numbers(vehicle)
    stride = record_length()
    first = at.HEADER + n * stride
    p = np.zeros(first + 4 * n * n + n * n)
    geometry = Geometry.of(vehicle.wheels, effects.radius)
    timing = timing_of(vehicle.controller.rate)
    p[at.STRIDE], p[at.COUPLING], p[at.TRACTION] = stride, first, first + 4 * n * n
    _controller(p, vehicle, timing)
    _body(p, vehicle, effects)
    records = wheel_records(p)
    _motors(records, vehicle, effects, timing)
    _wheels(records, vehicle, effects, geometry)
    _laws(records, vehicle)
    _flags(p, records, vehicle, effects)
    _discretise(p, records, geometry, timing)
    return p


def _controller(p: Array, vehicle: Vehicle, timing: Timing) -> None:
    given = vehicle.controller
    ramp = given.acceleration_limit * timing.period or math.inf
    p[at.PERIOD], p[at.SUBSTEPS], p[at.STEP] = timing.period, timing.steps, timing.step
    p[at.CONTINUOUS] = timing.continuous
    p[at.BACKWARD] = given.integrator == "backward"
    p[at.PROPORTIONAL], p[at.INTEGRAL_GAIN] = given.proportional, given.integral
    p[at.LINEAR_STEP], p[at.YAW_STEP] = ramp, ramp / vehicle.ramp_radius
    p[at.VOLTAGE] = vehicle.supply.nominal_voltage
    p[at.AUXILIARY] = vehicle.supply.auxiliary_power


def _body(p: Array, vehicle: Vehicle, effects: PlantNumbers) -> None:
    m, (x, y) = effects.mass, effects.mass_center
    inertia = np.array(
        [
            [m, 0.0, -m * y],
            [0.0, m, m * x],
            [-m * y, m * x, vehicle.inertia_z + m * (x * x + y * y)],
        ]
    )
    p[at.MASS], p[at.CENTER_X], p[at.CENTER_Y] = m, x, y
    p[at.FLOOR_X], p[at.FLOOR_Y] = m * GRAVITY * np.array(effects.floor_force)
    p[at.SAG], p[at.SUPPLY_SCALE] = effects.voltage_drop, effects.supply_scale
    p[at.INERTIA : at.INERTIA + 9] = inertia.ravel()
    p[at.MOBILITY : at.MOBILITY + 9] = np.linalg.inv(inertia).ravel()


def _motors(records: Array, vehicle: Vehicle, effects: PlantNumbers, timing: Timing) -> None:
    for record, motor in zip(records, vehicle.motors, strict=True):
        record[at.CONSTANT] = motor.wheel_constant
        record[at.RESISTANCE] = motor.resistance
        record[at.GEAR] = motor.gear_ratio
        record[at.ROTOR] = motor.gear_ratio**2 * motor.rotor_inertia
    records[:, at.VISCOUS] = effects.viscous
    k, resistance = records[:, at.CONSTANT], records[:, at.RESISTANCE]
    back = vehicle.controller.proportional if timing.continuous else 0.0
    records[:, at.DAMPING] = k * (k + back) / resistance + records[:, at.VISCOUS]
    records[:, at.AXLE_INERTIA] = vehicle.wheel_inertia + records[:, at.ROTOR]
    records[:, at.THERMAL_RESISTANCE] = effects.thermal_resistance
    times = np.array(effects.thermal_time)
    slow = times > 0.0
    rate = np.divide(timing.step, times, out=np.full(len(times), np.inf), where=slow)
    records[:, at.THERMAL_KEEP] = np.exp(-rate)
    records[:, at.INITIAL_RISE] = effects.initial_rise
    records[:, at.POWER_SCALE], records[:, at.POWER_BIAS] = effects.power_scale, effects.power_bias
    records[:, at.POWER_LAG], records[:, at.POWER_DELAY] = effects.power_lag, effects.power_delay
    records[:, at.ENCODER_SCALE] = effects.encoder_scale
    records[:, at.ENCODER_COSINE : at.ENCODER_SINE + 1] = effects.encoder_eccentricity


def _wheels(records: Array, vehicle: Vehicle, effects: PlantNumbers, geometry: Geometry) -> None:
    nominal = Geometry.of(vehicle.wheels, [vehicle.wheel_radius] * vehicle.count)
    records[:, at.ROLL : at.ROLL + 3] = geometry.roll
    records[:, at.ASK : at.ASK + 3] = nominal.roll
    records[:, at.ALONG : at.ALONG + 3] = geometry.along
    records[:, at.TO_TWIST : at.TO_TWIST + 3] = np.linalg.pinv(geometry.roll).T
    records[:, at.RADIUS] = geometry.grip
    records[:, at.NOMINAL_RADIUS] = vehicle.wheel_radius
    # Balance of forces and moments: sum N_i = m g, sum N_i p_i = m g c - m h a; where that leaves
    # a choice, loads are spread as evenly as they can be.
    places = np.array([*geometry.places.tolist(), *vehicle.casters])
    spread = np.linalg.pinv(np.vstack([np.ones(len(places)), places.T]))[: vehicle.count]
    weight = effects.mass * GRAVITY * np.array([1.0, *effects.mass_center])
    height = effects.mass * vehicle.mass_center[2]
    records[:, at.LOAD] = spread @ weight
    records[:, at.LOAD_X], records[:, at.LOAD_Y] = -height * spread[:, 1], -height * spread[:, 2]
    records[:, at.GRIP] = effects.grip
    records[:, at.QUANTUM] = vehicle.encoder_quantum
    plain = np.array([wheel.roller is None for wheel in vehicle.wheels])
    records[:, at.DRAG] = np.where(plain, records[:, at.GRIP], effects.axle_drag)
    slip = np.where(plain, 0.0, effects.roller_slip)
    records[:, at.ROLLER_SLIP] = slip * vehicle.wheel_radius


def _laws(records: Array, vehicle: Vehicle) -> None:
    for effect_id, place in law_offsets().items():
        names = list(EFFECTS[effect_id].parameters)
        for record, given in zip(records, vehicle.physics.get(effect_id, ()), strict=False):
            if given is not None:
                record[place] = 1.0
                record[place + 1 : place + 1 + len(names)] = [given[name] for name in names]


def _flags(p: Array, records: Array, vehicle: Vehicle, effects: PlantNumbers) -> None:
    drags, fades = bool(records[:, at.DRAG].any()), bool(records[:, at.ROLLER_SLIP].any())
    p[at.HOLDS], p[at.DRAGS] = drags and not fades, drags and fades
    p[at.SLIDES] = bool(np.any(records[:, at.GRIP] < NEVER_SLIDES))
    p[at.HEATS] = bool(np.any(effects.thermal_resistance)) or bool(np.any(effects.initial_rise))
    needed = any(EFFECTS[name].needs_load for name in vehicle.physics)
    p[at.LEANS] = drags or p[at.SLIDES] or needed


def _discretise(p: Array, records: Array, geometry: Geometry, timing: Timing) -> None:
    n, h, roll = len(records), timing.step, geometry.roll
    damping, axle = records[:, at.DAMPING], records[:, at.AXLE_INERTIA]
    body = p[at.INERTIA : at.INERTIA + 9].reshape(3, 3)
    inertia = body + roll.T @ (axle[:, None] * roll)
    # With V of D V = M V Lambda, V^T M V = 1: E = V e^(-h Lambda) V^T M, G likewise.
    rates, shapes = _modes(roll.T @ (damping[:, None] * roll), inertia)
    rates = np.maximum(rates, 0.0)
    held = np.where(rates * h > 1e-12, -np.expm1(-h * rates) / np.maximum(rates, 1e-300), h)
    gain = (shapes * held) @ shapes.T
    decay = (shapes * np.exp(-h * rates)) @ shapes.T @ inertia
    p[at.DECAY : at.DECAY + 9] = decay.ravel()
    p[at.GAIN : at.GAIN + 9] = gain.ravel()
    rows = np.vstack([roll, geometry.along])
    moves = gain @ rows.T
    records[:, at.FROM_ROLL : at.FROM_ROLL + 3] = moves[:, :n].T
    records[:, at.FROM_ALONG : at.FROM_ALONG + 3] = moves[:, n:].T
    first = int(p[at.COUPLING])
    # Row r of the coupling: what the force of row r does to every rate.
    p[first : first + 4 * n * n] = (rows @ moves).T.ravel()
    _discretise_sliding(p, records, geometry, h / SLIDING_PARTS)


def _modes(damping: Array, inertia: Array) -> tuple[Array, Array]:
    """Rates [1/s] and modes V of damping V = inertia V diag(rates), V^T inertia V = 1.

    By Cholesky, as scipy.linalg.eigh does it, which takes a node longer to import than to start.
    """
    back = np.linalg.inv(np.linalg.cholesky(inertia))
    rates, shapes = np.linalg.eigh(back @ damping @ back.T)
    return rates, back.T @ shapes


def _discretise_sliding(p: Array, records: Array, geometry: Geometry, part: float) -> None:
    n, radius = len(records), geometry.grip
    damping, axle = records[:, at.DAMPING], records[:, at.AXLE_INERTIA]
    decay = np.exp(-part * damping / axle)
    gain = (1.0 - decay) / damping
    directions = geometry.roll * radius[:, None]
    pull = part * p[at.MOBILITY : at.MOBILITY + 9].reshape(3, 3) @ directions.T
    coupling = directions @ pull + np.diag(radius**2 * gain)
    records[:, at.SLIDING_DECAY], records[:, at.SLIDING_GAIN] = decay, gain
    records[:, at.SLIDING_OWN] = np.diag(coupling)
    records[:, at.PULL : at.PULL + 3] = pull.T
    first = int(p[at.TRACTION])
    p[first : first + n * n] = np.linalg.inv(coupling).ravel()


@lru_cache(maxsize=8)
def no_input(wheels: int) -> tuple[float, ...]:
    """Inputs of a period in which nothing is asked for and nothing special happens."""
    u = [0.0] * at.input_size(wheels)
    u[at.SEEN_HEADING] = math.nan
    for wheel in range(wheels):
        first = at.INPUT_HEADER + wheel * at.INPUT_WHEEL
        u[first + at.SEEN_ANGLE] = math.nan
        u[first + at.CONNECTED] = u[first + at.COUNTS] = u[first + at.FLOOR] = 1.0
    return tuple(u)
