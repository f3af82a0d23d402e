"""What a flood of encoder messages does to `tomr_diagnosis`: delay of verdicts after it, memory.

bench/flood.py --rate 5000 --seconds 20
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from struct import Struct
from typing import Any

from attrs import frozen
from drive import ROBOT, Raw
from feeder_node import Feeder, feeder
from online import LISTENER, ONE, Command, all_run, noted_pairs, suite_commands
from processes import resident_mb, running

from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.messages.bag import bag_header, bag_message, jazzy_typestore
from tomr_power_model.messages.plain import NANOSECONDS
from tomr_power_model.messages.types import BATTERY, JOINT_STATE, TWIST_STAMPED
from tomr_power_model.robot import shipped_robot

USUAL = 100.0  # Hz of encoders
POWER, COMMANDS = 50.0, 20.0  # Hz
SETTLING, AFTER = 4.0, 5.0  # s of usual rates before and after the flood
_LEAD_NS = NANOSECONDS // 5
_STAMP = Struct("<iI")  # of a serialised message, after four bytes


@frozen
class Flood:
    """Encoders at `rate` [Hz] for `seconds`, between spells of the usual rate."""

    rate: float
    seconds: float
    start_ns: int

    @property
    def begin_ns(self) -> int:
        return self.start_ns + round(SETTLING * NANOSECONDS)

    @property
    def end_ns(self) -> int:
        return self.begin_ns + round(self.seconds * NANOSECONDS)

    @property
    def last_ns(self) -> int:
        return self.end_ns + round(AFTER * NANOSECONDS)

    def messages(self) -> list[Raw]:
        """What a robot at rest publishes, in the order of stamps."""
        robot = shipped_robot(ROBOT)
        zeros = [0.0] * len(robot.wheel_names)
        encoders = {"name": list(robot.wheel_names), "position": zeros, "velocity": zeros}
        supply = {"voltage": 24.0, "current": -0.05}
        found = [
            *_stream("/joint_states", JOINT_STATE, encoders, self.start_ns, self.begin_ns, USUAL),
            *_stream("/joint_states", JOINT_STATE, encoders, self.begin_ns, self.end_ns, self.rate),
            *_stream("/joint_states", JOINT_STATE, encoders, self.end_ns, self.last_ns, USUAL),
            *_stream("/cmd_vel", TWIST_STAMPED, {}, self.start_ns, self.last_ns, COMMANDS),
        ]
        for wheel in robot.wheel_topics:
            topic = f"/{wheel}/power"
            found += _stream(topic, BATTERY, supply, self.start_ns, self.last_ns, POWER)
        return sorted(found, key=lambda message: message.stamp_ns)


def _stream(
    topic: str, type_name: str, fields: dict[str, Any], begin_ns: int, end_ns: int, rate: float
) -> Iterator[Raw]:
    """One message over and over, stamped anew."""
    message = bag_message(type_name, header=bag_header(0), **fields)
    data = bytearray(jazzy_typestore().serialize_cdr(message, type_name))
    for number in range(round((end_ns - begin_ns) * rate / NANOSECONDS)):
        stamp_ns = begin_ns + round(number * NANOSECONDS / rate)
        _STAMP.pack_into(data, 4, *divmod(stamp_ns, NANOSECONDS))
        yield Raw(topic, type_name, bytes(data), stamp_ns)


def _play(source: Feeder, flood: Flood, messages: Sequence[Raw], pid: int) -> tuple[int, str]:
    """When the first message was due on the monotonic clock [ns], and how the flood went."""
    timed = [(message.stamp_ns - flood.start_ns, message) for message in messages]
    begin, end = (
        next(n for n, message in enumerate(messages) if message.stamp_ns >= stamp_ns)
        for stamp_ns in (flood.begin_ns, flood.end_ns)
    )
    start = time.monotonic_ns() + _LEAD_NS
    source.play(timed[:begin], start)
    before = resident_mb(pid)
    handed = source.play(timed[begin:end], start)
    source.play(timed[end:], start)
    late = (handed[-1] - start - timed[end - 1][0]) / NANOSECONDS
    after = resident_mb(pid)
    return start, (
        f"its last message handed over {late:.2f} s late; memory {before:.0f} MB before, "
        f"{after:.0f} MB after"
    )


def _flooded(flood: Flood) -> str:
    """The figures, as a line."""
    messages = flood.messages()
    described = files("tomr_power_model").joinpath("robots").joinpath(f"{ROBOT}.yaml")
    with (
        tempfile.TemporaryDirectory(prefix="tomr-bench-") as folder,
        as_file(described) as file,
        feeder(messages) as source,
    ):
        noted = Path(folder, "arrivals")
        commands = suite_commands(file, {"report_period": 0.05}, ONE)
        listener: dict[str, Command] = {"listener": [sys.executable, LISTENER, noted]}
        with running(commands | listener, Path(folder)) as nodes:
            readers = dict.fromkeys((DIAGNOSTICS, *(m.topic for m in messages)), 1)
            source.wait_for(readers, lambda: all_run(nodes))
            start, words = _play(source, flood, messages, nodes[ONE[0]].pid)
        pairs = noted_pairs(noted)
    delays = [
        (arrival - start - (stamp - flood.start_ns)) / NANOSECONDS
        for stamp, arrival in pairs
        if stamp > flood.end_ns
    ]
    if not delays:
        raise InputError("no verdict came after the flood")
    return (
        f"{flood.rate:g} Hz for {flood.seconds:g} s: of {len(delays)} verdicts in the {AFTER:g} s "
        f"after it the latest came {max(delays):.2f} s after its stamp; {words}"
    )


def _bench(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=5000.0, help="Hz (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=20.0, help="default: %(default)s")
    options = parser.parse_args(arguments)
    print(_flooded(Flood(options.rate, options.seconds, time.time_ns())))
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_bench))
