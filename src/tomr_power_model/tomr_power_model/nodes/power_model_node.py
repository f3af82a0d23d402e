"""Node `power_model`: the predicted power of each motor."""

from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.model.input_health import TOPIC as DIAGNOSTICS
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.settings import MODEL_PARAMETERS, ModelSettings
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.stage_node import StageNode, run_node
from tomr_power_model.topics.inputs import model_inputs
from tomr_power_model.topics.predictions import prediction_messages, prediction_topics


class PowerModelNode(StageNode):
    """Publishes expected wheel motion and power at the decision rate, stamped by the data, and how
    the commands come."""

    def __init__(self) -> None:
        super().__init__("power_model", MODEL_PARAMETERS)
        self._predictor = PowerPredictor(self._robot, ModelSettings.of(self.values))
        for topic, kind in prediction_topics(self._robot).items():
            self.offer(topic, kind)
        self.offer(DIAGNOSTICS, DiagnosticMessage)
        self.listen(model_inputs(self._robot, self._predictor), self._advance)

    def _advance(self) -> None:
        for prediction in self._predictor.due():
            for message in prediction_messages(self._robot, prediction):
                self.send(message)
        for report in self._predictor.reports():
            self.send(report)


def main() -> int:
    """Entry point of `power_model`."""
    description = "Predict the power of each motor from cmd_vel and joint_states."
    given = node_arguments("power_model", description, MODEL_PARAMETERS)
    return run_node(PowerModelNode, given)
