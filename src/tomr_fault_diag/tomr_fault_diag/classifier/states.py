"""The states that the diagnosis can name, in the order of Wang 2024, section 4."""

from attrs import frozen

from tomr_power_model.messages.plain import Level


@frozen
class State:
    """One state: its stable name, how grave it is, and the wheel (0..2) it concerns."""

    name: str
    level: Level
    wheel: int | None = None


STATES: tuple[State, ...] = (
    State("normal", Level.OK),
    State("slip", Level.WARN),
    State("control system fault", Level.ERROR),
    State("motor system fault 1", Level.ERROR, 0),
    State("motor system fault 2", Level.ERROR, 1),
    State("motor system fault 3", Level.ERROR, 2),
)
NORMAL = 0
SLIP = 1
CONTROL = 2
MOTOR = 3  # of wheel 0; those of wheels 1 and 2 follow
# Something is wrong that is none of these, or what is wrong cannot be told.
DISOBEYS = State("does not follow its commands", Level.ERROR)
UNKNOWN = State("unknown", Level.WARN)
POWER_SENSOR = tuple(State(f"power sensor fault {n}", Level.WARN, n - 1) for n in (1, 2, 3))
WAITING = State("waiting", Level.OK)  # for a first command: what it asks for is not known
STALE = State("stale", Level.STALE)  # nothing can be compared
NOT_ENOUGH = State("not enough data", Level.STALE)  # too many gaps to say anything
# Nothing is wrong as far as can be told, and in this motion nothing could be told.
NOT_OBSERVABLE = State("not observable in this motion", Level.OK)
FAULTLESS = frozenset(
    {STATES[NORMAL].name, WAITING.name, STALE.name, NOT_ENOUGH.name, NOT_OBSERVABLE.name}
)
