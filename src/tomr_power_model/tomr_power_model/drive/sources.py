"""The ways in which robots publish the power of their motors, one registered function each.

What a missing voltage means, live and offline: nothing makes one up, the current is compared. So a
reading's power is known only where the robot publishes it, or current and voltage of the supply;
`measurement.quantity` other than `power` says that the voltage does not belong to the current. A
supply that gives its voltage at times only is not compared where it does not. Fits need one unit:
they take the currents of a supply without any voltage at `supply.nominal_voltage`, modelled ones as
well, which compares currents still; a note says so. The whole robot's power is always in watts:
without a voltage it is unknown.
"""

from collections.abc import Callable, Iterator
from typing import Any

from attrs import frozen

from tomr_power_model.messages.intake import (
    NAN,
    Unusable,
    WheelFinder,
    battery_of,
    numbers_of,
    stamp_of,
)
from tomr_power_model.messages.types import BATTERY, JOINT_STATE, MULTI_ARRAY
from tomr_power_model.robot import WHEELS, Robot

# Topic of motor powers or currents in one array, in the order of the wheels.
ARRAY_TOPIC = "power"
VOLTAGE_TOPIC = "motor_voltage"  # that the drivers command, likewise
ENCODER_TOPIC = "joint_states"
TOTAL_TOPIC = "battery_state"
TOTAL = WHEELS  # in place of a wheel: the whole robot


@frozen
class PowerReading:
    """What one supply draws; NaN for what is not known."""

    wheel: int  # or TOTAL
    stamp_ns: int
    power: float  # W, NaN: the current is compared
    current: float  # A, of the supply or, by measurement.quantity, of the motor
    voltage: float  # of the supply [V]


@frozen
class PowerTopic:
    """A topic that carries power, and how to read its messages, received at some time [ns]."""

    topic: str
    type_name: str
    read: Callable[[Any, int], Iterator[PowerReading]]


Source = Callable[[Robot], tuple[PowerTopic, ...]]
SOURCES: dict[str, Source] = {}


def source(name: str) -> Callable[[Source], Source]:
    """Register a way of publishing motor power under its `measurement.source`."""

    def register(function: Source) -> Source:
        SOURCES[name] = function
        return function

    return register


def motor_topics(robot: Robot) -> tuple[PowerTopic, ...]:
    """Where the power of single motors comes from."""
    return SOURCES[robot.measurement.source](robot)


def total_topics(robot: Robot) -> tuple[PowerTopic, ...]:
    """Where the whole robot's power comes from."""

    def read(message: Any, receive_ns: int) -> Iterator[PowerReading]:
        voltage, current = battery_of(message)
        if voltage != voltage:
            raise Unusable("the voltage of the whole supply is missing")
        stamp = stamp_of(message, receive_ns)
        yield PowerReading(TOTAL, stamp, -voltage * current, -current, voltage)

    if robot.measurement.total != "battery_state":
        return ()
    return (PowerTopic(TOTAL_TOPIC, BATTERY, read),)


def _drawing(robot: Robot) -> Callable[[float], float]:
    """What a motor draws, from a reading: magnitudes may come with either sign."""
    return float if robot.measurement.signed else abs


@source("battery_state")
def battery_states(robot: Robot) -> tuple[PowerTopic, ...]:
    """One BatteryState per motor on `<wheel>/power`."""
    is_power, drawing = robot.measurement.quantity == "power", _drawing(robot)

    def reader(wheel: int) -> Callable[[Any, int], Iterator[PowerReading]]:
        def read(message: Any, receive_ns: int) -> Iterator[PowerReading]:
            voltage, current = battery_of(message)
            drawn = drawing(-current)
            power = voltage * drawn if is_power else NAN
            yield PowerReading(wheel, stamp_of(message, receive_ns), power, drawn, voltage)

        return read

    return tuple(
        PowerTopic(f"{name}/power", BATTERY, reader(wheel))
        for wheel, name in enumerate(robot.wheel_topics)
    )


@source("multi_array")
def multi_array(robot: Robot) -> tuple[PowerTopic, ...]:
    """One Float64MultiArray: motor powers [W] drawn, or currents [A] if so compared."""
    is_power, drawing = robot.measurement.quantity == "power", _drawing(robot)

    def read(message: Any, receive_ns: int) -> Iterator[PowerReading]:
        for wheel, value in enumerate(numbers_of(message, WHEELS)[:WHEELS]):
            power, current = (drawing(value), NAN) if is_power else (NAN, drawing(value))
            yield PowerReading(wheel, receive_ns, power, current, NAN)

    return (PowerTopic(ARRAY_TOPIC, MULTI_ARRAY, read),)


@source("joint_effort")
def joint_effort(robot: Robot) -> tuple[PowerTopic, ...]:
    """`JointState.effort` of the wheels as motor current [A], with the encoders."""
    wheels, drawing = WheelFinder(robot.wheel_names), _drawing(robot)

    def read(message: Any, receive_ns: int) -> Iterator[PowerReading]:
        stamp = stamp_of(message, receive_ns)
        efforts = () if wheels.is_others(message) else wheels.read(message).effort
        for wheel, current in enumerate(efforts):
            if current == current:  # not NaN
                yield PowerReading(wheel, stamp, NAN, drawing(current), NAN)

    return (PowerTopic(ENCODER_TOPIC, JOINT_STATE, read),)


@source("total_only")
def total_only(robot: Robot) -> tuple[PowerTopic, ...]:
    """No power of single motors."""
    return ()
