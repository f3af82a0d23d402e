"""Drives that the tests of training share."""

from collections.abc import Callable

import pytest
from attrs import evolve

from tomr_power_model.robot import Robot, shipped_robot
from tomr_sim_bridge.missions.schema import TwistPhase
from tomr_training.drives import Bump, Drive, random_drive

REFERENCE = shipped_robot("reference")


@pytest.fixture
def chosen() -> Callable[..., Drive]:
    """A random drive of a seed and kind, with some of its mission changed."""

    def make(seed: int = 3, kind: str | None = "encoder_lost", **changes: object) -> Drive:
        drive = random_drive(REFERENCE, seed, kind)
        return evolve(drive, mission=evolve(drive.mission, **changes))

    return make


@pytest.fixture
def straight(chosen: Callable[..., Drive]) -> Callable[..., Drive]:
    """A robot just as described, 0.5 m/s ahead after a second at rest."""

    def make(bumps: tuple[Bump, ...] = (), robot: Robot = REFERENCE, **changes: object) -> Drive:
        phases = (TwistPhase((0.0, 0.0, 0.0), 1.0), TwistPhase((0.5, 0.0, 0.0), 4.0))
        plain: dict[str, object] = {"faults": (), "payload": 0.0, "floor_friction": 0.8}
        drive = chosen(**{**plain, "phases": phases, **changes})
        return evolve(drive, plant=robot, believed=robot, bumps=bumps)

    return make
