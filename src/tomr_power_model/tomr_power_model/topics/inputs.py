"""Which topics a stage reads and what it does with each message; nodes and tools share this."""

from collections.abc import Callable
from functools import partial
from typing import Any

from attrs import frozen

from tomr_power_model.drive.plausible import IGNORED, PowerLimits
from tomr_power_model.drive.sources import (
    ENCODER_TOPIC,
    VOLTAGE_TOPIC,
    PowerReading,
    PowerTopic,
    motor_topics,
    total_topics,
)
from tomr_power_model.errors import one_line
from tomr_power_model.limits import limits
from tomr_power_model.messages.inertial import Imu
from tomr_power_model.messages.intake import (
    MALFORMED,
    Triple,
    Unusable,
    header_stamp_ns,
    numbers_of,
    stamp_of,
    twist_of,
)
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.messages.types import IMU, JOINT_STATE, MULTI_ARRAY, TWIST, TWIST_STAMPED
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.robot import WHEELS, Robot

_MOST_KINDS = 200  # of complaints that are distinguished: their words may be a message's
Take = Callable[[Any, int], Arrival | str | None]


@frozen
class Input:
    """One topic of a stage. `take` gets a message and its receive time [ns] and returns a
    complaint in words, or None if all is well."""

    topic: str
    type_name: str
    take: Callable[[Any, int], str | None]
    other_types: tuple[str, ...] = ()
    # Whether a message of this stamp [ns] is left out, decided before the rest of it is read.
    is_too_close: Callable[[int], bool] | None = None
    is_optional: bool = False  # whether a robot may well lack it


