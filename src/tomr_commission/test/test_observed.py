"""A drive in arrays makes the very frames that the residual stage publishes."""

from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_commission.observed import Observed, band_of, frames_of, observe
from tomr_fault_diag.diagnosis.offline import diagnose
from tomr_fault_diag.diagnosis.pipeline import Pipeline
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import shipped_robot

BAG = Path(__file__).resolve().parents[3] / "bags" / "square"


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0])
def test_frames_with_other_bands_are_those_of_a_pipeline_that_has_them(rate: float) -> None:
    bands = {"band.power": 0.7, "band.relative": 0.05, "band.speed": 0.03, "band.transient": 0.2}
    ticks = {"decision_rate": rate}
    pipeline = Pipeline(shipped_robot("reference"), DiagnosisSettings.of({**bands, **ticks}, ""))
    with open_recording(BAG) as recording:
        frames = [frame for _, step in diagnose(recording, pipeline) for frame in step.frames]
    own = BandSettings(power=0.7, relative=0.05, speed=0.03, transient=0.2)
    usual = DiagnosisSettings.of(ticks, "")
    made = frames_of(observe(BAG, "square", shipped_robot("reference"), usual), own)
    assert len(made) == len(frames) > 15 * rate
    for ours, theirs in zip(made, frames, strict=True):
        assert ours.stamp_ns == theirs.stamp_ns
        for one, other in zip(ours.residuals, theirs.residuals, strict=True):
            assert one.stale == other.stale
            if not other.stale:
                assert (one.residual, one.modelled, one.unit) == (
                    other.residual,
                    other.modelled,
                    other.unit,
                )
                assert np.isclose(one.band, other.band, rtol=1e-4)


def test_band_is_the_larger_of_least_and_share_and_grows_with_change(healthy: Observed) -> None:
    bands = BandSettings(power=1.0, relative=0.5, transient=0.1, total_factor=2.0)
    modelled = np.zeros((3, 10))
    modelled[:, 1] = [4.0, 4.0, 6.0]
    drive = evolve(
        healthy,
        stamp_ns=healthy.stamp_ns[:3],
        residual=np.zeros((3, 10)),
        modelled=modelled,
        missing=np.full((3, 10), ""),
    )
    # 0.5 * 6 W + 0.1 * (6 - 4) W; the total, at 0 W, twice the least.
    assert np.allclose(band_of(drive, bands)[2, :2], [2.0, 3.2])


def test_what_is_left_out_is_left_out(healthy: Observed) -> None:
    kept = healthy.without([(2.0, 5.0)])
    assert len(healthy.stamp_ns) - len(kept.stamp_ns) == 61
    assert not ((kept.seconds > 2.0) & (kept.seconds < 5.0)).any()


def test_the_gyro_is_seen_with_its_band(healthy: Observed) -> None:
    yaw = np.array([[np.nan, np.nan], [0.05, 2.0], [-0.5, 2.3]])
    drive = evolve(healthy.part(slice(0, 3), "three"), yaw=yaw)
    unknown, first, second = (frame.yaw for frame in frames_of(drive, BandSettings()))
    assert unknown.stale
    assert (first.residual, first.modelled, first.unit, first.code) == (0.05, 2.0, "rad/s", 0)
    # A tenth of 2.3 rad/s, and the 0.3 rad/s by which the wheels' rate moved.
    assert np.isclose(second.band, 0.53)
    assert second.code == 0
    narrow = BandSettings(yaw_transient=0.0)
    assert frames_of(drive, narrow)[2].yaw.code == -1


def test_the_voltages_are_seen_with_their_bands(healthy: Observed) -> None:
    volts = np.array(
        [[np.nan] * 6, [0.1, -0.7, 0.2, 4.0, 6.0, 0.0], [0.1, 0.0, 0.0, 6.0, 6.0, 0.0]]
    )
    drive = evolve(healthy.part(slice(0, 3), "three"), volts=volts)
    bands = BandSettings(voltage=0.5, voltage_relative=0.1, voltage_transient=0.3)
    unknown, first, second = (frame.voltages for frame in frames_of(drive, bands))
    assert all(item.stale for item in unknown)
    shown = [(item.residual, item.modelled, item.unit, item.code) for item in first]
    assert shown == [(0.1, 4.0, "V", 0), (-0.7, 6.0, "V", -1), (0.2, 0.0, "V", 0)]
    # A tenth of 6 V, and 0.3 of the 2 V by which the first moved; of the last the least.
    assert np.isclose([item.band for item in second], [1.2, 0.6, 0.5]).all()


def test_a_recording_shows_what_its_drivers_hold(healthy: Observed) -> None:
    """The simulated robot equals its description: hundredths of a volt."""
    known = np.isfinite(healthy.volts).all(axis=1)
    assert known.mean() > 0.9
    assert np.abs(healthy.volts[known, 3:]).max() > 3.0
    assert np.sqrt(np.mean(healthy.volts[known, :3] ** 2)) < 0.1


def test_the_accelerometer_is_seen_with_its_bands(healthy: Observed) -> None:
    along = np.array([[np.nan] * 4, [0.1, -0.7, 2.0, 1.0], [0.1, -0.7, 3.0, 1.0]])
    drive = evolve(healthy.part(slice(0, 3), "three"), along=along)
    unknown, first, second = (frame.along for frame in frames_of(drive, BandSettings()))
    assert all(item.stale for item in unknown)
    x, y = first
    assert (x.residual, x.modelled, x.unit, x.code) == (0.1, 2.0, "m/s^2", 0)
    assert (y.residual, y.modelled, y.unit, y.code) == (-0.7, 1.0, "m/s^2", -1)
    # 0.15 of 3 m/s^2, and 0.3 of the 1 m/s^2 by which it moved; along y the least.
    assert np.isclose([item.band for item in second], [0.75, 0.3]).all()


def test_nothing_is_seen_by_an_imu_that_is_not_as_described(tmp_path: Path) -> None:
    """From the first on, though it was believed until it was seen."""
    turned = tmp_path / "turned"
    with open_recording(BAG) as recording, RecordingWriter(turned) as writer:
        for topic, type_name, message, receive_ns in recording.messages():
            if topic.endswith("imu/data"):
                for values in (message.angular_velocity, message.linear_acceleration):
                    values.x, values.y = -values.x, -values.y
            writer.write(topic, type_name, message, receive_ns)
    robot, settings = shipped_robot("reference"), DiagnosisSettings.of({}, "")
    found = observe(turned, "turned", robot, settings)
    assert np.isnan(found.yaw).all()
    assert np.isnan(found.along).all()
    assert np.isfinite(found.residual).any()
