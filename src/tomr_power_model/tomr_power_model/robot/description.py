"""The robot as its owner describes it: frozen records made from flat dotted parameters."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import cast

from attrs import frozen

from tomr_power_model.effects import EFFECTS
from tomr_power_model.errors import InputError
from tomr_power_model.robot.held import too_steep
from tomr_power_model.robot.parameters import (
    SHARED_PARAMETERS,
    ParameterSpec,
    Value,
    check_all,
    nearest,
)
from tomr_power_model.robot.tables import MOTOR_PARAMETERS, ROBOT_PARAMETERS
from tomr_power_model.unmodelled import LearntTerm
from tomr_power_model.unmodelled.described import PREFIX, terms_of

WHEELS = 3
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_/-]{0,99}")
_LIGHTEST = 0.01  # share of the mass that a negative payload leaves
GRAVITY = 9.80665  # m/s^2

Parameters = Mapping[str, float]
PerWheel = tuple[Parameters | None, Parameters | None, Parameters | None]


@frozen
class Motor:
    """DC motor and ideal gear: v = R i + k_e omega_shaft [V], torque_wheel = k_e G i [N m]."""

    resistance: float  # ohm at 25 C
    torque_constant: float  # N m/A = V s/rad at the shaft
    gear_ratio: float  # motor turns per wheel turn
    rotor_inertia: float  # kg m^2

    @property
    def wheel_constant(self) -> float:
        """Torque at the wheel per ampere, and back-EMF per wheel speed [N m/A = V s/rad]."""
        return self.torque_constant * self.gear_ratio


@frozen
class Controller:
    """Wheel speed loop of the drivers."""

    rate: float  # Hz
    proportional: float  # V s/rad
    integral: float  # V/rad
    acceleration_limit: float  # m/s^2, 0: none
    delay: float  # s
    integrator: str  # backward: the sum holds the present error; forward: it does not yet


@frozen
class Supply:
    """Battery and what else it feeds."""

    nominal_voltage: float  # V
    auxiliary_power: float  # W


@frozen
class Sensors:
    """Rates, quanta and noise of the sensors; a simulator makes them, a band knows them."""

    encoder_rate: float  # Hz
    encoder_resolution: float  # rad at the wheel
    velocity_resolution: float  # rad/s at the wheel
    power_rate: float  # Hz
    power_window: float  # s, averaged before the stamp
    voltage_resolution: float  # V
    current_resolution: float  # A
    voltage_noise: float  # V
    current_noise: float  # A
    imu_rate: float  # Hz
    gyro_noise: float  # rad/s
    accelerometer_noise: float  # m/s^2
    odometry_rate: float  # Hz


@frozen
class Measurement:
    """How this robot publishes its power."""

    source: str
    quantity: str
    signed: bool
    total: str
    motor_voltage: bool = False  # whether drivers publish the voltages that they command


@frozen
class Robot:
    """All that is known of a robot before it moves. Units as in robot.yaml (SI)."""

    wheel_names: tuple[str, str, str]
    wheel_offset: float
    robot_radius: float
    wheel_radius: float
    wheel_inertia: float
    mass: float
    inertia_z: float
    mass_center: tuple[float, float, float]
    motors: tuple[Motor, Motor, Motor]
    controller: Controller
    supply: Supply
    sensors: Sensors
    measurement: Measurement
    physics: Mapping[str, PerWheel]
    unmodelled: tuple[LearntTerm, ...] = ()  # what was learnt and has no name
    imu_rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)  # rad, of the IMU in base_link

    @property
    def wheel_topics(self) -> tuple[str, str, str]:
        """Topic prefix of each wheel: its joint name without `_joint`."""
        first, second, third = (name.removesuffix("_joint") for name in self.wheel_names)
        return first, second, third

    def effect(self, effect_id: str, wheel: int = 0) -> Parameters | None:
        """Parameters of an effect at a wheel, None where it is left out."""
        per_wheel = self.physics.get(effect_id)
        return None if per_wheel is None else per_wheel[wheel]

    def everywhere(self, effect_id: str, key: str, absent: float = 0.0) -> tuple[float, ...]:
        """One parameter of an effect at the three wheels, `absent` where it is left out."""
        settings = (self.effect(effect_id, wheel) for wheel in range(WHEELS))
        return tuple(
            absent if setting is None else setting.get(key, absent) for setting in settings
        )


def robot_from_parameters(values: Mapping[str, object], place: str) -> Robot:
    """Make a Robot from flat dotted parameters, e.g. {"robot.mass": 15.0, ...}.

    `place` names the file or node in errors. Raises InputError for anything missing, unknown,
    non-finite or out of range.
    """
    checked = check_all(ROBOT_PARAMETERS, values, place)
    names = cast(tuple[str, str, str], checked["robot.wheel_names"])
    if len(set(names)) != WHEELS or not all(_NAME.fullmatch(name) for name in names):
        raise InputError(
            f"{place}: robot.wheel_names = {list(names)}: give three different names of letters, "
            "digits and _ / -, as joints and topics have"
        )
    _reject_unknown(values, names, place)
    number = _Group(checked)
    physics = _physics(values, names, place)
    _check_payload(number("robot.mass"), physics, place)
    robot = Robot(
        wheel_names=names,
        wheel_offset=number("robot.wheel_offset"),
        robot_radius=number("robot.robot_radius"),
        wheel_radius=number("robot.wheel_radius"),
        wheel_inertia=number("robot.wheel_inertia"),
        mass=number("robot.mass"),
        inertia_z=number("robot.inertia_z"),
        mass_center=cast(tuple[float, float, float], checked["robot.mass_center"]),
        imu_rpy=cast(tuple[float, float, float], checked["robot.imu_rpy"]),
        motors=_motors(checked, values, names, place),
        controller=Controller(
            **number.group("controller"), integrator=str(checked["controller.integrator"])
        ),
        supply=Supply(**number.group("supply")),
        sensors=Sensors(**number.group("sensors")),
        measurement=Measurement(
            source=str(checked["measurement.source"]),
            quantity=str(checked["measurement.quantity"]),
            signed=bool(checked["measurement.signed"]),
            total=str(checked["measurement.total"]),
            motor_voltage=bool(checked["measurement.motor_voltage"]),
        ),
        physics=MappingProxyType(physics),
        unmodelled=terms_of(values, names, place),
    )
    _check_held(robot, place)
    return robot


def why_not_held(robot: Robot, term: LearntTerm) -> str:
    """Why a learnt term would make a robot's loop unstable, in words; empty if it would not."""
    return too_steep(
        term,
        constants=[motor.wheel_constant for motor in robot.motors],
        resistances=[motor.resistance for motor in robot.motors],
        proportional=robot.controller.proportional,
        wheel_radius=robot.wheel_radius,
    )


