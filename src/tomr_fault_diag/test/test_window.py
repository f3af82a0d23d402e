"""The window classifier: what it sees, how it gathers evidence, what it says of a motion."""

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_fault_diag.classifier.belief import CONTROLS, Belief, six_of
from tomr_fault_diag.classifier.features import (
    BLIND,
    CHANNELS,
    INPUTS,
    WINDOW,
    by_wheel,
    channels,
    channels_of,
)
from tomr_fault_diag.classifier.judges import WindowJudge, make_judge
from tomr_fault_diag.classifier.messages import diagnosis_message
from tomr_fault_diag.classifier.observability import MotionWatch, Unseen
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.classifier.stage import Diagnosis, FaultClassifier
from tomr_fault_diag.classifier.states import CONTROL, MOTOR, NORMAL, NOT_OBSERVABLE, STATES
from tomr_fault_diag.classifier.window_network import WindowNetwork
from tomr_fault_diag.residuals.frame import Residual, ResidualFrame
from tomr_power_model.errors import InputError
from tomr_power_model.messages.plain import Level
from tomr_power_model.robot import shipped_robot

MS = 1_000_000
BASE = 1_700_000_000_000 * MS
NAN = float("nan")
Three = tuple[float, float, float]
NONE: Three = (0.0, 0.0, 0.0)
# Wheel speeds of a straight drive in which every wheel turns, and of one with wheel 1 idle.
ALL: Three = (3.0, -8.0, 5.0)
IDLE: Three = (0.0, -8.0, 8.0)


def frame(
    tick: int,
    expected: Three = ALL,
    speed: Three = NONE,
    power: Three = NONE,
    derived: Three = NONE,
) -> ResidualFrame:
    """Speeds expected [rad/s]; residuals of speed, power and derived power by wheel."""
    total = Residual(sum(power), 2.3, 18.0)
    motors = tuple(Residual(value, 2.0, 2.0) for value in power)
    speeds = tuple(
        Residual(off, 0.2, want, "rad/s") for off, want in zip(speed, expected, strict=True)
    )
    encoders = tuple(Residual(value, 2.0, 2.0) for value in derived)
    return ResidualFrame(BASE + tick * 50 * MS, (total, *motors, *speeds, *encoders))


def run(frames: Sequence[ResidualFrame]) -> list[Diagnosis]:
    """Diagnoses of the shipped window classifier."""
    classifier = FaultClassifier(make_judge(ClassifierSettings()))
    found = [classifier.classify(item) for item in frames]
    return [diagnosis for diagnosis in found if diagnosis is not None]


def _changes(found: Sequence[Diagnosis]) -> list[str]:
    return [diagnosis.state.name for diagnosis in found if diagnosis.changed]


# Encoder of wheel 2 lost: it reads standstill while its motor draws more and more.
LOST = {"speed": (0.1, -8.0, 0.1), "power": (4.0, 30.0, 4.0), "derived": (4.0, 32.0, 4.0)}


def test_channels_by_hand() -> None:
    seen = channels_of(frame(0, ALL, speed=(0.2, -0.4, NAN), power=(2.0, 0.0, -2.0)))
    one = np.arcsinh(3.0)
    assert seen[0] == 0.0
    np.testing.assert_allclose(seen[1:4], [one, 0.0, -one])
    # What is measured: 4 W, 2 W and nothing, each against a band of 2 W.
    np.testing.assert_allclose(seen[7:10], [np.arcsinh(6.0), one, 0.0])
    # "Slower than told" by 0.4 rad/s at -8 rad/s is +0.4 rad/s; an unknown one is as modelled.
    np.testing.assert_allclose(seen[10:13], [one, np.arcsinh(6.0), 0.0])
    np.testing.assert_allclose(seen[13:16], np.arcsinh([6.0, -16.0, 10.0]))
    np.testing.assert_allclose(seen[16:19], np.arcsinh([6.4, -15.2, 10.0]))


def test_unknown_power_looks_as_modelled_and_draws_nothing() -> None:
    seen = channels_of(frame(0, ALL, power=(NAN, 0.0, 0.0)))
    assert seen[1] == seen[7] == 0.0
    assert seen[8] > 0.0


def test_each_wheel_sees_itself_first_and_turning_forwards() -> None:
    window = np.arange(WINDOW * CHANNELS, dtype=float).reshape(WINDOW, CHANNELS) + 1.0
    window[:, 14] *= -1.0  # wheel 2 turns backwards
    views = by_wheel(window).reshape(3, WINDOW, CHANNELS)
    np.testing.assert_array_equal(views[0], window)
    np.testing.assert_array_equal(views[1, :, 1:4], window[:, [2, 3, 1]])
    np.testing.assert_array_equal(views[1, :, 13:16], -window[:, [14, 15, 13]])
    np.testing.assert_array_equal(views[2, :, 7:13], window[:, [9, 7, 8, 12, 10, 11]])


