"""Wang 2024: coefficients from a healthy drive, and the choice of the model by parameter."""

import math
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve, fields
from hypothesis import given, settings
from hypothesis import strategies as st

from tomr_power_model.calibration.wang2024_samples import read_samples
from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.errors import InputError
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.power_models import POWER_MODELS, own_parameters
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.model.settings import MODEL_PARAMETERS, ModelSettings
from tomr_power_model.robot import shipped_robot
from tomr_power_model.robot.parameters import check_all
from tomr_power_model.wang2024 import Coefficients, Wang2024Model
from tomr_power_model.wang2024.fit import Samples, fit_wang2024
from tomr_power_model.wang2024.state import Chassis, state_of

BAG = Path(__file__).parents[3] / "bags" / "square"
ROBOT = shipped_robot("reference")
# Of terms of one shape only one is at work: the data cannot distinguish the others from it.
FITTED = Coefficients.of_robot(ROBOT).having(
    dv_max_ours=3.0,
    P_stanby=(1.0, 1.2, 1.4),
    k_1h=5e-3,
    k_2h=1e-2,
    k_T=0.01,
    lambda_h=0.1,
    mu_i=(2e-3,) * 3,
    mu_R=1e-3,
    mu_S=2e-3,
    eps_1=0.02,
    eps_2=0.1,
    eps_3=5e-3,
    eps_4=0.05,
    k_1m=4e-3,
    k_2m=1e-3,
    c_2_ours=1e-3,
    P_sensor=5.5,
    P_stanby_c=5.5,
    rho_1=0.2,
    p_fs=0.5,
    P_fs=0.4,
)


def _motion(twist: np.ndarray, rate: np.ndarray) -> WheelMotion:
    """Motion of the wheels for body twists and their rates, (n, 3)."""
    matrix = twist_to_wheels(ROBOT)
    return WheelMotion(twist @ matrix.T, rate @ matrix.T)


