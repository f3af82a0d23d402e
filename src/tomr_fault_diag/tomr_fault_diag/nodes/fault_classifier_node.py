"""Node `fault_classifier`: the robot's state on /diagnostics."""

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from tomr_fault_diag.classifier.commissioned import commissioned_words
from tomr_fault_diag.classifier.messages import TOPIC, diagnosis_message, silence_message
from tomr_fault_diag.classifier.settings import CLASSIFIER_PARAMETERS, ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_fault_diag.residuals.messages import frame_of
from tomr_power_model.messages.intake import stamp_of
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.messages.types import DIAGNOSTICS
from tomr_power_model.nodes.command_line import node_arguments
from tomr_power_model.nodes.stage_node import STAGE_QOS, StageNode, run_node
from tomr_power_model.topics.inputs import Input, guarded


def offer_clearing(node: Node, release: Callable[[], str]) -> Any:
    """A service ~/clear; `release` lets go of a named fault and returns its name, if any."""

    def clear(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        named = release()
        response.success = True
        response.message = f"{named} is cleared" if named else "no fault was named"
        return response

    return node.create_service(Trigger, "~/clear", clear)


class FaultClassifierNode(StageNode):
    """Publishes the diagnosis once a second and at once on a change; ~/clear lets go of a fault."""

    def __init__(self) -> None:
        super().__init__("fault_classifier", CLASSIFIER_PARAMETERS)
        settings = ClassifierSettings.of(self.values)
        self.classifier = FaultClassifier.of(settings, self._robot)
        self._commissioned = commissioned_words(self.classifier.settings, self._robot)
        self.offer(TOPIC, DiagnosticMessage)
        self.listen([Input(RESIDUALS, DIAGNOSTICS, guarded(self._take))], self._advance, STAGE_QOS)
        self.on_change(self._retune)
        offer_clearing(self, self.classifier.release)
        self.watch_silence(self._say_silence)

    def _take(self, message: Any, receive_ns: int) -> None:
        frame = frame_of(message, stamp_of(message, receive_ns))
        diagnosis = self.classifier.classify(frame)
        self.heard_now()
        if diagnosis is not None:
            hardware_id = self.classifier.settings.hardware_id
            self.send(diagnosis_message(self._robot, diagnosis, hardware_id, self._commissioned))

    def _say_silence(self, now_ns: int) -> None:
        hardware_id = self.classifier.settings.hardware_id
        self.send(silence_message(self._robot, now_ns, hardware_id, self._commissioned))

    def _retune(self, values: Mapping[str, object]) -> None:
        self.classifier.settings = ClassifierSettings.of(values)

    def _advance(self) -> None:
        """Nothing is due later: a frame is answered when it comes."""


def main() -> int:
    """Entry point of `fault_classifier`."""
    description = "Name the state of the robot on /diagnostics from its residuals."
    given = node_arguments("fault_classifier", description, CLASSIFIER_PARAMETERS)
    return run_node(FaultClassifierNode, given)
