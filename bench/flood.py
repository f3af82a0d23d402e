"""What a flood of encoder messages does to `tomr_diagnosis`: delay of verdicts after it, memory.

bench/flood.py --rate 5000 --seconds 20
"""

import argparse
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from processes import command_path, resident_mb, running
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import BatteryState, JointState

from tomr_fault_diag.classifier.messages import NAME
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.messages.intake import header_stamp_ns
from tomr_power_model.nodes.stage_node import SENSOR_QOS
from tomr_power_model.robot import shipped_robot

USUAL = 100.0  # Hz of encoders
POWER, COMMANDS = 50.0, 20.0  # Hz
SETTLING, AFTER = 4.0, 5.0  # s of usual rates before and after the flood
_STAMP = struct.Struct("<iI")  # of a serialised message, after four bytes


class Robot(Node):
    """A robot at rest, which hears what is said of it."""

    def __init__(self) -> None:
        super().__init__("flooder")
        wheels = shipped_robot("reference").wheel_names
        zeros = [0.0] * len(wheels)
        encoders = JointState(name=list(wheels), position=zeros, velocity=zeros)
        supply = BatteryState(voltage=24.0, current=-0.05)
        self.encoders = self._outlet("joint_states", encoders)
        self.supplies = [
            self._outlet(f"{wheel.removesuffix('_joint')}/power", supply) for wheel in wheels
        ]
        self.commands = self._outlet("cmd_vel", TwistStamped())
        self.verdicts: list[tuple[float, float]] = []  # heard at, of [s]
        self.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 100)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def _outlet(self, topic: str, message: Any) -> Callable[[float], None]:
        data = bytearray(serialize_message(message))
        publisher = self.create_publisher(type(message), topic, SENSOR_QOS)

        def publish(stamp: float) -> None:
            _STAMP.pack_into(data, 4, int(stamp), int(1e9 * (stamp % 1.0)))
            publisher.publish(bytes(data))

        return publish

    def _hear(self, message: DiagnosticArray) -> None:
        if any(status.name == NAME for status in message.status):
            self.verdicts.append((time.time(), 1e-9 * (header_stamp_ns(message) or 0)))

    def spin(self) -> None:
        """Take what has come in."""
        for _ in range(8):
            self._executor.spin_once(0.0)

    def run(self, rate: float, seconds: float) -> None:
        """Publish for a time, encoders at a rate [Hz]."""
        begin = time.time()
        sent = dict.fromkeys(("encoders", "supplies", "commands"), 0)
        while (passed := time.time() - begin) < seconds:
            while sent["encoders"] < passed * rate:
                self.encoders(begin + sent["encoders"] / rate)
                sent["encoders"] += 1
            if sent["supplies"] < passed * POWER:
                sent["supplies"] += 1
                for supply in self.supplies:
                    supply(begin + passed)
                self.spin()
            if sent["commands"] < passed * COMMANDS:
                sent["commands"] += 1
                self.commands(begin + passed)
            time.sleep(0.0005)


def _flooded(robot: Robot, node: "subprocess.Popen[bytes]", rate: float, seconds: float) -> None:
    while not robot.verdicts:
        robot.run(USUAL, 0.5)
    robot.run(USUAL, SETTLING)
    memory = resident_mb(node.pid)
    robot.run(rate, seconds)
    end = time.time()
    robot.run(USUAL, AFTER)
    late = [heard - of for heard, of in robot.verdicts if of > end]
    print(
        f"{rate:g} Hz for {seconds:g} s: of {len(late)} verdicts in the {AFTER:g} s after it the "
        f"latest came {max(late):.2f} s after its stamp; memory {memory:.0f} MB before, "
        f"{resident_mb(node.pid):.0f} MB after"
    )


def _bench(arguments: Sequence[str] | None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=5000.0, help="Hz (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=20.0, help="default: %(default)s")
    options = parser.parse_args(arguments)
    described = files("tomr_power_model").joinpath("robots").joinpath("reference.yaml")
    with tempfile.TemporaryDirectory() as folder, as_file(described) as file:
        ros = ["--ros-args", "--params-file", str(file), "-p", "report_period:=0.05"]
        commands = {"tomr_diagnosis": [str(command_path("tomr_diagnosis")), *ros]}
        rclpy.init()
        robot = Robot()
        with running(commands, Path(folder)) as nodes:
            _flooded(robot, nodes["tomr_diagnosis"], options.rate, options.seconds)
        rclpy.shutdown()
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(run_main(_bench))
