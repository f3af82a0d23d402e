"""The coefficients of Wang 2024, each named as in the paper, and where they are kept.

They are parameters of the model stage, `wang2024.<name>`: a group `wang2024:` in the section of
the node `power_model`, in robot.yaml or in a file of its own. docs/wang2024.md says what the paper
leaves open about them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self, cast

import yaml
from attrs import Attribute, evolve, field, fields, frozen

from tomr_power_model.errors import InputError, one_line
from tomr_power_model.files import write_text
from tomr_power_model.robot import WHEELS, Robot, read_node_sections
from tomr_power_model.robot.description import closest
from tomr_power_model.robot.parameters import ParameterSpec, check_all

GROUP = "wang2024."
NODE = "power_model"  # the section of a parameter file that the group stands in
FILE_PARAMETER = GROUP + "coefficients"

_RADIUS_TOLERANCE = 0.01
_MASS_FACTOR = 1.5  # a payload may change the mass, another robot is further off

Triple = tuple[float, float, float]
_ZEROS: Triple = (0.0, 0.0, 0.0)


def _number(
    where: str, meaning: str, unit: str = "", default: float | Triple = 0.0, most: float = 1e9
) -> Any:
    notes = {"where": where, "meaning": meaning, "unit": unit, "most": most}
    return field(default=default, metadata=notes)


@frozen
class Coefficients:
    """Every constant of Eqs 1-17. The paper uses k_1, k_2 and P_stanby twice each: a letter
    distinguishes them (h: Eq. 6, m: 9, c: 11). Those that end in `_ours` the paper lacks."""

    # Given by the robot or by the conditions of the fit.
    M: float = _number("Eq. 5", "mass of the robot fitted", "kg", most=1e5)
    L: float = _number(
        "Eqs 12-16", "side of the robot: of the triangle on the wheels", "m", most=1e2
    )
    L_R: float = _number("Eqs 12-17", "centre to drive wheel", "m", most=1e2)
    L_v: float = _number("Eqs 14-16", "centre to side", "m", most=1e2)
    v_max: float = _number("Eq. 11", "highest speed", "m/s", most=1e3)
    v_0: float = _number("Eqs 6, 8", "speed at the start", "m/s", most=1e2)
    t: float = _number("Eqs 6, 11", "running time", "s", 600.0, most=1e7)
    t_0: float = _number("Eq. 6", "time at the start", "s", most=1e7)
    T: float = _number("Eq. 6", "temperature of the motors", "deg C", 45.0, most=300.0)
    T_0: float = _number("Eq. 6", "temperature at the start", "deg C", 25.0, most=300.0)
    dv_max_ours: float = _number(
        "Eq. 8", "largest |dv/dt| that the fit has seen", "m/s^2", most=1e2
    )
    # Fitted to the power of the motors.
    P_stanby: tuple[float, float, float] = _number("Eq. 3", "by motor at rest", "W", _ZEROS)
    k_1h: float = _number("Eq. 6", "heat time parameter k_1")
    k_2h: float = _number("Eq. 6", "heat time parameter k_2", "s/m")
    k_T: float = _number("Eq. 6", "heat torque parameter k(T)", "m/s")
    lambda_h: float = _number("Eq. 6", "heat time parameter of the robot", "W (m/s)^(1/6)")
    R_T: float = _number("Eq. 6", "heat constant R(T)", "W/K^2 (s/m)^(1/2)")
    mu_i: tuple[float, float, float] = _number("Eq. 7", "friction by wheel", "", _ZEROS)
    mu_R: float = _number("Eqs 12-16", "friction coefficient, rolling")
    mu_S: float = _number("Eqs 12-16", "friction coefficient, sliding")
    eps_1: float = _number("Eq. 8", "iron loss, acceleration", "W (s^2/m)^6")
    eps_2: float = _number("Eq. 8", "iron loss, speed", "W (s/m)^(1/2)")
    eps_3: float = _number("Eq. 8", "iron loss, acceleration of the wheels", "W (s^2/m)^2")
    eps_4: float = _number("Eq. 8", "iron loss, speed of the wheels", "W (s/m)^(1/6)")
    k_1m: float = _number("Eq. 9", "mechanical loss k_1", "W/N^2")
    k_2m: float = _number("Eq. 9", "mechanical loss k_2", "m")
    c_1_ours: float = _number("Eq. 9", "factor of N_i v_i sin(alpha)")
    c_2_ours: float = _number("Eq. 9", "factor of M g v sin(alpha)")
    M_rot_ours: float = _number("Eq. 5", "what turning parts add to M in E_k; 0: as printed", "kg")
    # Fitted to what the whole robot draws beside its motors.
    P_sensor: float = _number("Eq. 10", "power of all sensors", "W")
    P_stanby_c: float = _number("Eq. 11", "P_stanby of the control system", "W")
    rho_1: float = _number("Eq. 11", "rho_1, per m/s and per m/s^2 alike", "W s/m")
    rho_2: float = _number("Eq. 11", "rho_2", "W/s^(1/10)")
    p_fs: float = _number("Eq. 11", "sum of p_i fs_i at full speed", "W")
    P_fs: float = _number("Eq. 11", "sum of P_i fs_i", "W")

    @classmethod
    def of_robot(cls, robot: Robot) -> Self:
        """What the robot itself determines; everything fitted is still zero.

        The body is taken as the triangle on the wheels: L = sqrt(3) L_R, L_v = L_R / 2.
        """
        radius = robot.robot_radius
        motor = robot.motors[0]
        return cls(
            M=robot.mass,
            L=3.0**0.5 * radius,
            L_R=radius,
            L_v=0.5 * radius,
            v_max=robot.supply.nominal_voltage / motor.wheel_constant * robot.wheel_radius,
        )

    @classmethod
    def of(cls, values: Mapping[str, object]) -> Self:
        """Coefficients from checked parameters `wang2024.<name>`, or from the file they name."""
        path = str(values.get(FILE_PARAMETER, ""))
        if path:
            return cls.load(path)
        return cls(**{key.name: cast(Any, values[GROUP + key.name]) for key in fields(cls)})

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read the group `wang2024:` of a parameter file; raises InputError if it does not fit."""
        given = read_node_sections(path, ("/**", NODE))
        mine = {name: value for name, value in given.items() if name.startswith(GROUP)}
        mine.pop(FILE_PARAMETER, None)
        if not mine:
            raise InputError(f"{path}: no group wang2024: fit the model and save it there")
        table = {spec.name: spec for spec in COEFFICIENT_PARAMETERS}
        for name in mine:
            if name not in table:
                raise InputError(f"{path}: {name} is unknown: {closest(name, list(table))}")
        return cls.of(check_all(COEFFICIENT_PARAMETERS, mine, str(path)))

    def having(self, **values: Any) -> Self:
        """The same with some coefficients changed."""
        return evolve(self, **values)

    def save(self, path: Path) -> None:
        """Write `text` to a file."""
        write_text(path, self.text())

    def text(self, *notes: str) -> str:
        """A parameter file that the node, `load` and `--robot` read alike, notes at its top."""
        values = {key.name: getattr(self, key.name) for key in fields(type(self))}
        group = {
            name: [_short(v) for v in value] if isinstance(value, tuple) else _short(value)
            for name, value in values.items()
        }
        document = {NODE: {"ros__parameters": {GROUP.rstrip("."): group}}}
        head = ("Wang 2024: coefficients fitted to a healthy drive.", *notes)
        body = yaml.safe_dump(document, sort_keys=False, default_flow_style=None)
        return "".join(f"# {one_line(line)}\n" for line in head) + body

    def check(self, robot: Robot) -> None:
        """Raise InputError unless they were fitted for this robot."""
        if self.L_R <= 0.0:
            raise InputError(
                "power_model = wang2024 has no coefficients: fit them to a healthy drive (tomr_cali"
                f"brate --power-model wang2024) and give the file as {FILE_PARAMETER}, or the "
                f"group wang2024 in the section {NODE}"
            )
        for name in ("L", "L_v", "v_max", "t"):
            value = getattr(self, name)
            if not value > 0.0:
                raise InputError(f"wang2024.{name} = {value:g}: give more than 0, or fit again")
        if abs(self.L_R - robot.robot_radius) > _RADIUS_TOLERANCE * robot.robot_radius:
            raise InputError(
                f"wang2024.L_R = {self.L_R:g} m was fitted for another robot: robot.robot_radius "
                f"= {robot.robot_radius:g} m; fit again"
            )
        if not 1.0 / _MASS_FACTOR < self.M / robot.mass < _MASS_FACTOR:
            raise InputError(
                f"wang2024.M = {self.M:g} kg was fitted for another robot: robot.mass = "
                f"{robot.mass:g} kg; fit again"
            )


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _spec(key: "Attribute[Any]") -> ParameterSpec:
    notes = key.metadata
    is_list = isinstance(key.default, tuple)
    return ParameterSpec(
        GROUP + key.name,
        f"{notes['meaning']} (Wang 2024, {notes['where']})",
        "floats" if is_list else "float",
        key.default,
        notes["unit"],
        0.0,
        notes["most"],
        length=WHEELS if is_list else None,
    )


COEFFICIENT_PARAMETERS: tuple[ParameterSpec, ...] = tuple(
    _spec(key) for key in fields(Coefficients)
)
WANG2024_PARAMETERS: tuple[ParameterSpec, ...] = (
    ParameterSpec(
        FILE_PARAMETER, "file of coefficients, in place of those given one by one", "str", ""
    ),
    *COEFFICIENT_PARAMETERS,
)
