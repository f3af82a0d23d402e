"""Labels of training drives."""

from collections.abc import Callable

from attrs import evolve

from tomr_sim_bridge.missions.schema import PlannedFault
from tomr_training.drives import Drive
from tomr_training.planar.generate import CONTROL, IGNORED, MOTOR, NORMAL, simulate


def test_labels_follow_the_fault(chosen: Callable[..., Drive]) -> None:
    fault = PlannedFault("control_signal_lost", 2.0, 4.0, {"severity": 1.0, "wheel": 2})
    drive = chosen(11, phases=chosen(11).mission.phases[:5], faults=(fault,))
    labels = simulate(drive).labels
    assert set(labels[41:79].tolist()) == {CONTROL + 1}
    assert set(labels[20:40].tolist()) <= {NORMAL, IGNORED}
    assert labels[80] == IGNORED
    assert MOTOR not in labels
    healthy = simulate(evolve(drive, bumps=()).healthy).labels
    assert set(healthy.tolist()) <= {NORMAL, IGNORED}
    assert len(healthy) == len(labels)