class Thinning:
    """Leaves out samples that come more closely than nodes take those of a topic: they add nothing
    more. What `Flow` lets through of a flood is uneven, and recordings know nothing of it."""

    def __init__(self, closest_ns: int = 0, newest: Callable[[], int] | None = None) -> None:
        """`closest_ns`: that samples may come, where that is farther than the nodes' limit;
        `newest`: stamp of the sample that counts as the last, that asked about without."""
        self._newest = newest
        self._closest = max(closest_ns, NANOSECONDS // limits().topic_rate)
        self._last = 0

    def is_too_close(self, stamp_ns: int) -> bool:
        """Whether to leave out a sample; what goes back or repeats is for others to judge."""
        last = self._last if self._newest is None else self._newest()
        if 0 < stamp_ns - last < self._closest:
            return True
        self._last = stamp_ns
        return False

    def around(self, take: Take) -> Take:
        """The same as `take`, of the samples that are left."""

        def thinned(message: Any, receive_ns: int) -> Arrival | str | None:
            if self.is_too_close(header_stamp_ns(message) or 0):
                return None
            return take(message, receive_ns)

        return thinned


def guarded(
    take: Take, refused: Callable[[str], None] = lambda problem: None
) -> Callable[[Any, int], str | None]:
    """Turn an unusable message or stamp into a complaint: no message may stop a stage.

    `refused` gets why nothing can be read from a message.
    """

    def taken(message: Any, receive_ns: int) -> str | None:
        try:
            return _complaint(take(message, receive_ns))
        except Unusable as error:
            problem = str(error)
        except MALFORMED as error:
            problem = f"malformed ({error})"
        refused(problem)
        return f"{problem}; the message is ignored"

    return taken


def _complaint(arrival: Arrival | str | None) -> str | None:
    """What to say of a stamp, None if nothing."""
    if arrival is None or arrival is Arrival.TAKEN:
        return None
    if isinstance(arrival, str):
        return arrival
    if arrival is Arrival.RESTARTED:
        return "the stamp jumps against the other topics: started afresh"
    if arrival is Arrival.FOREIGN:
        return f"the stamp {arrival.value}; the message is ignored: synchronise the clocks"
    return f"the stamp {arrival.value}; the message is ignored"


def model_inputs(
    robot: Robot, predictor: PowerPredictor, wheels: WheelStream | None = None
) -> tuple[Input, ...]:
    """Inputs of the model stage; `wheels` may be shared with another stage."""

    def command(message: Any, receive_ns: int) -> Arrival:
        return predictor.command(stamp_of(message, receive_ns, fallback=True), twist_of(message))

    inertial = Imu(robot.imu_rpy)

    def imu(message: Any, receive_ns: int) -> Arrival:
        (_, _, rate), _ = inertial.read(message)
        return predictor.imu(stamp_of(message, receive_ns), rate)

    def voltages(message: Any, receive_ns: int) -> Arrival:
        first, second, third = numbers_of(message, WHEELS)[:WHEELS]
        return predictor.voltages(receive_ns, (first, second, third))

    limits = PowerLimits.of(robot)

    def power(reading: PowerReading) -> Arrival | str:
        if problem := limits.problem(reading):
            return f"{problem}; {IGNORED}"
        return predictor.measured(reading.wheel, reading.stamp_ns)

    inputs = [
        Input("cmd_vel", TWIST_STAMPED, guarded(command), (TWIST, TWIST_STAMPED)),
        *measured_inputs(robot, predictor.encoders, power, wheels),
    ]
    if robot.measurement.motor_voltage:
        inputs.append(Input(VOLTAGE_TOPIC, MULTI_ARRAY, guarded(voltages)))
    if predictor.settings.use_imu:
        inputs.append(imu_input(imu))
    return tuple(inputs)


def imu_input(take: Take) -> Input:
    """The IMU of a stage that decides by ticks, and that a robot may well lack: more samples than
    60 a second add nothing, and their reading costs."""
    thinning = Thinning(NANOSECONDS // 60)
    taker = guarded(thinning.around(take))
    return Input("imu/data", IMU, taker, is_too_close=thinning.is_too_close, is_optional=True)


def measured_inputs(
    robot: Robot,
    encoders: Callable[[int, Triple, Triple], Arrival | str],
    power: Callable[[PowerReading], Arrival | str],
    wheels: WheelStream | None = None,
    *,
    refused: Callable[[str, str], None] = lambda topic, problem: None,
) -> tuple[Input, ...]:
    """Inputs of a stage that takes encoders and power; `wheels` may be shared with another one.

    `refused` gets the topic of each message that nothing can be read from, and why.
    """
    wheels = wheels or WheelStream(robot.wheel_names)
    take = _encoders(wheels, encoders)
    inputs = []
    for source in (*motor_topics(robot), *total_topics(robot)):
        if source.topic == ENCODER_TOPIC:
            take = _with_power(take, source, power)
        else:
            taker = guarded(_power(source, power), partial(refused, source.topic))
            inputs.append(Input(source.topic, source.type_name, taker))
    # Wheels in messages of their own, and an arm's joints, are stamped right before and after.
    thinning = Thinning(newest=lambda: wheels.newest)
    taker = guarded(thinning.around(take), partial(refused, ENCODER_TOPIC))
    encoder_input = Input(ENCODER_TOPIC, JOINT_STATE, taker, is_too_close=thinning.is_too_close)
    return (encoder_input, *inputs)


def _power(source: PowerTopic, power: Callable[[PowerReading], Arrival | str]) -> Take:
    def take(message: Any, receive_ns: int) -> Arrival | str | None:
        outcome: Arrival | str | None = None
        for reading in source.read(message, receive_ns):
            found = power(reading)
            outcome = outcome if isinstance(outcome, str) else found
        return outcome

    return take


def _with_power(
    encoders: Take, source: PowerTopic, power: Callable[[PowerReading], Arrival | str]
) -> Take:
    also = _power(source, power)

    def take(message: Any, receive_ns: int) -> Arrival | str | None:
        arrival = encoders(message, receive_ns)
        if arrival in (Arrival.UNSTAMPED, Arrival.REPEATED):
            return arrival
        problem = also(message, receive_ns)
        return problem if isinstance(problem, str) else arrival

    return take


def _encoders(wheels: WheelStream, take: Callable[[int, Triple, Triple], Arrival | str]) -> Take:
    """Reads the wheels out of joint_states for a stage's `encoders`; reports missing wheels."""

    def encoders(message: Any, receive_ns: int) -> Arrival | str | None:
        outcome: Arrival | str | None = None
        for stamp, found in wheels.samples(message, stamp_of(message, receive_ns)):
            arrival = take(stamp, found.position, found.velocity)
            if arrival is Arrival.TAKEN and found.absent:
                arrival = f"no {', '.join(found.absent)} among its names"
            outcome = outcome if isinstance(outcome, str) else arrival
        return outcome

    return encoders


class Complaints:
    """Counts complaints and says which are worth a line: the 1st, 10th, 100th, ... of a kind."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str], int] = {}

    def note(self, topic: str, problem: str) -> str | None:
        """Count a complaint; returns the line to print, if it is time for one."""
        key = (topic, one_line(problem))
        if key not in self.counts and len(self.counts) >= _MOST_KINDS:
            key = (topic, "further problems of other kinds")
        count = self.counts[key] = self.counts.get(key, 0) + 1
        if str(count).rstrip("0") != "1":
            return None
        return f"{topic}: {key[1]}" + (f" ({count} times)" if count > 1 else "")
