"""The three stages in one process: messages in, the suite's messages out.

The three nodes run the same stages apart; both give the same numbers, because the stages are driven
by stamps and whatever crosses a topic is rounded as its message rounds it.
"""

from collections.abc import Callable, Iterator
from typing import Any

from attrs import frozen

from tomr_fault_diag.classifier.commissioned import commissioned_words
from tomr_fault_diag.classifier.messages import diagnosis_message, silence_message
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import ResidualFrame
from tomr_fault_diag.residuals.messages import residual_message
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_power_model.dynamics.binding import has_numba
from tomr_power_model.messages.joined import WheelStream
from tomr_power_model.messages.outgoing import DiagnosticMessage, Outgoing
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import Robot
from tomr_power_model.topics.inputs import Complaints, Input, model_inputs
from tomr_power_model.topics.predictions import prediction_messages

Take = Callable[[Any, int], str | None]


@frozen
class Step:
    """What one message brought about."""

    predictions: tuple[Prediction, ...] = ()
    frames: tuple[ResidualFrame, ...] = ()
    diagnoses: tuple[Diagnosis, ...] = ()
    reports: tuple[DiagnosticMessage, ...] = ()  # how the inputs do


_NOTHING = Step()


class Pipeline:
    """Model, residuals and classifier of one robot, fed with recorded or live messages."""

    def __init__(
        self,
        robot: Robot,
        settings: DiagnosisSettings,
        *,
        is_compiled: bool | None = None,
        warn: Callable[[str], object] | None = None,
    ) -> None:
        """`is_compiled`: run the dynamics compiled, None where that can be had; `warn` hears the
        complaints that are worth a line."""
        self.robot = robot
        self.settings = settings
        self.complaints = Complaints()
        self._warn = warn
        compiled = has_numba() if is_compiled is None else is_compiled
        self._predictor = PowerPredictor(robot, settings.model, is_compiled=compiled)
        self._residuals = ResidualStage(robot, settings.residuals)
        self._classifier = FaultClassifier.of(settings.classifier, robot)
        self._commissioned = commissioned_words(settings.classifier, robot)
        wheels = WheelStream(robot.wheel_names)
        self.inputs: tuple[Input, ...] = (
            *model_inputs(robot, self._predictor, wheels),
            *residual_inputs(robot, self._residuals, wheels),
        )
        self._takers: dict[str, list[Take]] = {}
        for item in self.inputs:
            self._takers.setdefault(item.topic, []).append(item.take)

    def take(self, topic: str, message: Any, receive_ns: int) -> Step:
        """Take a message of one of the inputs' topics (relative names, as in the contract)."""
        heard = None
        for take in self._takers[topic]:
            problem = take(message, receive_ns)
            if problem is not None and problem != heard:  # two stages may say the same
                line = self.complaints.note(topic, problem)
                if line is not None and self._warn is not None:
                    self._warn(line)
            heard = problem
        predictions = self._predictor.due()
        for prediction in predictions:
            self._residuals.prediction(prediction)
        frames = self._residuals.due()
        if not predictions and not frames:
            return _NOTHING
        diagnoses = (self._classifier.classify(frame) for frame in frames)
        return Step(
            tuple(predictions),
            tuple(frames),
            tuple(d for d in diagnoses if d is not None),
            (*self._predictor.reports(), *self._residuals.reports()),
        )

    def retune(self, settings: DiagnosisSettings) -> None:
        """Change what may be changed while running: bands, and times of the classifier."""
        self.settings = settings
        self._residuals.retune(settings.residuals.bands)
        self._classifier.settings = settings.classifier

    @property
    def imu_mistake(self) -> str:
        """In which way the IMU is not as described, in words; empty if it is."""
        return self._residuals.imu_mistake

    def misdescribed(self) -> tuple[str, ...]:
        """What speaks against robot.yaml and the sensors so far, and what to mend."""
        return self._residuals.misdescribed()

    def release(self) -> str:
        """Let go of a named fault, latched or not; returns its name, empty if there was none."""
        return self._classifier.release()

    def silence(self, stamp_ns: int) -> DiagnosticMessage:
        """What to say where nothing comes at all."""
        hardware_id = self.settings.classifier.hardware_id
        return silence_message(self.robot, stamp_ns, hardware_id, self._commissioned)

    def messages(self, step: Step) -> Iterator[Outgoing]:
        """The messages that the nodes publish at such a step."""
        hardware_id = self.settings.classifier.hardware_id
        for prediction in step.predictions:
            yield from prediction_messages(self.robot, prediction)
        for frame in step.frames:
            yield residual_message(self.robot, frame, hardware_id)
        for diagnosis in step.diagnoses:
            yield diagnosis_message(self.robot, diagnosis, hardware_id, self._commissioned)
        yield from step.reports
