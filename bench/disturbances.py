"""What may go wrong between a robot and its diagnosis: changes of a recorded drive."""

import math
from collections.abc import Callable
from copy import copy
from typing import Any

import numpy as np
from attrs import frozen

from tomr_power_model.model.ticks import NANOSECONDS, to_ns

START_NS = 1_700_000_000 * NANOSECONDS  # of a drive: times in seconds count from here
IMU = "imu/data"
POWER = ("wheel_1/power", "wheel_2/power", "wheel_3/power")
STREAMS: dict[str, tuple[str, ...]] = {
    "all": ("cmd_vel", "joint_states", *POWER, "battery_state"),
    "cmd_vel": ("cmd_vel",),
    "joint_states": ("joint_states",),
    "one motor": (POWER[1],),
    "motors": POWER,
}


@frozen
class Item:
    """One message of a drive."""

    stamp_ns: int
    topic: str
    message: Any


Drive = tuple[Item, ...]
Change = Callable[[Drive, np.random.Generator], Drive]
Made = Callable[[Any, Any], Any]


def stamped(item: Item, stamp_ns: int) -> Item:
    """The same message with another stamp."""
    message, header = copy(item.message), copy(item.message.header)
    time = copy(header.stamp)
    time.sec, time.nanosec = divmod(stamp_ns, NANOSECONDS)
    header.stamp, message.header = time, header
    return Item(stamp_ns, item.topic, message)


def pause(streams: str, at: float, length: float) -> Change:
    """Nothing comes on some streams for a while [s]."""
    first, last = START_NS + to_ns(at), START_NS + to_ns(at + length)
    topics = STREAMS[streams]
    return lambda items, _: tuple(
        item for item in items if item.topic not in topics or not first <= item.stamp_ns < last
    )


def disobeyed(at: float, length: float) -> Change:
    """For a while [s] the command before is recorded, and another obeyed: as one that is late."""
    first, last = START_NS + to_ns(at), START_NS + to_ns(at + length)

    def change(items: Drive, _: np.random.Generator) -> Drive:
        before, found = None, []
        for item in items:
            if item.topic == "cmd_vel" and before and first <= item.stamp_ns < last:
                message = copy(item.message)
                message.twist = before
                item = Item(item.stamp_ns, item.topic, message)
            elif item.topic == "cmd_vel":
                before = item.message.twist
            found.append(item)
        return tuple(found)

    return change


def unseen(at: float, length: float, is_silent: bool) -> Change:
    """For a while [s] another commands the robot: here it is told to stand, or told nothing."""
    first, last = START_NS + to_ns(at), START_NS + to_ns(at + length)

    def change(items: Drive, _: np.random.Generator) -> Drive:
        found = []
        for item in items:
            if item.topic == "cmd_vel" and first <= item.stamp_ns < last:
                if is_silent:
                    continue
                message, twist = copy(item.message), copy(item.message.twist)
                twist.linear, twist.angular = copy(twist.linear), copy(twist.angular)
                twist.linear.x = twist.linear.y = twist.angular.z = 0.0
                message.twist = twist
                item = Item(item.stamp_ns, item.topic, message)
            found.append(item)
        return tuple(found)

    return change


def leap(at: float, by: float) -> Change:
    """All stamps leap [s]."""
    first = START_NS + to_ns(at)
    return lambda items, _: tuple(
        stamped(item, item.stamp_ns + to_ns(by)) if item.stamp_ns >= first else item
        for item in items
    )


def loss(share: float, streams: str = "all") -> Change:
    """A share of the samples is lost."""
    topics = STREAMS[streams]
    return lambda items, random: tuple(
        item for item in items if item.topic not in topics or random.random() >= share
    )


def scatter(std: float, streams: str = "all") -> Change:
    """Stamps scatter around when samples were taken [s]; each stream stays in order."""
    topics = STREAMS[streams]

    def change(items: Drive, random: np.random.Generator) -> Drive:
        newest = dict.fromkeys(topics, 0)
        found = []
        for item in items:
            if item.topic in topics:
                stamp = item.stamp_ns + round(1e9 * random.normal(0.0, std))
                newest[item.topic] = stamp = max(stamp, newest[item.topic] + 1000)
                item = stamped(item, stamp)
            found.append(item)
        return tuple(found)

    return change


def replaced(topic: str, at: float, make: Made, length: float = 1e9) -> Change:
    """For a while [s] a topic's messages as another sensor would give them: `make` makes each from
    it and the one at `at`."""
    first, last = START_NS + to_ns(at), START_NS + to_ns(min(at + length, 1e6))

    def change(items: Drive, _: np.random.Generator) -> Drive:
        held, found = None, []
        for item in items:
            if item.topic == topic and first <= item.stamp_ns < last:
                held = held or item.message
                item = Item(item.stamp_ns, item.topic, make(copy(item.message), held))
            found.append(item)
        return tuple(found)

    return change


def power(wheel: int, at: float, make: Made, length: float = 1e9) -> Change:
    """A motor's power as another sensor would give it, for a while [s]."""
    return replaced(POWER[wheel], at, make, length)


def inertial(at: float, make: Made) -> Change:
    """What the IMU measures as another would give it, from a time on [s]."""
    return replaced(IMU, at, make)


def repeating(*fields: str) -> Made:
    """A sensor's driver that goes on with the last reading."""

    def make(message: Any, held: Any) -> Any:
        for field in fields:
            setattr(message, field, getattr(held, field))
        return message

    return make


FROZEN_SENSOR = repeating("voltage", "current")
REPEATING_GYRO = repeating("angular_velocity")
REPEATING_IMU = repeating("angular_velocity", "linear_acceleration")


def absurd(message: Any, _: Any) -> Any:
    """What no sensor measures."""
    message.voltage = 1e30
    return message


def dead(message: Any, _: Any) -> Any:
    """A bus that answers with zeros."""
    message.voltage, message.current = 0.0, 0.0
    return message


def both(*changes: Change) -> Change:
    """Several disturbances one after the other."""

    def change(items: Drive, random: np.random.Generator) -> Drive:
        for one in changes:
            items = one(items, random)
        return items

    return change


def unplugged(wheel: int, at: float) -> Change:
    """Nothing comes from a motor's power sensor any more."""
    first = START_NS + to_ns(at)
    return lambda items, _: tuple(
        item for item in items if item.topic != POWER[wheel] or item.stamp_ns < first
    )


def begun_anew_each_turn() -> Change:
    """Wheel angles from -pi to pi, as many encoders' drivers give them."""

    def change(items: Drive, _: np.random.Generator) -> Drive:
        found = []
        for item in items:
            if item.topic == "joint_states":
                message, angles = copy(item.message), np.array(item.message.position)
                message.position = (angles + math.pi) % (2.0 * math.pi) - math.pi
                item = Item(item.stamp_ns, item.topic, message)
            found.append(item)
        return tuple(found)

    return change


def zeros_of_imu(message: Any, _: Any) -> Any:
    """A bus that answers with zeros."""
    for field in ("angular_velocity", "linear_acceleration"):
        vector = copy(getattr(message, field))
        vector.x = vector.y = vector.z = 0.0
        setattr(message, field, vector)
    return message
