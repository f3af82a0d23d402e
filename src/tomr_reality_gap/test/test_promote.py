"""From a learnt term's law to an effect: its file, its test, how it joins, and is found again."""

import argparse
import json
import math
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from attrs import evolve

from tomr_power_model.effects import EFFECTS, Wheel
from tomr_power_model.effects.missions import SPEEDS, VARIED
from tomr_power_model.effects.scales import Scales
from tomr_power_model.effects.user import load_effects, load_named_effects, named_files
from tomr_power_model.errors import InputError
from tomr_power_model.robot import read_description, robot_from_parameters
from tomr_power_model.unmodelled import FAMILIES, LearntTerm
from tomr_power_model.unmodelled.described import parameters_of
from tomr_reality_gap.alignment.motion import motion_in
from tomr_reality_gap.alignment.simulation import RecordingSimulation
from tomr_reality_gap.arguments import add_inputs, inputs_of
from tomr_reality_gap.cli import main
from tomr_reality_gap.explanation import FittedLaw
from tomr_reality_gap.fit.jacobian import linearise
from tomr_reality_gap.fit.law_forms import LAWS, SMOOTH, Law
from tomr_reality_gap.fit.learnt import Table
from tomr_reality_gap.fit.remainder import Remainder
from tomr_reality_gap.fit.unmodelled import Tried, fitted
from tomr_reality_gap.hypotheses.scales import scales_of
from tomr_reality_gap.promote.learnt_law import learnt_law

from .test_alignment import simulation  # noqa: F401 -- the fixture
from .test_forward_selection import searched

WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
CUBE = {
    "size": {"value": 1e-4, "ci95": [9e-5, 1.1e-4], "unit": "N m"},
    "exponent": {"value": 3.0, "ci95": [2.9, 3.1], "unit": ""},
}


SCALES = Scales(*(1.0,) * 13)


@pytest.fixture(autouse=True)
def _vocabulary() -> Iterator[None]:
    """As it was before, whatever a test lets join."""
    before = dict(EFFECTS)
    yield
    for effect_id in list(EFFECTS):
        if effect_id not in before:
            EFFECTS.remove(effect_id)


def _explained(
    folder: Path, family: str = "torque.speed", laws: dict[str, object] | None = None
) -> Path:
    """What tomr_gap explain wrote: a description with a term, and its report."""
    values = dict(read_description("reference"))
    knots = (np.linspace(0.0, 12.0, 13),) * len(FAMILIES[family].axes)
    rows = {"torque": 3, "driver": 3, "force": 2, "supply": 1}[FAMILIES[family].acts]
    wheels = (0, 1, 2) if rows == 3 else ()
    term = LearntTerm(FAMILIES[family], wheels, knots, np.zeros((rows, 13 ** len(knots))))
    values.update(parameters_of("term_1", term, WHEELS, values))
    path = folder / "robot_explained.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    listed = [{"law": k, "parameters": v} for k, v in (laws or {"power law": CUBE}).items()]
    report = {"findings": [{"effect": "unknown", "learnt": {"family": family, "laws": listed}}]}
    path.with_name("report.json").write_text(json.dumps(report), encoding="utf-8")
    return path


def _known(**values: float) -> dict[str, object]:
    """Each known to a tenth."""
    return {
        name: {"value": value, "ci95": [value - 0.1 * abs(value), value + 0.1 * abs(value)]}
        for name, value in values.items()
    }


