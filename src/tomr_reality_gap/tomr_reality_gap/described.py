"""robot_explained.yaml: the description with what was found."""

from attrs import evolve

from tomr_power_model.calibration.fitted import fitted_text
from tomr_reality_gap.evidence import Evidence
from tomr_reality_gap.fit.study import Model


def for_users(evidence: Evidence, model: Model) -> Model:
    """The model for the user's simulation: without what that shows by itself."""
    names = [item.name for item in evidence.found.best.model.hypotheses]
    theirs = dict(zip(names, evidence.shared, strict=True))
    turns = tuple(
        tuple(turn - other for turn, other in zip(own, theirs[hypothesis.name], strict=True))
        for hypothesis, own in zip(model.hypotheses, model.turns, strict=True)
    )
    return evolve(model, turns=turns)


def described(evidence: Evidence, model: Model) -> str:
    """Text of robot_explained.yaml: what is alike for all wheels is written once."""
    values = dict(model.described.values)
    wheels = evidence.robot.wheel_names
    for key in [key for key in values if f".{wheels[0]}." in key]:
        keys = [key.replace(wheels[0], wheel) for wheel in wheels]
        numbers = {values.get(item) for item in keys}
        general = key.replace(f".{wheels[0]}.", ".")
        if len(numbers) == 1:
            values[general] = values[key]
            for item in keys:
                del values[item]
    findings = ", ".join(item.name for item in model.hypotheses)
    header = [f"{evidence.source}, with what reality showed besides:", findings]
    recordings = ", ".join(item.recorded.name for item in evidence.study.simulations)
    return fitted_text(evidence.source, values, (), (), (), header, {"recordings": recordings})
