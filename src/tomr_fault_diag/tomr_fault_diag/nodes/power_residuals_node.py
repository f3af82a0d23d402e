"""Node `power_residuals`: measured against predicted power, ten residuals as in Table 1."""

from typing import Any

from tomr_fault_diag.residuals.messages import TOPIC, residual_message
from tomr_fault_diag.residuals.settings import (
    RESIDUAL_PARAMETERS,
    BandSettings,
    ResidualSettings,
)
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.messages.intake import stamp_of
from tomr_power_model.messages.outgoing import TYPES, DiagnosticMessage
from tomr_power_model.model.input_health import TOPIC as DIAGNOSTICS
from tomr_power_model.model.ticks import Arrival
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.stage_node import STAGE_QOS, StageNode, run_node
from tomr_power_model.topics.inputs import Input, guarded
from tomr_power_model.topics.predictions import PredictionAssembler, prediction_topics


class PowerResidualsNode(StageNode):
    """Publishes the residuals of each tick as one DiagnosticArray, and how the sensors do."""

    def __init__(self) -> None:
        super().__init__("power_residuals", RESIDUAL_PARAMETERS)
        self.stage = ResidualStage(self._robot, ResidualSettings.of(self.values))
        self._assembler = PredictionAssembler(self._robot)
        self.offer(TOPIC, DiagnosticMessage)
        self.offer(DIAGNOSTICS, DiagnosticMessage)
        topics = prediction_topics(self._robot).items()
        predictions = [self._prediction(topic, TYPES[kind]) for topic, kind in topics]
        self.listen(predictions, self._advance, STAGE_QOS)
        self.listen(residual_inputs(self._robot, self.stage), self._advance)
        self.on_change(lambda values: self.stage.retune(BandSettings.of(values)))

    def _prediction(self, topic: str, type_name: str) -> Input:
        def take(message: Any, receive_ns: int) -> Arrival | None:
            stamp = stamp_of(message, receive_ns)
            prediction = self._assembler.add(topic, stamp, message)
            return None if prediction is None else self.stage.prediction(prediction)

        return Input(topic, type_name, guarded(take))

    def _advance(self) -> None:
        for frame in self.stage.due():
            self.send(residual_message(self._robot, frame, self.stage.settings.hardware_id))
        for report in self.stage.reports():
            self.send(report)


def main() -> int:
    """Entry point of `power_residuals`."""
    description = "Compare the measured power of each motor with the predicted."
    given = node_arguments("power_residuals", description, RESIDUAL_PARAMETERS)
    return run_node(PowerResidualsNode, given)
