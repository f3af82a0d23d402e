"""Node `tomr_diagnosis`: the three stages in one process."""

from collections.abc import Sequence
from typing import Any

from attrs import evolve
from lifecycle_msgs.msg import State
from rclpy._rclpy_pybind11 import RCLError
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn

from tomr_fault_diag.classifier.messages import TOPIC as DIAGNOSTICS
from tomr_fault_diag.diagnosis.pipeline import Pipeline, Step
from tomr_fault_diag.diagnosis.settings import PARAMETERS, STAGE_NODES, DiagnosisSettings
from tomr_fault_diag.nodes.fault_classifier_node import offer_clearing
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_power_model.messages.outgoing import DiagnosticMessage
from tomr_power_model.nodes.command_line import node_arguments, parameter_files
from tomr_power_model.nodes.stage_node import StageNode, run_node
from tomr_power_model.robot import read_node_sections
from tomr_power_model.topics.inputs import Input
from tomr_power_model.topics.predictions import prediction_topics

NAME = "tomr_diagnosis"
UNMANAGED = LifecycleState("unmanaged", State.PRIMARY_STATE_UNKNOWN)


class DiagnosisNode(LifecycleNodeMixin, StageNode):
    """Model, residuals and classifier with the topics and the numbers of the three nodes.

    Takes the transitions of a managed node by itself at its start, or from a lifecycle manager.
    """

    def __init__(self, files: Sequence[str] = ()) -> None:
        """`files`: parameter files, of which the sections of the three nodes count here too."""
        given: dict[str, object] = {}
        for file in files:
            given.update(read_node_sections(file, STAGE_NODES))
        StageNode.__init__(self, NAME, PARAMETERS.values(), given)
        self.pipeline = self._fresh()  # what cannot be used is reported at the start
        self.on_change(lambda _: self.pipeline.retune(self._settings()))
        if self.values["managed"]:
            LifecycleNodeMixin.__init__(self)
            _refuse_what_cannot_be(self._service_change_state)
        else:
            self.on_configure()
            self.on_activate()

    def on_configure(self, _: LifecycleState = UNMANAGED) -> TransitionCallbackReturn:
        """Offer what is published, and the service."""
        self.offer(DIAGNOSTICS, DiagnosticMessage)
        if self.values["intermediate_topics"]:
            self.offer(RESIDUALS, DiagnosticMessage)
            for topic, kind in prediction_topics(self._robot).items():
                self.offer(topic, kind)
        self._clearing = offer_clearing(self, lambda: self.pipeline.release())
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState = UNMANAGED) -> TransitionCallbackReturn:
        """Listen, and diagnose."""
        inputs = {item.topic: self._input(item) for item in self.pipeline.inputs}
        self.listen(inputs.values(), self._advance)
        self.watch_silence(self._say_silence)
        if state is not UNMANAGED:
            self.introduce()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, _: LifecycleState = UNMANAGED) -> TransitionCallbackReturn:
        """Listen no longer; what was heard counts for nothing later on."""
        self.unlisten()
        self.pipeline = self._fresh()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, _: LifecycleState = UNMANAGED) -> TransitionCallbackReturn:
        """Take back what was offered."""
        self.withdraw()
        self.destroy_service(self._clearing)
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState = UNMANAGED) -> TransitionCallbackReturn:
        """Neither listen nor offer anything; the process waits for its signal."""
        if state.state_id == State.PRIMARY_STATE_ACTIVE:
            self.unlisten()
        if state.state_id != State.PRIMARY_STATE_UNCONFIGURED:
            self.on_cleanup()
        return TransitionCallbackReturn.SUCCESS

    def _fresh(self) -> Pipeline:
        warn = self.get_logger().warning
        return Pipeline(self._robot, self._settings(), is_compiled=False, warn=warn)

    def _settings(self) -> DiagnosisSettings:
        return DiagnosisSettings.of(self.values, NAME)

    def _input(self, item: Input) -> Input:
        def take(message: Any, receive_ns: int) -> None:
            step = self.pipeline.take(item.topic, message, receive_ns)
            if step.frames:
                self.heard_now()
            for outgoing in self.pipeline.messages(self._heard(step)):
                self.send(outgoing)

        return evolve(item, take=take)

    def _say_silence(self, now_ns: int) -> None:
        self.send(self.pipeline.silence(now_ns))

    def _heard(self, step: Step) -> Step:
        """A step without what nobody listens to: words and numbers for it cost time."""
        if step.predictions and not any(map(self.is_heard, prediction_topics(self._robot))):
            step = evolve(step, predictions=())
        if step.frames and not self.is_heard(RESIDUALS):
            step = evolve(step, frames=())
        return step

    def _advance(self) -> None:
        """Nothing is due later: the pipeline answers at once."""


def _refuse_what_cannot_be(change_state: Any) -> None:
    """Let the service answer a transition that its state does not have: rclpy raises over it."""
    change = change_state.callback

    def guarded(request: Any, response: Any) -> Any:
        try:
            return change(request, response)
        except RCLError:
            response.success = False
            return response

    change_state.callback = guarded


def main() -> int:
    """Entry point of `tomr_diagnosis`."""
    description = "Diagnose a robot: commands, encoders and motor power in, /diagnostics out."
    given = node_arguments(NAME, description, PARAMETERS.values())
    return run_node(lambda: DiagnosisNode(parameter_files(given)), given)
