"""tomr_calibrate from the outside: what it refuses, what it writes."""

from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from attrs import evolve

from tomr_power_model.calibrate_cli import main
from tomr_power_model.calibration.calibrate import Timing, align, calibrate
from tomr_power_model.calibration.checks import refuse_faults, refuse_little_motion
from tomr_power_model.calibration.parameters import Choice
from tomr_power_model.calibration.recorded import Recorded
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.recordings import RecordingWriter
from tomr_power_model.robot import load_robot, read_description, shipped_robot

MakeDrive = Callable[..., Recorded]
ROBOT = shipped_robot("reference")
FAULTY_BAG = Path(__file__).resolve().parents[3] / "bags" / "circle_encoder_lost"
_START_NS = 1_700_000_000 * 1_000_000_000


def during(time: np.ndarray, start: float = 10.0, end: float = 16.0) -> np.ndarray:
    return (time >= start) & (time <= end)


def lose_encoder(drive: Recorded) -> Recorded:
    """Wheel 3 as its encoder tells it when it is cut off: still, while its driver gives all."""
    position, velocity, power = drive.position.copy(), drive.velocity.copy(), drive.power.copy()
    rows = during(drive.encoder_time)
    position[rows, 2] = position[rows, 2][0]
    velocity[rows, 2] = 0.0
    power[during(drive.power_time), 2] = 18.0
    return evolve(drive, position=position, velocity=velocity, power=power)


def lose_drive(drive: Recorded) -> Recorded:
    """Wheel 2 hardly turns."""
    velocity = drive.velocity.copy()
    velocity[during(drive.encoder_time), 1] *= 0.1
    return evolve(drive, velocity=velocity)


def stick(drive: Recorded) -> Recorded:
    reading = drive.reading.copy()
    reading[during(drive.power_time), 0] = 0.25
    return evolve(drive, reading=reading)


def saturate(drive: Recorded) -> Recorded:
    reading = drive.reading.copy()
    reading[:, 1] = np.minimum(reading[:, 1], 0.2 * reading[:, 1].max())
    return evolve(drive, reading=reading)


def reverse(drive: Recorded) -> Recorded:
    return evolve(drive, power=drive.power * np.array([1.0, 1.0, -1.0]))


@pytest.mark.parametrize(
    ("damage", "wheel", "seen", "remedy"),
    [
        (lose_encoder, 3, "encoder stands still while it draws 18.0 W", "--skip tour=9.0:17.0"),
        (lose_drive, 2, "does not follow its command", "--skip tour="),
        (stick, 1, "power sensor repeats 0.25", "--skip tour=9."),
        (saturate, 2, "power sensor is saturated", "record it again"),
        (reverse, 3, "it draws -", "must be negative while power is drawn"),
    ],
)
def test_faults_are_refused_with_wheel_interval_and_remedy(
    make_drive: MakeDrive,
    damage: Callable[[Recorded], Recorded],
    wheel: int,
    seen: str,
    remedy: str,
) -> None:
    healthy = make_drive(ROBOT, 1)
    refuse_faults([healthy], ROBOT)
    with pytest.raises(InputError) as caught:
        refuse_faults([healthy, damage(healthy)], ROBOT)
    text = str(caught.value)
    assert text.startswith(f"tour: wheel_{wheel}_joint, ")
    assert seen in text
    assert remedy in text
    assert "\n" not in text


def test_a_bag_of_another_robot_is_refused(make_drive: MakeDrive) -> None:
    turned = evolve(ROBOT, wheel_offset=ROBOT.wheel_offset + np.pi / 3)
    with pytest.raises(
        InputError, match=r"as a wheel at 60 degrees would, robot.yaml puts it at 0"
    ):
        refuse_faults([make_drive(turned, 1)], ROBOT)