def test_another_numbering_of_the_wheels_names_the_other_wheel() -> None:
    network, random = WindowNetwork.load(), np.random.default_rng(0)
    window = random.normal(0.0, 1.0, (WINDOW, CHANNELS))
    turned = window[:, [0, *(1 + 3 * g + (w + 1) % 3 for g in range(6) for w in range(3))]]
    ahead, found = network.scores_of(window), network.scores_of(turned)
    np.testing.assert_allclose(found[:2], ahead[:2])
    np.testing.assert_allclose(found[2:5], ahead[[3, 4, 2]])
    np.testing.assert_allclose(found[5:8], ahead[[6, 7, 5]])


def test_inference_equals_the_training_framework() -> None:
    """Scores of torch for the shipped weights, stored by `tomr_train` beside them."""
    shipped = json.loads(
        files("tomr_fault_diag").joinpath("weights").joinpath("window.json").read_text()
    )["torch_check"]
    found = WindowNetwork.load().scores_of(np.array(shipped["windows"]))
    np.testing.assert_allclose(found, np.array(shipped["scores"]), atol=0.01, rtol=1e-3)


def test_belief_by_hand() -> None:
    """One window that says e^-10 of everything but slip, at half weight: odds of 10^-6 e^5."""
    belief = Belief(0.5, 6.0)
    likelihoods = np.full(8, -10.0)
    likelihoods[1] = 0.0
    shares = belief.update(likelihoods)
    odds = 1e-6 * np.exp(5.0) / (1.0 - 7e-6)
    assert shares[1] / shares[0] == pytest.approx(odds, rel=1e-6)
    assert six_of(shares).sum() == pytest.approx(1.0)


def test_silence_leaves_a_belief_as_it_is() -> None:
    belief = Belief(0.4, 10.0)
    for _ in range(40):
        belief.update(np.where(np.arange(8) == 6, 0.0, -20.0))
    assert belief.shares[6] > 0.999
    for _ in range(200):  # ten seconds in which nothing can be told apart
        belief.update(np.zeros(8))
    assert belief.shares[6] > 0.97


class Saying:
    """A network that says the same of every window."""

    def __init__(self) -> None:
        self.likelihoods = np.zeros(8)

    def log_likelihoods(self, window: np.ndarray) -> np.ndarray:
        return self.likelihoods.copy()


@pytest.mark.parametrize(("idle", "state"), [((), 0), ((0,), 0), ((2,), CONTROL)])
def test_an_idle_wheel_does_not_refute_its_fault(idle: tuple[int, ...], state: int) -> None:
    """The signal of wheel 3 is lost; then five seconds that look normal, wheel 3 idle or not."""
    network = Saying()
    judge = WindowJudge(network, ClassifierSettings())  # type: ignore[arg-type]
    network.likelihoods[:] = -30.0
    network.likelihoods[CONTROLS.start + 2] = 0.0
    for tick in range(20):
        judge.judge(frame(tick), 50 * MS, Unseen())
    network.likelihoods[:] = -3.0
    network.likelihoods[0] = 0.0
    for tick in range(100):
        opinion = judge.judge(frame(20 + tick), 50 * MS, Unseen(idle))
    assert int(np.argmax(opinion.probabilities)) == state


def test_a_lost_encoder_is_named_within_half_a_second() -> None:
    found = run([frame(t) for t in range(40)] + [frame(40 + t, ALL, **LOST) for t in range(20)])
    named = next(d for d in found if d.state is STATES[MOTOR + 1])
    assert named.stamp_ns - (BASE + 40 * 50 * MS) <= 500 * MS
    assert named.wheel == 1


def _coasting(start: int, count: int) -> list[ResidualFrame]:
    """Wheel 3 without a signal coasts to a stop, its motor draws nothing."""
    return [
        frame(start + t, ALL, (0.0, 0.0, -min(5.0, 0.5 * t)), (0.3, 0.3, -1.0))
        for t in range(count)
    ]


def test_a_fault_stays_named_at_rest_and_recovers_in_motion() -> None:
    moving = [frame(t) for t in range(40)] + _coasting(40, 40)
    still = [frame(80 + t, NONE) for t in range(60)]
    healthy = [frame(140 + t) for t in range(60)]
    found = run(moving + still)
    assert found[-1].state is STATES[CONTROL]
    assert found[-1].unseen.everything
    assert run(moving + still + healthy)[-1].state.name == "normal"


def test_a_lost_signal_tells_its_wheel() -> None:
    found = run([frame(t) for t in range(40)] + _coasting(40, 30))
    assert found[-1].state is STATES[CONTROL]
    assert found[-1].wheel == 2
    status = diagnosis_message(shipped_robot("reference"), found[-1], "").statuses[0]
    assert status.message == "control system fault (wheel_3_joint)"