def _random_drive(rows: int = 1500, noise: float = 0.0) -> tuple[Coefficients, Samples]:
    """Random motion and the power that known coefficients give it."""
    random = np.random.default_rng(3)
    twist = random.uniform(-1.0, 1.0, (rows, 3)) * [0.5, 0.5, 0.8]
    rate = random.uniform(-1.0, 1.0, (rows, 3)) * [2.0, 2.0, 3.0]
    rate[: rows // 3] = 0.0
    twist[-rows // 10 :] = rate[-rows // 10 :] = 0.0
    motion = _motion(twist, rate)
    fastest = float(np.abs(state_of(Chassis.of(ROBOT), motion).dv).max())
    truth = FITTED.having(dv_max_ours=fastest)
    drives = Wang2024Model.of(ROBOT, truth).power(motion)
    assert drives.other is not None
    power = drives.power + random.normal(0.0, noise, drives.power.shape)
    return truth, Samples(motion, power, power.sum(axis=1) + drives.other)


class TestFit:
    """From samples back to coefficients."""

    def test_known_coefficients_come_back(self) -> None:
        truth, samples = _random_drive()
        found = fit_wang2024(ROBOT, samples)
        # The data determine only the sums of these pairs: compare what the pair amounts to.
        assert found.R_T * 400.0 + found.eps_2 == pytest.approx(truth.eps_2, rel=1e-3)
        ours = np.array(found.mu_i) + found.c_1_ours
        np.testing.assert_allclose(ours, truth.mu_i, rtol=1e-3)
        stable = found.P_fs + found.rho_2 * 600.0**0.1
        assert stable == pytest.approx(truth.P_fs, rel=1e-3)
        paired = {"R_T", "eps_2", "mu_i", "c_1_ours", "P_fs", "rho_2"}
        for key in fields(Coefficients):
            if key.name not in paired:
                wanted = pytest.approx(getattr(truth, key.name), rel=2e-3, abs=1e-9)
                assert getattr(found, key.name) == wanted, key.name

    def test_noise_does_not_make_coefficients_negative(self) -> None:
        truth, samples = _random_drive(noise=0.3)
        found = fit_wang2024(ROBOT, samples)
        values = [np.min(getattr(found, key.name)) for key in fields(Coefficients)]
        assert min(values) >= 0.0
        clean = _random_drive()[1]
        modelled = Wang2024Model.of(ROBOT, found).power(clean.motion).power
        assert accuracy(clean.power, modelled) > 0.97
        assert found.P_stanby == pytest.approx(truth.P_stanby, abs=0.1)

    def test_what_eq_5_leaves_out_can_be_fitted(self) -> None:
        truth, samples = _random_drive()
        heavier = truth.having(M_rot_ours=2.0)
        power = Wang2024Model.of(ROBOT, heavier).power(samples.motion).power
        found = fit_wang2024(ROBOT, Samples(samples.motion, power), turning=True)
        assert found.M_rot_ours == pytest.approx(2.0, rel=1e-3)
        assert found.P_sensor == ROBOT.supply.auxiliary_power  # no total was measured

    def test_rows_with_a_gap_are_left_out(self) -> None:
        _, samples = _random_drive()
        power = samples.power.copy()
        power[::7, 1] = math.nan
        found = fit_wang2024(ROBOT, Samples(samples.motion, power, samples.total))
        assert found.P_stanby == pytest.approx((1.0, 1.2, 1.4), rel=1e-2)

    def test_too_little_motion_is_refused(self) -> None:
        still = Samples(WheelMotion(np.zeros((500, 3)), np.zeros((500, 3))), np.ones((500, 3)))
        with pytest.raises(InputError, match="wheel_1_joint turns in only 0 samples"):
            fit_wang2024(ROBOT, still)

    def test_a_recording_can_be_fitted(self) -> None:
        if not BAG.exists():
            pytest.fail(f"{BAG} is missing: make bags")
        samples = read_samples(BAG, ROBOT)
        other = evolve(ROBOT, measurement=evolve(ROBOT.measurement, source="total_only"))
        with pytest.raises(InputError, match="needs the power of each motor"):
            read_samples(BAG, other)
        found = fit_wang2024(ROBOT, samples)
        assert found.P_stanby == pytest.approx((1.2, 1.2, 1.2), abs=0.05)
        assert found.P_sensor + found.P_stanby_c == pytest.approx(12.0, abs=0.1)
        drives = Wang2024Model.of(ROBOT, found).power(samples.motion)
        assert accuracy(samples.power.sum(axis=1), drives.power.sum(axis=1)) > 0.93
        assert nrmse(samples.power.sum(axis=1), drives.power.sum(axis=1)) < 0.25


class TestChoice:
    """By parameter, in nodes and tools alike."""

    def _settings(self, **given: object) -> ModelSettings:
        return ModelSettings.of(check_all(MODEL_PARAMETERS, given, "test"))

    def _values(self, c: Coefficients) -> dict[str, object]:
        names = (key.name for key in fields(Coefficients))
        return {f"wang2024.{name}": getattr(c, name) for name in names}

    def test_both_models_are_there_and_the_physical_is_the_default(self) -> None:
        assert set(POWER_MODELS) == {"physical", "wang2024"}
        assert self._settings().power_model == "physical"
        assert len(own_parameters()) == len(fields(Coefficients)) + 1

    def test_the_predictor_uses_the_model_that_is_chosen(self) -> None:
        settings = self._settings(power_model="wang2024", **self._values(FITTED))
        predictor = PowerPredictor(ROBOT, settings)
        for at_ms in range(3, 2000, 10):
            predictor.command(10**18 + (at_ms // 50) * 50 * 10**6 + 1, (0.4, 0.0, 0.0))
            predictor.encoders(10**18 + at_ms * 10**6, (0.0, 0.0, 0.0), (math.nan,) * 3)
        last = predictor.due()[-1]
        steady = _motion(np.array([[0.4, 0.0, 0.0]]), np.zeros((1, 3)))
        drives = Wang2024Model.of(ROBOT, FITTED).power(steady)
        powers = [reading.power for reading in last.motors]
        np.testing.assert_allclose(powers, drives.power[0], rtol=2e-2)
        # Steady: standby, sensors and the third case of Eq. 11.
        other = 5.5 + 5.5 + 0.4
        assert last.total.power - sum(powers) == pytest.approx(other, rel=1e-4)
        still = [reading.power for reading in last.from_encoders]
        assert still == pytest.approx([1.0, 1.2, 1.4])

    def test_in_ticks_between_the_drivers_periods_it_says_what_it_said_last(self) -> None:
        slow = evolve(ROBOT, controller=evolve(ROBOT.controller, rate=50.0))
        given = self._values(FITTED) | {"power_model": "wang2024", "decision_rate": 100.0}
        predictor, found = PowerPredictor(slow, self._settings(**given)), []
        for at_ms in range(3, 2000, 10):
            predictor.command(10**18 + (at_ms // 50) * 50 * 10**6 + 1, (0.4, 0.0, 0.0))
            predictor.encoders(10**18 + at_ms * 10**6, (0.0, 0.0, 0.0), (math.nan,) * 3)
            found += [item.motors[1].power for item in predictor.due()]
        assert len(found) > 180
        np.testing.assert_allclose(found[100:], found[-1], rtol=2e-2)

    def test_coefficients_go_into_a_file_and_back(self, tmp_path: Path) -> None:
        file = tmp_path / "fitted.yaml"
        FITTED.save(file)
        back = Coefficients.load(file)
        for key in fields(Coefficients):
            expected = pytest.approx(getattr(FITTED, key.name), rel=1e-5)
            assert getattr(back, key.name) == expected, key.name
        settings = self._settings(**{"power_model": "wang2024", "wang2024.coefficients": str(file)})
        assert settings.power_model == "wang2024"
        assert Coefficients.of(settings.model_values) == back

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ("wang2024: {k_1h: -1.0}", "wang2024.k_1h = -1: out of range"),
            ("wang2024: {T: 1.0e+308}", "wang2024.T = 1e.308 deg C: out of range"),
            ("wang2024: {k_9: 1.0}", "wang2024.k_9 is unknown"),
            ("wang2024: {mu_i: [0.1]}", "needs 3 values"),
            ("other: {a: 1}", "no group wang2024"),
        ],
    )
    def test_a_bad_file_is_refused(self, tmp_path: Path, change: str, words: str) -> None:
        file = tmp_path / "bad.yaml"
        file.write_text(f"power_model: {{ros__parameters: {{{change}}}}}")
        with pytest.raises(InputError, match=words):
            Coefficients.load(file)

    @pytest.mark.parametrize(
        ("coefficients", "words"),
        [
            (Coefficients(), "wang2024 has no coefficients"),
            (FITTED.having(L=0.0), "wang2024.L = 0: give more than 0"),
            (FITTED.having(t=0.0), "wang2024.t = 0: give more than 0"),
            (FITTED.having(L_R=0.125), "L_R = 0.125 m was fitted for another robot"),
            (FITTED.having(M=40.0), "M = 40 kg was fitted for another robot"),
        ],
    )
    def test_coefficients_of_another_robot_are_refused(
        self, coefficients: Coefficients, words: str
    ) -> None:
        settings = self._settings(power_model="wang2024", **self._values(coefficients))
        with pytest.raises(InputError, match=words):
            PowerPredictor(ROBOT, settings)


@settings(max_examples=30)
@given(st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=20))
def test_scores(powers: list[float]) -> None:
    measured = np.array([*powers, 3.0, math.nan])
    assert accuracy(measured, measured) == 1.0
    assert accuracy(measured, 0.0 * measured) == pytest.approx(0.0)
    assert nrmse(measured, np.full_like(measured, np.nanmean(measured))) == pytest.approx(1.0)