def test_too_little_motion_is_refused(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    refuse_little_motion([drive], ROBOT)
    with pytest.raises(
        InputError, match=r"the wheels turn for \d.\d s in all: drive at least 10 s"
    ):
        refuse_little_motion([make_drive(ROBOT, 1, seconds=8.0)], ROBOT)
    idle = drive.velocity * np.array([1.0, 0.0, 1.0])
    with pytest.raises(InputError, match=r"wheel_2_joint turns for 0.0 s"):
        refuse_little_motion([evolve(drive, velocity=idle)], ROBOT)


def test_power_unlike_the_rest_is_refused_after_the_fit(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    power = drive.power.copy()
    power[during(drive.power_time), 0] += 4.0
    samples = align([evolve(drive, power=power)], ROBOT, Timing())
    with pytest.raises(InputError, match=r"wheel_1_joint, (9.9|10.\d) s to 1[56].\d s: it draws"):
        calibrate(read_description("reference"), "test", samples, (), Choice())


def write_bag(drive: Recorded, path: Path) -> Path:
    """A recording in the contract's form."""
    messages = []
    for time, angle, speed in zip(drive.encoder_time, drive.position, drive.velocity, strict=True):
        fields = {"name": list(ROBOT.wheel_names), "position": angle, "velocity": speed}
        messages.append((time, "joint_states", "sensor_msgs/msg/JointState", fields))
    for time, power, total in zip(drive.power_time, drive.power, drive.total, strict=True):
        topics = [*(f"{name}/power" for name in ROBOT.wheel_topics), "battery_state"]
        for topic, drawn in zip(topics, (*power, total), strict=True):
            fields = {"voltage": 24.0, "current": -float(drawn) / 24.0}
            messages.append((time, topic, "sensor_msgs/msg/BatteryState", fields))
    for time, (vx, vy, wz) in zip(drive.command_time, drive.command, strict=True):
        twist = bag_message("geometry_msgs/msg/Twist")
        twist.linear.x, twist.linear.y, twist.angular.z = float(vx), float(vy), float(wz)
        messages.append((time, "cmd_vel", "geometry_msgs/msg/TwistStamped", {"twist": twist}))
    with RecordingWriter(path) as writer:
        for time, topic, kind, fields in sorted(messages, key=lambda item: (item[0], item[1])):
            stamp = _START_NS + round(time * 1e9)
            writer.write(topic, kind, bag_message(kind, header=bag_header(stamp), **fields), stamp)
    return path


class _Links(HTMLParser):
    """Collects what a page would load."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.pictures = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key in ("src", "href") and value is not None:
                self.pictures += value.startswith("data:image/png;base64,")
                if not value.startswith("data:"):
                    self.found.append(value)


def test_the_command_writes_a_robot_and_a_page(
    tmp_path: Path,
    make_drive: MakeDrive,
    other_values: Callable[..., object],
    capsys: pytest.CaptureFixture[str],
) -> None:
    real = other_values(ROBOT)
    bags = [
        str(write_bag(make_drive(real, seed, seconds=30.0), tmp_path / f"tour{seed}"))
        for seed in (1, 2)
    ]
    out, page = tmp_path / "fitted.yaml", tmp_path / "report.html"
    command = [bags[0], "--holdout", bags[1], "--robot", "reference", "--out", str(out)]
    assert main([*command, "--report", str(page)]) == 0
    told = capsys.readouterr().out
    assert "held out" in told
    assert "robot.mass" in told

    fitted = load_robot(out)
    assert fitted.mass == pytest.approx(real.mass, rel=0.01)
    for wheel in range(3):
        friction, truth = (r.effect("friction.coulomb", wheel) for r in (fitted, real))
        assert friction is not None
        assert truth is not None
        assert friction["torque"] == pytest.approx(truth["torque"], rel=0.15)
    text = out.read_text()
    assert "tour1" in text.splitlines()[0]
    assert "tour2, not fitted: motor 1" in text

    links = _Links()
    links.feed(page.read_text())
    assert links.found == []
    assert links.pictures == 3  # two drives, and the residuals
    assert "<script" not in page.read_text()


def test_a_fitted_file_of_another_robot_is_refused(tmp_path: Path, make_drive: MakeDrive) -> None:
    bag = write_bag(make_drive(ROBOT, 1, seconds=25.0), tmp_path / "tour")
    out = tmp_path / "fitted.yaml"
    assert main([str(bag), "--robot", "reference", "--out", str(out), "--shared", "all"]) == 0
    tree = yaml.safe_load(out.read_text())
    tree["/**"]["ros__parameters"]["robot"]["wheel_radius"] = 0.06
    out.write_text(yaml.safe_dump(tree))
    with pytest.raises(InputError, match=r"fitted to a robot with robot.wheel_radius = 0.05, not"):
        load_robot(out)
    assert main([str(bag), "--robot", str(out)]) == 2


def test_a_recorded_fault_is_one_line_and_skipping_it_helps(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = [str(FAULTY_BAG), "--robot", "reference", "--shared", "all"]
    assert main(command) == 2
    told = capsys.readouterr().err
    assert told.startswith(
        "error: circle_encoder_lost: wheel_3_joint, 8.0 s to 14.0 s: its encoder"
    )
    assert "--skip circle_encoder_lost=7.0:15.0" in told
    assert told.count("\n") == 1
    assert main([*command, "--skip", "circle_encoder_lost=7.0:15.0"]) == 0


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--skip", "other=1:2"], "no recording other"),
        (["--skip", "circle_encoder_lost=x"], "give BAG=FROM:TO in seconds"),
        (["--tolerance", "robot.mass=-1"], "give a number above 0"),
        (["--out", "/nowhere/fitted.yaml"], "no folder /nowhere"),
        (["--encoder-window", "0"], "give seconds above 0"),
    ],
)
def test_bad_options_are_one_line(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(FAULTY_BAG), "--robot", "reference", *arguments]) == 2
    told = capsys.readouterr().err
    assert reason in told
    assert told.count("\n") == 1
