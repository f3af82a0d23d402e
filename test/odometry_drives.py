"""Simulated drives for tests of the odometry: what the robot sends, and where it truly was."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.topics import odometry_inputs
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.plant.samples import command_sample
from tomr_sim_bridge.plant.simulation import Simulation

Array = NDArray[np.float64]
ROBOT = shipped_robot("reference")
START = 1_700_000_000_000_000_000
WITHIN_95 = 5.991  # squared distance over the covariance, of two coordinates
Change = Callable[[float, str, Any], Any]


@frozen
class Recorded:
    """Messages of a drive by time [s] and topic; times, poses and twists that are true."""

    messages: tuple[tuple[float, str, Any], ...]
    times: Array  # s
    pose: Array  # x, y [m], yaw [rad]
    twist: Array  # in base_link

    @property
    def end(self) -> Array:
        """True x, y at the end [m]."""
        return self.pose[-1, :2]

    def at(self, item: Estimate) -> Array:
        """True x, y at an estimate [m]."""
        time = 1e-9 * (item.stamp_ns - START)
        return np.array([np.interp(time, self.times, self.pose[:, k]) for k in (0, 1)])


@frozen
class Event:
    """A fault of the simulator from one time to another [s]."""

    fault: str
    begin: float
    end: float
    settings: tuple[tuple[str, float], ...]


def ice(begin: float, end: float) -> Event:
    """A floor without grip."""
    return Event("floor_slippery", begin, end, (("severity", 0.95),))


def drive(
    *events: Event, moving_from: float = 1.0, length: float = 9.0, turning: float = 0.0
) -> Recorded:
    """Forth until 4 s and back until 8 s, a tenth of it to the side, `turning` so many rad a m."""
    simulation, found, truth = Simulation(ROBOT, 3, start_ns=START), [], []
    for count in range(round(20.0 * length)):
        time = 0.05 * count
        stamp = START + round(1e9 * time)
        for event in events:
            if abs(time - event.begin) < 1e-6:
                simulation.set_fault(event.fault, **dict(event.settings))
            if abs(time - event.end) < 1e-6:
                simulation.set_fault(event.fault, severity=0.0)
        speed = 0.5 if moving_from <= time < 4.0 else -0.3 if 4.0 < time < 8.0 else 0.0
        sample = command_sample(stamp, speed, 0.1 * speed, turning * speed)
        simulation.command(speed, 0.1 * speed, turning * speed, stamp_ns=stamp)
        found.append((time, sample.topic, to_bag(sample.message)))
        for item in simulation.step_to(stamp + 50_000_000):
            message, seconds = to_bag(item.message), 1e-9 * (item.stamp_ns - START)
            if item.topic == "ground_truth/odom":
                place, twist = message.pose.pose, message.twist.twist
                yaw = 2.0 * math.atan2(place.orientation.z, place.orientation.w)
                truth.append((seconds, place.position.x, place.position.y, yaw,
                              twist.linear.x, twist.linear.y, twist.angular.z))  # fmt: skip
            found.append((seconds, item.topic, message))
    rows = np.array(truth)
    return Recorded(tuple(found), rows[:, 0], rows[:, 1:4], rows[:, 4:])


def as_it_is(time: float, topic: str, message: Any) -> Any:
    """No change."""
    return message


def play(
    recorded: Recorded, change: Change = as_it_is, settings: OdometrySettings | None = None
) -> Iterator[Estimate]:
    """Estimates of a drive whose messages are changed, or left out where that gives None."""
    core = SlipOdometry(ROBOT, settings)
    inputs = {item.topic: item for item in odometry_inputs(ROBOT, core)}
    for time, topic, message in recorded.messages:
        if topic in inputs:
            changed = change(time, topic, message)
            if changed is not None:
                inputs[topic].take(changed, START + round(1e9 * time))
        yield from core.due()


def off(recorded: Recorded, item: Estimate) -> float:
    """Distance from the true place [m]."""
    return math.hypot(*(item.pose[:2] - recorded.at(item)))


def contained(recorded: Recorded, items: Sequence[Estimate], floor: float = 0.005) -> float:
    """Share of the estimates whose 95 % ellipse holds the true place, give or take `floor` [m]."""
    inside = []
    for item in items:
        apart = item.pose[:2] - recorded.at(item)
        spread = item.pose_covariance[:2, :2] + floor**2 * np.eye(2)
        inside.append(apart @ np.linalg.solve(spread, apart) < WITHIN_95)
    return float(np.mean(inside))
