"""The residual stage: codes, bands, staleness, and the ways in which power may be published."""

import math
import random
from collections.abc import Callable
from types import SimpleNamespace as Message
from typing import Any

import pytest
from attrs import evolve

from tomr_fault_diag.residuals.frame import ENCODERS, MOTORS, SPEEDS, TOTAL, Residual, ResidualFrame
from tomr_fault_diag.residuals.messages import frame_of, residual_message
from tomr_fault_diag.residuals.settings import ResidualSettings
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.drive.sources import PowerReading
from tomr_power_model.messages.bag import bag_header, bag_message, to_bag
from tomr_power_model.messages.intake import Unusable
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import Robot, shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
FRAME = 16  # statuses of a frame
NAN = math.nan
SPEED = (4.0, -4.0, 0.0)


def _robot(**measurement: object) -> Robot:
    robot = shipped_robot("reference")
    return evolve(robot, measurement=evolve(robot.measurement, **measurement))


def _prediction(stamp: int, power: float = 10.0, current: float | None = None) -> Prediction:
    drawn = power / 24.0 if current is None else current
    reading = SupplyReading.rounded(24.0, drawn)
    total = SupplyReading.rounded(24.0, (3 * power + 12.0) / 24.0)
    motors = (reading, reading, reading)
    volts = (power, -power, 0.0)
    held = (power + 1.0, -power, 0.0)
    return Prediction(stamp, SPEED, (0.1, 0.1, 0.1), motors, total, motors, volts, held)


def _battery(stamp: int, voltage: float, current: float) -> Any:
    return bag_message(
        "sensor_msgs/msg/BatteryState", header=bag_header(stamp), voltage=voltage, current=current
    )


def _unstamped(message: Any) -> Any:
    message.header = bag_header(0)
    return message


def _speeds_in_degrees(message: Any) -> Any:
    message.position = []
    message.velocity = [math.degrees(speed) for speed in message.velocity]
    return message


def _joints(stamp: int, effort: tuple[float, ...] = ()) -> Any:
    robot = shipped_robot("reference")
    seconds = 1e-9 * (stamp - BASE)
    return bag_message(
        "sensor_msgs/msg/JointState",
        header=bag_header(stamp),
        name=["other", *reversed(robot.wheel_names)],
        position=[9.0, *(speed * seconds for speed in reversed(SPEED))],
        velocity=[9.0, *reversed(SPEED)],
        effort=[9.0, *reversed(effort)] if effort else [],
    )


def _frames(robot: Robot, feed: dict[str, Any], power: float = 10.0) -> list[ResidualFrame]:
    """Half a second of messages; `feed` makes those of a topic from a stamp."""
    stage = ResidualStage(robot)
    takers = {item.topic: item.take for item in residual_inputs(robot, stage)}
    assert set(feed) <= set(takers)
    frames: list[ResidualFrame] = []
    for step in range(51):
        stamp = BASE + step * 10 * MS
        if step % 5 == 0:
            stage.prediction(_prediction(stamp, power))
        for topic, make in feed.items():
            takers[topic](make(stamp), stamp)
        frames.extend(stage.due())
    return frames


WATTS = {f"wheel_{n}/power": lambda t: _battery(t, 24.0, -10.0 / 24.0) for n in (1, 2, 3)}
ALL = {
    **WATTS,
    "battery_state": lambda t: _battery(t, 24.0, -42.0 / 24.0),
    "joint_states": _joints,
}


def test_a_healthy_robot_has_ten_known_zeros() -> None:
    frames = _frames(_robot(), ALL)
    assert len(frames) >= 8
    for frame in frames[1:]:
        assert frame.codes == (0,) * 10
        assert not any(residual.stale for residual in frame.residuals)
        assert all(abs(residual.residual) < 1e-2 for residual in frame.residuals)


def test_what_a_driver_holds_is_compared_with_what_is_expected_of_it() -> None:
    frame = _frames(_robot(), ALL)[-1]
    assert [item.residual for item in frame.voltages] == [1.0, 0.0, 0.0]
    assert [item.modelled for item in frame.voltages] == [10.0, -10.0, 0.0]
    bands = ResidualSettings().bands
    assert [item.band for item in frame.voltages] == [1.0, 1.0, bands.voltage]


