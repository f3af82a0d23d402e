"""Recordings as they come: jittering, slow, late, in pieces, without voltages."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_power_model.calibration.calibrate import Result, Timing, align, calibrate
from tomr_power_model.calibration.parameters import Choice
from tomr_power_model.drive import read
from tomr_power_model.drive.clean import cleaned
from tomr_power_model.drive.cut import without
from tomr_power_model.drive.quality import sensor_faults
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import jazzy_typestore
from tomr_power_model.recordings import RecordingWriter, open_recording
from tomr_power_model.robot import read_description, shipped_robot

MakeDrive = Callable[..., Drive]
WriteBag = Callable[..., Path]
ROBOT = shipped_robot("reference")
BAG = Path(__file__).parents[3] / "bags" / "square"
CHOICE = Choice(keys=("robot.mass", "physics.friction.coulomb.torque"), shared=("all",))


def fitted(drive: Drive) -> tuple[float, float, Result]:
    """Mass, friction and all else of a calibration on a recording."""
    samples = align([cleaned(drive, ROBOT)], ROBOT, Timing(window=1e-9))
    result = calibrate(read_description("reference"), "test", samples, (), choice=CHOICE)
    friction = result.robot.effect("friction.coulomb")
    assert friction is not None
    return result.robot.mass, friction["torque"], result


def thinned(drive: Drive, encoders: int = 1, power: int = 1) -> Drive:
    """Every so many samples."""
    return evolve(
        drive,
        encoder_time=drive.encoder_time[::encoders],
        position=drive.position[::encoders],
        velocity=drive.velocity[::encoders],
        power_time=drive.power_time[::power],
        power=drive.power[::power],
        reading=drive.reading[::power],
        voltage=drive.voltage[::power],
        total_time=drive.total_time[::power],
        total=drive.total[::power],
        total_voltage=drive.total_voltage[::power],
    )


def test_jitter_is_taken_off_every_stream(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    drive = make_drive(ROBOT, 1)
    random = np.random.default_rng(1)
    topics = ("joint_states", "wheel_1/power", "wheel_2/power", "wheel_3/power", "battery_state")
    late = {topic: random.normal(0.0, 5e-4, 997) for topic in topics}
    found = read_drive(write_bag(drive, tmp_path / "tour", late), ROBOT)
    assert np.std(np.diff(found.encoder_time)) < 1e-6
    # What was sampled at once is one row again.
    assert len(found.power_time) == len(drive.power_time)
    assert np.isfinite(found.power).all()
    shift = found.encoder_time[0] - drive.encoder_time[0]
    assert np.abs(found.power_time - shift - drive.power_time).max() < 3e-4
    mass, friction, result = fitted(found)
    assert mass == pytest.approx(ROBOT.mass, rel=0.01)
    assert friction == pytest.approx(0.06, rel=0.1)
    assert not any("tomr_gap" in line for line in result.warnings)


@pytest.mark.parametrize(("encoders", "power"), [(3, 1), (1, 3)])
def test_slow_encoders_and_slow_power_still_suffice(
    make_drive: MakeDrive, encoders: int, power: int
) -> None:
    """33 Hz and 8 Hz."""
    drive = thinned(make_drive(ROBOT, 1), encoders, power)
    assert list(sensor_faults(drive, ROBOT)) == []
    mass, friction, _ = fitted(drive)
    assert mass == pytest.approx(ROBOT.mass, rel=0.05)
    assert friction == pytest.approx(0.06, rel=0.3)


def test_twenty_pieces_show_as_much_as_one(make_drive: MakeDrive) -> None:
    drive = make_drive(ROBOT, 1)
    holed = without(drive, [(2.0 * k + 1.6, 2.0 * k + 2.0) for k in range(20)])
    mass, friction, _ = fitted(holed)
    assert mass == pytest.approx(ROBOT.mass, rel=0.01)
    assert friction == pytest.approx(0.06, rel=0.1)


def test_one_late_sensor_is_named(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    bag = write_bag(make_drive(ROBOT, 1), tmp_path / "tour", {"wheel_2/power": 0.08})
    _, _, result = fitted(read_drive(bag, ROBOT))
    found = [line for line in result.warnings if "against joint_states" in line]
    assert [line.split()[0] for line in found] == ["wheel_2/power"]
    assert "late" in found[0]
    assert "tomr_gap explain" in found[0]


def test_a_clock_of_its_own_is_refused(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    drive = make_drive(ROBOT, 1)
    late = {"joint_states": 0.02 * drive.encoder_time}
    with pytest.raises(
        InputError, match=r"the clock of joint_states runs 2\.0 % faster than that of wheel_1/power"
    ):
        read_drive(write_bag(drive, tmp_path / "tour", late), ROBOT)


def test_a_clock_that_all_share_is_noted(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    drive = make_drive(ROBOT, 1)
    bag = write_bag(drive, tmp_path / "slow", received=lambda time: 1.02 * time)
    (note,) = read_drive(bag, ROBOT).notes
    assert "the stamps' clock runs 2.0 % slow against the recorder's" in note
    bag = write_bag(drive, tmp_path / "simulated", received=lambda time: 3.0 * time)
    assert read_drive(bag, ROBOT).notes == ()


def test_without_voltages_currents_are_compared_at_the_nominal_one(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    """And the whole robot's power, which has no other unit, is unknown."""
    drive = make_drive(ROBOT, 1)
    found = read_drive(write_bag(drive, tmp_path / "tour", voltage=float("nan")), ROBOT)
    np.testing.assert_allclose(found.power, drive.power, rtol=1e-6)
    assert len(found.total) == 0
    missing, nominal = found.notes
    assert "the voltage of the whole supply is missing (999 messages)" in missing
    assert nominal.endswith("currents are compared, at supply.nominal_voltage = 24 V")