def _check_held(robot: Robot, place: str) -> None:
    for number, term in enumerate(robot.unmodelled, start=1):
        why = why_not_held(robot, term)
        if why:
            raise InputError(
                f"{place}: unmodelled: learnt term {number} ({term.family.family_id}): {why}: the "
                "loop would not be stable: learn it anew with more drives, or remove it"
            )


def _check_payload(mass: float, physics: Mapping[str, PerWheel], place: str) -> None:
    payload = (physics.get("body.payload_mass") or (None,))[0]
    if payload is not None and mass + payload["mass"] < _LIGHTEST * mass:
        raise InputError(
            f"{place}: physics.body.payload_mass.mass = {payload['mass']:g} kg leaves nothing of "
            f"robot.mass = {mass:g} kg: give a smaller one"
        )


class _Group:
    """Reads numbers out of the checked table."""

    def __init__(self, checked: Mapping[str, Value]) -> None:
        self._checked = checked

    def __call__(self, name: str) -> float:
        return cast(float, self._checked[name])

    def group(self, prefix: str) -> dict[str, float]:
        start = prefix + "."
        return {
            name.removeprefix(start): value
            for name, value in self._checked.items()
            if name.startswith(start) and isinstance(value, float)
        }


def _motors(
    checked: Mapping[str, Value], values: Mapping[str, object], names: tuple[str, ...], place: str
) -> tuple[Motor, Motor, Motor]:
    motors = []
    for name in names:
        numbers: dict[str, float] = {}
        for spec in MOTOR_PARAMETERS:
            key = spec.name.removeprefix("motor.")
            override = f"motor.{name}.{key}"
            raw = checked[spec.name]
            if override in values:
                raw = spec.check(values[override], f"{place}: {override}")
            numbers[key] = cast(float, raw)
        motors.append(Motor(**numbers))
    return motors[0], motors[1], motors[2]


