"""Physics that no effect of the vocabulary describes; truth calls each of them `unknown`."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from concealed.nameless import USUAL, Beyond, Outside, Vector
from concealed.recipes import Recipe
from concealed.surroundings import SURROUNDINGS
from tomr_power_model.robot import WHEELS, Robot
from tomr_sim_bridge.plant.effects import DriverPower, WheelLoads


class TwoHarmonics(Beyond):
    """torque * (sin(n theta) + 0.8 sin(2 n theta + 1)) [N m]."""

    units: ClassVar = {"torque": "N m", "order": "1/rev"}
    shape_in_words = "torque of the wheel angle: two harmonics, neither symmetric nor a sine"

    def resist(self, loads: WheelLoads) -> None:
        turn = self._given["order"] * loads.angle
        wave = np.sin(turn) + 0.8 * np.sin(2.0 * turn + 1.0)
        loads.torque -= self._present * self._given["torque"] * wave


class ChippedTooth(Beyond):
    """A resisting bump of torque once per turn, a twentieth of a turn wide [N m]."""

    units: ClassVar = {"torque": "N m"}
    shape_in_words = "drag at one wheel angle only, once per turn"

    def resist(self, loads: WheelLoads) -> None:
        away = np.angle(np.exp(1j * (loads.angle - 1.0)))
        loads.dry += self._present * self._given["torque"] * np.exp(-((away / 0.3) ** 2))


class RunningIn(Beyond):
    """torque * exp(-t / time_constant) [N m], t since the start."""

    units: ClassVar = {"torque": "N m", "time_constant": "s"}
    shape_in_words = "dry friction that decays exponentially with the time since the start"

    def resist(self, loads: WheelLoads) -> None:
        share = math.exp(-self._elapsed / self._given["time_constant"])
        loads.dry += self._present * self._given["torque"] * share


class StripedFloor(Beyond):
    """Dry resistance of wheels that stand on stripes of another floor [N m]."""

    units: ClassVar = {"torque": "N m", "width": "m"}
    shape_in_words = "resistance depends on the place on the floor: stripes across x"

    def resist(self, loads: WheelLoads) -> None:
        stripe = np.sin(math.pi * loads.contact[:, 0] / self._given["width"]) > 0
        loads.dry += self._present * self._given["torque"] * stripe


class Cubic(Beyond):
    """coefficient * omega^3 [N m]."""

    units: ClassVar = {"coefficient": "N m s^3/rad^3"}
    shape_in_words = "torque grows with the cube of the wheel speed"

    def resist(self, loads: WheelLoads) -> None:
        loads.viscous += self._present * self._given["coefficient"] * loads.speed**2


class Intermittent(Beyond):
    """A drag that comes and goes, some seconds each, whatever the robot does [N m]."""

    units: ClassVar = {"torque": "N m", "seed": ""}
    shape_in_words = "dry friction that comes and goes at random, for seconds at a time"

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot, present, given)
        random = np.random.default_rng(int(self._given["seed"]))
        self._switches = np.cumsum(random.uniform(2.0, 6.0, 200))

    def resist(self, loads: WheelLoads) -> None:
        drags = int(np.searchsorted(self._switches, self._elapsed)) % 2
        loads.dry += self._present * self._given["torque"] * drags


class StickyStart(Beyond):
    """Grease that holds after a stand: torque * exp(-turned / 1 rad) since then [N m]."""

    units: ClassVar = {"torque": "N m"}
    shape_in_words = "dry friction that dies out over the first turn after standing still"
    _STANDING = 0.05  # rad/s

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot, present, given)
        self._stood_at = np.zeros(WHEELS)
        self._standing = np.zeros(WHEELS)

    def bill(self, drivers: DriverPower) -> None:
        super().bill(drivers)
        self._standing += drivers.duration

    def resist(self, loads: WheelLoads) -> None:
        self._standing[np.abs(loads.speed) > self._STANDING] = 0.0
        rested = self._standing > 0.3
        self._stood_at[rested] = loads.angle[rested]
        turned = np.abs(loads.angle - self._stood_at)
        loads.dry += self._present * self._given["torque"] * np.exp(-turned)


class Overload(Beyond):
    """coefficient * (|i| - current)^2 above a current [W], drawn by the driver."""

    units: ClassVar = {"coefficient": "W/A^2", "current": "A"}
    shape_in_words = "power lost in the driver above a motor current"

    def bill(self, drivers: DriverPower) -> None:
        excess = np.maximum(np.abs(drivers.current) - self._given["current"], 0.0)
        drivers.power += self._present * self._given["coefficient"] * excess**2


OUTSIDE: Mapping[str, Outside] = {
    "x.two_harmonics": Outside.of(
        TwoHarmonics,
        Recipe(
            lambda s, u, random: {
                "torque": 1.5 * s * u.torque,
                "order": float(random.integers(2, 6)),
            },
            USUAL,
        ),
    ),
    "x.chipped_tooth": Outside.of(
        ChippedTooth, Recipe(lambda s, u, _: {"torque": 4.0 * s * u.torque}, USUAL)
    ),
    "x.running_in": Outside.of(
        RunningIn,
        Recipe(lambda s, u, _: {"torque": 2.0 * s * u.torque, "time_constant": 20.0}, USUAL),
    ),
    "x.striped_floor": Outside.of(
        StripedFloor,
        Recipe(
            lambda s, u, random: {
                "torque": 1.5 * s * u.torque,
                "width": float(random.uniform(0.5, 0.9)),
            },
            USUAL,
        ),
    ),
    "x.cubic": Outside.of(
        Cubic, Recipe(lambda s, u, _: {"coefficient": s * u.torque / u.speed**3}, USUAL)
    ),
    "x.intermittent": Outside.of(
        Intermittent,
        Recipe(
            lambda s, u, random: {
                "torque": 1.5 * s * u.torque,
                "seed": float(random.integers(1, 10_000)),
            },
            USUAL,
        ),
    ),
    "x.sticky_start": Outside.of(
        StickyStart, Recipe(lambda s, u, _: {"torque": 4.0 * s * u.torque}, USUAL)
    ),
    "x.overload": Outside.of(
        Overload,
        Recipe(
            lambda s, u, _: {
                "coefficient": 0.1 * s * u.power / u.current**2,
                "current": 3.0 * u.current,
            },
            USUAL,
        ),
    ),
    **SURROUNDINGS,
}
