"""What fits no state: robots that do not follow, residuals that stay far out of their bands."""

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.braking import BrakingWatch
from tomr_fault_diag.classifier.contacts import NOTHING, Contacts
from tomr_fault_diag.classifier.evidence import ALONE, Beside
from tomr_fault_diag.classifier.judges import Opinion
from tomr_fault_diag.classifier.misfit import Misfit, MisfitWatch
from tomr_fault_diag.classifier.motors import Motors
from tomr_fault_diag.classifier.observability import Unseen
from tomr_fault_diag.classifier.outside import Outside, OutsideWatch
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.slides import SlideWatch
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.classifier.states import (
    CONTROL,
    DISOBEYS,
    FAULTLESS,
    NORMAL,
    PUSHED,
    UNKNOWN,
    WAITING,
)
from tomr_fault_diag.residuals.frame import MOTORS, Residual, ResidualFrame
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.messages.plain import Level
from tomr_power_model.robot import shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN = float("nan")
Three = tuple[float, float, float]
TURNING: Three = (3.0, -8.0, 5.0)


def frame(at_ms: int, expected: Three, measured: Three, power: float = 0.0) -> ResidualFrame:
    """Expected and measured wheel speeds [rad/s]; residual of motor 1's power in bands of 2 W."""
    quiet = (Residual(0.0, 1.0, 2.0),) * 3
    motors = (Residual(2.0 * power, 2.0, 20.0), *quiet[1:])
    speeds = tuple(
        Residual((is_ - want) * (-1.0 if want < 0.0 else 1.0), 0.2, want, "rad/s")
        for want, is_ in zip(expected, measured, strict=True)
    )
    return ResidualFrame(BASE + at_ms * MS, (Residual(0.0, 2.0, 20.0), *motors, *speeds, *quiet))


class Sure:
    """A judge that is sure of one state, whatever it sees; or only thinks so."""

    def __init__(self, state: int, sure: bool = True) -> None:
        self.settings = ClassifierSettings()
        self.state, self.sure = state, sure
        self.cleared = 0

    def clear(self) -> None:
        self.cleared += 1

    def interrupt(self) -> None:
        pass

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        return Opinion(np.eye(6)[self.state], sure=self.sure)


