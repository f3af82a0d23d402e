"""robot_explained.yaml: the description with what was found."""

from attrs import evolve

from tomr_power_model.calibration.fitted import fitted_text
from tomr_power_model.robot.description import why_not_held
from tomr_power_model.unmodelled.described import parameters_of
from tomr_reality_gap.analysis import AnalysisResult
from tomr_reality_gap.fit.model import Model


def for_users(analysis: AnalysisResult, model: Model) -> Model:
    """The model for the user's simulation: without what that shows by itself."""
    names = [item.name for item in analysis.found.best.model.hypotheses]
    theirs = dict(zip(names, analysis.shared, strict=True))
    offsets = tuple(
        tuple(offset - other for offset, other in zip(own, theirs[hypothesis.name], strict=True))
        for hypothesis, own in zip(model.hypotheses, model.offsets, strict=True)
    )
    return evolve(model, offsets=offsets)


def described(analysis: AnalysisResult, model: Model) -> str:
    """Text of robot_explained.yaml: what all wheels share is written once."""
    values = dict(model.described.values)
    wheels = analysis.robot.wheel_names
    term, robot = analysis.term, model.described.robot
    if term is not None and not why_not_held(robot, term):
        name = f"term_{len(analysis.robot.unmodelled) + 1}"
        values.update(parameters_of(name, term, wheels, values))
    for key in [key for key in values if f".{wheels[0]}." in key]:
        keys = [key.replace(wheels[0], wheel) for wheel in wheels]
        numbers = {values.get(item) for item in keys}
        general = key.replace(f".{wheels[0]}.", ".")
        if len(numbers) == 1:
            values[general] = values[key]
            for item in keys:
                del values[item]
    findings = ", ".join(item.name for item in model.hypotheses)
    header = [f"{analysis.source}, with what reality showed besides:", findings]
    recordings = ", ".join(item.recorded.name for item in analysis.dataset.simulations)
    return fitted_text(
        analysis.source,
        values,
        (),
        (),
        half_widths=(),
        header=header,
        provenance={"recordings": recordings},
    )
