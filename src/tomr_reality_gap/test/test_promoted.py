"""A law that was learnt on one drive, promoted, is the hypothesis that is chosen on another."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from attrs import evolve

from tomr_power_model.effects import EFFECTS
from tomr_power_model.effects.user import load_effects
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import bounds_of
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import Robot, read_description
from tomr_power_model.unmodelled.described import parameters_of
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.cli import main
from tomr_reality_gap.explanation import Learnt
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.model import Model
from tomr_reality_gap.fit.unmodelled import Remainder, Unmodelled, unmodelled_effect
from tomr_reality_gap.hypotheses.catalogue import nuisances
from tomr_reality_gap.hypotheses.scales import scales_of
from tomr_reality_gap.report.json import _learnt

from .test_alignment import _recorded, as_recorded, simulation  # noqa: F401 -- the fixture
from .test_forward_selection import NOISE, _base, searched

EFFECT = "learnt.power_law_by_speed"
SIZE, EXPONENT, WHEEL = 3e-4, 3.0, 2  # N m with rad/s


@pytest.fixture(autouse=True)
def _vocabulary() -> Iterator[None]:
    yield
    if EFFECT in EFFECTS:
        EFFECTS.remove(EFFECT)


def _driven(made: RecordingSimulation) -> np.ndarray:
    """What is measured of a robot one of whose wheels resists with the cube of its speed."""
    speed = made.run(made.robot).speed[:, WHEEL]
    torque = np.zeros((1, len(speed), 3))
    torque[0, :, WHEEL] = SIZE * np.abs(speed) ** EXPONENT * np.tanh(speed / 0.1)
    return np.asarray(next(made.respond(made.robot, torque)))


def _learnt_on(made: RecordingSimulation) -> Unmodelled:
    random, value = np.random.default_rng(2), _driven(made)
    for channel, part in zip(made.channels, rows_of(made.channels), strict=True):
        value[part] += NOISE[channel.kind] * random.standard_normal(part.stop - part.start)
    dataset, base = Dataset((as_recorded(made, value),)), _base(made.robot)
    parameters = nuisances(base, made.robot.wheel_names, 0.02)
    model = Model(base, parameters, (0.0,) * len(parameters))
    jacobian = linearise(dataset, model, ())
    run = made.run(made.robot)
    scales = scales_of(made.robot, run.speed, run.power, run.copper, duration=30.0)
    rest = Remainder.of(dataset, jacobian.value, jacobian.matrix)
    found = unmodelled_effect(rest, made.robot, scales)
    assert found is not None
    return found


def _written(found: Unmodelled, folder: Path) -> Path:
    """As tomr_gap explain writes it."""
    values = dict(read_description("reference"))
    names = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
    values.update(parameters_of("term_1", found.term, names, values))
    path = folder / "robot_explained.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    learnt = Learnt(found.learnt, found.sigma, found.share, found.is_repeatable, found.laws)
    report = {"findings": [{"effect": "unknown", "learnt": _learnt(learnt)}]}
    path.with_name("report.json").write_text(json.dumps(report), encoding="utf-8")
    return path


def _another_drive(robot: Robot) -> RecordingSimulation:
    """The same commands the other way round, and a third faster."""
    drive = _recorded(robot)
    command = 1.3 * drive.command[::-1] * [1.0, -1.0, 1.0]
    held = command[np.minimum((drive.encoder_time / 0.05).astype(int), len(command) - 1)]
    speed = held @ twist_to_wheels(robot).T
    drive = evolve(drive, command=command, velocity=speed, position=np.cumsum(speed, axis=0) * 0.01)
    return RecordingSimulation.of(drive, robot, channels_of(drive, robot))


def test_a_law_learnt_on_one_drive_is_the_hypothesis_that_another_drive_chooses(
    simulation: RecordingSimulation,  # noqa: F811
    tmp_path: Path,
) -> None:
    found = _learnt_on(simulation)
    assert found.family.family_id == "torque.speed"
    assert "power law" in [law.name for law in found.laws]
    explained, out = _written(found, tmp_path), tmp_path / "effects"
    assert main(["promote", str(explained), "--law", "power law", "--out", str(out)]) == 0
    assert load_effects(out) == [EFFECT]

    fresh = _another_drive(simulation.robot)
    tried = (EFFECT, "friction.viscous", "friction.quadratic", "friction.asymmetric")
    _, selection = searched(fresh, _driven(fresh), tried)
    best = selection.best
    assert best.model.names == {f"{EFFECT} at wheel_3_joint"}
    (hypothesis,), (offsets,) = best.model.hypotheses, best.model.offsets
    law = next(law for law in found.laws if law.name == "power law")
    for parameter, offset, true in zip(
        hypothesis.parameters, offsets, (SIZE, EXPONENT), strict=True
    ):
        value = hypothesis.start[parameter.keys[0]] + offset
        told = law.parameters[parameter.name]
        assert told.low <= value <= told.high
        assert told.low <= true <= told.high
        low, high = bounds_of(parameter.keys[0])
        assert low < value < high
