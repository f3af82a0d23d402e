"""A diagnosis as a DiagnosticArray (REP-107)."""

import math

from tomr_fault_diag.classifier.advice import check_first
from tomr_fault_diag.classifier.stage import Diagnosis
from tomr_fault_diag.classifier.states import (
    NAMED,
    NORMAL,
    NOT_ENOUGH,
    NOT_OBSERVABLE,
    POWER_SENSOR,
    STALE,
    STATES,
    UNKNOWN,
    WAITING,
    State,
)
from tomr_fault_diag.residuals.frame import (
    GAP,
    NO_FRESH,
    RESIDUALS,
    YAW,
    Residual,
    ResidualFrame,
    residual_names,
)
from tomr_fault_diag.residuals.messages import sentence
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.plain import Status
from tomr_power_model.model.ticks import NANOSECONDS
from tomr_power_model.robot import Robot

TOPIC = "/diagnostics"
NAME = "fault_classifier: drive"
SILENCE = "no stamped message comes on the topics of this robot: is their namespace right?"


def diagnosis_message(
    robot: Robot, diagnosis: Diagnosis, hardware_id: str, commissioned: str = "no"
) -> DiagnosticMessage:
    """The message of one diagnosis: state, since when, probabilities, evidence."""
    seconds, rest = divmod(diagnosis.since_ns, NANOSECONDS)
    values = [("state", diagnosis.state.name), ("six_state", six_state(diagnosis.state))]
    values += [("since", f"{seconds}.{rest:09d}")]
    values.append(("severity", diagnosis.severity.words if diagnosis.severity else ""))
    changes = [change.words for change in diagnosis.conditions]
    values.append(("conditions", "; ".join(changes)))
    values.append(("check_first", check_first(diagnosis.state)))
    values.append(("not_observable", ", ".join(diagnosis.unseen.words)))
    for state, share in zip(NAMED, diagnosis.probabilities, strict=False):
        values.append((f"p {state.name}", f"{share:.4f}"))
    values.append(("commissioned", commissioned))
    evidence = evidence_of(robot, diagnosis)
    values.extend((f"evidence {number}", text) for number, text in enumerate(evidence, start=1))
    status = Status(
        NAME, diagnosis.state.level, _headline(robot, diagnosis), tuple(values), hardware_id
    )
    return DiagnosticMessage(TOPIC, diagnosis.stamp_ns, (status,))


def silence_message(
    robot: Robot, stamp_ns: int, hardware_id: str, commissioned: str = "no"
) -> DiagnosticMessage:
    """What a node says to which nothing comes at all: a wrong namespace, or a robot that is off."""
    unknown = Residual(math.nan, math.nan, math.nan, missing=SILENCE)
    frame = ResidualFrame(stamp_ns, (unknown,) * RESIDUALS)
    said = Diagnosis(stamp_ns, STALE, stamp_ns, (), frame, changed=False)
    return diagnosis_message(robot, said, hardware_id, commissioned)


def evidence_of(robot: Robot, diagnosis: Diagnosis) -> list[str]:
    """The residuals outside their bands, and those that are missing, in words."""
    names = residual_names(robot.wheel_topics)
    found = [f"robot.yaml: {diagnosis.frame.mistake}"] if diagnosis.frame.mistake else []
    found += [
        f"{name.removeprefix('residuals: ')}: {sentence(residual)}"
        for name, residual in zip(names, diagnosis.frame.residuals, strict=True)
        if residual.code or residual.stale
    ]
    if diagnosis.frame.yaw.code:
        found.append(f"{YAW.removeprefix('residuals: ')}: {sentence(diagnosis.frame.yaw)}")
    return found


def six_state(state: State) -> str:
    """Which of the paper's six states it is; what is none of them is unknown."""
    return UNKNOWN.name if state.paper is None else STATES[state.paper].name


def _lacking(frame: ResidualFrame) -> str:
    """What is missing: all inputs of which nothing fresh came, else the first reason."""
    reasons = dict.fromkeys(r.missing for r in frame.residuals if r.stale)
    silent = [reason.removeprefix(NO_FRESH) for reason in reasons if reason.startswith(NO_FRESH)]
    first = next(iter(reasons), "too little seen")
    return NO_FRESH + ", ".join(silent) if first.startswith(NO_FRESH) else first


def _headline(robot: Robot, diagnosis: Diagnosis) -> str:
    said = _said(robot, diagnosis)
    is_held = not diagnosis.usable and diagnosis.state not in (STALE, NOT_ENOUGH, WAITING)
    return f"{said}; no data at present" if is_held else said


def _said(robot: Robot, diagnosis: Diagnosis) -> str:
    state = diagnosis.state
    if state == STALE:
        return f"{state.name}: {_lacking(diagnosis.frame)}"
    if state == NOT_ENOUGH:
        gaps = [r.missing for r in diagnosis.frame.residuals if r.missing.startswith(GAP)]
        return f"{state.name}: {gaps[0] if gaps else 'gaps a moment ago'}"
    if state == UNKNOWN and diagnosis.frame.mistake:
        return f"{state.name}: robot.yaml: {diagnosis.frame.mistake}"
    if state == WAITING:
        return f"{state.name}: no fresh command"
    if state == NOT_OBSERVABLE:
        return f"{state.name}: the robot stands still"
    ailing = {wheel: reason for wheel, reason in diagnosis.unseen.blind if reason}
    if state in POWER_SENSOR and ailing:
        words = ", ".join(f"motor {wheel + 1} ({reason})" for wheel, reason in ailing.items())
        return f"{state.name}; not observable: {words}"
    if diagnosis.wheel is not None:
        return f"{state.name} ({robot.wheel_names[diagnosis.wheel]})"
    if state is STATES[NORMAL] and diagnosis.unseen.wheels:
        motors = ", ".join(str(wheel + 1) for wheel in diagnosis.unseen.wheels)
        return f"{state.name}; motor {motors} not observable in this motion"
    return state.name
