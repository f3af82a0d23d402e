"""What is read out of messages, and what is refused with a reason."""

import math
import sys
from typing import Any
from unittest.mock import MagicMock, call, patch

import numpy as np
import pytest
from attrs import evolve
from rclpy.serialization import serialize_message

from tomr_power_model.drive.sources import TOTAL, PowerReading
from tomr_power_model.limits import limits
from tomr_power_model.messages.bag import bag_header, bag_message, jazzy_typestore, to_bag
from tomr_power_model.messages.intake import (
    Unusable,
    WheelFinder,
    battery_of,
    numbers_of,
    stamp_of,
    twist_of,
)
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.outgoing import (
    TYPES,
    DiagnosticMessage,
    JointMessage,
    Outgoing,
    SupplyMessage,
)
from tomr_power_model.messages.plain import Level, Status, battery_state
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.nodes.stage_node import message_class, to_ros
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.flow import Flow
from tomr_power_model.topics.inputs import Complaints, measured_inputs, model_inputs

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
    assert wheels.absent == (WHEELS[1],)


def test_angles_that_begin_anew_each_turn_go_on() -> None:
    finder, found = WheelFinder(WHEELS), []
    for angle in (3.0, -3.0, 3.0):
        found.append(finder.read(_joints(list(WHEELS), position=[0.0, angle, angle])).position)
    assert found[0] == (0.0, 3.0, 3.0)
    assert found[1] == pytest.approx((0.0, 2.0 * math.pi - 3.0, 2.0 * math.pi - 3.0))
    assert found[2] == pytest.approx(found[0])


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
        inputs = model_inputs(robot, PowerPredictor(robot))
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

    def test_stamps_of_power_reach_the_model(self) -> None:
        robot = shipped_robot("reference")
        predictor = PowerPredictor(robot)
        inputs = model_inputs(robot, predictor)
        message = to_bag(battery_state(STAMP, 24.0, -1.0))
        with patch.object(predictor, "measured", return_value=Arrival.REPEATED) as measured:
            for topic in ("wheel_3/power", "battery_state"):
                taken = next(item.take for item in inputs if item.topic == topic)(message, 0)
                assert "repeats" in str(taken)
        assert measured.call_args_list == [call(2, STAMP), call(TOTAL, STAMP)]

    def test_efforts_are_power_where_a_wheel_is_missing_and_never_from_an_old_message(self) -> None:
        reference = shipped_robot("reference")
        measurement = evolve(
            reference.measurement, source="joint_effort", quantity="motor_current", total="none"
        )
        readings: list[PowerReading] = []
        arrivals = iter((Arrival.TAKEN, Arrival.REPEATED, Arrival.RESTARTED, Arrival.FOREIGN))
        (joints,) = measured_inputs(
            evolve(reference, measurement=measurement),
            lambda *_: next(arrivals),
            lambda reading: readings.append(reading) or Arrival.TAKEN,  # type: ignore[func-returns-value]
        )
        message = _joints([WHEELS[0], WHEELS[2]], position=[1, 2], effort=[0.5, 0.7])
        assert "wheel_2_joint" in str(joints.take(message, STAMP))
        assert [(reading.wheel, reading.current) for reading in readings] == [(0, 0.5), (2, 0.7)]
        assert "repeats" in str(joints.take(message, STAMP))
        assert len(readings) == 2
        assert "started afresh" in str(joints.take(message, STAMP))
        assert len(readings) == 4
        words = str(joints.take(message, STAMP))
        assert words.endswith("the message is ignored: synchronise the clocks")


@pytest.mark.parametrize(
    ("period_us", "taken"),
    [(10_000, 100), (1_000, 100), (200, 20), (50, 6)],  # a sample each 0.83 ms is enough
)
def test_a_flood_of_encoders_is_thinned(period_us: int, taken: int) -> None:
    stamps: list[int] = []
    joints, *_ = measured_inputs(
        shipped_robot("reference"),
        lambda stamp_ns, *_: stamps.append(stamp_ns) or Arrival.TAKEN,  # type: ignore[func-returns-value]
        lambda _: Arrival.TAKEN,
    )
    for number in range(100):
        stamp_ns = STAMP + 1000 * period_us * number
        message = _joints(list(WHEELS), position=[1, 2, 3])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        assert joints.take(message, stamp_ns) is None
        data = jazzy_typestore().serialize_cdr(message, "sensor_msgs/msg/JointState")
        assert Flow(has_header=True).stamp_of(bytes(data)) == stamp_ns
        # Decided by the stamp alone, before and after: the answer is the same.
        assert joints.is_too_close is not None
        assert joints.is_too_close(stamp_ns) == (stamp_ns not in stamps)
    assert len(stamps) == taken
    assert min(np.diff(stamps)) >= 10**9 // limits().topic_rate


def test_what_repeats_or_goes_back_is_not_thinned_but_reported() -> None:
    joints = model_inputs(shipped_robot("reference"), MagicMock())[1]
    assert joints.is_too_close is not None
    joints.take(_joints(list(WHEELS), position=[1, 2, 3]), STAMP)
    answers = [joints.is_too_close(STAMP + shift) for shift in (0, 100, -100, 10**6)]
    assert answers == [False, True, False, False]


def _stamped(names: list[str], stamp_ns: int) -> Any:
    return bag_message(
        "sensor_msgs/msg/JointState",
        header=bag_header(stamp_ns),
        name=names,
        position=[1.0] * len(names),
    )


