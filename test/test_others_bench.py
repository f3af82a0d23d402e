"""The comparison with other methods: the refit, the library's terms, and the score of both."""
# ruff: noqa: E402 (bench/ is no package)

import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from attrs import evolve
from rich.console import Console

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "bench"))

from concealed.claims import Truth, truth_of
from others import cli, tables
from others.compare import excluded, row_of, score_refit, score_sparse
from others.library import columns_of, series_of, shape_of
from others.refit import Fit, Refit, fitted, half_widths, parameters_of
from others.sparse import Equation, Sparse

from tomr_power_model.cli import run_main
from tomr_power_model.drive.record import Drive
from tomr_power_model.estimation.noise import rows_of
from tomr_power_model.estimation.parameter import ParameterisedRobot, per_wheel
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import read_description, robot_from_parameters
from tomr_reality_gap.alignment.channels import channels_of
from tomr_reality_gap.alignment.simulation import RecordingSimulation

WHEELS = ("wheel_1_joint", "wheel_2_joint", "wheel_3_joint")
SECONDS = 10.0
NOISE = {"power": 0.05, "total": 0.1, "voltage": 3e-3, "speed": 0.01, "yaw": 2e-3}


@pytest.fixture(scope="module")
def base() -> ParameterisedRobot:
    values = dict(read_description("reference"))
    return per_wheel(values, robot_from_parameters(values, "reference").wheel_names, "reference")


@pytest.fixture(scope="module")
def forward(base: ParameterisedRobot) -> RecordingSimulation:
    """A drive in all directions, its channels not measured yet."""
    robot = base.robot
    command_time = np.arange(0.0, SECONDS, 0.05)
    phase = command_time // 2.0
    waves = [0.5 * np.sin(1.7 * phase), 0.5 * np.cos(2.3 * phase), 0.8 * np.sin(3.1 * phase)]
    command = np.stack(waves, axis=1)
    encoder_time = np.arange(0.0, SECONDS, 0.01)
    held = command[np.minimum((encoder_time / 0.05).astype(int), len(command) - 1)]
    speed = held @ twist_to_wheels(robot).T
    power_time = np.arange(0.02, SECONDS, 0.02)
    blank = np.zeros((len(power_time), 3))
    recorded = Drive(
        name="made",
        encoder_time=encoder_time,
        position=np.cumsum(speed, axis=0) * 0.01,
        velocity=speed,
        power_time=power_time,
        power=blank,
        reading=blank,
        total_time=power_time,
        total=blank[:, 0],
        command_time=command_time,
        command=command,
        voltage=blank,
        total_voltage=blank[:, 0],
        imu_time=encoder_time,
        inertial=np.zeros((len(encoder_time), 6)),
    )
    return RecordingSimulation.of(recorded, robot, channels_of(recorded, robot))


def measuring(forward: RecordingSimulation, real: ParameterisedRobot) -> RecordingSimulation:
    """What the drive would have shown, had the robot been another one."""
    random = np.random.default_rng(0)
    value = forward.predict([real.robot])[0]
    pairs = zip(forward.channels, rows_of(forward.channels), strict=True)
    channels = [
        evolve(item, value=random.normal(value[part], NOISE[item.kind])) for item, part in pairs
    ]
    return evolve(forward, channels=tuple(channels))


def test_everything_but_settings_and_geometry_is_refitted(base: ParameterisedRobot) -> None:
    parameters = {parameter.name: parameter for parameter in parameters_of(base, WHEELS)}
    assert {"robot.mass", "robot.inertia_z", "supply.auxiliary_power"} <= set(parameters)
    assert len(parameters["motor.rotor_inertia"].keys) == 3
    for general in ("motor.resistance", "motor.torque_constant"):
        group, leaf = general.split(".")
        assert all(f"{group}.{wheel}.{leaf}" in parameters for wheel in WHEELS)
    assert {key for key in base.values if key.startswith("physics.")} <= set(parameters)
    held = ("controller.", "robot.wheel_", "robot.robot_radius", "supply.nominal")
    assert not any(name.startswith(held) for name in parameters)