def test_signs_and_places() -> None:
    feed = {**ALL, "wheel_2/power": lambda t: _battery(t, 24.0, -20.0 / 24.0)}
    frame = _frames(_robot(), feed)[-1]
    assert frame.codes == (0, 0, 1, 0, 0, 0, 0, 0, 1, 0)
    assert frame.residuals[MOTORS[1]].residual == pytest.approx(10.0, abs=1e-3)


def test_slower_than_commanded_is_negative_whichever_way_it_turns() -> None:
    stage_frames = _frames(_robot(), {**ALL, "joint_states": lambda t: _slow(t)})
    codes = stage_frames[-1].codes
    assert [codes[place] for place in SPEEDS] == [-1, -1, 0]


def _slow(stamp: int) -> Any:
    message = _joints(stamp)
    message.position = message.position * 0.5
    return message


@pytest.mark.parametrize(
    ("lost", "places"),
    [
        ("wheel_1/power", {MOTORS[0], ENCODERS[0]}),
        ("battery_state", {TOTAL}),
        ("joint_states", set(SPEEDS)),
    ],
)
def test_a_missing_input_makes_only_its_residuals_stale(lost: str, places: set[int]) -> None:
    feed = {topic: make for topic, make in ALL.items() if topic != lost}
    frame = _frames(_robot(), feed)[-1]
    stale = {index for index, residual in enumerate(frame.residuals) if residual.stale}
    assert stale == places
    assert all(lost in frame.residuals[index].missing for index in places)


