"""Robots that report the currents of their motors and nothing of power; drivers of another kind."""

from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.drive.record import Drive
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, shipped_robot
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.response import answering, controller_alternatives
from tomr_reality_gap.alignment.simulation import RecordingSimulation, predict_all
from tomr_reality_gap.explain import explain
from tomr_reality_gap.explanation import Explanation
from tomr_reality_gap.prepared import check_commands
from tomr_reality_gap.request import Request
from tomr_sim_bridge.importers.dataset import choose, default_dataset, import_files, open_dataset
from tomr_sim_bridge.importers.robotino import Drive as RobotinoDrive
from tomr_sim_bridge.importers.robotino import Run, write_run

from .test_alignment import as_recorded

QUANTUM = 1.0 / 39.0  # A
START_NS = 1_672_531_200_000_000_000


def _recorded(robot: Robot, command: np.ndarray, time: np.ndarray) -> Drive:
    """A recording of commands, all else blank."""
    blank = np.zeros((len(time), 3))
    return Drive(
        name="made",
        encoder_time=time,
        position=np.full((len(time), 3), np.nan),
        velocity=blank,
        power_time=time,
        power=blank,
        reading=blank,
        total_time=np.empty(0),
        total=np.empty(0),
        command_time=time,
        command=command,
        voltage=np.full((len(time), 3), np.nan),
        total_voltage=np.empty(0),
        imu_time=np.empty(0),
        inertial=np.empty((0, 6)),
    )


def _forward(robot: Robot, command: np.ndarray) -> RecordingSimulation:
    recorded = _recorded(robot, command, 0.0312 * np.arange(len(command)))
    return RecordingSimulation.of(recorded, robot, channels_of(recorded, robot))


