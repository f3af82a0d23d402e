"""Drives in MuJoCo: the truth beside what the diagnosis sees, tick by tick."""

from collections.abc import Callable

import numpy as np
from attrs import evolve

from tomr_fault_diag.residuals.frame import MOTORS, SPEEDS
from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Bump, Drive
from tomr_training.simulated_drive import START_NS, healthy_twin, simulated_drive

Straight = Callable[..., Drive]


def test_truth_and_frames_are_of_the_same_ticks(straight: Straight) -> None:
    lost = PlannedFault("control_signal_lost", 2.0, 3.0, {"severity": 1.0, "wheel": 2})
    drive = straight(faults=(lost,))
    seen = simulated_drive(drive)
    ticks = seen.first + np.arange(len(seen.frames))
    stamps = np.array([frame.stamp_ns for frame in seen.frames])
    assert (np.diff(stamps) == 50_000_000).all()
    assert ticks[seen.faulty].tolist() == list(range(41, 61))
    assert len(seen.truth.power) == len(seen.frames)

    def measured(frame_index: int, channel: int) -> float:
        item = seen.frames[frame_index].residuals[channel]
        way = -1.0 if channel in SPEEDS and item.modelled < 0.0 else 1.0
        return item.modelled + way * item.residual

    for channels, true, off in ((MOTORS, seen.truth.power, 1.0), (SPEEDS, seen.truth.speed, 0.3)):
        found = np.array([[measured(k, c) for c in channels] for k in range(len(ticks))])
        by_shift = [
            float(np.nanmean(np.abs(np.roll(true, shift, axis=0) - found)[2:-2]))
            for shift in (-1, 0, 1)
        ]
        assert int(np.argmin(by_shift)) == 1
        assert by_shift[1] < off
    # Without its signal the motor draws standby only.
    np.testing.assert_allclose(seen.truth.power[seen.faulty][2:, 1], 1.2, atol=0.01)


def test_a_twin_is_the_same_drive_without_its_fault(straight: Straight) -> None:
    lost = PlannedFault("control_signal_lost", 2.0, None, {"severity": 1.0, "wheel": 2})
    drive = straight(faults=(lost,), bumps=(Bump(1.5, 0.1, (40.0, 0.0), 0.0),))
    seen, twin = simulated_drive(drive), healthy_twin(drive)
    calm = healthy_twin(evolve(drive, bumps=()))
    before = 40 - seen.first + 1
    own = twin.of_ticks(seen.first - 1 + np.arange(len(seen.frames)))
    np.testing.assert_array_equal(own.power[:before], seen.truth.power[:before])
    assert np.abs(own.power - seen.truth.power)[before + 2 :, 1].min() > 0.5
    # The push is over after 0.1 s, and only what comes after it differs.
    change = np.abs(twin.power - calm.power).max(axis=1)
    assert change[:30].max() == 0.0
    assert change[30:34].max() > 2.0
    assert change[45:].max() < 0.5


def test_a_robot_may_have_no_imu(straight: Straight) -> None:
    seen, without = simulated_drive(straight()), simulated_drive(straight(), ("imu/data",))
    assert any(not frame.along[0].stale for frame in seen.frames)
    assert all(one.stale for frame in without.frames for one in (frame.yaw, *frame.along))
    # Nothing else is another.
    assert [one.residuals for one in without.frames] == [one.residuals for one in seen.frames]


def test_an_accelerometer_feels_the_slope_that_pulls_and_no_push(straight: Straight) -> None:
    """For half a second 0.6 m/s^2 along x, on wheels that hold the robot."""
    mass = straight().plant.mass
    push = Bump(3.0, 0.5, (-0.6 * mass, 0.0), 0.0)
    felt = {}
    for is_slope in (False, True):
        seen = simulated_drive(straight(bumps=(evolve(push, is_slope=is_slope),)))
        begin = next(n for n, one in enumerate(seen.frames) if one.stamp_ns > START_NS + 3.2e9)
        while_it_pulls = [one.along[0].residual for one in seen.frames[begin : begin + 5]]
        felt[is_slope] = float(np.mean(while_it_pulls))
        after = [one.along[0].residual for one in seen.frames[begin + 12 :]]
        assert abs(np.mean(after)) < 0.05
    assert abs(felt[False]) < 0.05
    assert abs(felt[True] - 0.6) < 0.05
