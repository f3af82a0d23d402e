"""Both orders of Wang 2024, Table 1: the rows' and the text's."""

from pathlib import Path

import numpy as np
import pytest

from tomr_fault_diag.classifier.judges import CodeJudge
from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import FaultClassifier
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import INPUT_ORDERS, Residual, ResidualFrame
from tomr_power_model.errors import InputError

# Motor 1 lost its encoder: total, power 1, speed 1 and power 1 against the encoder stand out.
CODES = (1, 1, 0, 0, -1, 0, 0, 1, 0, 0)


def _probabilities(network: Network, settings: ClassifierSettings) -> tuple[float, ...]:
    residuals = tuple(Residual(2.0 * code, 1.0, 5.0) for code in CODES)
    diagnosis = FaultClassifier(CodeJudge(network, settings)).classify(
        ResidualFrame(10**18, residuals)
    )
    assert diagnosis is not None
    return diagnosis.probabilities


def test_weights_in_the_texts_order_get_their_inputs_so() -> None:
    shipped = Network.load()
    order = list(INPUT_ORDERS["powers_first"])
    assert [CODES[index] for index in order] == [1, 1, 0, 0, 1, 0, 0, -1, 0, 0]
    other = Network(
        shipped.hidden_weight[:, order],
        shipped.hidden_bias,
        shipped.output_weight,
        shipped.output_bias,
    )
    expected = _probabilities(shipped, ClassifierSettings())
    found = _probabilities(other, ClassifierSettings(input_order="powers_first"))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    mistaken = _probabilities(shipped, ClassifierSettings(input_order="powers_first"))
    assert np.abs(np.subtract(mistaken, expected)).max() > 0.1


def test_the_shipped_weights_take_one_order_only(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the shipped weights take speeds_first"):
        DiagnosisSettings.of({"input_order": "powers_first"}, "test")
    with pytest.raises(InputError, match="one of speeds_first, powers_first"):
        DiagnosisSettings.of({"input_order": "mixed"}, "test")
    given = {"input_order": "powers_first", "weights": str(tmp_path / "own.npz")}
    assert DiagnosisSettings.of(given, "test").classifier.input_order == "powers_first"
