"""The paper's network, and what the stage makes of a judge's opinions."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.commissioned import commissioned_words, stamp_of
from tomr_fault_diag.classifier.judges import JUDGES, make_judge
from tomr_fault_diag.classifier.messages import diagnosis_message
from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.settings import CLASSIFIER_PARAMETERS, ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, SLIP, STALE, STATES, WAITING
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.frame import NO_COMMAND, SCATTER, Residual, ResidualFrame
from tomr_fault_diag.residuals.settings import ResidualSettings
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import Level
from tomr_power_model.model.settings import ModelSettings
from tomr_power_model.robot import shipped_robot, suite_version

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
# Wang 2024, Table 1, columns first to sixth.
TABLE_1 = {
    SLIP: (-1, -1, -1, 0, 0, 0, 0, -1, -1, 0),
    CONTROL: (-1, -1, 0, 0, -1, 0, 0, 0, 0, 0),
    MOTOR: (1, 1, 0, 0, -1, 0, 0, 1, 0, 0),
    MOTOR + 1: (1, 0, 1, 0, 0, -1, 0, 0, 1, 0),
    MOTOR + 2: (1, 0, 0, 1, 0, 0, -1, 0, 0, 1),
    NORMAL: (0,) * 10,
}
HEALTHY = TABLE_1[NORMAL]


def _frame(tick: int, codes: tuple[int, ...], stale: bool = False) -> ResidualFrame:
    value = float("nan") if stale else 2.0
    residuals = tuple(Residual(value * code if code else value * 0.0, 1.0, 5.0) for code in codes)
    return ResidualFrame(BASE + tick * 50 * MS, residuals)


def _classifier() -> FaultClassifier:
    """The paper's, which codes alone decide."""
    return FaultClassifier(make_judge(ClassifierSettings(classifier="wang2024")))


def _classify(frames: list[ResidualFrame]) -> list[Diagnosis]:
    classifier = _classifier()
    found = [classifier.classify(frame) for frame in frames]
    return [diagnosis for diagnosis in found if diagnosis is not None]


def _run(*spells: tuple[tuple[int, ...], int]) -> list[Diagnosis]:
    """Diagnoses over spells of (codes, number of ticks)."""
    classifier = _classifier()
    found, tick = [], 0
    for codes, count in spells:
        for _ in range(count):
            tick += 1
            diagnosis = classifier.classify(_frame(tick, codes))
            if diagnosis is not None:
                found.append(diagnosis)
    return found


def test_defaults_of_parameters_are_those_of_settings() -> None:
    """Nodes take the former, benches and training the latter."""
    found = DiagnosisSettings.of({}, "test")
    assert found.classifier == ClassifierSettings()
    assert found.residuals == ResidualSettings()
    assert evolve(found.model, model_values={}) == ModelSettings()


def test_every_classifier_that_can_be_chosen_is_there() -> None:
    (spec,) = [spec for spec in CLASSIFIER_PARAMETERS if spec.name == "classifier"]
    assert set(spec.choices) == set(JUDGES)


def test_softmax_by_hand() -> None:
    network = Network(np.zeros((30, 10)), np.zeros(30), np.zeros((6, 30)), np.log(np.arange(1, 7)))
    np.testing.assert_allclose(network.probabilities(np.ones(10)), np.arange(1, 7) / 21.0)


def test_inference_equals_the_training_framework() -> None:
    """Scores of torch for the shipped weights, stored by `tomr_train` beside them."""
    shipped = json.loads(
        files("tomr_fault_diag").joinpath("weights").joinpath("wang2024.json").read_text()
    )
    inputs = np.array(shipped["torch_check"]["inputs"], dtype=np.float64)
    expected = np.array(shipped["torch_check"]["probabilities"])
    np.testing.assert_allclose(Network.load().probabilities(inputs), expected, atol=1e-6)


