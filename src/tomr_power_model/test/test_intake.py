"""What is read out of messages, and what is refused with a reason."""

import math
from typing import Any

import numpy as np
import pytest

from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.intake import (
    Unusable,
    WheelFinder,
    battery_of,
    numbers_of,
    stamp_of,
    twist_of,
)
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.inputs import Complaints, model_inputs

STAMP = 1_700_000_000_500_000_000
WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")


def _joints(names: list[str], **fields: Any) -> Any:
    return bag_message("sensor_msgs/msg/JointState", header=bag_header(STAMP), name=names, **fields)


def _twist(x: float, stamp: int | None = STAMP) -> Any:
    linear = bag_message("geometry_msgs/msg/Vector3", x=x, y=2.0)
    angular = bag_message("geometry_msgs/msg/Vector3", z=3.0)
    twist = bag_message("geometry_msgs/msg/Twist", linear=linear, angular=angular)
    if stamp is None:
        return twist
    header = bag_header(stamp)
    return bag_message("geometry_msgs/msg/TwistStamped", header=header, twist=twist)


def test_wheels_are_found_by_name_in_any_order_among_others() -> None:
    message = _joints(["arm", *reversed(WHEELS)], position=[9, 3, 2, 1], velocity=[9, 6, 5, 4])
    wheels = WheelFinder(WHEELS).read(message)
    assert wheels.position == (1.0, 2.0, 3.0)
    assert wheels.velocity == (4.0, 5.0, 6.0)
    assert all(map(math.isnan, wheels.effort))


def test_names_may_change_from_message_to_message() -> None:
    finder = WheelFinder(WHEELS)
    finder.read(_joints(list(WHEELS), position=[1, 2, 3]))
    wheels = finder.read(_joints([WHEELS[2], WHEELS[0]], position=[3, 1]))
    assert wheels.position[0] == 1.0
    assert wheels.position[2] == 3.0
    assert math.isnan(wheels.position[1])
    assert finder.missing() == (WHEELS[1],)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (_joints(["left", "right"], position=[1, 2]), "left, right"),
        (_joints([]), "no joint"),
        (_joints(list(WHEELS), position=[1, 2]), "3 names but 2 values in position"),
        (_joints(list(WHEELS), position=[1, 2, 3], velocity=[1]), "1 values in velocity"),
    ],
)
def test_joint_states_without_sense(message: Any, words: str) -> None:
    with pytest.raises(Unusable, match=words):
        WheelFinder(WHEELS).read(message)


def test_not_a_number_counts_as_missing() -> None:
    message = _joints(list(WHEELS), position=[1.0, math.nan, math.inf])
    position = WheelFinder(WHEELS).read(message).position
    assert position[0] == 1.0
    assert math.isnan(position[1])
    assert math.isnan(position[2])


def test_twists_with_and_without_stamp() -> None:
    assert twist_of(_twist(1.0)) == twist_of(_twist(1.0, None)) == (1.0, 2.0, 3.0)
    assert stamp_of(_twist(1.0), 7) == STAMP
    assert stamp_of(_twist(1.0, None), 7) == 7
    assert stamp_of(_twist(1.0, 0), 7) == 0
    assert stamp_of(_twist(1.0, 0), 7, fallback=True) == 7
    with pytest.raises(Unusable, match="finite"):
        twist_of(_twist(math.nan))


def test_battery_voltage_may_be_missing_but_not_the_current() -> None:
    name = "sensor_msgs/msg/BatteryState"
    voltage, current = battery_of(bag_message(name, voltage=math.nan, current=-2.0))
    assert math.isnan(voltage)
    assert current == -2.0
    with pytest.raises(Unusable, match="current"):
        battery_of(bag_message(name, voltage=24.0, current=math.nan))


def test_arrays_need_three_numbers() -> None:
    with pytest.raises(Unusable, match="2 values"):
        numbers_of(bag_message("std_msgs/msg/Float64MultiArray", data=[1.0, 2.0]), 3)


class TestInputsOfAStage:
    """No message may raise; each gets a complaint in words."""

    def _take(self, topic: str, message: Any) -> str | None:
        robot = shipped_robot("reference")
        inputs = model_inputs(robot, PowerPredictor(robot), "geometry_msgs/msg/TwistStamped")
        return next(item.take for item in inputs if item.topic == topic)(message, STAMP)

    def test_good_messages_get_no_complaint(self) -> None:
        assert self._take("cmd_vel", _twist(1.0)) is None
        assert self._take("joint_states", _joints(list(WHEELS), position=[1, 2, 3])) is None

    def test_strange_messages_get_one(self) -> None:
        assert "finite" in str(self._take("cmd_vel", _twist(math.inf)))
        assert "wheel_2_joint" in str(
            self._take("joint_states", _joints([WHEELS[0], WHEELS[2]], position=[1, 2]))
        )
        assert "malformed" in str(self._take("joint_states", object()))
        message = _joints(list(WHEELS), position=[1, 2, 3])
        message.header = bag_header(0)
        assert "no stamp" in str(self._take("joint_states", message))


def test_complaints_thin_out() -> None:
    complaints = Complaints()
    lines = [complaints.note("topic", "odd") for _ in range(1000)]
    said = [number for number, line in enumerate(lines, start=1) if line]
    assert said == [1, 10, 100, 1000]
    assert lines[99] == "topic: odd (100 times)"


def test_readings_round_as_the_message_does() -> None:
    reading = SupplyReading.rounded(24.1, 0.1)
    assert reading.voltage == float(np.float32(24.1)) != 24.1
    assert reading.power == pytest.approx(2.41, rel=1e-6)
