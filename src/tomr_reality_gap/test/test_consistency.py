"""Recordings of different robots in one list: shown by parameters that cannot change in between."""

from types import SimpleNamespace

import numpy as np
import pytest

from tomr_power_model.errors import InputError
from tomr_power_model.estimation.parameter import Parameter
from tomr_reality_gap.fit.consistency import check_same_robot

KEYS = ("robot.mass", "motor.wheel_1_joint.torque_constant", "physics.friction.coulomb.torque")
VALUES = {KEYS[0]: 15.0, KEYS[1]: 0.035, KEYS[2]: 0.06}
ROWS = 400


def _made(
    *off: tuple[float, float, float],
    noise: float = 0.1,
    duration: float = 60.0,
    named: tuple[float, ...] = (),
) -> tuple[object, object]:
    """A dataset whose recordings' robots are off by such shares of mass, constant and friction.

    `named`: how much of each recording's mass a finding explains beside its own tolerance.
    """
    random = np.random.default_rng(2)
    parameters = tuple(Parameter(key, (key,), "", 0.01 * VALUES[key]) for key in KEYS)
    matrix = random.standard_normal((ROWS * len(off), 4))  # and one sensor nuisance
    if named:
        matrix = np.column_stack([matrix, np.repeat(named, ROWS) * matrix[:, 0]])
    offsets = np.repeat([[part / 0.01 for part in parts] for parts in off], ROWS, axis=0)
    value = (matrix[:, :3] * offsets).sum(axis=1) + noise * random.standard_normal(len(matrix))
    simulations = tuple(
        SimpleNamespace(
            size=ROWS, recorded=SimpleNamespace(name=f"tour{number}", duration=duration)
        )
        for number in range(len(off))
    )
    model = SimpleNamespace(nuisances=parameters, described=SimpleNamespace(values=VALUES))
    jacobian = SimpleNamespace(
        matrix=matrix,
        nuisance=slice(0, 3),
        sensors=slice(3, 4),
        kept=matrix.shape[1],
        own=(),
        value=np.zeros(len(matrix)),
        model=model,
    )
    weight = np.full(len(matrix), 1.0 / noise)
    last = SimpleNamespace(jacobian=jacobian, noise=SimpleNamespace(weight=weight))
    return SimpleNamespace(simulations=simulations, value=value), last


def test_recordings_of_one_robot_go_together() -> None:
    """Off by five times the tolerance, but all of them alike."""
    check_same_robot(*_made((0.1, 0.0, 0.3), (0.1, 0.0, 0.3), (0.11, 0.0, 0.3)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ((0.3, 0.0, 0.0), r"tour0 and tour2: .* values of robot\.mass that lie 30 % apart"),
        ((0.0, -0.2, 0.0), r"motor\.wheel_1_joint\.torque_constant that lie 20 % apart"),
    ],
)
def test_another_robot_among_them_is_refused(other: tuple[float, float, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_same_robot(*_made((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), other))  # type: ignore[arg-type]


def test_another_floor_is_no_other_robot() -> None:
    check_same_robot(*_made((0.0, 0.0, 0.0), (0.0, 0.0, 0.5)))  # type: ignore[arg-type]


def test_what_a_recording_hardly_shows_is_not_held_against_it() -> None:
    check_same_robot(*_made((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), noise=200.0))  # type: ignore[arg-type]


def test_short_drives_show_the_floor_under_them() -> None:
    """One straight each, in directions of their own."""
    check_same_robot(*_made((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), duration=18.0))  # type: ignore[arg-type]


def test_a_mass_that_is_found_wrong_takes_nothing_from_its_tolerance() -> None:
    """Each recording would divide what it asks for between the two as it likes."""
    named = (200.0, 1.0)  # the same, in other units, as the finding's response has it
    check_same_robot(*_made((0.3, 0.0, 0.0), (0.3, 0.0, 0.0), named=named))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"robot\.mass that lie 30 % apart"):
        check_same_robot(*_made((0.3, 0.0, 0.0), (0.0, 0.0, 0.0), named=named))  # type: ignore[arg-type]
