"""The fit finds the creep that made a drive."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from attrs import evolve

from tomr_odometry.learn import drives
from tomr_odometry.learn.drives import Leg, leg_of, read_legs
from tomr_odometry.learn.fit import Batch, fit_creep
from tomr_odometry.reference import Path2D, reference_of
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import shipped_robot
from tomr_power_model.slides.body import body_of

BAG = Path(__file__).parents[3] / "bags" / "square"
BODY = body_of(shipped_robot("robotino_v2"))[0]


def _legs(coefficient: float, growth: float, drag: float) -> list[Leg]:
    """Straight drives at many headings on a floor whose rollers drag with a share of the load."""
    legs = []
    for heading in np.radians(np.arange(0.0, 360.0, 15.0)):
        direction = np.array([math.cos(heading), math.sin(heading), 0.0])
        used = 1.5 * drag * (BODY.rows @ direction)
        step = 0.003 * direction
        rims = BODY.rows @ step + coefficient * used * (1.0 + growth * used**2) * 0.003
        moved = 500 * step
        legs.append(Leg(np.tile(rims, (500, 1)), np.tile(used, (500, 1)), moved, 1.5))
    return legs


def test_relation_is_inverted_exactly() -> None:
    batch = Batch(_legs(0.7, 0.5, 0.3), BODY)
    assert batch.errors(np.full(3, 0.7), 0.5) == pytest.approx(0.0, abs=1e-3)
    assert np.median(batch.errors(np.zeros(3), 0.0)) > 0.1


def test_one_floor_is_learnt_in_its_details() -> None:
    found = fit_creep({"floor": _legs(0.7, 0.5, 0.3)}, BODY)
    assert found.coefficient == pytest.approx((0.7, 0.7, 0.7), abs=0.06)
    assert found.uncertainty < 0.1


def test_several_floors_share_one_coefficient_and_say_how_far_they_are_apart() -> None:
    found = fit_creep({"one": _legs(0.5, 0.0, 0.3), "other": _legs(0.9, 0.0, 0.3)}, BODY)
    assert 0.5 < found.coefficient[0] < 0.9
    assert found.coefficient[0] == found.coefficient[2]
    assert 0.1 < found.uncertainty < 0.3


def _straight(
    lag: float = 0.0, jump: float = 0.0, turned: float = 0.0, speed: float = 0.5
) -> Leg | None:
    """4 s of which 3 s are driven at a speed [m/s], heading 0.4 rad, seen by a reference."""
    seconds = np.arange(0.0, 4.0, 0.01)
    stamps = (1e9 * seconds).astype(np.int64)
    way = speed * np.clip(seconds - lag - 0.5, 0.0, 3.0)
    pose = np.stack([way * math.cos(0.4), way * math.sin(0.4), np.full(400, 0.4 + turned)], axis=1)
    pose[200:, 0] += jump
    rims = speed * np.clip(seconds - 0.5, 0.0, 3.0)[:, None] * (BODY.rows @ (1.0, 0.0, 0.0))
    return leg_of(stamps, rims, np.zeros((400, 3)), Path2D(stamps, pose), -turned)


def test_a_leg_is_what_the_reference_moved_in_the_frame_of_its_start() -> None:
    for turned in (0.0, 0.2):
        leg = _straight(turned=turned)
        assert leg is not None
        assert leg.moved == pytest.approx((1.5, 0.0, 0.0), abs=1e-6)
        assert leg.way == pytest.approx(1.5, abs=0.02)
        assert Batch([leg], BODY).errors(np.zeros(3), 0.0) == pytest.approx(0.0, abs=1e-6)


def test_a_reference_that_lags_costs_nothing_from_rest_to_rest() -> None:
    late = _straight(lag=0.2)
    assert late is not None
    assert late.moved == pytest.approx((1.5, 0.0, 0.0), abs=0.01)


def test_a_leg_whose_reference_jumps_is_left_out() -> None:
    assert _straight(jump=0.6) is None
    assert _straight(jump=0.1) is not None


def test_legs_of_a_recording_end_where_it_did() -> None:
    (leg,) = read_legs(BAG, shipped_robot("reference"), "ground_truth/odom")
    with open_recording(BAG) as recording:
        true = reference_of(recording, "ground_truth/odom")
    assert leg.moved == pytest.approx(true.pose[-1] - true.pose[0], abs=0.01)
    assert np.abs(leg.used).max() > 0.02
    assert leg.way == pytest.approx(4.8, abs=0.1)


def test_long_drives_are_cut_into_legs_of_the_time_of_the_reference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = shipped_robot("reference")
    (whole,) = read_legs(BAG, robot, "ground_truth/odom")
    monkeypatch.setattr(drives, "LEG_S", 4.0)
    legs = read_legs(BAG, robot, "ground_truth/odom")
    assert len(legs) > 2
    assert max(len(leg.steps) for leg in legs) <= 400
    assert sum(leg.way for leg in legs) == pytest.approx(whole.way, abs=0.3)
    monkeypatch.undo()
    with open_recording(BAG) as recording:
        known = reference_of(recording, "ground_truth/odom")
    late = Path2D(known.stamps[200:], known.pose[200:])
    monkeypatch.setattr(drives, "reference_of", lambda *_: late)
    (rest,) = read_legs(BAG, robot, "ground_truth/odom")
    missing = 1e-7 * (known.stamps[200] - known.stamps[0])  # samples of 10 ms
    assert len(whole.steps) - len(rest.steps) == pytest.approx(missing, abs=2)


def test_learning_needs_power_and_a_pose() -> None:
    robot = shipped_robot("reference")
    deaf = evolve(robot, measurement=evolve(robot.measurement, source="total_only"))
    with pytest.raises(InputError, match="no motor power"):
        read_legs(BAG, deaf, "ground_truth/odom")
    for topic in ("joint_states", "ground_truth/odom:base_link"):
        with pytest.raises(InputError, match="give a nav_msgs/Odometry, a pose, or tf:CHILD"):
            read_legs(BAG, robot, topic)


def test_a_leg_that_hardly_moved_is_left_out() -> None:
    assert _straight(speed=0.05) is None
    assert _straight(speed=0.1) is not None


def test_a_reference_from_tf_is_that_of_the_named_frame(tmp_path: Path) -> None:
    def transform(frame: str, stamp: int, x: float, yaw: float) -> Any:
        turn = bag_message(
            "geometry_msgs/msg/Quaternion", z=math.sin(0.5 * yaw), w=math.cos(0.5 * yaw)
        )
        moved = bag_message(
            "geometry_msgs/msg/Transform",
            translation=bag_message("geometry_msgs/msg/Vector3", x=x),
            rotation=turn,
        )
        return bag_message(
            "geometry_msgs/msg/TransformStamped",
            header=bag_header(stamp),
            child_frame_id=frame,
            transform=moved,
        )

    with RecordingWriter(tmp_path / "bag") as writer:
        for k in range(20):
            stamp = 1_000_000_000 + k * 10_000_000
            both = [
                transform("camera", stamp, 5.0, 0.0),
                transform("/base_link", stamp, math.nan if k == 7 else 0.1 * k, 0.4 * k),
            ]
            message = bag_message("tf2_msgs/msg/TFMessage", transforms=both)
            writer.write("/tf", "tf2_msgs/msg/TFMessage", message, stamp)
    with open_recording(tmp_path / "bag") as recording:
        path = reference_of(recording, "tf:base_link")
    assert path.pose[-1] == pytest.approx((1.9, 0.0, 7.6))  # the heading goes on beyond a turn
    assert len(path.pose) == 19
