"""A recording through the odometry, as fast as it can."""

from collections.abc import Iterator

from tomr_odometry.estimate import Estimate
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.topics import odometry_inputs
from tomr_power_model.recordings import Recording
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Complaints
from tomr_power_model.topics.recorded import recorded_inputs


def estimates(
    recording: Recording,
    robot: Robot,
    core: SlipOdometry,
    complaints: Complaints,
    namespace: str | None = None,
) -> Iterator[Estimate]:
    """Play a recording; what is wrong with messages is counted in `complaints`."""
    inputs = recorded_inputs(recording, odometry_inputs(robot, core), namespace)
    for topic, _, message, receive_ns in recording.messages(inputs):
        problem = inputs[topic].take(message, receive_ns)
        if problem is not None:
            complaints.note(inputs[topic].topic, problem)
        yield from core.due()