@pytest.mark.parametrize("law", [law for law in LAWS.values() if law.formula])
def test_the_formula_of_a_law_is_the_law(law: Law) -> None:
    at = np.linspace(0.0, 8.0, 33)
    values = {"size": 0.3, "exponent": 1.7, "threshold": 3.1, "decay": 1.3, "order": 2.0,
              "phase": 0.4, "width": 0.7, "place": 2.0}  # fmt: skip
    p = [values[name] for name in law.units]
    expected = law.value(np.array(p), at[:, None])
    names = {**values, "math": math, "WIDTH": SMOOTH * 0.25}
    found = [eval(law.formula, {**names, "x": x}) for x in at]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(
    ("family", "law", "known", "stem"),
    [
        ("torque.speed", "power law", CUBE, "power_law_by_speed"),
        ("torque.speed", "step", _known(size=-0.1, threshold=4.0), "step_by_speed"),
        ("torque.speed", "exponential", _known(size=0.1, decay=2.0), "exponential_by_speed"),
        ("driver.current", "square beyond a threshold", _known(size=0.2, threshold=3.0),
         "square_beyond_a_threshold_by_current"),
        ("torque.tight_angle", "bump", _known(size=0.05, width=2.0, place=1.0),
         "bump_by_tight_angle"),
        ("torque.angle", "periodic", _known(size=0.05, order=3.0, phase=-0.5),
         "periodic_by_angle"),
    ],
)  # fmt: skip
def test_a_promoted_law_is_an_effect_that_passes_its_own_test(
    tmp_path: Path, family: str, law: str, known: dict[str, object], stem: str
) -> None:
    out = tmp_path / "effects"
    explained = _explained(tmp_path, family, {law: known})
    assert main(["promote", str(explained), "--law", law, "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == [f"{stem}.py", f"test_{stem}.py"]
    own = runpy.run_path(str(out / f"test_{stem}.py"))
    (mark,) = own["test_the_law_is_as_it_was_learnt"].pytestmark
    for x, expected in mark.args[1]:
        own["test_the_law_is_as_it_was_learnt"](x, expected)
        assert expected != 0.0 or law == "square beyond a threshold"
    own["test_what_was_learnt_is_within_the_ranges"]()
    made = EFFECTS[f"learnt.{stem}"]
    assert made.__doc__ is not None
    assert "with 95 % intervals" in made.__doc__
    assert made.prior is not None
    size = made.parameters["size"]
    assert made.prior.sign == (1 if size.start > 0.0 else -1)
    assert (size.minimum < 0.0, size.maximum > 0.0) == (size.start < 0.0, size.start > 0.0)
    assert made.prior.sizes["size"](SCALES) == pytest.approx(abs(size.start))
    shape = {name: item.start for name, item in made.parameters.items() if name != "size"}
    assert [dict(tried) for tried in made.prior.shapes(SCALES)] == [shape]
    # What a driver loses is in its power alone, and shows where motors work.
    assert made.in_currents is (family != "driver.current")
    assert made.mission == (SPEEDS if made.in_currents else VARIED)
    if "phase" in shape:
        assert (made.parameters["phase"].minimum, made.parameters["phase"].maximum) == (-1e2, 1e2)
        unknown = Wheel(1.0, 50.0, 0.0, math.nan, 0.05, 20.0)
        assert made.moving_torque(0.05, 3.0, 0.5, unknown) == pytest.approx(0.05 * math.sin(0.5))


def test_ranges_stay_within_what_an_effect_can_be(tmp_path: Path) -> None:
    """Intervals from below nothing to far above the rest, and one of no width."""
    wide = {"size": {"value": 1e-4, "ci95": [1e-4, 1e-4]},
            "exponent": {"value": 3.0, "ci95": [-1.0, 7.0]}}  # fmt: skip
    explained = _explained(tmp_path, "torque.speed", {"power law": wide})
    assert main(["promote", str(explained), "--out", str(tmp_path / "e")]) == 0
    load_effects(tmp_path / "e")
    size, exponent = EFFECTS["learnt.power_law_by_speed"].parameters.values()
    assert (exponent.minimum, exponent.maximum) == pytest.approx((0.3, 6.0))
    assert size.prior_std == pytest.approx(2e-6)  # nothing is known better than by 2 %
    slow = Wheel(0.05, 50.0, 0.0, 0.0, 0.05, 20.0)
    torque = EFFECTS["learnt.power_law_by_speed"].moving_torque(0.1, 1.0, slow)
    assert torque == pytest.approx(0.1 * 0.05 * math.tanh(0.5))


def test_of_several_terms_the_named_one_is_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    explained = _explained(tmp_path)
    values = dict(read_description(explained))
    knots = (np.linspace(0.0, 3.0, 7),)
    term = LearntTerm(FAMILIES["driver.current"], (0,), knots, np.zeros((1, 7)))
    values.update(parameters_of("term_2", term, WHEELS, values))
    explained.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    report = json.loads(explained.with_name("report.json").read_text(encoding="utf-8"))
    law = {"law": "power law", "parameters": _known(size=0.5, exponent=2.0)}
    report["findings"].append({"learnt": {"family": "driver.current", "laws": [law]}})
    explained.with_name("report.json").write_text(json.dumps(report), encoding="utf-8")
    assert main(["promote", str(explained), "--out", str(tmp_path / "e")]) == 2
    assert "several learnt terms: give --term" in capsys.readouterr().err
    found = learnt_law(explained, "term_2")
    assert (found.family, found.parameters["size"].unit) == (FAMILIES["driver.current"], "W")
    assert (found.parameters["size"].value, found.spacing) == (0.5, 0.5)
    assert learnt_law(explained, "term_1").family is FAMILIES["torque.speed"]


def test_units_ranges_and_priors_are_those_of_the_intervals(tmp_path: Path) -> None:
    assert main(["promote", str(_explained(tmp_path)), "--out", str(tmp_path / "e")]) == 0
    assert load_effects(tmp_path / "e") == ["learnt.power_law_by_speed"]
    made = EFFECTS["learnt.power_law_by_speed"]
    size, exponent = made.parameters["size"], made.parameters["exponent"]
    assert (size.unit, size.minimum, size.neutral) == ("N m", 0.0, 0.0)
    assert (size.maximum, size.prior_std, size.start) == pytest.approx((2e-4, 1e-5, 1e-4))
    assert (exponent.minimum, exponent.maximum) == pytest.approx((2.0, 4.0))
    assert made.prior is not None
    assert made.prior.sign == 1
    wheel = Wheel(5.0, 50.0, 0.0, 0.0, 0.05, 20.0)
    assert made.moving_torque(1e-4, 3.0, wheel) == pytest.approx(0.0125)
    assert made.moving_torque(1e-4, 3.0, wheel._replace(speed=-5.0)) == pytest.approx(-0.0125)
    key = "physics.learnt.power_law_by_speed"
    values = {**read_description("reference"), f"{key}.size": 1e-4, f"{key}.exponent": 3.0}
    assert robot_from_parameters(values, "made").effect("learnt.power_law_by_speed", 1)
    with pytest.raises(InputError, match=r"size = 0\.001 .*at most 0\.0002"):
        robot_from_parameters({**values, f"{key}.size": 1e-3}, "made")


@pytest.mark.parametrize(
    ("family", "laws", "more", "message"),
    [
        ("force.place", {"spring": _known(stiffness=4.0, slack=0.5, x=0.1, y=0.1)}, (),
         "no effect acts on that"),
        ("torque.speed", {"power law": CUBE}, ("--term", "term_2"), "has no learnt term 'term_2'"),
        ("torque.speed", {"power law": CUBE}, ("--law", "step"), "no law 'step'.* power law"),
        ("torque.speed", {"moon": CUBE}, (), "it has none"),
        ("torque.speed", {"power law": {**CUBE, "size": {"value": 1.0, "ci95": [None, None]}}}, (),
         "no value with an interval"),
        ("torque.speed", {"power law": {**CUBE, "size": {"value": math.inf, "ci95": [0, 1]}}}, (),
         "not finite"),
        ("torque.speed", {"step": _known(size=0.1, threshold=-1.0)}, (), "its threshold is -1"),
    ],
)  # fmt: skip
def test_what_cannot_be_promoted_is_refused_with_one_line(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    family: str,
    laws: dict[str, object],
    more: tuple[str, ...],
    message: str,
) -> None:
    explained = _explained(tmp_path, family, laws)
    assert main(["promote", str(explained), *more, "--out", str(tmp_path / "effects")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert re.search(message, said)
    assert not (tmp_path / "effects").exists()


def test_laws_are_those_of_the_terms_own_family(tmp_path: Path) -> None:
    explained = _explained(tmp_path)
    report = json.loads(explained.with_name("report.json").read_text(encoding="utf-8"))
    laws = [{"law": "power law", "parameters": _known(size=9.0, exponent=0.5)}]
    other = {"effect": "unknown", "learnt": {"family": "driver.current", "laws": laws}}
    both = {"findings": [other, *report["findings"], other, {"effect": "friction.coulomb"}]}
    explained.with_name("report.json").write_text(json.dumps(both), encoding="utf-8")
    found = learnt_law(explained).parameters
    assert {name: item.value for name, item in found.items()} == {"size": 1e-4, "exponent": 3.0}


def test_a_description_without_a_report_or_a_term_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    explained = _explained(tmp_path)
    explained.with_name("report.json").write_text("[1, 2]", encoding="utf-8")
    assert main(["promote", str(explained), "--out", str(tmp_path / "e")]) == 2
    explained.with_name("report.json").unlink()
    assert main(["promote", str(explained), "--out", str(tmp_path / "e")]) == 2
    plain = tmp_path / "plain.yaml"
    values = read_description("reference")
    plain.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), encoding="utf-8")
    assert main(["promote", str(plain), "--out", str(tmp_path / "e")]) == 2
    first, second, third = capsys.readouterr().err.splitlines()
    assert "is no report of tomr_gap explain" in first
    assert "cannot be read" in second
    assert "has no learnt term" in third


OWN = '''
from types import MappingProxyType
from tomr_power_model.effects import Effect, EffectParameter, effect

@effect
class Own(Effect):
    """Nothing much."""

    effect_id = "{effect_id}"
    label = "Nothing much"
    parameters = MappingProxyType({{name: EffectParameter("W") for name in {names!r}}})

    @staticmethod
    def driver_power(*given: float) -> float:
        return 0.0
'''


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (OWN.format(effect_id="friction.coulomb", names=["a"]), "is there already"),
        (OWN.format(effect_id="own.x", names=["a", "b", "c", "d"]), "one to 3 parameters"),
        (OWN.format(effect_id="own.x", names=[]), "one to 3 parameters"),
        ("this is no Python", "cannot be used"),
        ("import nothing_of_that_name", "cannot be used"),
        ("x = 1", "no file registers an effect"),
    ],
)
def test_files_that_are_no_effects_are_refused(tmp_path: Path, text: str, message: str) -> None:
    before = dict(EFFECTS)
    (tmp_path / "own.py").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_effects(tmp_path)
    assert dict(EFFECTS) == before


