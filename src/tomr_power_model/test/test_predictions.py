"""Predictions as messages and back."""

import pytest

from tomr_power_model.messages.bag import to_bag
from tomr_power_model.messages.readings import SupplyReading
from tomr_power_model.model.prediction import Prediction
from tomr_power_model.robot import shipped_robot
from tomr_power_model.topics.predictions import (
    PredictionAssembler,
    prediction_messages,
    prediction_topics,
)

ROBOT = shipped_robot("reference")
STAMP = 1_700_000_000_000_000_000


def reading(current: float) -> SupplyReading:
    return SupplyReading.rounded(24.0, current)


PREDICTION = Prediction(
    STAMP,
    (1.0, 2.0, 3.0),
    (0.1, 0.2, 0.3),
    (reading(0.5), reading(0.75), reading(1.0)),
    reading(2.5),
    (reading(1.25), reading(1.5), reading(1.75)),
    (4.0, 5.0, 6.0),
    (4.5, 5.5, 6.5),
)


@pytest.mark.parametrize("first", range(10))
def test_a_prediction_survives_its_messages_in_any_order(first: int) -> None:
    messages = prediction_messages(ROBOT, PREDICTION)
    assert [(one.topic, type(one)) for one in messages] == list(prediction_topics(ROBOT).items())
    assembler = PredictionAssembler(ROBOT)
    *parts, last = [*messages[first:], *messages[:first]]
    for part in parts:
        assert assembler.add(part.topic, STAMP, to_bag(part.plain)) is None
    assert assembler.add(last.topic, STAMP, to_bag(last.plain)) == PREDICTION
