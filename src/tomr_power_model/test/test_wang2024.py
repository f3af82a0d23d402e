"""Wang 2024, Eqs 1-17: numbers worked by hand, symmetries, energies."""

import math

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given
from hypothesis import strategies as st

from tomr_power_model.dynamics.drives import WheelMotion
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.robot import GRAVITY, Robot, shipped_robot
from tomr_power_model.wang2024 import Coefficients, Wang2024Model
from tomr_power_model.wang2024 import angles as a
from tomr_power_model.wang2024 import terms as t
from tomr_power_model.wang2024.state import Chassis, State, state_of

DEGREE = math.pi / 180.0
SPEEDS = st.floats(-1.0, 1.0)
CENTERED = a.MassCenter(0.0, 0.0)
ROBOT = shipped_robot("reference")
GIVEN = Coefficients.of_robot(ROBOT)
# Every term at work, all wheels alike.
FITTED = GIVEN.having(
    dv_max_ours=3.0,
    P_stanby=(1.2, 1.2, 1.2),
    k_1h=5e-3,
    k_2h=1e-2,
    k_T=0.01,
    lambda_h=0.1,
    R_T=1e-4,
    mu_i=(2e-3,) * 3,
    mu_R=1e-3,
    mu_S=2e-3,
    eps_1=0.02,
    eps_2=0.1,
    eps_3=5e-3,
    eps_4=0.05,
    k_1m=4e-3,
    k_2m=1e-3,
    c_1_ours=1e-3,
    c_2_ours=1e-3,
    P_sensor=5.0,
    P_stanby_c=6.0,
    rho_1=0.2,
    rho_2=0.3,
    p_fs=0.5,
    P_fs=0.4,
)


def _state(**changes: object) -> State:
    """One instant with handy roots: v = 0.6^6 m/s, sum v_i = 0.9^6 m/s; M g = 98.0665 N."""
    values: dict[str, object] = {
        "M": 10.0,
        "N_i": np.array([30.0, 30.0, 38.0665]),
        "center": CENTERED,
        "v": np.array([0.046656]),
        "dv": np.array([-0.5]),
        "v_i": np.array([[0.3, 0.2, 0.031441]]),
        "dv_i": np.array([[0.4, -0.1, 0.1]]),
        "v_i_prime": np.array([[0.1, 0.2, 0.3]]),
        "omega": np.array([[6.0, 4.0, 0.62882]]),
        "alpha": np.array([30.0 * DEGREE]),
        "F_wheel": np.array([[1.0, 2.0, 3.0]]),
        "P_accelerating": np.array([[0.5, -0.2, 0.1]]),
    }
    return State(**{**values, **changes})  # type: ignore[arg-type]


def _motion(
    velocity: np.ndarray, acceleration: np.ndarray | None = None, robot: Robot = ROBOT
) -> WheelMotion:
    """Motion of the wheels for body twists and their rates, (n, 3) or (3,)."""
    matrix = twist_to_wheels(robot)
    twist = np.atleast_2d(velocity)
    rate = np.zeros_like(twist) if acceleration is None else np.atleast_2d(acceleration)
    return WheelMotion(twist @ matrix.T, rate @ matrix.T)


