"""Labels of training drives."""

from collections.abc import Callable

import numpy as np
from attrs import evolve

from tomr_fault_diag.classifier.belief import CONTROLS, DRAGS, ENCODERS, EXTERNAL, METERS, OTHER
from tomr_fault_diag.classifier.states import NORMAL, SLIP
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.schema import PlannedFault, TwistPhase
from tomr_training.drives import Bump, Drive
from tomr_training.labels import SLIPPING, Noise, deviates
from tomr_training.planar.generate import BEYOND, IGNORED, PAPER_OF, simulate
from tomr_training.planar.plant import run_plant

REFERENCE = shipped_robot("reference")


def test_labels_follow_the_fault(chosen: Callable[..., Drive]) -> None:
    fault = PlannedFault("control_signal_lost", 2.0, 4.0, {"severity": 1.0, "wheel": 2})
    drive = chosen(11, phases=chosen(11).mission.phases[:5], faults=(fault,))
    labels = simulate(drive).labels
    assert set(labels[41:79].tolist()) == {CONTROLS.start + 1}
    assert set(labels[20:40].tolist()) <= {NORMAL, IGNORED}
    assert labels[80] == IGNORED
    assert ENCODERS.start not in labels
    healthy = simulate(evolve(drive, bumps=()).healthy).labels
    assert set(healthy.tolist()) <= {NORMAL, IGNORED}
    assert len(healthy) == len(labels)


def test_the_aftermath_is_ignored_while_it_shows(straight: Callable[..., Drive]) -> None:
    """A wheel that starts again takes longer than the half second that is ignored anyhow."""
    lost = PlannedFault("encoder_lost", 2.0, 3.0, {"severity": 1.0, "wheel": 2})
    drive = straight(faults=(lost,))
    truth, twin = run_plant(drive).truth, run_plant(drive.healthy).truth
    last = int(np.flatnonzero(deviates(truth, twin, Noise.of(drive.plant)))[-1])
    assert last > 60
    labels = simulate(drive).labels
    assert set(labels[60 : last + 11].tolist()) == {IGNORED}
    assert labels[last + 11] == NORMAL


def test_slipping_without_a_fault_is_ignored(straight: Callable[..., Drive]) -> None:
    drive = straight(floor_friction=0.05)
    slips = run_plant(drive).truth.slip.max(axis=1) > SLIPPING
    assert slips.any()
    labels = simulate(drive).labels
    assert (labels[slips] == IGNORED).all()
    assert (labels[~slips] == NORMAL).all()


def test_what_a_push_did_is_the_pushs(straight: Callable[..., Drive]) -> None:
    bump = Bump(2.5, 0.15, (40.0, 0.0), 0.0)
    labels = simulate(straight(bumps=(bump,))).labels
    pushed = np.flatnonzero(labels == EXTERNAL)
    assert 50 <= pushed[0] <= 52
    assert 53 < pushed[-1] < 110
    assert set(labels.tolist()) == {NORMAL, EXTERNAL}
    assert (simulate(straight()).labels == NORMAL).all()


def test_two_faults_at_once_are_none_that_is_known(straight: Callable[..., Drive]) -> None:
    drags = PlannedFault("bearing_dragging", 2.0, 4.0, {"wheel": 2, "severity": 1, "torque": 0.2})
    wrong = PlannedFault("power_sensor_scaled", 3.0, 5.0, {"wheel": 3, "factor": 0.5})
    labels = simulate(straight(faults=(drags, wrong))).labels
    for ticks, hypothesis in (
        (slice(41, 59), DRAGS.start + 1),
        (slice(61, 79), OTHER),
        (slice(81, 99), METERS.start + 2),
    ):
        assert set(labels[ticks].tolist()) == {hypothesis}


def test_a_floor_that_drags_is_slippery_where_wheels_slide_on_it(
    straight: Callable[..., Drive],
) -> None:
    phases = (*straight().mission.phases, TwistPhase((0.0, 0.0, 0.0), 1.0))
    ice = PlannedFault("floor_slippery", 3.5, None, {"severity": 1.0, "drag": 0.5})
    drive = straight(faults=(ice,), phases=phases)
    sliding = np.flatnonzero(run_plant(drive).truth.slip.max(axis=1) > SLIPPING)
    labels = simulate(drive).labels
    assert 100 <= sliding[0] < 105  # it brakes
    assert set(labels[71:100].tolist()) == {EXTERNAL}
    assert set(labels[sliding].tolist()) == {SLIP}


def test_what_the_paper_would_call_them() -> None:
    beyond = [BEYOND] * 3
    assert PAPER_OF.tolist() == [0, 1, 2, 2, 2, *[3, 4, 5] * 3, *beyond, 0, BEYOND, BEYOND]