def _to_and_fro(heading: float, speed: float, seconds: float = 13.0) -> np.ndarray:
    """Straight there and back, three seconds each, from rest."""
    time = 0.0312 * np.arange(int(seconds / 0.0312))
    along = speed * np.where(time // 3.0 % 2 == 0, 1.0, -1.0)
    return np.stack([along * np.cos(heading), along * np.sin(heading), 0.0 * time], axis=1)


@pytest.fixture
def robotino() -> Robot:
    return shipped_robot("robotino_v2")


def test_the_current_of_a_steady_spin_is_that_of_its_friction(robotino: Robot) -> None:
    """Commanded 2.5 rad/s: k_p (2.5 - w) = R i + k w, k i = c + b w; |i| either way round."""
    motor, gain = robotino.motors[0], robotino.controller.proportional
    k = motor.torque_constant * motor.gear_ratio
    coulomb, viscous = 0.1300992, 0.006063360
    speed = (k * gain * 2.5 / motor.resistance - coulomb) / (
        k * (gain + k) / motor.resistance + viscous
    )
    for turn in (-0.8, 0.8):  # rad/s: wheels turn by R / r as fast, against it
        simulation = _forward(robotino, np.tile([0.0, 0.0, turn], (100, 1)))
        value = simulation.predict([robotino])[0]
        for channel, part in zip(simulation.channels, rows_of(simulation.channels), strict=True):
            if channel.kind == "current":
                assert (channel.unit, channel.quantum) == ("A", pytest.approx(QUANTUM))
                assert value[part][-1] == pytest.approx((coulomb + viscous * speed) / k, rel=2e-3)
            else:
                assert abs(value[part][-1]) == pytest.approx(speed, rel=2e-3)
        kinds = [channel.kind for channel in simulation.channels]
        assert kinds == ["current"] * 3 + ["speed"] * 3


def test_short_recordings_side_by_side_are_each_by_itself(robotino: Robot) -> None:
    simulations = [
        _forward(robotino, _to_and_fro(0.3, 0.2)),
        _forward(robotino, _to_and_fro(1.9, 0.3, 7.0)),
    ]
    robots = [robotino, evolve(robotino, mass=1.2 * robotino.mass)]
    together = predict_all(simulations, robots)
    alone = np.concatenate([item.predict(robots) for item in simulations], axis=1)
    np.testing.assert_allclose(together, alone, atol=1e-9)


def test_a_later_robot_is_the_same_robot_later(robotino: Robot) -> None:
    simulation = _forward(robotino, _to_and_fro(0.3, 0.2))

    def late(delay: float) -> Robot:
        controller = evolve(robotino.controller, delay=robotino.controller.delay + delay)
        return evolve(robotino, controller=controller)

    value = simulation.predict([late(0.0234)])[0]
    for first, rest in ((0.0, 0.0234), (0.0017, 0.0217)):
        found = simulation.predict([late(first)], later=[rest])[1]
        np.testing.assert_allclose(value, found, atol=0.05)


@pytest.mark.parametrize("integral", [0.0, 157.0])
def test_delay_and_loop_are_seen_in_wheel_speeds(robotino: Robot, integral: float) -> None:
    """A loop without an integral stays behind what is commanded; one with it does not."""
    simulation = _forward(robotino, _to_and_fro(0.3, 0.2))
    controller = evolve(robotino.controller, delay=0.1, integral=integral)
    value = simulation.predict([evolve(robotino, controller=controller)])[0]
    value = value + 0.05 * np.random.default_rng(1).standard_normal(len(value))
    channels = as_recorded(simulation, value).channels
    right = RecordingSimulation.of(
        simulation.recorded, evolve(robotino, controller=controller), channels
    )
    assert controller_alternatives([right], right.robot) == {}
    other = evolve(robotino.controller, delay=0.0, integral=157.0 - integral)
    wrong = RecordingSimulation.of(
        simulation.recorded, evolve(robotino, controller=other), channels
    )
    found = controller_alternatives([wrong], wrong.robot)
    assert found["controller.integral"] == pytest.approx(integral)
    assert found["controller.delay"] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("described", [0.0, 0.8, 3.2])
def test_another_ramp_is_seen_in_wheel_speeds(described: float) -> None:
    """Whether none, a gentler or a steeper one is described; and such a drive is not refused."""
    robot = shipped_robot("reference")
    controller = evolve(robot.controller, acceleration_limit=1.6)
    simulation = _forward(robot, np.concatenate([_to_and_fro(0.3, 0.6), _to_and_fro(1.9, 0.5)]))
    value = simulation.predict([evolve(robot, controller=controller)])[0]
    value = value + 0.05 * np.random.default_rng(1).standard_normal(len(value))
    channels = as_recorded(simulation, value).channels
    speeds = [channel.value for channel in channels if channel.kind == "speed"]
    recorded = evolve(simulation.recorded, velocity=np.stack(speeds, axis=1))
    other = evolve(robot, controller=evolve(controller, acceleration_limit=described))
    made = RecordingSimulation.of(recorded, other, channels)
    found = controller_alternatives([made], other)
    assert found["controller.acceleration_limit"] == pytest.approx(1.6, rel=0.05)
    assert answering(other, found).controller.acceleration_limit == pytest.approx(1.6, rel=0.05)
    check_commands([made], [made.run(other)], other)
    right = RecordingSimulation.of(recorded, evolve(robot, controller=controller), channels)
    assert controller_alternatives([right], right.robot) == {}


@pytest.mark.parametrize("delay", [0.05, 0.1, 0.25, 0.35])
def test_late_commands_of_quick_drivers_are_no_ramp(robotino: Robot, delay: float) -> None:
    """The fit to encoders at 32 Hz blurs a step over 0.16 s: late besides, it looks like a ramp."""
    controller = evolve(robotino.controller, delay=robotino.controller.delay + delay)
    simulation = _forward(robotino, _to_and_fro(0.3, 0.1, 30.0))
    value = simulation.predict([evolve(robotino, controller=controller)])[0]
    value = value + 0.05 * np.random.default_rng(1).standard_normal(len(value))
    channels = as_recorded(simulation, value).channels
    speeds = [channel.value for channel in channels if channel.kind == "speed"]
    recorded = evolve(simulation.recorded, velocity=np.stack(speeds, axis=1))
    made = RecordingSimulation.of(recorded, robotino, channels)
    found = controller_alternatives([made], robotino)
    assert [*found] == ["controller.delay"]
    assert found["controller.delay"] == pytest.approx(controller.delay, abs=0.02)


def _written(path: Path, robot: Robot, command: np.ndarray, seed: int) -> Path:
    """What a robot's encoders and current sensors report, with their quanta and noise."""
    random = np.random.default_rng(seed)
    time = 0.0312 * np.arange(len(command))
    recorded = _recorded(robot, command, time)
    recorded = evolve(recorded, velocity=command @ twist_to_wheels(robot).T)
    simulation = RecordingSimulation.of(recorded, robot, channels_of(recorded, robot))
    run, line = simulation.run(robot), simulation.timeline
    speed = np.stack([np.interp(time, line.middle, column) for column in run.speed.T], axis=1)
    loss = np.stack([np.interp(time, line.middle, column) for column in run.copper.T], axis=1)
    current = np.sqrt(loss / robot.motors[0].resistance) + random.normal(0.0, 0.05, loss.shape)
    measured = speed + random.normal(0.0, 0.1, speed.shape)
    stamps = tuple(START_NS + int(1e9 * stamp) for stamp in time)
    rounded = np.abs(np.round(current / QUANTUM)) * QUANTUM
    angle = np.cumsum(speed, axis=0) * 0.0312
    drive = RobotinoDrive(command, np.zeros_like(command), np.zeros_like(command))
    write_run(Run(stamps, angle, measured, np.zeros_like(measured), rounded, drive), path, "mcap")
    return path


def _names(found: Explanation) -> set[str]:
    return {f"{item.effect} at {', '.join(item.where)}" for item in found.findings}


def test_a_concealed_friction_and_a_late_command_are_named(tmp_path: Path, robotino: Robot) -> None:
    concealed = (None, {"torque": 0.08}, None)
    real = evolve(
        robotino,
        physics={**robotino.physics, "friction.asymmetric": concealed},
        controller=evolve(robotino.controller, delay=0.303),
    )
    paths = tuple(
        _written(tmp_path / f"drive{number}", real, _to_and_fro(heading, speed), number)
        for number, (heading, speed) in enumerate(((0.3, 0.1), (1.9, 0.2)))
    )
    found = explain(Request("robotino_v2", paths[:1], holdout=paths[1:]))
    assert _names(found) == {
        "friction.asymmetric at wheel_2_joint",
        "parameter.controller.delay at body",
    }
    values = {item.effect: item.parameters for item in found.findings}
    assert values["friction.asymmetric"]["torque"].value == pytest.approx(0.08, rel=0.1)
    assert values["parameter.controller.delay"]["value"].value == pytest.approx(0.303, abs=5e-3)
    assert found.score is not None
    assert found.score.quantity == "motor current [A]"
    assert found.score.nrmse_after < 0.5 * found.score.nrmse_before
    fitted, held = found.comparisons
    assert held.sigma == fitted.sigma  # the sensors', not what is left of each drive


@pytest.mark.timeout(600)  # three recordings of the real robot, on a busy machine
def test_the_rollers_of_the_real_robot_drag_on_its_floor(tmp_path: Path) -> None:
    """Wheels that turned freely on the bench: the floor adds most of the current."""
    dataset = default_dataset()
    if not dataset.exists():
        pytest.skip(f"{dataset} is absent: set TOMR_RECORDINGS")
    names = ("gray/exp07", "gray/exp19", "gray/exp34", "gray/exp154")  # 35, 95, 170 degrees; 50
    with open_dataset(dataset) as files:
        chosen = [item for item in choose(files, ("gray",)) if item.bag in names]
        import_files(chosen, tmp_path, "mcap", pytest.fail)
    *real, held = (tmp_path / name for name in names)
    found = explain(Request("robotino_v2", tuple(real), holdout=(held,)))
    best = max(found.findings, key=lambda item: item.located.share)
    assert (best.effect, best.where) == ("contact.roller_drag", ("all_wheels",))
    assert found.score is not None
    assert found.score.accuracy_before < 0.3
    assert found.score.accuracy_after > 0.7
