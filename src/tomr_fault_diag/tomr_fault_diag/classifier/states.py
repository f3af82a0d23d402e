"""The states that the diagnosis can name: those of Wang 2024, section 4, and those beyond."""

from attrs import frozen

from tomr_power_model.messages.plain import Level


@frozen
class State:
    """One state: its stable name, how grave it is, the wheel (0..2) it concerns.

    `paper` is the one of the paper's six that it belongs to, None where it is none of them.
    """

    name: str
    level: Level
    wheel: int | None = None
    paper: int | None = None


def _of_wheels(name: str, level: Level, paper: int | None = None) -> tuple[State, State, State]:
    """A state of each wheel; `paper`: that of the first, the others follow."""
    first, second, third = (
        State(f"{name} {wheel + 1}", level, wheel, None if paper is None else paper + wheel)
        for wheel in range(3)
    )
    return first, second, third


NORMAL = 0
SLIP = 1
CONTROL = 2
MOTOR = 3  # of wheel 0; those of wheels 1 and 2 follow
# The paper's six.
STATES: tuple[State, ...] = (
    State("normal", Level.OK, paper=NORMAL),
    State("slip", Level.WARN, paper=SLIP),
    State("control system fault", Level.ERROR, paper=CONTROL),
    *_of_wheels("motor system fault", Level.ERROR, MOTOR),
)
# Drivetrains that the paper would call faults of the motor system.
DRAGGING = _of_wheels("dragging wheel", Level.ERROR, MOTOR)
STUCK = _of_wheels("stuck wheel", Level.ERROR, MOTOR)
DEGRADED = _of_wheels("degraded motor", Level.ERROR, MOTOR)
POWER_SENSOR = _of_wheels("power sensor fault", Level.WARN)
# A force from outside: over soon and nobody's fault, or there to stay.
PUSHED = State("pushed", Level.OK, paper=NORMAL)
BURDENED = State("external load", Level.WARN)
# Something is wrong that is none of these, or what is wrong cannot be decided.
DISOBEYS = State("does not follow its commands", Level.ERROR)
UNKNOWN = State("unknown", Level.WARN)
LOW_SUPPLY = State("low supply", Level.WARN)  # its voltage lies below what is normal
WAITING = State("waiting", Level.OK)  # for a first command: what it asks for is not known
STALE = State("stale", Level.STALE)  # nothing can be compared
# Too many gaps to say anything. OK as all that cannot be decided: the status of the stream that
# has them warns of it, and a pause of the commands is nobody's fault.
NOT_ENOUGH = State("not enough data", Level.OK)
# Nothing is wrong as far as can be seen, and in this motion nothing could be detected.
NOT_OBSERVABLE = State("not observable in this motion", Level.OK)
FAULTLESS = frozenset(
    {
        STATES[NORMAL].name, PUSHED.name, WAITING.name, STALE.name, NOT_ENOUGH.name,
        NOT_OBSERVABLE.name,
    }
)  # fmt: skip
# Those that have a probability of their own, the paper's first. A stuck wheel drags.
NAMED: tuple[State, ...] = (
    *STATES, *DRAGGING, *DEGRADED, *POWER_SENSOR, PUSHED, BURDENED, UNKNOWN,
)  # fmt: skip
