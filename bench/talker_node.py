"""A small node of the suite's kind: twelve topics out, eight in, each heard by its like."""

import sys

from rclpy.node import Node
from std_msgs.msg import String

from tomr_power_model.nodes.stage_node import run_node


class Talker(Node):
    """Says nothing."""

    def __init__(self) -> None:
        super().__init__("talker")
        for number in range(12):
            self.create_publisher(String, f"topic_{number}", 10)
        for number in range(8):
            self.create_subscription(String, f"topic_{number}", self._hear, 10)
        print("is up", flush=True)

    def _hear(self, message: String) -> None:
        pass


if __name__ == "__main__":
    sys.exit(run_node(Talker))
