"""What happens in a soak: faults that come and go, and interruptions while they are in force."""

import random
from collections.abc import Iterator, Mapping

from attrs import frozen

NORMAL = "normal"
SUITES: Mapping[str, tuple[str, ...]] = {
    "three": ("power_model", "power_residuals", "fault_classifier"),
    "one": ("tomr_diagnosis",),
}  # by namespace
POWER = ("wheel_1/power", "wheel_2/power", "wheel_3/power")
COMMANDS, ENCODERS, BATTERY = "cmd_vel", "joint_states", "battery_state"
STREAMS: Mapping[str, tuple[str, ...]] = {
    "all streams": (COMMANDS, ENCODERS, *POWER, BATTERY),
    "commands": (COMMANDS,),
    "encoders": (ENCODERS,),
    "one motor's power": (POWER[1],),
    "all power": POWER,
}
SIMULATOR = "sim_bridge"


@frozen
class Condition:
    """What is wrong with the robot, and the states that say so."""

    fault: str = ""  # of sim_bridge
    wheel: int = 0  # 1..3, 0: none
    severity: float = 1.0
    states: tuple[str, ...] = (NORMAL,)

    @property
    def words(self) -> str:
        return self.fault or "healthy"

    def settings(self, severity: float) -> dict[str, int | float]:
        """Parameters of sim_bridge for it."""
        head = f"faults.{self.fault}."
        wheel = {head + "wheel": self.wheel} if self.wheel else {}
        return {**wheel, head + "severity": severity}


HEALTHY = Condition()
FAULTS = (
    Condition("floor_slippery", 0, 0.8, ("slip",)),
    *(
        Condition("encoder_lost", wheel, 1.0, (f"motor system fault {wheel}",))
        for wheel in (1, 2, 3)
    ),
    *(
        Condition("control_signal_lost", wheel, 1.0, ("control system fault",))
        for wheel in (1, 2, 3)
    ),
)


@frozen
class Pause:
    """Nothing comes on some streams for a while [s]."""

    streams: str
    length: float

    @property
    def words(self) -> str:
        return f"{self.streams} silent"


@frozen
class Jump:
    """The clock of all streams jumps [s], and stays there."""

    by: float
    words: str = "clock jumps"


@frozen
class Kill:
    """A node is killed and started again."""


@frozen
class Flood:
    """Encoders come much more often for a while [s]."""

    length: float
    words: str = "flood of encoders"


@frozen
class Rest:
    """The robot is commanded to stand for a while [s]."""

    length: float
    words: str = "at rest"


_FAR = 3e7  # s, that a clock jumps once in a while

Interruption = Pause | Jump | Kill | Flood | Rest


@frozen
class Act:
    """A condition of the robot and what interrupts its diagnosis meanwhile."""

    condition: Condition
    interruptions: tuple[Interruption, ...]


def _interruptions(dice: random.Random, flood: float) -> Iterator[Interruption]:
    """All kinds again and again, in an order of chance; a flood comes first, being most to bear.

    Which of a kind goes around as well, so that a short soak has many and a long one all.
    """
    streams = dice.sample(sorted(STREAMS), len(STREAMS))
    count, far = 0, -_FAR
    yield Flood(flood)
    while True:
        by = dice.choice((-3600.0, -1.5, -0.3, 0.3, 1.5, 60.0, _FAR))
        if by == _FAR:  # there and back: stamps hold 68 years
            by = far = -far
        turn: list[Interruption] = [
            Kill(),
            Pause(streams[count % len(streams)], dice.choice((0.3, 1.0, 3.0))),
            Pause(streams[(count + 2) % len(streams)], dice.choice((0.6, 5.0))),
            Jump(by),
            Rest(dice.choice((1.0, 4.0))),
        ]
        yield from dice.sample(turn, len(turn))
        count += 1
        if count % 6 == 0:
            yield Flood(flood)


def acts(seed: int, flood: float) -> Iterator[Act]:
    """What happens, without an end: healthy and faulty in turn."""
    dice = random.Random(seed)
    interruptions = _interruptions(dice, flood)
    faults = dice.sample(FAULTS, len(FAULTS))
    while True:
        for fault in faults:
            yield Act(HEALTHY, (next(interruptions), next(interruptions)))
            yield Act(fault, (next(interruptions), next(interruptions)))
