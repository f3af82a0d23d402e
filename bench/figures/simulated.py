"""Missions of the simulated robot, driven once and played to the stages with any power model."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen
from numpy.typing import NDArray
from stages import as_arrays
from tqdm import tqdm

from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL, ResidualFrame
from tomr_power_model.geometry.kinematics import wheels_to_twist
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.robot import Robot, load_robot
from tomr_sim_bridge.missions import Mission, drive, start_mission
from tomr_sim_bridge.missions.schema import CirclePhase, TwistPhase

Array = NDArray[np.float64]

ROBOT = "reference"
PHYSICAL: Mapping[str, object] = {"power_model": "physical"}
# Wang 2024, Eqs 19-20: 5 % of the model; below it the noise of the simulated sensors, and half of
# the model's own change over three ticks where it jumps. Narrower than `PAPER_BANDS`, which have to
# hold robots that are 5 % off their description: these equal theirs.
SENSOR_BANDS: Mapping[str, object] = {
    "band.relative": 0.05,
    "band.total_relative": 0.05,
    "band.speed_relative": 0.05,
    "band.power": 0.25,
    "band.total_factor": 2.0,
    "band.speed": 0.3,
    "band.transient": 0.5,
    "band.speed_transient": 0.5,
}
COLUMNS = ("motor 1", "motor 2", "motor 3", "motors", "robot")
_PATIENCE = 2.0  # s before a progress bar shows
_START_NS = 1_700_000_000 * NANOSECONDS


def plain_mission(name: str, phases: Sequence[TwistPhase | CirclePhase]) -> Mission:
    """A drive of the robot as described, without load, faults or jitter."""
    return Mission(name, tuple(phases), seed=0)


@frozen
class Heard:
    """A message as a robot publishes it."""

    topic: str
    message: Any
    stamp_ns: int


@frozen
class Played:
    """A drive as the stages see it, tick by tick; n ticks."""

    time: Array  # s since the start, (n,)
    measured: Array  # W: motors 1-3, their sum, the whole robot, (n, 5)
    modelled: Array  # W, from the command, (n, 5)
    derived: Array  # W, motors 1-3 from the encoders, (n, 3)
    speed: Array  # measured wheel speeds [rad/s], (n, 3)
    expected: Array  # wheel speeds from the command [rad/s], (n, 3)
    codes: NDArray[np.int64]  # Wang 2024, Eq. 21, (n, 10)
    states: tuple[str, ...]  # named at each tick

    def rows(self, since: float, until: float) -> NDArray[np.bool_]:
        """The ticks in (since, until] [s]."""
        return (self.time > since) & (self.time <= until)


def exact(robot: Robot) -> Robot:
    """A robot whose power sensors have neither noise nor quanta nor gaps."""
    silent = {"current_noise": 0.0, "voltage_noise": 0.0, "power_rate": 200.0}
    silent |= {"current_resolution": 0.0, "voltage_resolution": 0.0}
    return evolve(robot, sensors=evolve(robot.sensors, **silent))


def driven(mission: Mission, robot: Robot, seed: int = 0) -> list[Heard]:
    """Drive a mission with the MuJoCo robot; what it publishes, in order."""
    simulation = start_mission(mission, robot, seed, _START_NS)
    count = round(mission.plan(robot, seed).duration * mission.command_rate)
    bar = tqdm(drive(mission, simulation, seed), "driving", count, leave=False, delay=_PATIENCE)
    return [
        Heard(sample.topic, to_bag(sample.message), sample.stamp_ns)
        for samples in bar
        for sample in samples
    ]


def played(
    heard: Sequence[Heard], robot: Robot, parameters: Mapping[str, object] = PHYSICAL
) -> Played:
    """A drive through model, residuals and classifier; `parameters` of the stages."""
    pipeline = Pipeline(robot, DiagnosisSettings.of(parameters, "the experiment"))
    topics = {item.topic for item in pipeline.inputs}
    steps = (
        pipeline.take(item.topic, item.message, item.stamp_ns)
        for item in heard
        if item.topic in topics
    )
    return gathered(steps, heard[0].stamp_ns)


def gathered(steps: Iterable[Step], start_ns: int) -> Played:
    """What the stages said, as arrays."""
    frames: list[ResidualFrame] = []
    named: list[tuple[int, str]] = []
    for step in steps:
        frames.extend(step.frames)
        named.extend((found.stamp_ns, found.state.name) for found in step.diagnoses)
    stamps = np.array([frame.stamp_ns for frame in frames])
    residual, modelled = as_arrays(frames)
    at = np.searchsorted([stamp for stamp, _ in named], stamps, side="right") - 1
    motors, speeds, encoders = list(MOTORS), list(SPEEDS), list(ENCODERS)
    expected = modelled[:, speeds]
    # A speed residual counts in the direction of the expected speed.
    against = np.where(expected < 0.0, -1.0, 1.0)

    def columns(values: Array) -> Array:
        of_motors = values[:, motors]
        return np.column_stack([of_motors, of_motors.sum(axis=1), values[:, TOTAL]])

    return Played(
        time=np.float64(1e-9) * (stamps - start_ns),
        measured=columns(residual + modelled),
        modelled=columns(modelled),
        derived=modelled[:, encoders],
        speed=expected + against * residual[:, speeds],
        expected=expected,
        codes=np.array([frame.codes for frame in frames], dtype=np.int64),
        states=tuple(named[index][1] if index >= 0 else "" for index in at),
    )


def of_robot(robot: Robot, wheel_speed: Array) -> Array:
    """Speed of the robot [m/s] from the speeds of its wheels [rad/s]; (n, 3) -> (n,)."""
    twist = wheel_speed @ wheels_to_twist(robot).T
    return np.hypot(twist[:, 0], twist[:, 1])


def true_speed(heard: Sequence[Heard]) -> tuple[Array, Array]:
    """Times since the start [s] and the simulated robot's true speed [m/s], (n,) each."""
    odometry = [item for item in heard if item.topic == "ground_truth/odom"]
    time = [1e-9 * (item.stamp_ns - heard[0].stamp_ns) for item in odometry]
    linear = [item.message.twist.twist.linear for item in odometry]
    return np.array(time), np.array([np.hypot(v.x, v.y) for v in linear])


def scores(measured: Array, modelled: Array) -> dict[str, dict[str, float]]:
    """Accuracy and NRMSE by column, (n, 5)."""
    return {
        name: {
            "accuracy": accuracy(measured[:, column], modelled[:, column]),
            "nrmse": nrmse(measured[:, column], modelled[:, column]),
        }
        for column, name in enumerate(COLUMNS)
    }


def speed_scores(found: Played) -> dict[str, float]:
    """Accuracy and NRMSE of the wheel speeds, all wheels together."""
    return {
        "accuracy": accuracy(found.speed, found.expected),
        "nrmse": nrmse(found.speed, found.expected),
    }


def reference() -> Robot:
    """The robot that drives, described without error."""
    return load_robot(ROBOT)