def test_an_effect_that_only_configures_may_have_more_parameters(tmp_path: Path) -> None:
    text = OWN.format(effect_id="own.x", names=["a", "b", "c", "d"])
    (tmp_path / "own.py").write_text(text.replace("driver_power", "configure"), encoding="utf-8")
    assert load_effects(tmp_path) == ["own.x"]


def test_the_vocabulary_of_a_process_has_the_effects_of_the_folder_named_for_all(
    tmp_path: Path,
) -> None:
    (tmp_path / "own.py").write_text(OWN.format(effect_id="own.x", names=["a"]), encoding="utf-8")
    asked = "from tomr_power_model.effects import EFFECTS; print('own.x' in EFFECTS)"
    for named, expected in (({"TOMR_EFFECTS": str(tmp_path)}, "True\n"), ({}, "False\n")):
        environment = {k: v for k, v in os.environ.items() if k != "TOMR_EFFECTS"} | named
        command = [sys.executable, "-c", asked]
        assert subprocess.check_output(command, env=environment, text=True) == expected


def test_effects_of_a_user_join_only_where_their_folder_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.py").write_text(OWN.format(effect_id="own.x", names=["a"]), encoding="utf-8")
    (tmp_path / "test_own.py").write_text("raise RuntimeError", encoding="utf-8")
    monkeypatch.delenv("TOMR_EFFECTS", raising=False)
    load_named_effects()
    assert "own.x" not in EFFECTS
    monkeypatch.setenv("TOMR_EFFECTS", str(tmp_path))
    load_named_effects()
    assert "own.x" in EFFECTS
    assert named_files() == [tmp_path / "own.py"]
    assert load_effects(tmp_path) == ["own.x"]  # the same file again is no clash
    with pytest.raises(InputError, match="holds no effects"):
        load_effects(tmp_path / "nowhere")