def test_malformed_messages_are_left_out_and_counted(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever reading a message raises, as live: the others still count."""
    bag = write_bag(make_drive(ROBOT, 1), tmp_path / "tour")
    whole = read_drive(bag, ROBOT)
    given, count = read.twist_of, iter(range(10**6))

    def now_and_then(message: object) -> tuple[float, float, float]:
        number = next(count)
        if number < 2:
            raise (OverflowError, ValueError)[number]("no number")
        return given(message)

    monkeypatch.setattr(read, "twist_of", now_and_then)
    found = read_drive(bag, ROBOT)
    assert len(found.command_time) == len(whole.command_time) - 2
    assert any("no number" in note for note in found.notes)


def test_power_of_a_whole_robot_without_its_voltage_is_refused_in_these_words(
    tmp_path: Path, make_drive: MakeDrive, write_bag: WriteBag
) -> None:
    drive = make_drive(ROBOT, 1, seconds=12.0)
    alone = evolve(ROBOT, measurement=evolve(ROBOT.measurement, source="total_only"))
    bag = write_bag(drive, tmp_path / "tour", voltage=float("nan"))
    with pytest.raises(InputError, match=r"battery_state: the voltage of the whole supply is miss"):
        read_drive(bag, alone)


@pytest.mark.parametrize("is_measured", [True, False])
def test_an_imu_without_a_gyro_shows_no_yaw_rate(tmp_path: Path, is_measured: bool) -> None:
    store, kind = jazzy_typestore(), "sensor_msgs/msg/Imu"
    with (
        open_recording(BAG) as recording,
        RecordingWriter(tmp_path / "tour") as writer,
    ):
        for topic, type_name, data, stamp_ns in recording.raw_messages():
            if type_name == kind and not is_measured:
                message = store.deserialize_cdr(data, kind)
                message.angular_velocity_covariance = np.array([-1.0, *[0.0] * 8])
                writer.write_raw(topic, kind, bytes(store.serialize_cdr(message, kind)), stamp_ns)
            else:
                writer.write_raw(topic, type_name, data, stamp_ns)
    found = read_drive(tmp_path / "tour", ROBOT)
    assert (len(found.yaw_rate) > 0) is is_measured
    assert not any("imu" in note for note in found.notes)