class TestEquations:
    """One equation each; the sum over the wheels is what the paper prints."""

    def test_5_kinetic_energy(self) -> None:
        assert t.E_k(15.0, np.array([0.4]))[0] == pytest.approx(1.2)
        # 15 kg at 0.4 m/s, 2 m/s^2 along the motion: M v dv/dt = 12 W, whatever it yaws.
        motion = _motion(np.array([0.24, 0.32, 0.7]), np.array([1.2, 1.6, 0.0]))
        s = state_of(Chassis.of(ROBOT), motion)
        assert s.dv[0] == pytest.approx(2.0)
        assert t.P_k(s, GIVEN).sum() == pytest.approx(12.0)
        assert t.P_k(s, GIVEN.having(M_rot_ours=3.0)).sum() == pytest.approx(12.0 * 1.2)

    @pytest.mark.parametrize(
        ("coefficients", "power"),
        [
            ({"k_1h": 0.01}, 0.01 * 98.0665 * 0.531441),
            ({"k_T": 0.05}, 0.05 * 6.0),
            ({"lambda_h": 0.12}, 0.12 / 0.6),
            ({"R_T": 1e-3}, 1e-3 * 20.0**2 * 0.216),
            ({"k_2h": 0.02}, 0.02 * 98.0665 * (0.09 + 0.04 + 0.031441**2)),
        ],
    )
    def test_6_heat(self, coefficients: dict[str, float], power: float) -> None:
        assert t.P_h(_state(), GIVEN.having(**coefficients)).sum() == pytest.approx(power)

    def test_7_friction(self) -> None:
        s = _state()
        # mu' = 0.046188, and mu = 0.02 / 3 * 2 + ... enters by its climbing angle, given here.
        c = GIVEN.having(mu_R=0.01, mu_S=0.02)
        mu = 0.01 * (0.2 / 0.3) + 0.02 * (0.4 * 0.5 / 0.4464102)
        whole = (mu * math.sin(0.5) + 0.0461880) * 98.0665 * 0.046656
        mu_2 = 0.02 * 0.3464102 / 0.5464102
        rollers = mu_2 * (30.0 * 0.1 + 30.0 * 0.2 + 38.0665 * 0.3)
        found = t.P_f(s, c, np.array([0.5])).sum()
        assert found == pytest.approx(whole + rollers, rel=1e-6)
        by_wheel = t.P_f(s, GIVEN.having(mu_i=(0.1, 0.2, 0.0)))[0]
        np.testing.assert_allclose(by_wheel, [0.1 * 30 * 0.3 / 2, 0.2 * 30 * 0.2 / 2, 0.0])
        # mu_1 (Eq. 14) needs a displaced mass centre: 1.254700 * 0.01 at psi = 30 degrees.
        moved = _state(center=a.MassCenter(0.03, 30.0 * DEGREE), alpha=np.zeros(1))
        rolling = 0.01254700 * (30.0 * 0.3 + 30.0 * 0.2 + 38.0665 * 0.031441)
        assert t.P_f(moved, GIVEN.having(mu_R=0.01)).sum() == pytest.approx(rolling, rel=1e-6)

    @pytest.mark.parametrize(
        ("coefficients", "power"),
        [
            ({"eps_1": 2.0, "dv_max_ours": 1.0}, 2.0 / 64.0),
            ({"eps_1": 2.0, "dv_max_ours": 0.1}, 2.0e-6),
            ({"eps_4": 0.3}, 0.3 * 0.9),
            ({"eps_3": 0.3}, 0.3 * 0.16),
            ({"eps_2": 0.3}, 0.3 * 0.216),
        ],
    )
    def test_8_iron(self, coefficients: dict[str, float], power: float) -> None:
        assert t.P_i(_state(), GIVEN.having(**coefficients)).sum() == pytest.approx(power)

    @pytest.mark.parametrize(
        ("coefficients", "power"),
        [
            ({"c_1_ours": 0.1}, 0.1 * 0.5 * (9.0 + 6.0 + 38.0665 * 0.031441)),
            ({"k_1m": 0.01}, 0.01 * 14.0),
            ({"c_2_ours": 0.1}, 0.1 * 98.0665 * 0.046656 * 0.5),
            ({"k_2m": 0.01}, 0.01 * (6.0 + 8.0 + 3 * 0.62882)),
        ],
    )
    def test_9_mechanics(self, coefficients: dict[str, float], power: float) -> None:
        assert t.P_m(_state(), GIVEN.having(**coefficients)).sum() == pytest.approx(power)

    def test_10_and_11_sensors_and_control(self) -> None:
        c = GIVEN.having(P_sensor=5.0, P_stanby_c=6.0, rho_1=0.2, rho_2=0.1, p_fs=0.5, P_fs=0.4)
        moving, still = _state(), _state(v=np.zeros(1), v_i=np.zeros((1, 3)))
        steady = _state(dv=np.zeros(1), dv_i=np.zeros((1, 3)))
        assert t.P_sensor(moving, c)[0] == 5.0
        assert t.P_control(still, c)[0] == 6.0
        speed = 0.046656
        spec = 0.2 * (0.6 + 0.5 + speed) + 6.0 + 0.5 * speed / (24.0 / 0.7 * 0.05)
        assert t.P_control(moving, c)[0] == pytest.approx(spec)
        assert t.P_control(steady, c)[0] == pytest.approx(0.4 + 0.1 * 1.896 + 6.0, rel=1e-4)

    def test_12_and_13_direction(self) -> None:
        c = GIVEN.having(mu_R=0.01, mu_S=0.02)
        # 2 sqrt(3) 0.01 + 0.02 / sqrt(3) at 30 degrees; sin 30 = 1/2 of it at 10 degrees.
        found = a.mu_prime(c, np.array([30.0, 10.0, 0.0]) * DEGREE)
        np.testing.assert_allclose(found, [0.0461880, 0.0230940, 0.0], rtol=1e-6)
        found = a.beta(1.0, np.array([30.0, 0.0]) * DEGREE)
        np.testing.assert_allclose(found, [math.pi / 4 * math.sin(1.0), 0.0], atol=1e-12)
        headings = np.array([0.0, 20.0, 30.0, 50.0, 60.0, -70.0, 180.0]) * DEGREE
        expected = np.array([0.0, 20.0, 30.0, 10.0, 0.0, 10.0, 0.0]) * DEGREE
        np.testing.assert_allclose(a.alpha(headings), expected, atol=1e-9)

    def test_14_to_16_mass_center(self) -> None:
        c = GIVEN.having(mu_R=0.01, mu_S=0.02)
        center = a.MassCenter(0.03, 30.0 * DEGREE)
        assert a.mu_1(c, center) == pytest.approx(0.01 * 0.3764102 / 0.3, rel=1e-6)
        assert a.mu_2(c, center) == pytest.approx(0.0, abs=1e-12)
        assert a.mu_1(c, a.MassCenter(0.03, 0.0)) == 0.0
        assert a.mu_2(c, a.MassCenter(0.03, math.pi)) == pytest.approx(0.02 * 0.3764102 / 0.5464102)
        expected = 0.01 * 0.23 / 0.3 + 0.02 * 0.4 * (0.5 - 0.0225) / 0.4464102
        assert a.mu(c, center) == pytest.approx(expected, rel=1e-6)

    def test_17_loads(self) -> None:
        # 3 cm towards wheel 1: 49.03325 N times 1.3, 0.85, 0.85.
        found = a.N_i(15.0, 0.2, a.MassCenter(0.03, 0.0))
        np.testing.assert_allclose(found, [63.743225, 41.6782625, 41.6782625])

    @given(x=st.floats(-0.05, 0.05), y=st.floats(-0.05, 0.05), offset=st.floats(-3.0, 3.0))
    def test_17_is_the_static_balance(self, x: float, y: float, offset: float) -> None:
        robot = evolve(ROBOT, mass_center=(x, y, 0.1), wheel_offset=offset)
        found = a.N_i(robot.mass, robot.robot_radius, a.MassCenter.of(robot))
        axles = offset + 2.0 * math.pi * np.arange(3) / 3.0
        assert found.sum() == pytest.approx(15.0 * GRAVITY)
        moments = [(found * np.cos(axles)).sum(), (found * np.sin(axles)).sum()]
        assert 0.2 * np.array(moments) == pytest.approx(15.0 * GRAVITY * np.array([x, y]))

    def test_roots_are_whole_above_standstill_and_end_at_rest(self) -> None:
        speeds = np.array([0.729**2, 0.02, 0.01, 0.0])
        np.testing.assert_allclose(
            t.root(speeds, 6), [0.9, 0.02 ** (1 / 6), 0.5 * 0.02 ** (1 / 6), 0]
        )
        np.testing.assert_allclose(
            t.inverse_root(speeds, 6), [1 / 0.9, 0.02 ** (-1 / 6), 0.5 * 0.02 ** (-1 / 6), 0]
        )


