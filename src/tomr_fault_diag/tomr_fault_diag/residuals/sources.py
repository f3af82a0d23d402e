"""The ways in which robots publish the power of their motors, one registered function each."""

from collections.abc import Callable
from typing import Any

from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.inputs import (
    BATTERY,
    JOINT_STATE,
    MULTI_ARRAY,
    Input,
    encoder_taker,
    guarded,
)
from tomr_power_model.messages.intake import (
    NAN,
    Unusable,
    WheelFinder,
    battery_of,
    numbers_of,
    stamp_of,
)
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import WHEELS, Robot

# Topic of motor powers or currents in one array, in the order of the wheels.
ARRAY_TOPIC = "power"

Source = Callable[[Robot, ResidualStage], tuple[Input, ...]]
SOURCES: dict[str, Source] = {}


def source(name: str) -> Callable[[Source], Source]:
    """Register a way of publishing motor power under its `measurement.source`."""

    def register(function: Source) -> Source:
        SOURCES[name] = function
        return function

    return register


@source("battery_state")
def battery_states(robot: Robot, stage: ResidualStage) -> tuple[Input, ...]:
    """One BatteryState per motor on `<wheel>/power`."""

    def taker(wheel: int) -> Callable[[Any, int], str | None]:
        def take(message: Any, receive_ns: int) -> Arrival:
            voltage, current = battery_of(message)
            return stage.motor(wheel, stamp_of(message, receive_ns), voltage, current)

        return guarded(take)

    return tuple(
        Input(f"{topic}/power", BATTERY, taker(wheel))
        for wheel, topic in enumerate(robot.wheel_topics)
    )


@source("multi_array")
def multi_array(robot: Robot, stage: ResidualStage) -> tuple[Input, ...]:
    """One Float64MultiArray: motor powers [W] drawn, or currents [A] if so compared."""
    is_power = robot.measurement.quantity == "power"

    def take(message: Any, receive_ns: int) -> Arrival | None:
        arrival = None
        for wheel, value in enumerate(numbers_of(message, WHEELS)[:WHEELS]):
            # A power is a current at -1 V: the one path below it asks for voltage and current.
            arrival = stage.motor(wheel, receive_ns, 1.0 if is_power else NAN, -value)
        return arrival

    return (Input(ARRAY_TOPIC, MULTI_ARRAY, guarded(take)),)


@source("joint_effort")
def joint_effort(robot: Robot, stage: ResidualStage) -> tuple[Input, ...]:
    """`JointState.effort` of the wheels as motor current [A], with the encoders."""
    wheels = WheelFinder(robot.wheel_names)
    encoders = encoder_taker(robot, stage.encoders)

    def take(message: Any, receive_ns: int) -> Arrival | str:
        arrival = encoders(message, receive_ns)
        if arrival is Arrival.TAKEN:
            for wheel, current in enumerate(wheels.read(message).effort):
                if current == current:  # not NaN
                    stage.motor(wheel, stamp_of(message, receive_ns), NAN, -current)
        return arrival

    return (Input("joint_states", JOINT_STATE, guarded(take)),)


@source("total_only")
def total_only(robot: Robot, stage: ResidualStage) -> tuple[Input, ...]:
    """No power of single motors: their residuals are STALE."""
    return ()


def residual_inputs(
    robot: Robot, stage: ResidualStage, wheels: WheelFinder | None = None
) -> tuple[Input, ...]:
    """Measured inputs of the residual stage, besides the predictions."""

    def supply(message: Any, receive_ns: int) -> Arrival:
        return stage.supply(stamp_of(message, receive_ns), *_with_voltage(message))

    inputs = list(SOURCES[robot.measurement.source](robot, stage))
    if not any(item.topic == "joint_states" for item in inputs):
        taker = encoder_taker(robot, stage.encoders, wheels)
        inputs.append(Input("joint_states", JOINT_STATE, guarded(taker)))
    if robot.measurement.total == "battery_state":
        inputs.append(Input("battery_state", BATTERY, guarded(supply)))
    return tuple(inputs)


def _with_voltage(message: Any) -> tuple[float, float]:
    voltage, current = battery_of(message)
    if voltage != voltage:
        raise Unusable("the voltage of the whole supply is missing")
    return voltage, current