def _disturbed(
    topic: str, change: Callable[[int, Any], Any | None], steps: int = 150
) -> dict[int, ResidualFrame]:
    """Frames by time [ms]; `change` gets time and message of a topic, None: it is lost."""
    robot = _robot()
    stage = ResidualStage(robot)
    takers = {item.topic: item.take for item in residual_inputs(robot, stage)}
    found = {}
    for step in range(steps):
        stamp = BASE + step * 10 * MS
        if step % 5 == 0:
            stage.prediction(_prediction(stamp))
        for name, make in ALL.items():
            message = make(stamp)
            message = change(step * 10, message) if name == topic else message
            if message is not None:
                takers[name](message, stamp)
        for frame in stage.due():
            found[(frame.stamp_ns - BASE) // MS] = frame
    return found


def test_an_input_that_falls_silent_is_a_gap_and_then_missing() -> None:
    frames = _disturbed("wheel_3/power", lambda t, message: message if t < 400 else None)
    said = {at: frame.residuals[MOTORS[2]].missing for at, frame in frames.items()}
    assert {said[t] for t in range(50, 500, 50)} == {""}  # 0.1 s is no gap
    assert {said[t] for t in range(500, 900, 50)} == {"a gap in wheel_3/power"}
    assert {said[t] for t in range(900, 1400, 50)} == {"no fresh wheel_3/power"}


@pytest.mark.parametrize(("topic", "place"), [("wheel_2/power", 2), ("joint_states", 5)])
def test_a_gap_ends_a_moment_after_the_stream_goes_on(topic: str, place: int) -> None:
    frames = _disturbed(topic, lambda t, message: message if t <= 500 or t > 700 else None)
    unknown = [at for at, frame in frames.items() if frame.residuals[place].stale]
    end = {"wheel_2/power": 710 + 50, "joint_states": 710 + 250}[topic]
    start = {"wheel_2/power": 650, "joint_states": 600}[topic]
    assert unknown == list(range(start, end, 50))


def test_stamps_that_go_back_leave_a_gap() -> None:
    """A clock put back by 0.2 s: what comes till it catches up is ignored, then comes the gap."""

    def back(at: int, message: Any) -> Any:
        stamp = BASE + (at - 200 * (at > 500)) * MS
        message.header = bag_header(stamp)
        return message

    frames = _disturbed("wheel_2/power", back, 160)
    said = {at: frame.residuals[MOTORS[1]].missing for at, frame in frames.items()}
    assert said[500] == ""
    assert "a gap in wheel_2/power" in {said[t] for t in range(550, 850, 50)}
    late = _disturbed("wheel_2/power", lambda t, m: back(750, m) if t == 700 else m)
    assert not any(frame.residuals[MOTORS[1]].stale for frame in late.values())


@pytest.mark.parametrize("stamp", [lambda at: BASE + (at - 700) * MS, lambda at: 0])
def test_a_sensor_with_bad_stamps_does_not_fall_silent(stamp: Callable[[int], int]) -> None:
    def stamped(at: int, message: Any) -> Any:
        if at > 1000:
            message.header = bag_header(stamp(at))
        return message

    frames = _disturbed("wheel_2/power", stamped, 450)
    said = {at: frame.residuals[MOTORS[1]].missing for at, frame in frames.items()}
    assert {said[t] for t in range(50, 1050, 50)} == {""}
    assert {said[t] for t in range(1550, 4400, 50)} == {
        "a gap in wheel_2/power: its stamps do not fit"
    }


def test_a_sensor_not_heard_since_the_stamps_leapt_is_not_silent_either() -> None:
    def hour(at: int, message: Any) -> Any | None:
        return message if at < 1000 else None

    stage = ResidualStage(_robot())
    takers = {item.topic: item.take for item in residual_inputs(_robot(), stage)}
    said: dict[int, str] = {}
    for step in range(300):
        at = step * 10
        stamp = BASE + at * MS + (3_600_000 * MS if at >= 1000 else 0)
        if step % 5 == 0:
            stage.prediction(_prediction(stamp))
        for name, make in ALL.items():
            message = hour(at, make(stamp)) if name == "wheel_2/power" else make(stamp)
            if message is not None:
                takers[name](message, stamp)
        for frame in stage.due():
            said[at] = frame.residuals[MOTORS[1]].missing
    assert {text for at, text in said.items() if at > 1200} == {
        "a gap in wheel_2/power: its stamps do not fit"
    }


def test_a_power_is_too_late_where_no_decision_can_rest_on_it() -> None:
    def taken(at_ms: int, begun_ms: int = 0) -> Arrival | str:
        stage = ResidualStage(_robot())
        stage._decided = BASE + 10_000 * MS
        if begun_ms:
            stage.power(PowerReading(1, BASE + 10_000 * MS, 10.0, 10.0 / 24.0, 24.0))
            stage.power(PowerReading(1, BASE + begun_ms * MS, 10.0, 10.0 / 24.0, 24.0))
        return stage.power(PowerReading(1, BASE + at_ms * MS, 10.0, 10.0 / 24.0, 24.0))

    stale = ResidualSettings().stale // MS
    assert taken(10_000 - stale + 1) is Arrival.TAKEN
    assert "too old" in str(taken(10_000 - stale))
    assert taken(1_010, begun_ms=1_000) is Arrival.TAKEN  # the clock begins anew


def test_after_a_leap_back_the_stage_is_as_at_its_start() -> None:
    def frames(stage: ResidualStage, power: float, start: int) -> list[ResidualFrame]:
        takers, found = {item.topic: item.take for item in residual_inputs(_robot(), stage)}, []
        watts = {topic: lambda t: _battery(t, 24.0, -power / 24.0) for topic in WATTS}
        for step in range(80):
            stamp = start + step * 10 * MS
            if step % 5 == 0:
                stage.prediction(_prediction(stamp, power))
            for name, make in (ALL | watts).items():
                takers[name](make(stamp), stamp)
            found += stage.due()
        return found

    used, fresh = ResidualStage(_robot()), ResidualStage(_robot())
    frames(used, 10.0, BASE + 100_000 * MS)
    again, wanted = frames(used, 14.0, BASE), frames(fresh, 14.0, BASE)
    # Encoders are a gap at first: who knows what happened meanwhile.
    assert repr(again[6:]) == repr(wanted[6:])  # NaN is not equal to itself
    assert [frame.voltages for frame in again[1:]] == [frame.voltages for frame in wanted[1:]]
    motors = [[frame.residuals[place] for place in MOTORS] for frame in again[1:]]
    assert motors == [[frame.residuals[place] for place in MOTORS] for frame in wanted[1:]]


def test_what_no_supply_can_deliver_is_no_sample() -> None:
    def absurd(at: int, message: Any) -> Any:
        if at == 600:
            message.voltage = 1e30
        return message

    for frame in _disturbed("wheel_2/power", absurd).values():
        assert frame.codes == (0,) * 10
        assert not frame.residuals[MOTORS[1]].stale


@pytest.mark.parametrize(
    ("topic", "bad", "words"),
    [
        (
            "wheel_2/power",
            lambda t: _battery(t, 24.0, NAN),
            "sends what cannot be used: the current",
        ),
        ("wheel_2/power", lambda t: _battery(t, 24e3, 1.0), "sends what cannot be used: more V"),
        (
            "battery_state",
            lambda t: _battery(t, NAN, -1.0),
            "sends what cannot be used: the voltage",
        ),
        (
            "joint_states",
            lambda t: Message(header=_joints(t).header, name=None),
            "sends what cannot be used: malformed",
        ),
        (
            "joint_states",
            lambda t: _speeds_in_degrees(_joints(t)),
            "sends what cannot be used: by robot.yaml no wheel can turn so far so fast (rad of",
        ),
        ("joint_states", lambda t: _unstamped(_joints(t)), "its stamps do not fit"),
        ("battery_state", lambda t: _unstamped(ALL["battery_state"](t)), "its stamps do not fit"),
    ],
)
def test_an_input_that_sends_what_cannot_be_used_says_so(
    topic: str, bad: Callable[[int], Any], words: str
) -> None:
    def ails(stamp: int) -> Any:
        return bad(stamp) if stamp > BASE + 500 * MS else ALL[topic](stamp)

    said, _ = _health({**ALL, topic: ails})
    assert words in said.pop(f"inputs: {topic}")
    assert set(said.values()) == {"as it should be"}


def _health(feed: dict[str, Callable[[int], Any]]) -> tuple[dict[str, str], list[int]]:
    """What is said of each input at last, in 1.5 s of messages, and the ticks [ms]."""
    robot, ticks = _robot(), []
    stage = ResidualStage(robot)
    takers = {item.topic: item.take for item in residual_inputs(robot, stage)}
    said: dict[str, str] = {}
    for step in range(150):
        stamp = BASE + step * 10 * MS
        if step % 5 == 0:
            stage.prediction(_prediction(stamp))
        for name, make in feed.items():
            takers[name](make(stamp), stamp)
        ticks += [(frame.stamp_ns - BASE) // MS for frame in stage.due()]
        for report in stage.reports():
            said.update({status.name: status.message for status in report.statuses})
    assert said.pop("inputs: robot.yaml") == "nothing speaks against it"
    return said, ticks


@pytest.mark.parametrize("topic", ["joint_states", "wheel_2/power", "imu/data"])
def test_an_input_of_another_clock_is_left_out_and_says_so(topic: str) -> None:
    feed = {**ALL, "imu/data": _imu}
    make = feed[topic]
    said, ticks = _health({**feed, topic: lambda stamp: make(stamp - 7_500 * MS)})
    words = "stamped 7.5 s behind the other inputs: synchronise the clocks"
    assert said.pop(f"inputs: {topic}") == words
    assert set(said.values()) == {"as it should be"}
    assert ticks == list(range(50, 1451, 50))


@pytest.mark.parametrize(
    ("topic", "place"), [("battery_state", TOTAL), ("wheel_2/power", MOTORS[1])]
)
def test_what_is_measured_once_a_second_is_not_compared(topic: str, place: int) -> None:
    stage, missing = ResidualStage(_robot()), []
    takers = {item.topic: item.take for item in residual_inputs(_robot(), stage)}
    for step in range(600):
        stamp = BASE + step * 10 * MS
        if step % 5 == 0:
            stage.prediction(_prediction(stamp))
        for name, make in ALL.items():
            if name != topic or step % 100 == 0:
                takers[name](make(stamp), stamp)
        missing += [frame.residuals[place].missing for frame in stage.due()]
    words = f"a gap in {topic}: it comes too rarely to be compared"
    assert set(missing[60:]) == {words}


def _imu(stamp: int) -> Any:
    rate = bag_message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.1)
    force = bag_message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=9.81)
    return bag_message(
        "sensor_msgs/msg/Imu",
        header=bag_header(stamp),
        angular_velocity=rate,
        linear_acceleration=force,
    )