def test_a_blip_is_no_fault() -> None:
    blip = [frame(40 + t, ALL, **LOST) for t in range(1)]
    found = run([frame(t) for t in range(40)] + blip + [frame(41 + t) for t in range(40)])
    assert _changes(found) == ["normal"]


def test_what_a_motion_cannot_show() -> None:
    robot = shipped_robot("reference")
    idle = run([frame(t, IDLE) for t in range(60)])[-1]
    assert idle.state.name == "normal"
    status = diagnosis_message(robot, idle, "").statuses[0]
    assert status.message == "normal; motor 1 not observable in this motion"
    assert dict(status.values)["not_observable"] == "motor 1, slip"
    still = run([frame(t, NONE) for t in range(60)])[-1]
    assert still.state is NOT_OBSERVABLE
    assert still.state.level is Level.OK
    turning = run([frame(t, (3.0 + 0.2 * t, -8.0, 5.0 - 0.2 * t)) for t in range(60)])[-1]
    assert turning.unseen.words == ()


def test_a_wheel_that_moves_without_being_told_is_not_idle() -> None:
    found = run([frame(t, IDLE, speed=(2.0, 0.0, 0.0)) for t in range(60)])
    assert 0 not in found[-1].unseen.wheels


def test_robots_that_lack_a_sensor_look_as_modelled_there() -> None:
    window = np.ones((2, WINDOW, CHANNELS))
    total, motors, encoders = (blind(window.copy()) for blind in BLIND)
    assert (total[..., 0] == 0.0).all()
    assert (total[..., 1:] == 1.0).all()
    assert (motors[..., 1:10] == 0.0).all()
    assert (motors[..., 10:] == 1.0).all()
    assert (encoders[..., [4, 5, 6, 10, 11, 12]] == 0.0).all()
    assert (encoders[..., [7, 8, 9]] == 1.0).all()
    assert by_wheel(window).shape == (2, 3, INPUTS)


@pytest.mark.parametrize("hz", [5, 10, 20, 40, 100])
def test_what_is_named_does_not_hang_on_the_rate_of_decisions(hz: int) -> None:
    period, start = 1000 // hz, 2000

    def at(ms: int) -> ResidualFrame:
        found = frame(0, ALL, **(LOST if ms > start else {}))
        return evolve(found, stamp_ns=BASE + ms * MS)

    found = run([at(ms) for ms in range(period, 4000, period)])
    changes = [((d.stamp_ns - BASE) // MS, d.state.name) for d in found if d.changed]
    assert [state for _, state in changes] == ["normal", "motor system fault 2"]
    assert changes[1][0] - start <= 300 + period


def test_after_a_gap_one_tick_counts_once() -> None:
    """Not as often as would have fitted into the gap."""
    healthy = [frame(tick) for tick in range(1, 40)]
    (*_, last) = run([*healthy, frame(400, **LOST)])
    assert last.state is STATES[NORMAL]


@pytest.mark.parametrize("hz", [5, 10, 20, 40, 100])
def test_an_idle_wheel_is_idle_after_half_a_second_at_any_rate(hz: int) -> None:
    period = 1000 // hz
    watch, found = MotionWatch(), []
    for ms in range(period, 2000, period):
        found.append(watch.take(evolve(frame(0, IDLE), stamp_ns=BASE + ms * MS)))
    first = next(k for k, unseen in enumerate(found) if unseen.wheels == (0,))
    assert 450 <= first * period < 450 + period


def test_damaged_weights_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "weights.npz"
    file.write_bytes(b"no zip")
    with pytest.raises(InputError, match="train it again"):
        WindowNetwork.load(file)
    np.savez(file, **{name: np.zeros(3) for name in ("weight_1", "bias_1", "weight_2", "bias_2")})
    with pytest.raises(InputError, match="set classifier to the kind"):
        WindowNetwork.load(file)
    with pytest.raises(InputError, match="no weights of the window network"):
        make_judge(
            evolve(
                ClassifierSettings(),
                weights=str(files("tomr_fault_diag") / "weights" / "wang2024.npz"),
            )
        )


def test_channels_of_a_frame_are_those_of_arrays() -> None:
    random = np.random.default_rng(1)
    values = random.normal(0.0, 3.0, (10, 3))
    values[[2, 5], 0] = NAN
    values[6] = NAN
    residuals = tuple(Residual(r, abs(b), m) for r, b, m in values.tolist())
    found = channels_of(ResidualFrame(BASE, residuals))
    expected = channels(values[:, 0], np.abs(values[:, 1]), values[:, 2])
    np.testing.assert_allclose(found, expected, rtol=1e-12)