def test_inference_equals_torch_itself() -> None:
    torch = pytest.importorskip("torch", reason="torch is only needed to train")
    network = Network.load()
    inputs = np.random.default_rng(0).integers(-1, 2, (500, 10)).astype(np.float64)
    module = torch.nn.Sequential(
        torch.nn.Linear(10, 30), torch.nn.ReLU(), torch.nn.Linear(30, 6), torch.nn.Softmax(dim=1)
    ).double()
    weights = [
        network.hidden_weight, network.hidden_bias, network.output_weight, network.output_bias,
    ]  # fmt: skip
    with torch.no_grad():
        for parameter, value in zip(module.parameters(), weights, strict=True):
            parameter.copy_(torch.tensor(value))
        expected = module(torch.tensor(inputs)).numpy()
    np.testing.assert_allclose(network.probabilities(inputs), expected, atol=1e-6)


@pytest.mark.parametrize("state", [NORMAL, CONTROL, MOTOR, MOTOR + 1, MOTOR + 2])
def test_the_papers_table_is_named(state: int) -> None:
    named = int(Network.load().probabilities(np.array(TABLE_1[state], dtype=float)).argmax())
    assert STATES[named].name == STATES[state].name


def test_a_fault_is_named_after_its_time_and_recovers_after_its_own() -> None:
    found = _run((HEALTHY, 40), (TABLE_1[MOTOR], 20), (HEALTHY, 40))
    changes = [(d.state.name, (d.stamp_ns - BASE) // (50 * MS)) for d in found if d.changed]
    assert [name for name, _ in changes] == ["normal", "motor system fault 1", "normal"]
    named, recovered = changes[1][1], changes[2][1]
    assert 41 < named <= 41 + 8
    assert 61 + 12 <= recovered <= 61 + 18


def test_a_blip_is_no_fault() -> None:
    found = _run((HEALTHY, 40), (TABLE_1[MOTOR], 2), (HEALTHY, 40))
    assert {d.state.name for d in found} == {"normal"}


def test_reports_come_once_a_second_and_on_changes() -> None:
    found = _run((HEALTHY, 200))
    gaps = np.diff([d.stamp_ns for d in found]) // MS
    assert set(gaps[1:].tolist()) == {1000}


def test_nothing_to_compare_is_stale_not_normal() -> None:
    classifier = _classifier()
    diagnosis = classifier.classify(_frame(1, HEALTHY, stale=True))
    assert diagnosis is not None
    assert diagnosis.state is STALE
    assert diagnosis.state.level is Level.STALE


def test_a_robot_that_has_not_been_commanded_anything_waits() -> None:
    nan = float("nan")
    unknown = Residual(nan, nan, nan, missing=NO_COMMAND)
    (waiting,) = _classify([ResidualFrame(BASE + 50 * MS, (unknown,) * 10)])
    assert waiting.state is WAITING
    assert waiting.state.level is Level.OK
    robot = shipped_robot("reference")
    status = diagnosis_message(robot, waiting, "").statuses[0]
    assert status.message == "waiting: no fresh command"
    # Without any power there is more amiss than that.
    lost = Residual(nan, nan, nan, missing="no fresh wheel_1/power")
    (stale,) = _classify([ResidualFrame(BASE + 50 * MS, (unknown, lost, *(unknown,) * 8))])
    assert stale.state is STALE
    status = diagnosis_message(robot, stale, "").statuses[0]
    assert status.message == "stale: no fresh cmd_vel for the model, wheel_1/power"
    other = Residual(nan, nan, nan, missing=SCATTER)
    (stale,) = _classify([ResidualFrame(BASE + 50 * MS, (other, lost, *(other,) * 8))])
    assert diagnosis_message(robot, stale, "").statuses[0].message == f"stale: {SCATTER}"


def test_the_message_says_when_the_robot_was_commissioned() -> None:
    robot, found = shipped_robot("reference"), _run((HEALTHY, 40))[-1]
    plain = ClassifierSettings()
    with_these = evolve(plain, commissioned=stamp_of("2026-03-01", plain, robot))
    with_others = evolve(with_these, classifier="wang2024")
    renamed = evolve(robot, wheel_names=("a_joint", "b_joint", "c_joint"))
    wider = evolve(robot, robot_radius=0.3)
    older = evolve(with_these, commissioned=with_these.commissioned.rpartition(" ")[0] + " 0.0.1")
    another = "another robot, or this one before its description was changed,"
    for settings, described, said in (
        (plain, robot, "no: run tomr_commission"),
        (with_these, robot, "2026-03-01"),
        (with_others, robot, "no: with another classifier on 2026-03-01"),
        (with_these, renamed, f"no: {another} on 2026-03-01"),
        (with_these, wider, f"no: {another} on 2026-03-01"),
        (older, robot, f"no: with version 0.0.1 of the suite, this is {suite_version()}, on 2026"),
    ):
        words = commissioned_words(settings, described)
        assert words.startswith(said)
        assert words.endswith(", run tomr_commission again") == (", " in words)
        status = diagnosis_message(robot, found, "", words).statuses[0]
        assert dict(status.values)["commissioned"] == words


def test_of_a_robot_that_is_not_the_one_described_nothing_is_known() -> None:
    """Named before, fault or not: what residuals show is of the wrong description."""
    classifier, words = _classifier(), "the order of the wheels is wrong: write another"
    healthy = [_frame(tick, HEALTHY) for tick in range(1, 40)]
    faulty = [_frame(tick, TABLE_1[CONTROL]) for tick in range(40, 80)]
    mistaken = [evolve(_frame(tick, TABLE_1[CONTROL]), mistake=words) for tick in range(80, 120)]
    mended = [_frame(tick, HEALTHY) for tick in range(120, 200)]
    found = [classifier.classify(frame) for frame in (*healthy, *faulty, *mistaken, *mended)]
    named = [item.state.name for item in found if item is not None and item.changed]
    assert named == ["normal", "control system fault", "unknown", "normal"]
    (said,) = [item for item in found if item is not None and item.changed and item.frame.mistake]
    status = diagnosis_message(shipped_robot("reference"), said, "").statuses[0]
    assert status.message == f"unknown: robot.yaml: {words}"
    assert dict(status.values)["evidence 1"] == f"robot.yaml: {words}"


def test_a_mistake_is_no_reason_to_speak_of_what_hardly_comes() -> None:
    classifier = _classifier()
    for tick in range(1, 40):
        classifier.classify(_frame(tick, HEALTHY, stale=True))
    said = classifier.classify(evolve(_frame(40, HEALTHY), mistake="exchange the plugs"))
    assert said is not None
    assert said.state.name == "not enough data"


def test_a_clock_that_goes_back_starts_afresh() -> None:
    classifier = _classifier()
    for tick in range(100, 130):
        classifier.classify(_frame(tick, TABLE_1[MOTOR]))
    assert classifier.classify(_frame(129, HEALTHY)) is None
    diagnosis = classifier.classify(_frame(1, HEALTHY))
    assert diagnosis is not None
    assert diagnosis.state is STATES[NORMAL]


def test_the_message_is_for_people_and_plots() -> None:
    robot = shipped_robot("reference")
    found = [d for d in _run((HEALTHY, 40), (TABLE_1[MOTOR], 20)) if d.changed][-1]
    status = diagnosis_message(robot, found, "robot_7").statuses[0]
    values = dict(status.values)
    assert status.level is Level.ERROR
    assert status.message == "motor system fault 1 (wheel_1_joint)"
    assert status.hardware_id == "robot_7"
    assert sum(float(values[f"p {state.name}"]) for state in STATES) == pytest.approx(1, abs=1e-3)
    assert float(values["since"]) * 1e9 == pytest.approx(found.since_ns)
    assert "wheel_1 power" in values["evidence 2"]


def test_damaged_weights_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "weights.npz"
    file.write_bytes(b"no zip")
    with pytest.raises(InputError, match="train it again"):
        Network.load(file)
    np.savez(file, hidden_weight=np.zeros((3, 3)))
    with pytest.raises(InputError, match="train it again"):
        Network.load(file)