def test_samples_that_come_in_another_order_are_a_gap_until_the_clock_begins_anew() -> None:
    stage, found = ResidualStage(_robot()), []
    takers = {item.topic: item.take for item in residual_inputs(_robot(), stage)}
    dice = random.Random(3)
    for number in range(300):
        # After 2 s another clock, and true stamps.
        begin, by = (0, 0.1) if number < 200 else (-90_000, 0.0)
        stamp = BASE + (begin + 10 * number) * MS
        message = _joints(stamp)
        message.position = message.position + message.velocity * dice.gauss(0.0, by)
        if number % 5 == 0:
            stage.prediction(_prediction(stamp))
        for topic, make in WATTS.items():
            takers[topic](make(stamp), stamp)
        takers["joint_states"](message, stamp)
        found += stage.due()
    speeds = [frame.residuals[SPEEDS[0]].missing for frame in found]
    assert set(speeds[12:38]) == {"a gap in joint_states: its stamps do not fit"}
    assert speeds[-10:] == [""] * 10


@pytest.mark.parametrize(
    ("count", "is_known"),
    [(2.0 * math.pi / 40_960, True), (2.0 * math.pi / (64 * 15), True), (0.1, False)],
)
def test_coarse_encoders_widen_bands_until_no_speed_is_known(count: float, is_known: bool) -> None:
    """Whole counts of the angles: 40,960 a turn, 960, 63. The third wheel stands all the time."""

    def rounded(_: int, message: Any) -> Any:
        message.position = count * (message.position // count)
        return message

    frames = list(_disturbed("joint_states", rounded).values())[10:]
    speeds = [[frame.residuals[place] for place in SPEEDS] for frame in frames]
    assert {speed.stale for one in speeds for speed in one} == {not is_known}
    assert {frame.codes for frame in frames} == {(0,) * 10}
    if not is_known:
        scatter = "the stamps of joint_states scatter too much to measure a speed"
        assert {speed.missing for one in speeds for speed in one} == {scatter}
    standing, least = {one[2].band for one in speeds}, ResidualSettings().bands.speed
    if count < 0.001:
        assert standing == {least}
    else:
        assert min(standing) > 1.2 * least


def test_where_stamps_scatter_no_speed_is_known_not_even_that_of_a_wheel_that_stands() -> None:
    dice = random.Random(4)

    def scattered(_: int, message: Any) -> Any:
        message.position = message.position + message.velocity * dice.gauss(0.0, 0.01)
        return message

    frames = list(_disturbed("joint_states", scattered).values())[10:]
    assert all(frame.residuals[place].stale for frame in frames for place in SPEEDS)


def test_an_angle_that_no_wheel_reaches_is_no_sample_unless_it_stays() -> None:
    def leaps(at: int, message: Any, until: int) -> Any:
        if 600 <= at < until:
            message.position = message.position + 40.0
        return message

    once = _disturbed("joint_states", lambda t, m: leaps(t, m, 620))
    assert {frame.codes for frame in once.values()} == {(0,) * 10}
    assert not any(once[t].residuals[SPEEDS[0]].stale for t in range(100, 1400, 50))
    anew = _disturbed("joint_states", lambda t, m: leaps(t, m, 10_000))
    assert {frame.codes for frame in anew.values()} == {(0,) * 10}
    unknown = [t for t, frame in anew.items() if frame.residuals[SPEEDS[0]].stale and t > 50]
    assert unknown == list(range(650, 870, 50))


def test_without_predictions_everything_is_stale_and_says_so() -> None:
    robot = _robot()
    stage = ResidualStage(robot)
    takers = {item.topic: item.take for item in residual_inputs(robot, stage)}
    frames = []
    for step in range(100):
        for topic, make in ALL.items():
            takers[topic](make(BASE + step * 10 * MS), 0)
        frames.extend(stage.due())
    assert frames
    assert all("power_model" in r.missing for r in frames[-1].residuals)


def test_a_current_without_voltage_is_compared_in_amperes() -> None:
    feed = {
        **ALL,
        **{f"wheel_{n}/power": lambda t: _battery(t, NAN, -10.0 / 24.0) for n in (1, 2, 3)},
    }
    frame = _frames(_robot(), feed)[-1]
    assert {frame.residuals[index].unit for index in MOTORS} == {"A"}
    assert frame.codes == (0,) * 10
    assert frame.residuals[MOTORS[0]].modelled == pytest.approx(10.0 / 24.0, rel=1e-5)


def test_an_array_of_powers() -> None:
    feed = {
        "power": lambda t: bag_message("std_msgs/msg/Float64MultiArray", data=[10.0, 10.0, 30.0]),
        "joint_states": _joints,
        "battery_state": ALL["battery_state"],
    }
    frame = _frames(_robot(source="multi_array"), feed)[-1]
    assert frame.codes == (0, 0, 0, 1, 0, 0, 0, 0, 0, 1)


def test_effort_as_current() -> None:
    robot = _robot(source="joint_effort", quantity="motor_current", total="sum")
    drawn = 10.0 / 24.0
    feed = {"joint_states": lambda t: _joints(t, (drawn, 3.0 * drawn, drawn))}
    frame = _frames(robot, feed)[-1]
    assert frame.codes == (1, 0, 1, 0, 0, 0, 0, 0, 1, 0)
    assert {residual.unit for residual in frame.residuals[:4]} == {"A"}


def test_one_total_only() -> None:
    feed = {"joint_states": _joints, "battery_state": lambda t: _battery(t, 24.0, -60.0 / 24.0)}
    frame = _frames(_robot(source="total_only"), feed)[-1]
    assert frame.codes[TOTAL] == 1
    assert all(frame.residuals[index].stale for index in (*MOTORS, *ENCODERS))
    assert not any(frame.residuals[index].stale for index in SPEEDS)


def test_unsigned_currents_are_magnitudes() -> None:
    robot = _robot(signed=False, total="sum")
    feed = {
        **{f"wheel_{n}/power": lambda t: _battery(t, NAN, 10.0 / 24.0) for n in (1, 2, 3)},
        "joint_states": _joints,
    }
    assert _frames(robot, feed)[-1].codes == (0,) * 10


def test_the_supplys_voltage_is_that_of_the_whole_else_the_middle_of_the_motors() -> None:
    volts = {1: 18.0, 2: 21.0, 3: 24.0}
    feed = {
        f"wheel_{n}/power": lambda t, n=n: _battery(t, volts[n], -10.0 / volts[n]) for n in volts
    }
    whole = {**feed, "battery_state": lambda t: _battery(t, 19.2, -42.0 / 19.2)}
    assert _frames(_robot(), whole)[-1].supply == 0.8
    assert _frames(_robot(total="sum"), feed)[-1].supply == 0.875
    unknown = {f"wheel_{n}/power": lambda t: _battery(t, NAN, -0.4) for n in volts}
    assert math.isnan(_frames(_robot(total="sum"), unknown)[-1].supply)


def test_a_frame_survives_its_message() -> None:
    robot = _robot()
    values = [0.123456, -4.0, 1e-7, NAN, 2.0, 3.0, -123456.0, 0.0, 1.5, 7.0]
    residuals = tuple(
        Residual(value, 1.0, 2.5, unit, missing="lost" if math.isnan(value) else "")
        for value, unit in zip(values, ["W", "A", "rad/s"] * 4, strict=False)
    )
    frame = ResidualFrame(BASE, residuals, 0.912, mistake="a plug: exchange it")
    message = to_bag(residual_message(robot, frame).plain)
    back = frame_of(message, BASE)
    assert back.supply == 0.912
    assert back.mistake == frame.mistake
    assert [item.value for item in message.status[TOTAL].values if item.key == "supply"] == [
        "0.912"
    ]
    assert not any(item.key == "supply" for item in message.status[MOTORS[0]].values)
    assert back.codes == frame.codes
    for one, other in zip(back.residuals, frame.residuals, strict=True):
        assert (one.residual == other.residual) or (one.stale and other.stale)
        assert one.missing == other.missing
        assert one.stale or one.unit == other.unit


@pytest.mark.parametrize("band", ["0", "-0.0", "-1"])
@pytest.mark.parametrize("residual", ["0.5", "nan"])
def test_a_band_without_width_is_refused(band: str, residual: str) -> None:
    values = {"residual": residual, "band": band, "modelled": "2.0"}
    pairs = [Message(key=key, value=value) for key, value in values.items()]
    status = Message(name="x", message="high by 1 W", values=pairs)
    with pytest.raises(Unusable, match=f"x: a band of {float(band):g}, it must be above 0"):
        frame_of(Message(status=[status] * FRAME), BASE)


@pytest.mark.parametrize(
    "message",
    [
        Message(status=[]),
        Message(status=[Message(name="x", message="", values=[])] * FRAME),
        Message(
            status=[
                Message(name="x", message="", values=[Message(key="residual", value="a")])
            ] * FRAME
        ),
    ],
)  # fmt: skip
def test_a_strange_message_is_refused(message: Any) -> None:
    with pytest.raises(Unusable):
        frame_of(message, BASE)
