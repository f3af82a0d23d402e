"""All parameters of the diagnosis together, for tools that run the three stages in one."""

from collections.abc import Mapping
from typing import Self

from attrs import evolve, frozen

from tomr_fault_diag.classifier.settings import CLASSIFIER_PARAMETERS, ClassifierSettings
from tomr_fault_diag.residuals.settings import RESIDUAL_PARAMETERS, ResidualSettings
from tomr_power_model.errors import InputError
from tomr_power_model.model.settings import MODEL_PARAMETERS, ModelSettings
from tomr_power_model.robot.description import closest
from tomr_power_model.robot.parameters import ParameterSpec, check_all

# Whose sections of a robot.yaml hold settings of the diagnosis; a later one counts more.
STAGE_NODES = ("power_model", "power_residuals", "fault_classifier", "tomr_diagnosis")

# Of the node that holds all stages; tools read them in its section and have no use for them.
_NODE_PARAMETERS = (
    ParameterSpec(
        "intermediate_topics",
        "of tomr_diagnosis: publish predictions and residuals too, as the three nodes do, where "
        "anybody listens",
        "bool",
        True,
    ),
    ParameterSpec(
        "managed",
        "of tomr_diagnosis: be a managed node, which waits for the transitions configure and "
        "activate of a lifecycle manager",
        "bool",
        False,
    ),
)
# The stages share some parameters by name and meaning; a name stands once.
PARAMETERS: Mapping[str, ParameterSpec] = {
    spec.name: spec
    for spec in (
        *MODEL_PARAMETERS,
        *RESIDUAL_PARAMETERS,
        *CLASSIFIER_PARAMETERS,
        *_NODE_PARAMETERS,
    )
}


@frozen
class DiagnosisSettings:
    """Settings of the three stages."""

    model: ModelSettings
    residuals: ResidualSettings
    classifier: ClassifierSettings

    @classmethod
    def of(cls, values: Mapping[str, object], place: str) -> Self:
        """Settings from dotted parameters; absent ones take their default.

        Raises InputError for an unknown name or a value that does not fit.
        """
        for name in values:
            if name not in PARAMETERS:
                raise InputError(f"{place}: {name} is unknown: {closest(name, list(PARAMETERS))}")
        checked = check_all(PARAMETERS.values(), values, place)
        return cls(
            ModelSettings.of(checked),
            ResidualSettings.of(checked),
            ClassifierSettings.of(checked),
        )

    def at_phase(self, share: float) -> Self:
        """The same with the grid of decisions shifted by a share of its period."""
        ticks = self.model.ticks
        shifted = evolve(ticks, phase=round(share * ticks.period))
        return evolve(
            self,
            model=evolve(self.model, ticks=shifted),
            residuals=evolve(self.residuals, ticks=shifted),
        )