@pytest.mark.parametrize("shift_us", [-300, 0, 300])
@pytest.mark.parametrize("first", [0, 4])
def test_other_joints_right_before_or_after_cost_no_wheels(shift_us: int, first: int) -> None:
    """Two stages that share a stream, as one process has them."""
    stream, taken = WheelStream(WHEELS), [0, 0]

    def count(stage: int) -> Any:
        def take(*_: object) -> Arrival:
            taken[stage] += 1
            return Arrival.TAKEN

        return take

    robot = shipped_robot("reference")
    stages = [measured_inputs(robot, count(stage), count(stage), stream)[0] for stage in (0, 1)]
    for number in range(20):
        stamp = STAMP + 20_000_000 * number
        arm = _stamped(["elbow"], stamp + 1000 * shift_us)
        wheels = _stamped(list(WHEELS), stamp)
        for message in (arm, wheels) if shift_us <= 0 else (wheels, arm):
            if message is not arm or number >= first:
                for stage in stages:
                    stage.take(message, stamp)
    assert taken == [20, 20]


def test_of_several_samples_at_once_a_problem_is_said() -> None:
    """A wheel falls silent: what waited for it comes together."""
    outcomes = iter([Arrival.TAKEN, "the first cannot be", *[Arrival.TAKEN] * 50])
    robot = shipped_robot("reference")
    take = measured_inputs(robot, lambda *_: next(outcomes), MagicMock())[0].take
    said = []
    for ms in range(0, 600, 20):
        for name in WHEELS[:2] if ms >= 20 else (WHEELS[0], WHEELS[2], WHEELS[1]):
            said.append(take(_stamped([name], STAMP + ms * 1_000_000), 0))
    assert "the first cannot be" in said


def test_complaints_thin_out() -> None:
    complaints = Complaints()
    lines = [complaints.note("topic", "odd") for _ in range(1000)]
    said = [number for number, line in enumerate(lines, start=1) if line]
    assert said == [1, 10, 100, 1000]
    assert lines[99] == "topic: odd (100 times)"


@pytest.mark.parametrize(
    "message",
    [
        SupplyMessage("wheel_1/power/predicted", STAMP, SupplyReading(24.0, -0.5)),
        JointMessage(
            "predicted/joint_states", STAMP, WHEELS, (1.0, 2.0, 3.0), (0.1, 0.2, math.nan)
        ),
        DiagnosticMessage(
            "residuals", STAMP, (Status("a", Level.ERROR, "b", (("key", "value"),), "c"),)
        ),
    ],
    ids=lambda message: type(message).__name__,
)
def test_what_is_published_is_the_same_as_what_is_recorded(message: Outgoing) -> None:
    store, name = jazzy_typestore(), TYPES[type(message)]
    recorded = bytes(store.serialize_cdr(to_bag(message.plain), name))
    data = serialize_message(to_ros(message.plain))
    # Written anew, because ROS leaves anything in the gaps between fields and after the last.
    published = store.deserialize_cdr(data[: len(recorded)], name)
    assert bytes(store.serialize_cdr(published, name)) == recorded
    assert stamp_of(to_bag(message.plain), 0) == STAMP


def test_levels_and_unknowns_are_those_of_the_message_definitions() -> None:
    statuses = tuple(Status(level.name, level, "") for level in Level)
    message = to_bag(DiagnosticMessage("residuals", STAMP, statuses).plain)
    assert [status.level for status in message.status] == [0, 1, 2, 3]
    supply = to_bag(battery_state(STAMP, 24.0, -1.0, "wheel_1"))
    unknown = (supply.temperature, supply.charge, supply.capacity, supply.design_capacity)
    assert all(map(math.isnan, (*unknown, supply.percentage)))
    assert (supply.voltage, supply.current, supply.location) == (24.0, -1.0, "wheel_1")
    assert supply.present


def test_readings_round_as_the_message_does() -> None:
    reading = SupplyReading.rounded(24.1, 0.1)
    assert reading.voltage == float(np.float32(24.1)) != 24.1
    assert reading.power == pytest.approx(2.41, rel=1e-6)


@pytest.mark.parametrize("name", ["antigravity/msg/X", "os.path/msg/X", "../x/msg/X", "this/srv/X"])
def test_a_type_s_name_does_not_import_what_is_no_message(name: str) -> None:
    with pytest.raises((ImportError, ValueError)):
        message_class(name)
    assert not {"antigravity", "this"} & set(sys.modules)


def test_what_no_sensor_measures_is_no_sample() -> None:
    finder = WheelFinder(WHEELS)
    wheels = finder.read(_joints(list(WHEELS), position=[1.0, 1e308, -1e10], velocity=[1.0] * 3))
    assert wheels.position[0] == 1.0
    assert math.isnan(wheels.position[1])
    assert math.isnan(wheels.position[2])
    for voltage, current in ((1e30, 1.0), (24.0, 1e30), (math.inf, 1.0)):
        with pytest.raises(Unusable):
            battery_of(
                bag_message("sensor_msgs/msg/BatteryState", voltage=voltage, current=current)
            )
    assert math.isnan(
        battery_of(bag_message("sensor_msgs/msg/BatteryState", voltage=math.nan, current=1.0))[0]
    )


def test_complaints_of_ever_other_kinds_do_not_fill_the_memory() -> None:
    complaints = Complaints()
    for number in range(5000):
        complaints.note("joint_states", f"odd name\n{number}" + "x" * 5000)
    assert len(complaints.counts) < 300
    assert all(len(problem) < 2000 and "\n" not in problem for _, problem in complaints.counts)