class TestProperties:
    """What must hold whatever the coefficients."""

    @given(vx=SPEEDS, vy=SPEEDS, ax=SPEEDS, ay=SPEEDS)
    def test_a_turn_of_60_degrees_changes_nothing_in_total(
        self, vx: float, vy: float, ax: float, ay: float
    ) -> None:
        """The paper's Fig. 5, of a robot whose mass is in the middle."""
        model = Wang2024Model.of(ROBOT, FITTED)
        first = model.power(_motion(np.array([vx, vy, 0.0]), np.array([ax, ay, 0.0])))
        turned = model.power(_motion(_turned(60.0, vx, vy), _turned(60.0, ax, ay)))
        assert turned.power.sum() == pytest.approx(first.power.sum(), rel=1e-9)

    def test_power_is_least_along_an_axle_and_most_half_way(self) -> None:
        headings = np.arange(0.0, 61.0, 5.0) * DEGREE
        twists = 0.4 * np.stack([np.cos(headings), np.sin(headings), 0.0 * headings], axis=1)
        total = Wang2024Model.of(ROBOT, FITTED).power(_motion(twists)).power.sum(axis=1)
        assert total.argmax() == 6
        assert total[0] == pytest.approx(total[-1])
        assert (np.diff(total[:7]) > 0.0).all()

    @given(vx=SPEEDS, vy=SPEEDS, wz=SPEEDS, ax=SPEEDS, ay=SPEEDS)
    def test_a_turn_of_120_degrees_only_moves_the_labels(
        self, vx: float, vy: float, wz: float, ax: float, ay: float
    ) -> None:
        model = Wang2024Model.of(ROBOT, FITTED)
        yaw = np.array([0.0, 0.0, wz])
        first = model.power(_motion(np.array([vx, vy, wz]), np.array([ax, ay, 0.0])))
        turned = model.power(_motion(_turned(120.0, vx, vy) + yaw, _turned(120.0, ax, ay)))
        np.testing.assert_allclose(turned.power[0], np.roll(first.power[0], 1), rtol=1e-7)

    @given(offset=st.floats(-3.0, 3.0), heading=st.floats(-3.0, 3.0))
    def test_the_mounting_of_the_wheels_does_not_matter(
        self, offset: float, heading: float
    ) -> None:
        robot = evolve(ROBOT, wheel_offset=offset)
        motion = _motion(0.4 * _unit(heading + offset), robot=robot)
        found = Wang2024Model.of(robot, FITTED).power(motion).power
        straight = Wang2024Model.of(ROBOT, FITTED).power(_motion(0.4 * _unit(heading))).power
        np.testing.assert_allclose(found, straight, rtol=1e-7)

    def test_an_idle_wheel_draws_standby(self) -> None:
        """Wang 2024, 3.1: a motor that need not move has P_stanby alone."""
        steady = _motion(np.array([0.4, 0.0, 0.0]))
        power = Wang2024Model.of(ROBOT, FITTED).power(steady).power[0]
        assert power[0] == pytest.approx(1.2, abs=1e-4)
        assert power[1] == pytest.approx(power[2])
        assert power[1] > 1.7

    def test_a_heavier_load_on_one_wheel_moves_power_there(self) -> None:
        moved = evolve(ROBOT, mass_center=(0.0, 0.04, 0.12))  # towards wheel 2, off wheel 3
        power = Wang2024Model.of(moved, FITTED).power(_motion(np.array([0.4, 0.0, 0.0]))).power[0]
        assert power[1] > power[2]

    def test_payload_and_mass_center_of_the_description_count(self) -> None:
        shift = {"x": 0.0, "y": 0.03}
        physics = {
            **ROBOT.physics,
            "body.payload_mass": ({"mass": 3.0},) * 3,
            "body.mass_center_offset": (shift,) * 3,
        }
        chassis = Chassis.of(evolve(ROBOT, physics=physics, wheel_offset=0.4))
        assert chassis.body.mass == 18.0
        assert chassis.center.delta_R == pytest.approx(0.03)
        assert chassis.center.psi == pytest.approx(math.pi / 2 - 0.4)
        assert a.MassCenter.of(evolve(ROBOT, wheel_offset=0.4)).psi == 0.0  # no direction at all

    def test_a_gyro_replaces_the_wheels_yaw_rate(self) -> None:
        """It enters the force across the motion, M v omega_z, and nothing else."""
        wheels = _motion(np.array([0.5, 0.0, 0.0]))
        turning = WheelMotion(wheels.speed, wheels.acceleration, np.array([1.0]))
        unknown = WheelMotion(wheels.speed, wheels.acceleration, np.array([math.nan]))
        chassis = Chassis.of(ROBOT)
        assert state_of(chassis, wheels).F_wheel.max() == pytest.approx(0.0, abs=1e-9)
        assert state_of(chassis, unknown).F_wheel.max() == pytest.approx(0.0, abs=1e-9)
        # 7.5 N along y: 2/3 of it on wheel 1, 1/3 on the others.
        found = state_of(chassis, turning).F_wheel[0]
        np.testing.assert_allclose(found, [5.0, 2.5, 2.5])

    def test_rows_alone_or_together_give_the_same_numbers(self) -> None:
        random = np.random.default_rng(1)
        motion = WheelMotion(random.normal(0.0, 5.0, (50, 3)), random.normal(0.0, 20.0, (50, 3)))
        model = Wang2024Model.of(ROBOT, FITTED)
        together = model.power(motion)
        assert together.other is not None
        for row in range(50):
            alone = model.power(WheelMotion(motion.speed[[row]], motion.acceleration[[row]]))
            np.testing.assert_allclose(alone.power[0], together.power[row], rtol=1e-12)
            assert alone.other is not None
            assert alone.other[0] == pytest.approx(together.other[row], rel=1e-12)

    def test_the_motors_current_makes_the_power(self) -> None:
        random = np.random.default_rng(2)
        motion = WheelMotion(random.normal(0.0, 5.0, (50, 3)), random.normal(0.0, 3.0, (50, 3)))
        drives = Wang2024Model.of(ROBOT, FITTED).power(motion)
        np.testing.assert_allclose(drives.voltage * drives.current, drives.power - 1.2, atol=1e-9)
        driving = drives.power > 1.2
        assert (np.sign(drives.current) == np.sign(motion.speed))[driving].all()

    def test_energies_are_the_integrals_of_the_powers(self) -> None:
        """Eqs 1-5 over a start, a turn and a stop, 0.5 ms apart."""
        time = np.arange(0.0, 4.0, 5e-4)
        speed, slope = 0.5 * np.sin(math.pi * time / 4.0) ** 2, np.gradient
        heading = 0.8 * time
        twist = np.stack([speed * np.cos(heading), speed * np.sin(heading), 0.3 * speed], axis=1)
        s = state_of(Chassis.of(ROBOT), _motion(twist, slope(twist, time, axis=0)))
        kinetic = t.energy(t.P_k(s, FITTED), time).sum(axis=1)
        np.testing.assert_allclose(kinetic, t.E_k(15.0, speed), atol=2e-4)
        parts = [t.P_k(s, FITTED), t.P_h(s, FITTED), t.P_f(s, FITTED), t.P_i(s, FITTED)]
        parts.append(t.P_m(s, FITTED))
        running = sum(t.energy(part, time)[-1].sum() for part in parts)
        motion = running + 3 * 1.2 * time[-1]  # Eqs 2-4
        assert t.energy(t.P_motion(s, FITTED), time)[-1].sum() == pytest.approx(motion)
        other = t.energy(t.P_control(s, FITTED) + t.P_sensor(s, FITTED), time)[-1]
        assert t.energy(t.P_robot(s, FITTED), time)[-1] == pytest.approx(motion + other)
        for part in parts[1:]:
            assert (part >= 0.0).all()  # what is lost is lost


def _unit(heading: float) -> np.ndarray:
    return np.array([math.cos(heading), math.sin(heading), 0.0])


def _turned(degrees: float, x: float, y: float) -> np.ndarray:
    cosine, sine = math.cos(degrees * DEGREE), math.sin(degrees * DEGREE)
    return np.array([cosine * x - sine * y, sine * x + cosine * y, 0.0])
