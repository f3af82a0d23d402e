"""How much traction there is, and where it gave way."""

import math

import numpy as np
import pytest
from odometry_drives import ROBOT, START, drive, ice, play

from tomr_odometry import grip
from tomr_odometry.estimate import Estimate
from tomr_odometry.grip import SIDE, UNKNOWN, Available, Floor
from tomr_odometry.settings import OdometrySettings
from tomr_odometry.topics import FLOOR_TOPIC, STATUS_TOPIC, estimate_messages
from tomr_power_model.messages.bag import to_bag
from tomr_power_model.slides.body import body_of

NO, YES = np.zeros(3, dtype=bool), np.ones(3, dtype=bool)
STD = np.full(3, 0.5)
SETTINGS = OdometrySettings(publish_floor=True)


def test_a_wheel_that_grips_has_at_least_what_it_transmits() -> None:
    limit = Available()
    assert np.isnan(limit.interval[:, 1]).all()
    limit.take(np.array([8.0, -8.0, np.nan]), STD, NO, 0.01)
    assert limit.interval[:, 0] == pytest.approx([7.0, 7.0, 0.0])
    assert np.isnan(limit.interval[:, 1]).all()


def test_a_wheel_that_slides_has_what_it_transmits_until_it_grips_with_more() -> None:
    limit, random = Available(), np.random.default_rng(0)
    for _ in range(100):
        limit.take(random.normal(3.0, STD), STD, YES, 0.01)
    assert limit.interval[:, 0] == pytest.approx(2.0, abs=0.4)
    assert limit.interval[:, 1] == pytest.approx(4.0, abs=0.4)
    limit.take(np.array([9.0, 3.0, np.nan]), STD, NO, 0.01)
    assert limit.interval[0, 0] == pytest.approx(8.0)
    assert np.isnan(limit.interval[:, 1]).tolist() == [True, False, False]
    limit.take(np.full(3, 1.0), STD, NO, 3.0)  # so long ago that it may be another floor
    assert np.isnan(limit.interval[:, 1]).all()


def test_a_slide_on_another_floor_begins_anew() -> None:
    limit = Available()
    limit.take(np.full(3, 9.0), STD, YES, 0.01)
    limit.take(np.full(3, 1.0), STD, NO, 3.0)  # long ago
    limit.take(np.full(3, 2.0), STD, YES, 0.01)
    assert limit.interval[:, 1] == pytest.approx(np.full(3, 3.0))
    limit.take(np.full(3, 9.0), STD, NO, 0.01)  # more than there was: it is another floor
    limit.take(np.full(3, 8.0), STD, YES, 0.01)
    assert limit.interval == pytest.approx(np.tile([7.0, 9.0], (3, 1)))


def test_a_slide_without_known_forces_limits_nothing() -> None:
    limit = Available()
    limit.take(np.full(3, np.nan), np.full(3, np.nan), YES, 0.01)
    assert np.isnan(limit.interval[:, 1]).all()


