"""What to replay of a recording, and when: the part of `bag_replay` that needs no ROS."""

from collections.abc import Sequence

from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.recordings import Recording, require_topic
from tomr_power_model.robot.parameters import ParameterSpec

GROUND_TRUTH = "ground_truth"
# What the suite or ROS itself publishes while a recording is replayed; never played back unasked.
_OUTPUTS = frozenset(
    {
        "clock",
        "diagnostics",
        "floor_traction",
        "from_encoders",
        "odom_slip",
        "parameter_events",
        "predicted",
        "residuals",
        "rosout",
        "slip",
    }
)

REPLAY_PARAMETERS = (
    ParameterSpec("bag", "recording to replay: a rosbag2 folder, a .mcap or a .db3 file", "str"),
    ParameterSpec(
        "rate",
        "speed of replay, 1: as recorded",
        default=1.0,
        above=0.0,
        maximum=100.0,
        read_only=False,
    ),
    ParameterSpec("start_offset", "skip this much", default=0.0, unit="s", minimum=0.0),
    ParameterSpec("loop", "begin again at the end; /clock jumps back then", "bool", False),
    ParameterSpec(
        "topics", "replay only these; none named: all but what the suite publishes", "strs", ()
    ),
    ParameterSpec(
        "include_ground_truth",
        "replay ground_truth/* too, where `topics` names none",
        "bool",
        False,
    ),
    ParameterSpec(
        "wait_for_subscribers",
        "wait at most this long until each topic has a subscriber; 0: begin at once",
        default=3.0,
        unit="s",
        minimum=0.0,
        maximum=600.0,
    ),
    ParameterSpec(
        "clock_rate",
        "messages on /clock per second of wall time",
        default=50.0,
        unit="Hz",
        minimum=1.0,
        maximum=1000.0,
    ),
)


class PlaybackClock:
    """Maps wall time to the recording's time at a rate that may change in between."""

    def __init__(self, start_ns: int, wall_ns: int, rate: float) -> None:
        """Begin at the recording's `start_ns` [ns] when the wall clock shows `wall_ns` [ns]."""
        self._anchor_ns = start_ns
        self._wall_ns = wall_ns
        self._rate = rate

    @property
    def rate(self) -> float:
        """Seconds of the recording per second of wall time."""
        return self._rate

    def set_rate(self, rate: float, wall_ns: int) -> None:
        """Go on at another rate from here, without a jump."""
        self._anchor_ns = self.now_ns(wall_ns)
        self._wall_ns = wall_ns
        self._rate = rate

    def now_ns(self, wall_ns: int) -> int:
        """Time of the recording [ns] at wall time `wall_ns` [ns]."""
        return self._anchor_ns + round((wall_ns - self._wall_ns) * self._rate)

    def due_ns(self, stamp_ns: int) -> int:
        """Wall time [ns] at which the recording reaches `stamp_ns` [ns]."""
        return self._wall_ns + round((stamp_ns - self._anchor_ns) / self._rate)


def select_topics(
    recording: Recording, topics: Sequence[str], include_ground_truth: bool
) -> dict[str, str]:
    """Return type by full name of the topics to replay.

    With `topics` these and no others, found with or without a namespace; else every topic but the
    outputs of the suite (predictions, residuals, diagnostics, slip), /clock, ROS's own and, unless
    included, ground_truth/*.

    Raises:
        InputError: a topic that is not there, or nothing left to replay.
    """
    if topics:
        names = [require_topic(recording, topic) for topic in topics]
    else:
        left_out = _OUTPUTS if include_ground_truth else _OUTPUTS | {GROUND_TRUTH}
        names = [name for name in recording.topics if left_out.isdisjoint(name.split("/"))]
    if not names:
        raise InputError(
            f"{recording.name} holds no sensor topic, only {', '.join(recording.topics)}; "
            "name what to replay in `topics`"
        )
    return {name: recording.topics[name] for name in names}


def first_stamp_ns(recording: Recording, start_offset: float) -> int:
    """Return the recording's stamp [ns] `start_offset` [s] after its begin.

    Raises:
        InputError: the offset is beyond the end.
    """
    stamp_ns = recording.start_ns + round(start_offset * NANOSECONDS)
    if stamp_ns > recording.end_ns:
        length = (recording.end_ns - recording.start_ns) / NANOSECONDS
        raise InputError(
            f"start_offset = {start_offset:g} s is beyond the end: {recording.name} lasts "
            f"{length:g} s"
        )
    return stamp_ns
