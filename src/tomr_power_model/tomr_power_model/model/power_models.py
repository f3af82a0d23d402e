"""The power models to choose from, by name: the parameter `power_model`."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from attrs import frozen

from tomr_power_model.dynamics import layout as at
from tomr_power_model.dynamics.binding import plain
from tomr_power_model.dynamics.drives import PowerModel, WheelMotion
from tomr_power_model.dynamics.numbers import laid_out
from tomr_power_model.dynamics.vehicle import vehicle_of
from tomr_power_model.model.commanded import Commanded
from tomr_power_model.model.means import Means
from tomr_power_model.robot import WHEELS, Robot
from tomr_power_model.robot.parameters import ParameterSpec
from tomr_power_model.wang2024 import WANG2024_PARAMETERS, Coefficients, Wang2024Model

_PARTS = 10  # of a tick, where torque ripples with the wheels' angles


@frozen
class MeasuredMotion:
    """Motion of the wheels at the middle of a tick, and what else the encoder path needs."""

    speed: Sequence[float]  # rad/s
    acceleration: Sequence[float]  # rad/s^2
    angle: Sequence[float]  # rad, NaN where not known
    yaw_rate: float  # of a gyro [rad/s]; NaN: as the wheels say
    heading: float  # rad
    rise: Sequence[float]  # of the windings above 25 C [K]
    held: Sequence[float]  # voltage of a driver whose wheel is at rest [V]; NaN: not known


class TickPower(Protocol):
    """A power model as the predictor asks it, tick by tick."""

    def commanded(self, motion: Commanded) -> Means:
        """Power in the motion that the commands lead to."""
        ...

    def measured(self, motion: MeasuredMotion) -> Means:
        """Power in the motion that the encoders show."""
        ...


Maker = Callable[[Robot, Mapping[str, object], float], TickPower]


@frozen
class Kind:
    """A power model: how it is made, and the parameters that are its own."""

    make: Maker
    parameters: tuple[ParameterSpec, ...] = ()


POWER_MODELS: dict[str, Kind] = {}


def power_model(name: str, *parameters: ParameterSpec) -> Callable[[Maker], Maker]:
    """Register a maker of a power model; it gets the robot, checked parameters and a tick [s]."""

    def register(make: Maker) -> Maker:
        POWER_MODELS[name] = Kind(make, parameters)
        return make

    return register


def own_parameters() -> tuple[ParameterSpec, ...]:
    """The parameters of all power models."""
    return tuple(spec for kind in POWER_MODELS.values() for spec in kind.parameters)


class Physical:
    """Our dynamics: the simulation's own power, and inverse dynamics of the encoders."""

    def __init__(self, robot: Robot, period_s: float) -> None:
        self._numbers: list[float] = laid_out(vehicle_of(robot)).tolist()
        self._step = plain(tuple(robot.physics))
        parts = _PARTS if "drivetrain.torque_ripple" in robot.physics else 1
        self._instants = [period_s * ((k + 0.5) / parts - 0.5) for k in range(parts)]

    def commanded(self, motion: Commanded) -> Means:
        """As simulated."""
        return Means(
            motion.torque, motion.current, motion.at_motor, motion.power, voltage=motion.voltage
        )

    def measured(self, motion: MeasuredMotion) -> Means:
        """As inverse dynamics tell, mean over the parts of the tick."""
        sums = [[0.0] * WHEELS for _ in range(4)]
        share = 1.0 / len(self._instants)
        for instant in self._instants:
            for wheel, found in enumerate(self._at(motion, instant)):
                torque, current, voltage, power = found
                for total, value in zip(
                    sums, (torque, current, voltage * current, power), strict=True
                ):
                    total[wheel] += share * value
        return Means(*sums)

    def _at(self, motion: MeasuredMotion, instant: float) -> list[list[float]]:
        """Torque, current, voltage and power of each drive, `instant` after the middle [s]."""
        row = [motion.yaw_rate, motion.heading]
        for wheel in range(WHEELS):
            speed, change = motion.speed[wheel], motion.acceleration[wheel]
            angle = motion.angle[wheel] + instant * (speed + 0.5 * change * instant)
            rise, held = motion.rise[wheel], motion.held[wheel]
            row += [speed + change * instant, change, angle, 0.0, rise, held]
        out = [0.0] * (WHEELS * at.POWER_WHEEL)
        self._step.drive_power(self._numbers, row, out, WHEELS)
        return [out[first : first + 4] for first in range(0, len(out), at.POWER_WHEEL)]


class FromMotion:
    """A model that knows of motion alone: both paths ask it about theirs."""

    def __init__(self, model: PowerModel, step_s: float) -> None:
        self._model = model
        self._step = step_s

    def commanded(self, motion: Commanded) -> Means:
        """Mean over the steps of the tick."""
        speed = np.array(motion.rows)
        change = np.empty_like(speed)
        edge = np.array(motion.edge)
        for row, mean in enumerate(speed):
            change[row] = 2.0 * (mean - edge) / self._step
            edge = 2.0 * mean - edge
        return Means.of(self._model.power(WheelMotion(speed, change)))

    def measured(self, motion: MeasuredMotion) -> Means:
        """At the middle of the tick."""
        yaw = None if math.isnan(motion.yaw_rate) else np.array([motion.yaw_rate])
        speed, change = np.array([motion.speed]), np.array([motion.acceleration])
        return Means.of(self._model.power(WheelMotion(speed, change, yaw)))


@power_model("physical")
def physical(robot: Robot, values: Mapping[str, object], period_s: float) -> TickPower:
    """The dynamics with the effects of robot.yaml."""
    return Physical(robot, period_s)


@power_model("wang2024", *WANG2024_PARAMETERS)
def wang2024(robot: Robot, values: Mapping[str, object], period_s: float) -> TickPower:
    """The paper's energy model, with coefficients fitted to a healthy drive."""
    model = Wang2024Model.of(robot, Coefficients.of(values))
    step = laid_out(vehicle_of(robot))[at.STEP]
    return FromMotion(model, float(step))
