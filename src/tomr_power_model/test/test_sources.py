"""Ways of publishing power: what each says, and what a missing voltage leaves."""

import math
from typing import Any

import pytest
from attrs import evolve

from tomr_power_model.drive.sources import (
    SOURCES,
    TOTAL,
    PowerReading,
    motor_topics,
    total_topics,
)
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.intake import Unusable
from tomr_power_model.messages.types import BATTERY, JOINT_STATE, MULTI_ARRAY
from tomr_power_model.robot import Robot, shipped_robot

NAN = float("nan")
REFERENCE = shipped_robot("reference")


def robot(source: str, quantity: str = "power") -> Robot:
    measurement = evolve(REFERENCE.measurement, source=source, quantity=quantity)
    return evolve(REFERENCE, measurement=measurement)


def battery(voltage: float, current: float) -> Any:
    return bag_message(BATTERY, header=bag_header(7), voltage=voltage, current=current)


def same(found: PowerReading, wheel: int, stamp: int, *numbers: float) -> bool:
    """Power, current and voltage, NaN like NaN."""
    given = (found.power, found.current, found.voltage)
    alike = [
        a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(given, numbers, strict=True)
    ]
    return (found.wheel, found.stamp_ns) == (wheel, stamp) and all(alike)


def test_every_source_of_robot_yaml_is_registered() -> None:
    spec_choices = {"battery_state", "multi_array", "joint_effort", "total_only"}
    assert set(SOURCES) == spec_choices
    assert motor_topics(robot("total_only")) == ()


@pytest.mark.parametrize(
    ("quantity", "voltage", "power"),
    [("power", 24.0, 12.0), ("power", NAN, NAN), ("supply_current", 24.0, NAN)],
)
def test_a_battery_state_has_power_only_with_its_own_voltage(
    quantity: str, voltage: float, power: float
) -> None:
    topic = motor_topics(robot("battery_state", quantity))[1]
    assert topic.topic == "wheel_2/power"
    (found,) = topic.read(battery(voltage, -0.5), 9)
    assert same(found, 1, 7, power, 0.5, voltage)


@pytest.mark.parametrize("reading", [0.5, -0.5])
def test_a_magnitude_may_have_either_sign(reading: float) -> None:
    def unsigned(source: str, quantity: str = "power") -> Robot:
        given = robot(source, quantity)
        return evolve(given, measurement=evolve(given.measurement, signed=False))

    (found,) = motor_topics(unsigned("battery_state"))[1].read(battery(24.0, reading), 9)
    assert same(found, 1, 7, 12.0, 0.5, 24.0)
    array = bag_message(MULTI_ARRAY, data=[reading, 0.0, 0.0])
    (powers,) = motor_topics(unsigned("multi_array"))
    assert same(next(powers.read(array, 9)), 0, 9, 0.5, NAN, NAN)
    efforts = bag_message(
        JOINT_STATE, header=bag_header(7), name=REFERENCE.wheel_names, effort=[reading, NAN, NAN]
    )
    (currents,) = motor_topics(unsigned("joint_effort", "motor_current"))
    assert same(next(currents.read(efforts, 9)), 0, 7, NAN, 0.5, NAN)


def test_an_array_holds_powers_or_currents() -> None:
    message = bag_message(MULTI_ARRAY, data=[1.0, -2.0, 3.0, 99.0])
    (powers,) = motor_topics(robot("multi_array"))
    assert same(list(powers.read(message, 9))[1], 1, 9, -2.0, NAN, NAN)
    (currents,) = motor_topics(robot("multi_array", "motor_current"))
    assert [item.wheel for item in currents.read(message, 9)] == [0, 1, 2]
    assert same(list(currents.read(message, 9))[2], 2, 9, NAN, 3.0, NAN)


def test_efforts_are_currents_and_blank_ones_say_nothing() -> None:
    names = list(reversed(REFERENCE.wheel_names))
    message = bag_message(JOINT_STATE, header=bag_header(7), name=names, effort=[3.0, NAN, 1.0])
    (topic,) = motor_topics(robot("joint_effort", "motor_current"))
    first, third = topic.read(message, 9)
    assert same(first, 0, 7, NAN, 1.0, NAN)
    assert same(third, 2, 7, NAN, 3.0, NAN)
    arm = bag_message(JOINT_STATE, header=bag_header(8), name=["elbow"], effort=[4.0])
    assert list(topic.read(arm, 9)) == []


def test_the_whole_robot_is_known_with_a_voltage_only() -> None:
    (topic,) = total_topics(REFERENCE)
    (found,) = topic.read(battery(24.0, -2.0), 9)
    assert same(found, TOTAL, 7, 48.0, 2.0, 24.0)
    with pytest.raises(Unusable, match="voltage of the whole supply is missing"):
        list(topic.read(battery(NAN, -2.0), 9))
