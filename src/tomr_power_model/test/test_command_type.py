"""Which type of cmd_vel a node listens to, by the types of its publishers."""

import pytest

from tomr_power_model.messages.types import TWIST, TWIST_STAMPED
from tomr_power_model.nodes.command_type import chosen_type


@pytest.mark.parametrize(
    ("current", "found", "chosen"),
    [
        (TWIST_STAMPED, set(), TWIST_STAMPED),
        (TWIST_STAMPED, {TWIST}, TWIST),
        (TWIST, {TWIST_STAMPED}, TWIST_STAMPED),
        # Where both are there, it stays: no flapping.
        (TWIST, {TWIST, TWIST_STAMPED}, TWIST),
        (TWIST_STAMPED, {TWIST, TWIST_STAMPED}, TWIST_STAMPED),
        (TWIST_STAMPED, {"std_msgs/msg/String"}, TWIST_STAMPED),
    ],
)
def test_the_type_that_publishers_have(current: str, found: set[str], chosen: str) -> None:
    assert chosen_type(current, found) == chosen