def split_effect(key: str) -> tuple[str, str] | None:
    """(effect id, rest) of physics.<effect id>.<rest>; None for another key."""
    for effect_id in EFFECTS:
        prefix = f"physics.{effect_id}."
        if key.startswith(prefix):
            return effect_id, key.removeprefix(prefix)
    return None


def _physics(
    values: Mapping[str, object], names: tuple[str, ...], place: str
) -> dict[str, PerWheel]:
    shared: dict[str, dict[str, float]] = {}
    own: dict[str, dict[str, dict[str, float]]] = {}
    for key, value in values.items():
        parts = split_effect(key)
        if parts is None:
            continue
        effect_id, rest = parts
        name = next((name for name in names if rest.startswith(name + ".")), None)
        parameter = rest if name is None else rest.removeprefix(name + ".")
        number = _effect_parameter(effect_id, parameter, key, value, place)
        if name is None:
            shared.setdefault(effect_id, {})[parameter] = number
        else:
            own.setdefault(effect_id, {}).setdefault(name, {})[parameter] = number
    physics: dict[str, PerWheel] = {}
    for effect_id in EFFECTS:
        if effect_id not in shared and effect_id not in own:
            continue
        wheels = [
            _complete(effect_id, shared.get(effect_id), own.get(effect_id, {}).get(name), place)
            for name in names
        ]
        physics[effect_id] = (wheels[0], wheels[1], wheels[2])
    return physics


def _effect_parameter(effect_id: str, parameter: str, key: str, value: object, place: str) -> float:
    known = EFFECTS[effect_id].parameters
    if parameter not in known:
        raise InputError(f"{place}: {key} is unknown: {effect_id} takes {', '.join(known)}")
    return cast(float, effect_spec(effect_id, parameter, key).check(value, place))


def effect_spec(effect_id: str, parameter: str, key: str) -> ParameterSpec:
    """What an effect's number may be, under the key that a description gives it by."""
    described = EFFECTS[effect_id].parameters[parameter]
    return ParameterSpec(
        key,
        f"of {effect_id}",
        unit=described.unit,
        minimum=described.minimum,
        maximum=described.maximum,
    )


def _complete(
    effect_id: str,
    shared: dict[str, float] | None,
    own: dict[str, float] | None,
    place: str,
) -> Parameters | None:
    if shared is None and own is None:
        return None
    known = EFFECTS[effect_id].parameters
    defaults = {key: item.default for key, item in known.items() if item.default is not None}
    merged = {**defaults, **(shared or {}), **(own or {})}
    missing = [key for key in known if key not in merged]
    if missing:
        raise InputError(f"{place}: physics.{effect_id}.{missing[0]} is missing: add it")
    return MappingProxyType(merged)


def _reject_unknown(values: Mapping[str, object], names: tuple[str, ...], place: str) -> None:
    fixed = {spec.name for spec in ROBOT_PARAMETERS}
    overrides = {
        f"motor.{name}.{spec.name.removeprefix('motor.')}"
        for name in names
        for spec in MOTOR_PARAMETERS
    }
    shared = {spec.name: spec for spec in SHARED_PARAMETERS}
    for key in values:
        if key in fixed or key in overrides or split_effect(key) or key.startswith(PREFIX):
            continue
        if key in shared:
            shared[key].check(values[key], place)
            continue
        near = closest(key, [*fixed, *(f"physics.{effect}" for effect in EFFECTS)])
        raise InputError(f"{place}: {key} is unknown: {near}")


def closest(word: str, known: list[str]) -> str:
    """A hint for a mistyped word."""
    found = nearest(word, known)
    return f"did you mean {found}?" if found else "remove it"
