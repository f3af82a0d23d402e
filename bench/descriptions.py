"""Whether a robot that is not as described, or not wired so, is found, and a right one left alone.

    .venv/bin/python bench/descriptions.py BAG... --robot robot.yaml
        [--live | --wrong | --explain | --rewired | --odometry]

Counts the recordings that show other radii or another ramp than described; with --live those in
which `inputs: robot.yaml` ever warns, or the IMU is said to be otherwise.
--wrong diagnoses the first with one value off at a time, --rewired as a robot that is wired or
reports otherwise would have recorded it; both say what is named and noted then. --odometry asks
`tomr_odometry` where the first ends with its IMU otherwise, beside where the wheels alone have it,
which is right where none slides. --explain asks `tomr_gap explain`, with the last held out, what it
makes of values that are far off.
"""

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from pool import each

from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.replayed import Task, replay_one
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_odometry.estimator import SlipOdometry
from tomr_odometry.offline import estimates
from tomr_odometry.settings import OdometrySettings
from tomr_power_model.calibration.following import expected_speed
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.drive.astray import other_radii, other_ramp
from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.read import read_drive
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.messages.plain import NANOSECONDS, Level
from tomr_power_model.messages.types import JOINT_STATE
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import load_robot
from tomr_power_model.robot.files import robot_file
from tomr_power_model.topics.inputs import Complaints
from tomr_reality_gap.explain import explain
from tomr_reality_gap.request import Request

_TOLERANCE = 0.05  # of values, for an explanation

# By how much each value is off: factors, but of the offset radians.
WRONG: Sequence[Mapping[str, float]] = (
    {},
    {"robot.wheel_radius": 1.03},
    {"robot.wheel_radius": 1.08},
    {"robot.robot_radius": 1.08},
    {"robot.wheel_offset": 0.0349},
    {"robot.wheel_radius": 1.08, "robot.robot_radius": 0.967},
    {"controller.acceleration_limit": 0.0},
    {"controller.acceleration_limit": 0.5},
    {"controller.acceleration_limit": 2.0},
)


# What owners know least of, or mistake, by factors.
FAR_OFF: Sequence[Mapping[str, float]] = (
    {},
    {"controller.acceleration_limit": 0.0},
    {"controller.acceleration_limit": 0.5},
    {"controller.acceleration_limit": 2.0},
    {"controller.integral": 0.0},
    {"controller.integral": 1.0 / 3.0},
    {"controller.integral": 3.0},
    {"controller.proportional": 0.5},
    {"controller.proportional": 2.0},
    {"controller.proportional": 1.0 / 3.0, "controller.integral": 1.0 / 3.0},
    {"controller.proportional": 2.0, "controller.integral": 2.0},
    {"motor.resistance": 1.3},
    {"motor.torque_constant": 0.85},
    {"robot.mass": 0.7},
    {"robot.mass": 1.4},
)


def found(bag: Path, robot: str) -> str | None:
    """What is found in a recording, "" where nothing; None where it cannot be read."""
    described = load_robot(robot)
    try:
        drive = cleaned(read_drive(bag, described, None), described)
    except InputError:
        return None
    time, expected = expected_speed(drive, described)
    checks = (other_ramp, other_radii)
    return "; ".join(
        str(item) for check in checks for item in check(drive, described, time, expected)
    )


def warned(bag: Path, robot: str) -> str | None:
    """What `inputs: robot.yaml` warns of first in a recording, and when; as `found`."""
    try:
        with open_recording(bag) as recording:
            pipeline = Pipeline(load_robot(robot), DiagnosisSettings.of({}, "bench"))
            for receive_ns, step in diagnose(recording, pipeline):
                if pipeline.imu_mistake:
                    return pipeline.imu_mistake
                for report in step.reports:
                    for status in report.statuses:
                        if status.name == "inputs: robot.yaml" and status.level is not Level.OK:
                            seconds = (receive_ns - recording.start_ns) / NANOSECONDS
                            return f"{seconds:.1f} s: {status.message}"
    except InputError:
        return None
    return ""


def changed(robot: str, wrong: Mapping[str, float], path: Path) -> str:
    """A file with a robot some of whose values are off."""
    tree: dict[str, Any] = yaml.safe_load(robot_file(robot).read_text(encoding="utf-8"))
    for place, off in wrong.items():
        group, key = place.split(".")
        values = tree["/**"]["ros__parameters"][group]
        values[key] = values[key] + off if key == "wheel_offset" else values[key] * off
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return str(path)


Part = tuple[str, Any]  # topic and message
REWIRED: dict[str, Callable[[str, Any], Iterator[Part]]] = {}


def _rewired(
    function: Callable[[str, Any], Iterator[Part]],
) -> Callable[[str, Any], Iterator[Part]]:
    REWIRED[function.__name__.replace("_", " ")] = function
    return function