def test_the_floor_is_marked_where_contacts_slid() -> None:
    floor, share = Floor(ROBOT), np.array([0.1, 0.1, np.nan])
    assert floor.grid() is None
    for x in np.arange(0.0, 4.0, 0.05):
        floor.take(np.array([x, -2.0, 0.0]), YES if 1.0 < x < 2.0 else NO, share)
    grid = floor.grid()
    assert grid is not None
    assert grid.corner[1] <= -2.0 - 0.5 * ROBOT.robot_radius

    def cell(x: float, y: float) -> int:
        column, row = ((np.array([x, y]) - grid.corner) // SIDE).astype(int)
        return int(grid.cells[row, column])

    first = ROBOT.robot_radius * np.array([np.cos(ROBOT.wheel_offset), np.sin(ROBOT.wheel_offset)])
    assert cell(1.5 + first[0], -2.0 + first[1]) >= 90  # a tenth of the load, or not known
    assert cell(3.2 + first[0], -2.0 + first[1]) == 0
    assert UNKNOWN in grid.cells
    floor.take(np.array([1e9, np.nan, 0.0]), NO, share)
    floor.take(np.array([5e5, 0.0, 0.0]), NO, share)
    far = floor.grid()
    assert far is not None
    assert far.cells.size < 10


@pytest.mark.parametrize(
    "pose", [(1e7, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, math.nan), (0.0, 0.0, math.inf)]
)
def test_a_pose_that_is_nowhere_marks_nothing(pose: tuple[float, float, float]) -> None:
    floor = Floor(ROBOT)
    floor.take(np.array(pose), YES, np.full(3, 0.1))
    assert floor.grid() is None


def test_contacts_turn_with_the_robot() -> None:
    floor = Floor(ROBOT)
    pose, angle = np.array([10.0, 10.0, 2.5]), ROBOT.wheel_offset + 2.5  # on a corner of cells
    floor.take(pose, np.array([True, False, False]), np.zeros(3))
    grid = floor.grid()
    assert grid is not None
    first = pose[:2] + ROBOT.robot_radius * np.array([np.cos(angle), np.sin(angle)])
    column, row = ((first - grid.corner) // SIDE).astype(int)
    assert grid.cells[row, column] == 100
    assert (grid.cells > 0).sum() == 1


def test_of_a_large_floor_the_newest_cells_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grip, "_MOST_CELLS", 6)
    floor = Floor(ROBOT)
    for x in (0.0, 5.0, 10.0):
        floor.take(np.array([x, 0.0, 0.0]), NO, np.zeros(3))
    floor.take(np.array([math.nan, 0.0, 0.0]), NO, np.zeros(3))
    grid = floor.grid()
    assert grid is not None
    assert (grid.cells != UNKNOWN).sum() <= 6
    assert 4.0 < grid.corner[0] < 5.0


def test_what_a_wheel_transmitted_long_ago_may_be_gone() -> None:
    limit = Available()
    limit.take(np.full(3, 8.0), STD, NO, 0.01)
    limit.take(np.full(3, 1.0), STD, NO, 4.0)
    assert limit.interval[:, 0] == pytest.approx(7.0 * math.exp(-2.0))


@pytest.fixture(scope="module")
def slipping() -> list[Estimate]:
    return list(play(drive(ice(3.0, 6.0)), settings=SETTINGS))


def test_intervals_hold_what_ice_transmits(slipping: list[Estimate]) -> None:
    load = body_of(ROBOT)[0].load
    during = [item for item in slipping if item.loses_traction.any()]
    lost = [
        item.available[wheel] / load[wheel]
        for item in during
        for wheel in np.flatnonzero(item.loses_traction)
    ]
    low, high = np.array(lost)[len(lost) // 4 :].T
    assert np.median(low) < 0.05 < np.median(high)  # of a floor with a twentieth of its grip
    assert np.median(high) < 0.3
    assert np.isnan(slipping[60].available[:, 1]).all()
    stds = np.array([item.traction_std for item in slipping[10:]])
    assert np.isfinite(stds).all()
    assert (stds > 0.0).all()


def test_the_two_kinds_of_slip_are_distinguished(slipping: list[Estimate]) -> None:
    lost = next(item for item in slipping if item.is_slipping)
    assert "loss of traction at wheel" in lost.words
    assert np.abs(lost.losing).max() > 0.02
    assert not any(item.losing.any() for item in slipping[:100])
    (status,) = (
        to_bag(one.message).status[0]
        for one in estimate_messages(ROBOT, slipping[next_status(slipping)], SETTINGS)
        if one.topic == STATUS_TOPIC
    )
    values = {item.key: float(item.value) for item in status.values}
    assert values["wheel_1_traction_used_low"] < values["wheel_1_traction_used"]
    more = {"wheel_2_creeping", "wheel_2_loss_of_traction", "wheel_3_traction_available_high"}
    assert more <= set(values)


def next_status(items: list[Estimate]) -> int:
    return next(k for k, item in enumerate(items) if (item.stamp_ns - START) % 100_000_000 == 0)


def test_a_map_of_the_floor_is_published_each_second_on_request(slipping: list[Estimate]) -> None:
    maps = [
        to_bag(one.message)
        for item in slipping
        for one in estimate_messages(ROBOT, item, SETTINGS)
        if one.topic == FLOOR_TOPIC
    ]
    assert len(maps) == 8
    last = maps[-1]
    assert last.info.width * last.info.height == len(last.data)
    assert last.info.resolution == pytest.approx(SIDE)
    assert max(last.data) > 30
    assert min(last.data) == UNKNOWN
    assert max(maps[1].data) == 0
    asked_not = play(drive(length=2.0), settings=OdometrySettings())
    assert all(item.floor is None for item in asked_not)