def test_a_refit_finds_parameters_that_are_wrong(
    base: ParameterisedRobot, forward: RecordingSimulation
) -> None:
    names = ("robot.mass", "motor.wheel_2_joint.resistance", "motor.wheel_3_joint.resistance")
    parameters = [item for item in parameters_of(base, WHEELS) if item.name in names]
    off = {"robot.mass": 1.1, "motor.wheel_2_joint.resistance": 1.3}
    turns = [parameter.prior_std * (off.get(parameter.name, 1.0) - 1.0) for parameter in parameters]
    fits = fitted(measuring(forward, base.offset(parameters, turns)), base, parameters)
    for fit in fits:
        actual = fit.nominal * off.get(fit.key, 1.0)
        assert fit.value == pytest.approx(actual, abs=2.5 * fit.half_width)
        assert 0.0 < fit.half_width < 0.05 * fit.nominal
        assert not fit.at_bound


def test_a_refit_stops_at_twice_the_described_value(
    base: ParameterisedRobot, forward: RecordingSimulation
) -> None:
    parameters = [
        parameter for parameter in parameters_of(base, WHEELS) if parameter.name == "robot.mass"
    ]
    heavy = base.offset(parameters, [1.4 * parameters[0].prior_std])
    (fit,) = fitted(measuring(forward, heavy), base, parameters)
    assert fit.at_bound
    assert fit.value == pytest.approx(2.0 * fit.nominal, rel=1e-3)


def test_intervals_are_those_of_least_squares() -> None:
    """A mean of four: s^2 = 4/3, variance of the mean 1/3, Student's t of 3 degrees 3.1824."""
    residual = np.array([1.0, -1.0, 1.0, -1.0])
    assert half_widths(residual, np.ones((4, 1))) == pytest.approx(3.1824 / np.sqrt(3.0), rel=1e-4)
    blind = np.column_stack([np.ones(4), np.zeros(4)])
    assert np.isinf(half_widths(residual, blind)).tolist() == [False, True]


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("friction.quadratic", {"coefficient": 1e-4}),
        ("friction.asymmetric", {"torque": 0.02}),
        ("contact.roller_drag", {"coefficient": 0.01}),
        ("electrical.switching_loss", {"coefficient": 0.3}),
        ("electrical.iron_loss", {"hysteresis": 0.0, "eddy": 1e-5}),
        ("electrical.regeneration_loss", {"efficiency": 0.5}),
        ("sensor.power_lag", {"time_constant": 0.003}),
        ("body.slope", {"angle": 0.02, "azimuth": 0.5}),
        ("body.payload_mass", {"mass": 1.0}),
    ],
)
def test_an_effect_has_the_terms_that_the_library_says(
    effect: str, values: Mapping[str, float], base: ParameterisedRobot, forward: RecordingSimulation
) -> None:
    """Its own terms explain most of the power that it adds, and more with those that come along."""
    given = {f"physics.{effect}.{name}": value for name, value in values.items()}
    robots = [base.robot, base.given(given).robot]
    added = np.subtract(*forward.predict(robots)[::-1])
    series = series_of(forward, base.robot)
    own, along = shape_of(effect)
    for channel, part in zip(forward.channels, rows_of(forward.channels), strict=True):
        if channel.kind == "power":
            columns = dict(zip(series, columns_of(forward, series, channel).T, strict=True))
            assert _explained(added[part], [columns[name] for name in own | along]) > 0.5
            assert _explained(added[part], [columns[name] for name in own]) > 0.4


def _explained(target: np.ndarray[Any, Any], columns: list[np.ndarray[Any, Any]]) -> float:
    """Share of the target's energy that columns explain."""
    matrix = np.stack(columns, axis=1)
    left = target - matrix @ np.linalg.lstsq(matrix, target, rcond=None)[0]
    return float(1.0 - left @ left / (target @ target))


def truth(*effects: Mapping[str, Any]) -> Truth:
    """Coulomb 0.1 N m, half, once and one and a half percent more by wheel; 10.2 of 10 kg."""
    share = {"nrmse_before": 0.5, "nrmse_after": 0.1}
    return truth_of(
        {
            "id": "abc",
            "kind": "a",
            "null": not effects,
            "barely_excited": False,
            "effects": effects,
            "nominal": {"robot": {"mass": 10.0}, "physics": {"friction.coulomb": {"torque": 0.1}}},
            "deviations": {
                "robot.mass": 1.02,
                "physics.friction.coulomb.torque": [1.005, 1.01, 1.015],
            },
            "oracle": {"real_holdout": {"total": share}},
        }
    )