def named(frames: list[ResidualFrame], judge: int = NORMAL) -> list[tuple[int, str]]:
    """Changes of the state: when [ms], and to what."""
    classifier, found = FaultClassifier(Sure(judge)), []
    for item in frames:
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append(((diagnosis.stamp_ns - BASE) // MS, diagnosis.state.name))
    return found


def test_a_robot_that_brakes_unasked_does_not_follow_before_it_stands() -> None:
    """From 1 m/s at its drivers' 2 m/s^2; that it stands is known 0.3 s later at the earliest."""
    robot = shipped_robot("reference")
    first, second, third = (float(speed) for speed in twist_to_wheels(robot) @ [1.0, 0.0, 0.0])
    ahead = first, second, third
    classifier = FaultClassifier.around(Sure(NORMAL), robot)
    named_at = 0
    for at_ms in range(50, 2000, 50):
        left = max(0.0, 1.0 - max(at_ms - 1000, 0) / 500)
        slower = twist_to_wheels(robot) @ [left, 0.0, 0.0]
        one, two, three = (float(speed) for speed in slower)
        diagnosis = classifier.classify(frame(at_ms, ahead, (one, two, three)))
        if diagnosis is not None and diagnosis.state is DISOBEYS and not named_at:
            named_at = at_ms
    assert 1300 <= named_at <= 1350


def test_a_robot_that_stands_after_a_silence_may_have_been_asked_to() -> None:
    watch = MisfitWatch(braking=BrakingWatch(shipped_robot("reference")))
    for at_ms in range(50, 1000, 50):
        watch.take(frame(at_ms, TURNING, TURNING), 0.0)
    assert not watch.take(frame(3000, TURNING, (0.0, 0.0, 0.0)), 0.0).disobeys


@pytest.mark.parametrize("period", [10, 50, 200])
def test_a_robot_that_stands_when_commanded_to_drive_does_not_follow(period: int) -> None:
    driving = [frame(t, TURNING, TURNING) for t in range(period, 2000, period)]
    stopped = [frame(t, TURNING, (0.0, 0.0, 0.1)) for t in range(2000, 4000, period)]
    again = [frame(t, TURNING, TURNING) for t in range(4000, 6000, period)]
    changes = named(driving + stopped + again)
    assert [state for _, state in changes] == ["normal", "does not follow its commands", "normal"]
    assert 300 <= changes[1][0] - 2000 <= 300 + period
    assert 500 <= changes[2][0] - 4000 <= 500 + period


HALF: Three = (1.5, -4.0, 2.5)


def watched(frames: list[ResidualFrame], idle: tuple[float, ...] = ()) -> list[int]:
    """When [ms] it is said that a robot does not follow its commands."""
    watch = MisfitWatch(idle)
    return [(item.stamp_ns - BASE) // MS for item in frames if watch.take(item, 0.0).disobeys]


@pytest.mark.parametrize(
    ("slower", "first"),
    [
        (HALF, 1300),  # all alike: it has begun to stand
        ((0.6, -4.0, 2.5), 1500),  # otherwise it begins when it stands
        ((2.25, -6.0, 3.75), 1500),  # and where wheels are hardly slower
    ],
)
def test_a_robot_that_brakes_to_a_stand_is_named_from_its_braking_on(
    slower: Three, first: int
) -> None:
    driving = [frame(t, TURNING, TURNING) for t in range(0, 1000, 50)]
    braking = [frame(t, TURNING, slower) for t in range(1000, 1200, 50)]
    standing = [frame(t, TURNING, (0.0, 0.0, 0.0)) for t in range(1200, 2000, 50)]
    assert watched(driving + braking + standing)[0] == first


def test_a_robot_that_is_only_slower_follows_its_commands() -> None:
    assert watched([frame(t, TURNING, HALF) for t in range(0, 3000, 50)]) == []


def undriven(at_ms: int, measured: Three, drawn: float) -> ResidualFrame:
    """All motors draw so much [W], of 20 W, 2 W and 2 W that they should."""
    item = frame(at_ms, TURNING, measured)
    motors = [
        evolve(item.residuals[k], residual=drawn - item.residuals[k].modelled, band=1.0)
        for k in MOTORS
    ]
    return evolve(item, residuals=(item.residuals[0], *motors, *item.residuals[4:]))


COASTING: Three = (2.0, -6.0, 6.0)  # rad/s


@pytest.mark.parametrize(
    ("measured", "drawn", "first"),
    [
        (COASTING, 0.4, 300),
        (COASTING, 0.9, None),  # more than a motor draws that is not driven
        (TURNING, 0.4, None),  # it turns as it should: nothing need be driven
        ((3.0, -8.0, 6.0), 0.4, None),  # one wheel may have a fault of its own
        (COASTING, NAN, None),
    ],
)
def test_a_robot_that_coasts_because_no_motor_is_driven_does_not_follow(
    measured: Three, drawn: float, first: int | None
) -> None:
    said = watched([undriven(t, measured, drawn) for t in range(0, 1000, 50)], (0.3, 0.3, 0.3))
    assert (said[0] if said else None) == first


def test_a_described_robot_says_what_a_motor_draws_that_is_not_driven() -> None:
    robot = shipped_robot("reference")
    idle = float(Motors(robot).idle[0])
    classifier = FaultClassifier.of(ClassifierSettings(), robot)
    driving = [undriven(t, TURNING, 20.0) for t in range(0, 1000, 50)]
    coasting = [undriven(t, COASTING, idle) for t in range(1000, 1500, 50)]
    said = [classifier.classify(item) for item in driving + coasting]
    assert next(one.stamp_ns for one in said if one is not None and one.state is DISOBEYS) == (
        BASE + 1300 * MS
    )


def test_drivers_that_lack_voltage_are_not_off() -> None:
    watch = MisfitWatch((0.3, 0.3, 0.3))
    low = [evolve(undriven(t, COASTING, 0.4), supply=0.6) for t in range(0, 900, 50)]
    said = [watch.take(item, 0.88) for item in low]
    assert not any(one.disobeys for one in said)


def test_what_a_motor_draws_that_is_not_driven_may_be_unknown() -> None:
    assert watched([undriven(t, COASTING, 0.0) for t in range(0, 1000, 50)]) == []


class Others(MisfitWatch):
    """From the first second on others' commands are obeyed."""

    def take(self, frame: ResidualFrame, low_supply: float) -> Misfit:
        return Misfit(obeys_others=frame.stamp_ns >= BASE + 1000 * MS)


@pytest.mark.parametrize(
    ("judge", "state"), [(NORMAL, DISOBEYS.name), (CONTROL, "control system fault")]
)
def test_beside_a_fault_nothing_is_said_of_others_commands(judge: int, state: str) -> None:
    """Its wheel strays, and what the body then does makes a second one stray."""
    classifier = FaultClassifier(Sure(judge), misfits=Others())
    for at_ms in range(50, 2000, 50):
        classifier.classify(frame(at_ms, TURNING, TURNING))
    assert classifier._state is not None
    assert classifier._state.name == state


def test_no_wheel_is_accused_meanwhile() -> None:
    driving = [frame(50, TURNING, TURNING)]
    stopped = [frame(t, TURNING, (0.0, 0.0, 0.0)) for t in range(100, 1000, 50)]
    assert [state for _, state in named(stopped, CONTROL)] == [
        "normal",
        "does not follow its commands",
    ]
    assert named(driving, CONTROL) == [(50, "control system fault")]


@pytest.mark.parametrize(
    ("expected", "measured"),
    [
        (TURNING, (0.0, -8.0, 5.0)),  # one wheel only: a fault of its own
        ((3.0, 0.0, 0.0), (0.0, 0.0, 0.0)),  # one that need turn: it may have one
        (TURNING, (1.0, -3.0, 2.0)),  # slower, but not standing
        ((0.2, -0.3, 0.1), (0.0, 0.0, 0.0)),  # creeping
        (TURNING, (NAN, NAN, NAN)),  # nobody knows
        (TURNING, (0.0, 9.0, 0.0)),  # one is driven the other way
    ],
)
def test_what_may_be_something_else(expected: Three, measured: Three) -> None:
    watch = MisfitWatch()
    seen = [watch.take(frame(t, expected, measured), 0.88) for t in range(50, 3000, 50)]
    assert not any(item.disobeys or item.ignores_commands for item in seen)


def test_what_a_healthy_robot_could_not_show_is_unknown() -> None:
    normal = [frame(t, TURNING, TURNING) for t in range(50, 1000, 50)]
    far = [frame(t, TURNING, TURNING, power=-4.0) for t in range(1000, 3000, 50)]
    near = [frame(t, TURNING, TURNING, power=2.0) for t in range(3000, 5000, 50)]
    changes = named(normal + far + near)
    assert changes == [(50, "normal"), (2000, "unknown"), (4000, "normal")]


def test_more_that_the_computer_draws_is_not_unknown() -> None:
    """Unless the motors' own power is not known: then it may be theirs."""

    def watched(motor: Residual) -> bool:
        watch = MisfitWatch()
        for t in range(50, 2000, 50):
            item = frame(t, TURNING, TURNING)
            rest = item.residuals[2:]
            seen = watch.take(
                evolve(item, residuals=(Residual(9.0, 2.0, 20.0), motor, *rest)), 0.88
            )
        return seen.unexplained

    assert not watched(Residual(0.0, 2.0, 20.0))
    assert watched(Residual(NAN, NAN, NAN))


def test_a_named_fault_is_not_called_unknown() -> None:
    far = [frame(t, TURNING, TURNING, power=9.0) for t in range(50, 3000, 50)]
    assert named(far, CONTROL) == [(50, "control system fault")]


@pytest.mark.parametrize("power", [9.0, 2.0])
def test_what_is_far_off_and_merely_looks_like_a_fault_is_unknown(power: float) -> None:
    classifier, states = FaultClassifier(Sure(CONTROL, sure=False)), []
    for t in range(50, 3000, 50):
        diagnosis = classifier.classify(frame(t, TURNING, TURNING, power=power if t > 500 else 0.0))
        if diagnosis is not None and diagnosis.changed:
            states.append(diagnosis.state.name)
    assert states[1:] == (["unknown"] if power > 3.0 else [])


class Leans(OutsideWatch):
    """Somebody leans on the robot, whatever it shows."""

    outside = Outside(may_be_push=True)

    def take(self, frame: ResidualFrame) -> Outside:
        return self.outside


class Looks(Sure):
    """Less than sure that something pushes, and otherwise of a state."""

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        said = super().judge(frame, elapsed_ns, unseen, beside)
        return evolve(said, state=PUSHED if self.state == NORMAL else None, sure=False)


class Grips(SlideWatch):
    """Whatever it shows; and whether an accelerometer is heard."""

    contacts = Contacts(0.0)

    def take(self, frame: ResidualFrame) -> Contacts:
        return self.contacts


def changes(judge: Sure, outside: Outside, contacts: Contacts = NOTHING) -> list[tuple[int, str]]:
    """When [ms] states of a robot that is far off change, and to what."""
    robot = shipped_robot("reference")
    leans = Leans(robot)
    leans.outside = outside
    slides = Grips(robot)
    slides.contacts = contacts
    classifier = FaultClassifier(judge, outside=leans, slides=slides)
    far = (frame(t, TURNING, TURNING, power=9.0) for t in range(50, 3000, 50))
    said = [classifier.classify(item) for item in far]
    return [
        ((item.stamp_ns - BASE) // MS, item.state.name)
        for item in said
        if item is not None and item.changed
    ]


def judged(judge: Sure, outside: Outside, contacts: Contacts = NOTHING) -> list[str]:
    return [name for _, name in changes(judge, outside, contacts)]


def test_what_somebody_who_leans_explains_is_not_unknown() -> None:
    assert judged(Sure(NORMAL), Outside(may_be_push=True)) == ["normal", "pushed"]


def test_what_looks_like_a_push_and_may_be_a_slope_is_not_unknown() -> None:
    assert judged(Looks(NORMAL), Outside(fits_slope=True)) == ["normal", "pushed"]
    assert judged(Looks(NORMAL), Outside()) == ["normal", "unknown"]
    assert judged(Looks(CONTROL), Outside(fits_slope=True))[-1] == "unknown"


GRIPS, FEELS = Contacts(0.0), Contacts(0.0, felt=True)


def test_what_fits_a_slope_is_unknown_only_where_an_accelerometer_would_feel_one() -> None:
    """Whatever it looks like, if not like a fault."""
    fits = Outside(fits_slope=True)
    assert judged(Sure(NORMAL), fits, GRIPS) == ["normal", "pushed"]
    assert judged(Sure(NORMAL), fits, FEELS) == ["normal", "unknown"]
    assert judged(Looks(NORMAL), fits, FEELS) == ["normal", "pushed"]
    assert judged(Sure(NORMAL), fits) == ["normal", "unknown"]  # nothing is known of the contacts


def test_what_looks_like_a_push_may_be_a_slope_that_begins() -> None:
    """Where nothing feels one, its laws need longer to show."""
    assert changes(Looks(NORMAL), Outside(), GRIPS) == [(50, "normal"), (2550, "unknown")]
    for contacts in (FEELS, NOTHING):
        assert changes(Looks(NORMAL), Outside(), contacts)[1] == (1050, "unknown")
    assert changes(Sure(NORMAL), Outside(), GRIPS)[1] == (1050, "unknown")


class Wavers(Looks):
    """Sure of a fault for two seconds; then it looks like a push."""

    def judge(
        self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
    ) -> Opinion:
        is_over = frame.stamp_ns > BASE + 2000 * MS
        self.state, self.sure = (NORMAL, False) if is_over else (CONTROL, True)
        if is_over:
            return super().judge(frame, elapsed_ns, unseen, beside)
        return Opinion(np.eye(6)[CONTROL], sure=True)


def test_a_named_fault_stays_while_what_is_far_off_looks_like_a_push() -> None:
    """No slope has just begun there, so it is not over after a second and a half."""
    slides = Grips(shipped_robot("reference"))
    slides.contacts = GRIPS
    classifier = FaultClassifier(Wavers(CONTROL), slides=slides)
    far = (frame(t, TURNING, TURNING, power=9.0 * (t > 1500)) for t in range(50, 3900, 50))
    said = [classifier.classify(item) for item in far]
    assert {item.state.name for item in said if item} == {"control system fault"}


def test_what_an_accelerometer_feels_is_not_unknown() -> None:
    assert judged(Looks(NORMAL), Outside(fits_felt=True)) == ["normal", "pushed"]
    assert judged(Sure(NORMAL), Outside(fits_felt=True)) == ["normal", "pushed"]
    assert judged(Looks(CONTROL), Outside(fits_felt=True))[-1] == "unknown"


def test_what_is_seen_later_to_be_a_push_is_unknown_no_longer() -> None:
    leans = Leans(shipped_robot("reference"))
    classifier, states = FaultClassifier(Sure(NORMAL), outside=leans), []
    for t in range(50, 5000, 50):
        leans.outside = Outside(may_be_push=t > 3000)
        said = classifier.classify(frame(t, TURNING, TURNING, power=9.0))
        if said is not None and said.changed:
            states.append(said.state.name)
    assert states == ["normal", "unknown", "pushed"]


def test_a_short_stray_is_not_unknown() -> None:
    frames = [
        frame(t, TURNING, TURNING, power=9.0 if t % 1000 < 900 else 0.0)
        for t in range(50, 5000, 50)
    ]
    assert [state for _, state in named(frames)] == ["normal"]


def test_two_wheels_that_stand_are_enough_where_the_third_is_not_known() -> None:
    stopped = [frame(t, TURNING, (0.0, NAN, 0.0)) for t in range(50, 1000, 50)]
    assert [state for _, state in named(stopped)] == ["normal", "does not follow its commands"]


def test_what_a_judge_took_from_ignored_commands_is_forgotten() -> None:
    judge = Sure(CONTROL)
    classifier = FaultClassifier(judge)
    for t in range(50, 1000, 50):
        before = judge.cleared
        classifier.classify(frame(t, TURNING, (0.0, 0.0, 0.0)))
    assert judge.cleared == before + 1


@pytest.mark.parametrize("outside", [None, Leans(shipped_robot("reference"))])
def test_a_fault_that_is_fading_stays_named_and_is_not_called_unknown(
    outside: OutsideWatch | None,
) -> None:
    """Nor does somebody who leans on the robot mend it."""
    judge = Sure(CONTROL)
    classifier, states = FaultClassifier(judge, outside=outside), []
    for t in range(50, 4000, 50):
        judge.state = CONTROL if t < 2000 else NORMAL
        diagnosis = classifier.classify(frame(t, TURNING, TURNING, power=9.0))
        if diagnosis is not None and diagnosis.changed:
            states.append(diagnosis.state.name)
    assert states == ["control system fault"]


def test_after_a_clock_goes_back_time_counts_anew() -> None:
    far = [frame(t, TURNING, TURNING, power=9.0) for t in range(50, 1000, 50)]
    back = [frame(t - 50_000, TURNING, TURNING, power=9.0) for t in range(1000, 2500, 50)]
    changes = named(far + back)
    # The robot is normal anew, and a second later it is not: not when the old time is reached.
    assert changes[-1] == (2000 - 50_000, "unknown")


@pytest.mark.parametrize("measured", [(0.0, 0.0, 0.0), TURNING])
def test_a_silence_does_not_count(measured: Three) -> None:
    frames = [frame(t, TURNING, measured, power=9.0) for t in (50, 5000, 5050, 5100)]
    assert [state for _, state in named(frames)] == ["normal"]


def test_waiting_is_no_fault_and_not_following_is_one() -> None:
    assert WAITING.name in FAULTLESS
    assert not {DISOBEYS.name, UNKNOWN.name} & FAULTLESS


def test_levels() -> None:
    classifier = FaultClassifier(Sure(NORMAL))
    levels = {}
    for t in range(50, 3000, 50):
        diagnosis = classifier.classify(frame(t, TURNING, (0.0, 0.0, 0.0)))
        if diagnosis is not None:
            levels[diagnosis.state.name] = diagnosis.state.level
    assert levels["does not follow its commands"] is Level.ERROR


def _supplied(shares: dict[int, float], end: int = 6000) -> list[ResidualFrame]:
    """Frames of a drive whose supply has a share of its nominal voltage from some times [ms] on."""
    found = []
    for t in range(50, end, 50):
        share = [share for begin, share in shares.items() if begin <= t][-1]
        found.append(evolve(frame(t, TURNING, TURNING), supply=share))
    return found


def test_a_supply_that_stays_low_is_said_until_it_has_risen_again() -> None:
    assert named(_supplied({0: 1.0, 1000: 0.87, 3000: 0.89, 4000: 0.91})) == [
        (50, "normal"),
        (2000, "low supply"),
        (4500, "normal"),
    ]


def test_a_supply_that_sags_for_a_moment_is_not_low() -> None:
    assert named(_supplied({0: 1.0, 1000: 0.8, 1950: 0.9, 2000: 0.8, 2950: 0.9})) == [
        (50, "normal")
    ]


@pytest.mark.parametrize("share", [NAN, 0.881])
def test_what_is_not_known_or_not_low_is_none(share: float) -> None:
    assert named(_supplied({0: share})) == [(50, "normal")]


def test_other_faults_are_named_beside_a_low_supply_and_leave_it_behind() -> None:
    judge = Sure(NORMAL)
    classifier, found = FaultClassifier(judge), []
    for item in _supplied({0: 0.8}):
        at = (item.stamp_ns - BASE) // MS
        judge.state = CONTROL if 3000 <= at < 4000 else NORMAL
        diagnosis = classifier.classify(item)
        if diagnosis is not None and diagnosis.changed:
            found.append((at, diagnosis.state.name))
    assert found == [
        (50, "normal"),
        (1050, "low supply"),
        (3000, "control system fault"),
        (4500, "low supply"),
    ]


def test_a_fault_that_is_not_sure_is_not_named_beside_a_low_supply() -> None:
    class Unsure(Sure):
        def judge(
            self, frame: ResidualFrame, elapsed_ns: int, unseen: Unseen, beside: Beside = ALONE
        ) -> Opinion:
            return evolve(super().judge(frame, elapsed_ns, unseen), sure=False)

    classifier = FaultClassifier(Unsure(CONTROL))
    found = [classifier.classify(item) for item in _supplied({0: 0.8})]
    assert [item.state.name for item in found if item is not None][-1] == "low supply"


def test_what_is_low_is_set_and_0_is_never() -> None:
    judge = Sure(NORMAL)
    judge.settings = ClassifierSettings(low_supply=0.0)
    classifier = FaultClassifier(judge)
    found = [classifier.classify(item) for item in _supplied({0: 0.1})]
    assert {item.state.name for item in found if item is not None} == {"normal"}
