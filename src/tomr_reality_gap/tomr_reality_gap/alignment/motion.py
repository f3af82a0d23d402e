"""The motion that smooth torques and learnt terms depend on, in a recording."""

import numpy as np

from tomr_power_model.drive.motion import turned_angle
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.unmodelled import Motion, motion_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation


def motion_in(simulation: RecordingSimulation, robot: Robot) -> Motion:
    """The motion that a robot makes in a recording."""
    run, line, recorded = simulation.run(robot), simulation.timeline, simulation.recorded
    angle = [
        np.interp(line.middle, recorded.encoder_time, turned_angle(recorded, wheel))
        for wheel in range(WHEELS)
    ]
    return motion_of(
        wheels_to_twist(robot),
        line.middle,
        speed=run.speed,
        current=run.current,
        angle=np.stack(angle, axis=1),
    )