def test_an_option_names_the_folder(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN.format(effect_id="own.x", names=["a"]), encoding="utf-8")
    parser = argparse.ArgumentParser()
    add_inputs(parser)
    given = ["--robot", "reference", "--real", str(tmp_path)]
    inputs_of(parser.parse_args(given))
    assert "own.x" not in EFFECTS
    inputs_of(parser.parse_args([*given, "--effects", str(tmp_path)]))
    assert "own.x" in EFFECTS


def _learnt(made: RecordingSimulation, value: np.ndarray) -> FittedLaw:
    """The first law of what depends on speed, from a drive with the description beside it."""
    dataset, found = searched(made, value, ())
    jacobian = linearise(dataset, found.best.model, ())
    rest = Remainder.of(dataset, jacobian.value, np.asarray(jacobian.matrix))
    motions, run = [motion_in(made, made.robot)], made.run(made.robot)
    scales = scales_of(made.robot, run.speed, run.power, run.copper, duration=30.0)
    table = Table.over(FAMILIES["torque.speed"], motions, scales)
    assert table is not None
    return fitted(rest, Tried(table, 1.0), made.robot, motions).laws[0]


def test_a_promoted_law_is_found_on_another_drive_within_what_is_known_of_both(
    tmp_path: Path,
    simulation: RecordingSimulation,  # noqa: F811
) -> None:
    """3e-4 N m at 1 rad/s that grows with the cube of the speed, up to 10 rad/s."""
    true, effect_id = {"size": 3e-4, "exponent": 3.0}, "learnt.power_law_by_speed"

    def promoted(known: dict[str, object]) -> None:
        explained = _explained(tmp_path, "torque.speed", {"power law": known})
        assert main(["promote", str(explained), "--out", str(tmp_path / "e")]) == 0
        load_effects(tmp_path / "e")

    promoted(_known(**true))
    robot = simulation.robot
    theirs = evolve(robot, physics={**robot.physics, effect_id: (true,) * 3})
    law = _learnt(simulation, simulation.predict([theirs])[0])
    learnt = law.parameters
    assert law.name == "power law"
    promoted({k: {"value": v.value, "ci95": [v.low, v.high]} for k, v in learnt.items()})
    turned = evolve(simulation.recorded, command=-simulation.recorded.command[:, [1, 0, 2]])
    another = evolve(simulation, recorded=turned)
    _, found = searched(another, another.predict([theirs])[0], ("learnt",))
    (named,), (offsets,) = found.best.model.hypotheses, found.best.model.offsets
    assert (named.effect, named.where) == (effect_id, ("all_wheels",))
    fresh = {"size": offsets[0], "exponent": learnt["exponent"].value + offsets[1]}
    for name, value in true.items():
        half = 0.5 * (learnt[name].high - learnt[name].low)
        assert abs(learnt[name].value - value) < half < 0.4 * value
        assert abs(learnt[name].value - fresh[name]) < half
        assert fresh[name] == pytest.approx(value, rel=0.05)
