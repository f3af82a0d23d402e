"""Fig. 4: power against the position of the mass centre, along one heading and over all of them.

The floor drags on the rollers in proportion to each wheel's load. Without such a drag the mass
centre changes next to nothing, which is measured as well. Of the paper's model stand Eqs 14-17
alone, their mu_R and mu_S fitted to the very powers they are compared with.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from numpy.typing import NDArray
from scipy.optimize import nnls
from tqdm import tqdm

from figures.page import DERIVED, INK, MUTED, PHYSICAL, WANG2024, page, plain, titled
from figures.result import Result
from figures.simulated import driven, plain_mission, played, reference
from tomr_power_model.dynamics.drives import InverseDynamics, PowerModel, WheelMotion
from tomr_power_model.geometry.kinematics import twist_to_wheels
from tomr_power_model.model.scores import accuracy, nrmse
from tomr_power_model.robot import Robot
from tomr_power_model.wang2024 import Coefficients, Wang2024Model
from tomr_power_model.wang2024.fit import MOTOR_COEFFICIENTS
from tomr_sim_bridge.missions import Mission
from tomr_sim_bridge.missions.schema import CirclePhase, TwistPhase

Array = NDArray[np.float64]

DRAG = 0.1  # coefficient of the rollers' drag; a gray floor has 0.5 under a Robotino
DISTANCES = (0.02, 0.04, 0.06, 0.08)  # m; at 0.1 a wheel can lift
ANGLES = tuple(range(0, 360, 30))  # degrees from +x, the axle of wheel 1
MOTIONS = ("along +Y", "all headings")
_SPEED, _TURN = 0.4, 8.0  # m/s; s that the heading takes for a full turn
_COUNTED = ((1.5, 3.0), (4.0, 4.0 + _TURN))  # s of the drive, by motion
_SEED = 5


@frozen
class Position:
    """A place of the mass centre: distance from the middle [m], angle from +x [rad]."""

    distance: float
    angle: float

    def of(self, robot: Robot) -> Robot:
        """The robot with its mass centre there."""
        x, y = self.distance * math.cos(self.angle), self.distance * math.sin(self.angle)
        return evolve(robot, mass_center=(x, y, robot.mass_center[2]))


def fig4(scratch: Path) -> Result:
    """Power against the position of the mass centre."""
    positions = [
        Position(0.0, 0.0),
        *(Position(d, math.radians(a)) for d in DISTANCES for a in ANGLES),
    ]
    robot = _dragging(reference())
    measured = _driven(robot, positions)
    physical = np.array([_steady(InverseDynamics.of, place.of(robot)) for place in positions])
    found = {
        "measured": measured,
        "physical": physical,
        "Eqs 14-17": _equations(robot, positions, measured),
    }
    bare = _driven(reference(), [positions[0], *positions[-len(ANGLES) :: 3]])
    rows, numbers = [], {}
    for column, motion in enumerate(MOTIONS):
        for name, power in found.items():
            title = f"{motion}, {name}"
            numbers[title] = figures_of(power[:, column], measured[:, column])
            rows.append(_row(title, numbers[title], name != "measured"))
    change = float(np.abs(bare[1:] / bare[0] - 1.0).max())
    return Result(
        "Fig. 4: power of the motors by distance of the mass centre, % of that in the middle",
        ("", "middle, W", *(f"{100 * d:.0f} cm" for d in DISTANCES), "accuracy", "RMS error"),
        rows,
        {
            "roller_drag": DRAG,
            "distance_m": [place.distance for place in positions],
            "angle_deg": [math.degrees(place.angle) for place in positions],
            "largest_change_without_drag_at_8_cm": change,
            "powers": numbers,
        },
        _picture(positions, found, robot),
        (
            "change, least to most over twelve angles; RMS error: of the change, in points of %;\n"
            f"without the rollers' drag the change at {100 * DISTANCES[-1]:.0f} cm is "
            f"{100 * change:.1f} % at most",
        ),
    )


def figures_of(power: Array, measured: Array) -> dict[str, Any]:
    """Changes by distance; `power` [W] in the middle, then by distance and angle, (1 + 4 * 12,)."""
    changes = power[1:].reshape(len(DISTANCES), len(ANGLES)) / power[0] - 1.0
    most = int(changes[-1].argmax())
    halfway = float(changes[1, most])
    error = power / power[0] - measured / measured[0]
    return {
        "middle_W": float(power[0]),
        "least_change": changes.min(axis=1).tolist(),
        "mean_change": changes.mean(axis=1).tolist(),
        "most_change": changes.max(axis=1).tolist(),
        "angle_of_most_deg": ANGLES[most],
        # 2 where power rises in proportion to the distance, 4 with its square.
        "change_at_8_cm_over_4_cm": float(changes[-1, most]) / halfway if halfway else math.nan,
        "accuracy": accuracy(measured, power),
        "nrmse": nrmse(measured, power),
        "rms_error_of_change": float(np.sqrt(np.mean(error**2))),
        "power_W": power.tolist(),
    }


def _row(name: str, numbers: dict[str, Any], is_model: bool) -> tuple[str, ...]:
    ranges = zip(numbers["least_change"], numbers["most_change"], strict=True)
    cells = (f"{100 * least:+.1f} to {100 * most:+.1f}" for least, most in ranges)
    error = f"{100 * numbers['rms_error_of_change']:.1f}"
    score = (f"{100 * numbers['accuracy']:.1f} %", error) if is_model else ("", "")
    return (name, f"{numbers['middle_W']:.2f}", *cells, *score)


def _equations(robot: Robot, positions: Sequence[Position], measured: Array) -> Array:
    """Power [W] by Wang 2024, Eqs 14-17, at best: mu_R, mu_S and a constant fitted, (n, 2)."""
    nothing = {name: 0.0 for name in MOTOR_COEFFICIENTS if name not in ("P_stanby", "mu_i")}
    bare = Coefficients.of_robot(robot).having(**nothing, M=robot.mass)

    def power(coefficients: Coefficients) -> Array:
        def make(displaced: Robot) -> PowerModel:
            return Wang2024Model.of(displaced, coefficients)

        return np.array([_steady(make, place.of(robot)) for place in positions])

    rest = power(bare)
    terms = [power(bare.having(**{name: 1.0})) - rest for name in ("mu_R", "mu_S")]
    found = np.empty_like(measured)
    for column in range(len(MOTIONS)):
        columns = np.column_stack([np.ones(len(measured)), *(term[:, column] for term in terms)])
        found[:, column] = columns @ nnls(columns, measured[:, column])[0]
    return found


def _dragging(robot: Robot) -> Robot:
    wheel = {"coefficient": DRAG, "slip": 0.0}
    return evolve(robot, physics={**robot.physics, "contact.roller_drag": (wheel, wheel, wheel)})


def _driven(robot: Robot, positions: Sequence[Position]) -> Array:
    """Mean measured power of the motors [W] at each position, by motion, (n, 2)."""
    mission, means = _mission(), []
    # Gentle starts: a displaced mass must not lift a wheel.
    robot = evolve(robot, controller=evolve(robot.controller, acceleration_limit=0.5))
    for place in tqdm(positions, desc="positions", unit="drive", leave=False):
        displaced = place.of(robot)
        found = played(driven(mission, displaced, _SEED), displaced)
        means.append([found.measured[found.rows(*span), 3].mean() for span in _COUNTED])
    return np.array(means)


def _mission() -> Mission:
    along = TwistPhase((0.0, _SPEED, 0.0), _COUNTED[0][1])
    around = CirclePhase(_SPEED, 2.0 * math.pi / _TURN, _COUNTED[1][1] - _COUNTED[0][1])
    return plain_mission("mass_center", (along, around))


def _steady(make: Callable[[Robot], PowerModel], robot: Robot) -> tuple[float, float]:
    """Modelled power of the motors [W]: along +Y, and the mean over a turn of the heading."""
    heading = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False)
    rate = 2.0 * math.pi / _TURN
    turn = _SPEED * np.column_stack([np.cos(heading), np.sin(heading), np.zeros(72)])
    change = rate * np.column_stack([-turn[:, 1], turn[:, 0], turn[:, 2]])
    twist = np.concatenate([[[0.0, _SPEED, 0.0]], turn])
    wheels = twist_to_wheels(robot).T
    motion = WheelMotion(twist @ wheels, np.concatenate([np.zeros((1, 3)), change]) @ wheels)
    power = make(robot).power(motion).power.sum(axis=1)
    return float(power[0]), float(power[1:].mean())


def _picture(positions: Sequence[Position], found: dict[str, Array], robot: Robot) -> Figure:
    figure = page(11.0, 5.0)
    grid = figure.add_gridspec(1, 2, width_ratios=(1, 1.15))
    axis = figure.add_subplot(grid[0, 0], projection="polar")
    assert isinstance(axis, PolarAxes)
    _map(axis, positions, found["measured"][:, 0], robot)
    _by_distance(figure.add_subplot(grid[0, 1]), found)
    return figure


def _map(axis: PolarAxes, positions: Sequence[Position], measured: Array, robot: Robot) -> None:
    """Change of power along +Y by position: the model as an area, the simulated robot as dots."""
    angles, distances = np.radians(np.arange(0, 361, 10)), np.arange(0.0, 0.0801, 0.005)
    steady = [
        [_steady(InverseDynamics.of, Position(float(d), float(a)).of(robot))[0] for a in angles]
        for d in distances
    ]
    change = 100.0 * (np.array(steady) / steady[0][0] - 1.0)
    span = 22.0
    levels = np.linspace(-span, span, 23)
    filled = axis.contourf(angles, 100 * distances, change, levels, cmap="RdBu_r")
    axis.scatter(
        [place.angle for place in positions],
        [100 * place.distance for place in positions],
        c=100.0 * (measured / measured[0] - 1.0),
        cmap="RdBu_r",
        vmin=-span,
        vmax=span,
        s=60,
        edgecolors=INK,
        linewidths=0.8,
        zorder=3,
        clip_on=False,
    )
    axis.set_rticks([2, 4, 6, 8], ["2", "4", "6", "8 cm"])
    axis.set_rlabel_position(15)
    axis.tick_params(labelsize=8)
    bar = axis.figure.colorbar(filled, ax=axis, location="bottom", shrink=0.8, aspect=35, pad=0.08)
    bar.set_label(
        "change of the motors' power along +Y, %\narea: physical model, dots: MuJoCo", fontsize=8
    )
    bar.ax.tick_params(labelsize=8)
    bar.set_ticks([-20, -10, 0, 10, 20])


def _by_distance(axis: Axes, found: dict[str, Array]) -> None:
    """Change by distance along three angles, and over all headings."""
    centimetres = 100 * np.array([0.0, *DISTANCES])
    changes = {
        name: 100 * (power[1:].reshape(len(DISTANCES), len(ANGLES), 2) / power[0] - 1.0)
        for name, power in found.items()
    }
    styles = (("measured", "o", 5.0), ("physical", "-", 0.0), ("Eqs 14-17", "--", 0.0))
    for angle, colour in ((180, PHYSICAL), (90, DERIVED), (0, WANG2024)):
        for name, style, size in styles:
            values = np.append(0.0, changes[name][:, ANGLES.index(angle), 0])
            label = f"along +Y, mass centre at {angle}°" if name == "physical" else None
            axis.plot(centimetres, values, style, color=colour, ms=size, lw=1.3, label=label)
    values = np.append(0.0, np.median(changes["measured"][..., 1], axis=1))
    axis.plot(centimetres, values, "s-", color=MUTED, ms=4, lw=1.3, label="all headings, measured")
    plain(axis)
    axis.legend(fontsize=8, frameon=False, loc="upper left")
    axis.set_xlabel("distance of the mass centre from the middle, cm", fontsize=9)
    axis.set_ylabel("change of the motors' power, %", fontsize=9)
    titled(axis, "Dots: MuJoCo; lines: physical model; dashed: Eqs 14-17 at best")
