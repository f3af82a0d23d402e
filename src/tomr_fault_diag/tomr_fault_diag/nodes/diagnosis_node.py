"""Node `tomr_diagnosis`: the three stages in one process."""

from collections.abc import Sequence
from typing import Any

from attrs import evolve

from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_fault_diag.diagnosis.settings import PARAMETERS, STAGE_NODES, DiagnosisSettings
from tomr_fault_diag.nodes.fault_classifier_node import offer_clearing
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_power_model.messages.outgoing import DiagnosticMessage, JointMessage, SupplyMessage
from tomr_power_model.nodes.command_line import node_arguments, parameter_files
from tomr_power_model.nodes.stage_node import StageNode, run_node
from tomr_power_model.robot import read_node_sections
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.topics.inputs import Input
from tomr_power_model.topics.predictions import EXPECTED, prediction_topics

NAME = "tomr_diagnosis"
INTERMEDIATE = ParameterSpec(
    "intermediate_topics",
    "publish predictions and residuals too, as the three nodes do, where anybody listens",
    "bool",
    True,
)
NODE_PARAMETERS = (*PARAMETERS.values(), INTERMEDIATE)


class DiagnosisNode(StageNode):
    """Model, residuals and classifier with the topics and the numbers of the three nodes."""

    def __init__(self, files: Sequence[str] = ()) -> None:
        """`files`: parameter files, of which the sections of the three nodes count here too."""
        given: dict[str, object] = {}
        for file in files:
            given.update(read_node_sections(file, STAGE_NODES))
        super().__init__(NAME, NODE_PARAMETERS, given)
        self.pipeline = Pipeline(
            self._robot,
            self._settings(),
            is_compiled=False,
            warn=self.get_logger().warning,
        )
        self.offer(DIAGNOSTICS, DiagnosticMessage)
        if self.values["intermediate_topics"]:
            self.offer(RESIDUALS, DiagnosticMessage)
            for topic in prediction_topics(self._robot):
                self.offer(topic, JointMessage if topic == EXPECTED else SupplyMessage)
        inputs = {item.topic: self._input(item) for item in self.pipeline.inputs}
        self.listen(inputs.values(), self._advance)
        offer_clearing(self, self.pipeline.release)
        self.on_change(lambda _: self.pipeline.retune(self._settings()))

    def _settings(self) -> DiagnosisSettings:
        own = {name: value for name, value in self.values.items() if name in PARAMETERS}
        return DiagnosisSettings.of(own, NAME)

    def _input(self, item: Input) -> Input:
        def take(message: Any, receive_ns: int) -> None:
            step = self.pipeline.take(item.topic, message, receive_ns)
            for outgoing in self.pipeline.messages(self._heard(step)):
                self.send(outgoing)

        return evolve(item, take=take)

    def _heard(self, step: Step) -> Step:
        """A step without what nobody listens to: words and numbers for it cost time."""
        if step.predictions and not any(map(self.is_heard, prediction_topics(self._robot))):
            step = evolve(step, predictions=())
        if step.frames and not self.is_heard(RESIDUALS):
            step = evolve(step, frames=())
        return step

    def _advance(self) -> None:
        """Nothing is due later: the pipeline answers at once."""


def main() -> int:
    """Entry point of `tomr_diagnosis`."""
    description = "Diagnose a robot: commands, encoders and motor power in, /diagnostics out."
    given = node_arguments(NAME, description, NODE_PARAMETERS)
    return run_node(lambda: DiagnosisNode(parameter_files(given)), given)