def concealed(effect: str, where: str, **values: float) -> dict[str, Any]:
    parameters = {name: {"value": value} for name, value in values.items()}
    return {"effect": effect, "where": [where], "parameters": parameters}


def refitted(mass: float, coulomb: float) -> Refit:
    """Mass with an interval of 0.1 kg and Coulomb friction of wheel 1 with one of 0.01 N m."""
    key = "physics.friction.coulomb.wheel_1_joint.torque"
    fits = (
        Fit("robot.mass", 10.0, mass, 0.1, "kg", False),
        Fit(key, 0.1, coulomb, 0.01, "N m", False),
    )
    return Refit(fits, 0.5, 0.4)


@pytest.mark.parametrize(
    ("mass", "coulomb", "off", "claims", "false"),
    [
        (10.25, 0.105, {}, 0, 0),  # both intervals hold the truth
        (10.25, 0.1205, {"coulomb": 2.0}, 1, 1),  # 0.1005 is two half-widths away
        (10.15, 0.111, {"coulomb": 1.05}, 0, 0),  # excludes, but 1 % off for sure is no claim
        (12.0, 0.105, {"mass": 18.0}, 1, 1),
    ],
)
def test_what_a_refit_claims(
    mass: float, coulomb: float, off: dict[str, float], claims: int, false: int
) -> None:
    found = refitted(mass, coulomb)
    missed = excluded(truth(), found)
    assert [x in key for x, key in zip(off, missed, strict=True)] == [True] * len(off)
    assert list(missed.values()) == pytest.approx(list(off.values()))
    verdict = score_refit(truth(), found)
    assert (verdict.claims, len(verdict.false)) == (claims, false)


def test_a_payload_is_mass_that_is_there() -> None:
    loaded = truth(concealed("body.payload_mass", "body", mass=1.8))
    assert excluded(loaded, refitted(12.0, 0.1005)) == {}
    assert score_refit(loaded, refitted(12.0, 0.1005)).false == ()


def test_what_sparse_regression_claims() -> None:
    """Viscous friction at wheel 2 brings w^2 there; Coulomb deviates, so |w| is fine anywhere."""
    found = Sparse(
        (
            Equation("wheel_1/power", 0, 0.1, {"|w|": 0.1, "w^2": 0.4}),
            Equation("wheel_2/power", 1, 0.1, {"w^2": 0.9, "dP/dt": 0.2}),
        ),
        0.2,
    )
    verdict = score_sparse(truth(concealed("friction.viscous", "wheel_2_joint")), found)
    assert verdict.false == ("w^2 at wheel_1/power", "dP/dt at wheel_2/power")
    assert (verdict.named, verdict.claims) == (1, 4)
    elsewhere = score_sparse(truth(concealed("friction.viscous", "wheel_3_joint")), found)
    assert (elsewhere.named, len(elsewhere.false)) == (0, 3)


def test_the_comparison_is_shown(tmp_path: Path) -> None:
    sparse = Sparse((Equation("wheel_1/power", 0, 0.1, {}),), 0.2)
    row = row_of(truth(), refitted(12.0, 0.1), sparse, tmp_path)
    console = Console(width=200, record=True)
    tables.show(console, [row])
    text = console.export_text()
    assert "wheel_1/power: nothing" in text
    assert "(no report)" in text
    found = tables.totals([row])
    assert found["refit"]["oracle ratio, median"] == pytest.approx(4.0)
    assert found["refit"]["false claims on nulls"] == 1
    assert found["PySINDy"]["false claims on nulls"] == 0
    tables.draw([row], tmp_path / "others.png")
    assert (tmp_path / "others.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("package", "words"),
    [(None, "pysindy is not installed: pip install -r"), (ModuleType("pysindy"), "is absent")],
)
def test_bad_input_gets_one_line(
    package: ModuleType | None,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "pysindy", package)
    monkeypatch.setenv("TOMR_RECORDINGS", str(tmp_path))
    assert run_main(cli.main, ["--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
