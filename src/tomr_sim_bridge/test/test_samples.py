"""Messages that only the simulated robot publishes."""

import math

import pytest

from tomr_power_model.messages import motion
from tomr_power_model.messages.bag import jazzy_typestore, to_bag
from tomr_power_model.messages.motion import transform_of
from tomr_power_model.messages.types import TF
from tomr_sim_bridge.plant.samples import odometry


def test_odometry_and_its_transform_say_the_same() -> None:
    variances = (1e-3, 2e-3, 0.0, 0.0, 0.0, 1e-2)
    message = odometry(
        1_500_000_000, "odom", (1.0, -2.0, 0.5 * math.pi), [0.1, 0.0, 0.2], variances
    )
    moving = to_bag(message).twist
    assert (moving.twist.linear.x, moving.twist.linear.y, moving.twist.angular.z) == (0.1, 0.0, 0.2)
    covariance = to_bag(message).pose.covariance.reshape(6, 6)
    assert covariance.diagonal() == pytest.approx(variances)
    assert covariance.sum() == pytest.approx(sum(variances))
    store = jazzy_typestore()
    moved = store.deserialize_cdr(store.serialize_cdr(to_bag(transform_of(message)), TF), TF)
    (transform,) = moved.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("odom", "base_link")
    assert (transform.header.stamp.sec, transform.header.stamp.nanosec) == (1, 500_000_000)
    place = transform.transform
    assert (place.translation.x, place.translation.y, place.translation.z) == (1.0, -2.0, 0.0)
    assert 2.0 * math.atan2(place.rotation.z, place.rotation.w) == pytest.approx(0.5 * math.pi)


def test_pose_and_twist_have_a_doubt_each() -> None:
    doubts = ([1.0] * 36, [2.0] * 36)
    still = (0.0, 0.0, 0.0)
    message = to_bag(motion.odometry(1, ("odom", "base_link"), still, still, doubts))
    assert (message.pose.covariance[0], message.twist.covariance[0]) == (1.0, 2.0)