@_rewired
def wheels_in_another_order(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("joint_states"):
        message.name = [*message.name[1:], message.name[0]]
    yield topic, message


def _wheels_times(angles: Any, speeds: Any, topic: str, message: Any) -> Iterator[Part]:
    """Encoders that show so many times as much; no angles where there is no factor."""
    if topic.endswith("joint_states"):
        position = message.position
        message.position = position[:0] if angles is None else position * angles
        message.velocity = message.velocity * speeds
    yield topic, message


_BACKWARDS, _DEGREES, _RPM = np.array([1.0, -1.0, 1.0]), 180.0 / math.pi, 30.0 / math.pi
_GEAR, _TURNS = 15.0, 0.5 / math.pi
REWIRED |= {
    "one encoder counts backwards": partial(_wheels_times, _BACKWARDS, _BACKWARDS),
    "all encoders count backwards": partial(_wheels_times, -1.0, -1.0),
    "encoders count on shafts of motors": partial(_wheels_times, _GEAR, _GEAR),
    "speeds alone in revolutions per minute": partial(_wheels_times, None, _RPM),
    "speeds in revolutions per minute beside angles": partial(_wheels_times, 1.0, _RPM),
    "angles and speeds in degrees": partial(_wheels_times, _DEGREES, _DEGREES),
    "angles in revolutions": partial(_wheels_times, _TURNS, 1.0),
}


@_rewired
def commands_turn_the_other_way(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("cmd_vel"):
        twist = getattr(message, "twist", message)
        twist.angular.z *= -1.0
    yield topic, message


@_rewired
def currents_are_positive_while_drawing(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("/power"):
        message.current *= -1.0
    yield topic, message


@_rewired
def currents_in_milliamperes(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("/power"):
        message.current *= 1000.0
    yield topic, message


@_rewired
def gyro_turns_the_other_way(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("imu/data"):
        message.angular_velocity.z *= -1.0
    yield topic, message


@_rewired
def imu_in_degrees_and_g(topic: str, message: Any) -> Iterator[Part]:
    if topic.endswith("imu/data"):
        for values, unit in (
            (message.angular_velocity, 1.0 / _DEGREES),
            (message.linear_acceleration, 9.80665),
        ):
            values.x, values.y, values.z = values.x / unit, values.y / unit, values.z / unit
    yield topic, message


def _imu_turned(
    turned: Callable[[float, float, float], tuple[float, float, float]], topic: str, message: Any
) -> Iterator[Part]:
    if topic.endswith("imu/data"):
        for values in (message.angular_velocity, message.linear_acceleration):
            values.x, values.y, values.z = turned(values.x, values.y, values.z)
    yield topic, message


REWIRED |= {
    "imu upside down": partial(_imu_turned, lambda x, y, z: (x, -y, -z)),
    "imu turned to the left": partial(_imu_turned, lambda x, y, z: (y, -x, z)),
    "imu facing backwards": partial(_imu_turned, lambda x, y, z: (-x, -y, z)),
    "imu on its side": partial(_imu_turned, lambda x, y, z: (x, z, -y)),
}


@_rewired
def powers_of_two_motors_exchanged(topic: str, message: Any) -> Iterator[Part]:
    other = {"/wheel_1/power": "/wheel_2/power", "/wheel_2/power": "/wheel_1/power"}
    yield other.get(topic, topic), message


@_rewired
def a_message_for_each_wheel_and_an_arm(topic: str, message: Any) -> Iterator[Part]:
    if not topic.endswith("joint_states"):
        yield topic, message
        return
    before = bag_header((header_stamp_ns(message) or 0) - 300_000)
    yield topic, bag_message(JOINT_STATE, header=before, name=["elbow"], position=[0.5])
    for number, name in enumerate(message.name):
        here = slice(number, number + 1)
        position, velocity = message.position[here], message.velocity[here]
        fields = {"header": message.header, "position": position, "velocity": velocity}
        yield topic, bag_message(JOINT_STATE, name=[name], **fields)


def recorded(bag: Path, change: Callable[[str, Any], Iterator[Part]], new: Path) -> None:
    """Write a recording as a robot that is wired otherwise would have made it."""
    with open_recording(bag) as recording, RecordingWriter(new) as writer:
        for topic, type_name, message, receive_ns in recording.messages():
            for place, part in change(topic, message):
                writer.write(place, type_name, part, receive_ns)


def explained(robot: str, bags: Sequence[Path]) -> str:
    """Cells of a table: what is named, and the error of the held-out drive before and after."""
    request = Request(robot, tuple(bags[:-1]), holdout=tuple(bags[-1:]), tolerance=_TOLERANCE)
    try:
        made = explain(request)
    except InputError as error:
        return f"refused: {error} | -"
    names = [
        f"{item.effect} {', '.join(f'{value.value:.4g}' for value in item.parameters.values())}"
        for item in made.findings
    ]
    score = made.score
    fit = f"{score.nrmse_before:.3f} -> {score.nrmse_after:.3f}" if score else "-"
    return f"{'; '.join(names) or made.verdict} | {fit}"


def _explanations(bags: Sequence[Path], robot: str) -> Iterator[str]:
    yield "| changed | named | NRMSE, held out |"
    yield "|---|---|---|"
    with TemporaryDirectory() as name:
        robots = [
            changed(robot, wrong, Path(name) / f"{number}.yaml")
            for number, wrong in enumerate(FAR_OFF)
        ]
        cells = each(partial(explained, bags=bags), robots)
        for wrong, row in zip(FAR_OFF, cells, strict=True):
            yield f"| {dict(wrong) or 'nothing'} | {row} |"


def _rows(names: Sequence[str], tasks: Sequence[Task]) -> Iterator[str]:
    """A table of what is named and noted."""
    yield "| otherwise | named | noted |"
    yield "|---|---|---|"
    for name, played in zip(names, each(replay_one, tasks), strict=True):
        shares = sorted(played.phases[0].summary.shares.items(), key=lambda item: -item[1])
        named = ", ".join(f"{name} {share:.1%}" for name, share in shares if share > 0.001)
        yield f"| {name} | {named} | {'; '.join(played.notes) or '-'} |"


def _table(options: argparse.Namespace) -> list[str]:
    settings, bag = DiagnosisSettings.of({}, "bench"), options.bags[0]
    with TemporaryDirectory() as name:
        folder = Path(name)
        if options.rewired:
            bags = [folder / str(number) for number in range(len(REWIRED))]
            for change, new in zip(REWIRED.values(), bags, strict=True):
                recorded(bag, change, new)
            return list(_rows([*REWIRED], [Task(new, options.robot, settings) for new in bags]))
        robots = [
            changed(options.robot, wrong, folder / f"{number}.yaml")
            for number, wrong in enumerate(WRONG)
        ]
        names = [str(dict(wrong)) if wrong else "as described" for wrong in WRONG]
        return list(_rows(names, [Task(bag, robot, settings) for robot in robots]))


def ended(bag: Path, robot: str) -> str:
    """Cells of a table: how far the odometry ends from where the wheels have it, how long it says
    that wheels slip, and what it makes of the IMU."""
    described = load_robot(robot)
    cores = [
        SlipOdometry(described, OdometrySettings(use_imu=is_used)) for is_used in (True, False)
    ]
    ends, slips = [], 0.0
    for core in reversed(cores):
        with open_recording(bag) as recording:
            found = list(estimates(recording, described, core, Complaints()))
        ends.append(found[-1].pose)
        slips = sum(item.is_slipping for item in found) / len(found)
    (wheels, ours), use = ends, dict(found[-1].sensors)["imu/data"]
    off = math.hypot(*(ours[:2] - wheels[:2]))
    return f"{off:.3f} m | {ours[2] - wheels[2]:+.3f} rad | {slips:.1%} | {use}"


def _ends(bag: Path, robot: str) -> Iterator[str]:
    yield "| otherwise | end off | heading off | said to slip | the IMU |"
    yield "|---|---|---|---|---|"
    with TemporaryDirectory() as name:
        names = ["as it is", *(name for name in REWIRED if "imu" in name or "gyro" in name)]
        bags = [bag, *(Path(name) / str(number) for number in range(1, len(names)))]
        for other, new in zip(names[1:], bags[1:], strict=True):
            recorded(bag, REWIRED[other], new)
        for row, cells in zip(names, each(partial(ended, robot=robot), bags), strict=True):
            yield f"| {row} | {cells} |"


def _main(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG")
    parser.add_argument("--robot", required=True)
    parser.add_argument(
        "--live", action="store_true", help="as nodes say it while the robot drives"
    )
    parser.add_argument("--wrong", action="store_true", help="put values wrong, one at a time")
    parser.add_argument("--explain", action="store_true", help="what tomr_gap makes of values")
    parser.add_argument("--rewired", action="store_true", help="wire the robot otherwise")
    parser.add_argument("--odometry", action="store_true", help="where the odometry ends then")
    options = parser.parse_args(arguments)
    if options.odometry:
        print("\n".join(_ends(options.bags[0], options.robot)))
        return EXIT_OK
    if options.explain:
        print("\n".join(_explanations(options.bags, options.robot)))
        return EXIT_OK
    if options.wrong or options.rewired:
        print("\n".join(_table(options)))
        return EXIT_OK
    look = warned if options.live else found
    seen = each(partial(look, robot=options.robot), options.bags)
    for bag, words in zip(options.bags, seen, strict=True):
        if words:
            print(f"{bag}: {words}")
    read = [words for words in seen if words is not None]
    print(f"found in {sum(map(bool, read))} of {len(read)}; {len(seen) - len(read)} not read")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_main))
