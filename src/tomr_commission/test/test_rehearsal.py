"""Simulated healthy hours and simulated faults of a robot."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from attrs import evolve

from tomr_commission import simulated
from tomr_commission.observed import Observed
from tomr_commission.rehearsal import (
    Rehearsal,
    Usage,
    electrical_off,
    observed_of,
    rehearse,
    shoved_drive,
)
from tomr_commission.simulated import KINDS, cases, simulated_fault, try_simulated
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.residuals.frame import MOTORS, SPEEDS
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.errors import InputError
from tomr_power_model.robot import shipped_robot

ROBOT = shipped_robot("reference")
USAGE = Usage((0.1, 0.4), 0.5)


def test_usage_is_what_the_commands_ask_for() -> None:
    commands = np.zeros((1000, 3))
    commands[:500, 0], commands[500:, 1] = 0.2, -0.4
    commands[:, 2] = np.linspace(-1.0, 1.0, 1000)
    usage = Usage.of(commands)
    assert usage.speed == (0.2, 0.4)
    assert math.isclose(usage.yaw_rate, 0.98, rel_tol=0.01)


def test_shoves_show_in_the_residuals_and_only_there() -> None:
    drive = shoved_drive(
        ROBOT, USAGE, Rehearsal(off=0.0, payload=0.0, force=(3.0, 3.0)), 80_000_001
    )
    seen = observed_of(drive)
    size = np.abs(seen.residual[:, list(MOTORS)]).max(axis=1)
    near = np.zeros(len(size), dtype=bool)
    for bump in drive.bumps:
        near |= (seen.seconds > bump.start - 0.1) & (seen.seconds < bump.start + 2.0)
    assert len(drive.bumps) == 3
    assert size[near].max() > 3.0 * size[~near].max()
    volts = np.abs(seen.volts[:, :3]).max(axis=1)
    assert volts[near].max() > 1.0
    assert volts[seen.seconds < drive.bumps[0].start - 0.1].max() < 0.1


@pytest.mark.parametrize(("seed", "stands"), [(80_000_000, True), (80_000_001, False)])
def test_of_four_drives_one_stands_still_when_it_is_shoved(seed: int, stands: bool) -> None:
    seen = observed_of(shoved_drive(ROBOT, USAGE, Rehearsal(), seed))
    late = seen.modelled[seen.seconds > 5.0][:, list(SPEEDS)]
    assert bool((np.abs(late) < 0.1).all()) is stands


def test_motors_are_no_farther_off_than_their_drivers_voltages_say() -> None:
    usual, known = (
        shoved_drive(ROBOT, USAGE, plan, 80_000_001)
        for plan in (Rehearsal(), Rehearsal(electrical=0.005))
    )
    for before, drawn, nominal in zip(
        usual.plant.motors, known.plant.motors, ROBOT.motors, strict=True
    ):
        assert 0.0 < abs(before.resistance / nominal.resistance - 1.0) <= 0.02
        for name in ("resistance", "torque_constant"):
            far, near = (
                getattr(motor, name) / getattr(nominal, name) - 1.0 for motor in (before, drawn)
            )
            assert math.isclose(near, 0.25 * far, rel_tol=1e-6)
        assert drawn.rotor_inertia == before.rotor_inertia
    assert evolve(known.plant, motors=usual.plant.motors) == usual.plant


def test_what_voltages_say_is_their_scatter_over_what_they_are(
    steady: Callable[..., Observed],
) -> None:
    random = np.random.default_rng(3)
    volts = np.hstack([random.normal(0.0, 0.02, (4000, 3)), np.full((4000, 3), -8.0)])
    drive = steady()
    found = electrical_off([evolve(drive, volts=volts)], 0.02)
    assert math.isclose(found, 3.29 * 0.02 / 8.0, rel_tol=0.1)
    assert electrical_off([evolve(drive, volts=10.0 * volts)], 0.02) < 0.02  # both
    wide = np.hstack([10.0 * volts[:, :3], volts[:, 3:]])
    assert electrical_off([evolve(drive, volts=wide)], 0.02) == 0.02
    assert electrical_off([drive], 0.02) == 0.02  # nothing is known of them
    still = np.hstack([volts[:, :3], np.zeros((4000, 3))])
    assert electrical_off([evolve(drive, volts=still)], 0.02) == 0.02


def test_rehearsal_depends_on_its_arguments_alone() -> None:
    plan = Rehearsal(shoves=3)
    one, other = (
        rehearse("reference", BandSettings(), ClassifierSettings(), USAGE, plan) for _ in range(2)
    )
    assert one == other
    assert len(one.peaks) == 3


def test_first_shoves_and_the_others_are_all_of_them() -> None:
    plan = Rehearsal(shoves=9, first=3)
    args = ("reference", BandSettings(), ClassifierSettings(), USAGE)
    whole, few, others = (rehearse(*args, asked) for asked in (plan, *plan.parts))
    assert len(few.peaks) == 3
    both = few.followed_by(others)
    assert both.peaks == whole.peaks
    assert math.isclose(both.hours, whole.hours)
    assert len(set(whole.peaks)) > 3


def test_cases_are_those_that_the_simulator_can_do() -> None:
    found = cases()
    assert {case.kind.fault for case in found} >= {"control_signal_lost", "encoder_lost"}
    assert [case.wheel for case in found if case.kind.fault == "encoder_lost"] == [1, 2, 3]
    assert len({case.seed for case in found}) == len(found)
    assert all(list(kind.sizes) == sorted(kind.sizes, reverse=True) for kind in KINDS)


def test_fault_comes_on_under_way_and_stays() -> None:
    case = cases()[0]
    drive = simulated_fault("reference", USAGE, case, 0.4)
    (fault,) = drive.mission.faults
    assert fault.start == 3.0
    assert fault.end is None
    assert fault.settings["severity"] == 0.4
    assert drive.length > 8.0


def test_rehearsal_sees_no_more_than_the_robot_reports() -> None:
    deaf = Rehearsal(shoves=3, force=(3.0, 3.0), silent=tuple(range(10)))
    args = (BandSettings(power=0.1, relative=0.01, speed=0.01), ClassifierSettings(), USAGE)
    assert max(rehearse("reference", *args, deaf).peaks) == 0.0
    assert max(rehearse("reference", *args, evolve(deaf, silent=())).peaks) > 0.0


def test_faults_are_simulated_only_where_the_simulator_measures_what_was_recorded(
    monkeypatch: pytest.MonkeyPatch, steady: Callable[..., Observed]
) -> None:
    monkeypatch.setattr(simulated, "on_all_cores", lambda work, jobs: [work(jobs[0])])
    monkeypatch.setattr(simulated, "observed_simulation", lambda drive: steady())
    bands, settings = BandSettings(), ClassifierSettings()
    assert try_simulated("reference", bands, settings, USAGE, "W")
    with pytest.raises(InputError, match="the recordings hold A of the motors, the simulator W"):
        try_simulated("reference", bands, settings, USAGE, "A")
