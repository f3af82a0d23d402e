"""What the demo plays: how the robot drives, and which fault comes when."""

import math
from collections.abc import Mapping

from attrs import evolve, field, frozen

from tomr_power_model.robot.parameters import Value
from tomr_sim_bridge.missions.schema import Twist

# The direction of motion turns all the time, so that every wheel works and traction is needed.
SPEED = 0.5  # m/s
TURNING = 2.5  # rad/s of the direction of motion
STOP = 1.5  # s at rest at the end

QUICK_FAULT = 3.0  # s
QUICK_HEALTHY = 3.5  # s: normal has to lead for a second before it is named again


@frozen
class Act:
    """A part of the demo: healthy, or with one fault in force."""

    title: str
    duration: float  # s
    fault_id: str | None = None
    settings: Mapping[str, Value] = field(factory=dict)

    @property
    def begin(self) -> dict[str, Value]:
        """Parameters of sim_bridge that bring the fault."""
        return {f"faults.{self.fault_id}.{name}": value for name, value in self.settings.items()}

    @property
    def end(self) -> dict[str, Value]:
        """Parameters of sim_bridge that take the fault away."""
        return {f"faults.{self.fault_id}.severity": 0.0}


ACTS = (
    Act("healthy", 8.0),
    Act("floor slippery", 6.0, "floor_slippery", {"severity": 0.8}),
    Act("healthy", 4.0),
    Act(
        "wheel 3: signal lost",
        6.0,
        "control_signal_lost",
        {"wheel": 3, "severity": 1.0},
    ),
    Act("healthy", 4.0),
    Act("wheel 1: encoder lost", 6.0, "encoder_lost", {"wheel": 1, "severity": 1.0}),
    Act("healthy", 4.0),
)


def shortened(acts: tuple[Act, ...]) -> tuple[Act, ...]:
    """The same acts, each as short as it may be."""
    return tuple(
        evolve(act, duration=QUICK_FAULT if act.fault_id else QUICK_HEALTHY) for act in acts
    )


def twist_at(time: float) -> Twist:
    """Commanded v_x, v_y [m/s] and omega_z [rad/s], `time` [s] after the start of the drive."""
    angle = TURNING * time
    return SPEED * math.cos(angle), SPEED * math.sin(angle), 0.0
