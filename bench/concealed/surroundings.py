"""What pulls, blows, sticks or draws outside the vocabulary: forces on the body, consumers."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from concealed.nameless import USUAL, Beyond, Outside, Vector
from concealed.recipes import Recipe
from concealed.scales import Scales
from tomr_power_model.robot import GRAVITY, WHEELS, Robot
from tomr_sim_bridge.plant.effects import DriverPower, WheelLoads

_PERIOD = 0.005  # s, between two looks of the plant at its effects


def _phases(seed: float, low: float, high: float) -> Vector:
    """Times at which something comes or goes [s]."""
    return np.cumsum(np.random.default_rng(int(seed)).uniform(low, high, 200))


class Tether(Beyond):
    """A rope to a fixed point that pulls with stiffness * (distance - slack) beyond its slack."""

    units: ClassVar = {"stiffness": "N/m", "slack": "m", "x": "m", "y": "m"}
    shape_in_words = "a force on the body towards a place, beyond a distance from it"

    def resist(self, loads: WheelLoads) -> None:
        away = np.array([self._given["x"], self._given["y"]]) - loads.contact.mean(axis=0)
        distance = float(np.hypot(*away))
        beyond = max(distance - self._given["slack"], 0.0)
        loads.push[:2] += self._given["stiffness"] * beyond * away / max(distance, 1e-9)


class Wind(Beyond):
    """coefficient * |w - v| (w - v) [N], w the wind and v the robot's velocity in the world."""

    units: ClassVar = {"coefficient": "N s^2/m^2", "x": "m/s", "y": "m/s"}
    shape_in_words = "a force on the body by its velocity in the world"

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot, present, given)
        self._place: Vector | None = None

    def resist(self, loads: WheelLoads) -> None:
        place = loads.contact.mean(axis=0)
        velocity = np.zeros(2) if self._place is None else (place - self._place) / _PERIOD
        self._place = place
        past = np.array([self._given["x"], self._given["y"]]) - velocity
        loads.push[:2] += self._given["coefficient"] * float(np.hypot(*past)) * past


class Gust(Beyond):
    """A force in one direction of the world that comes and goes, some seconds each [N]."""

    units: ClassVar = {"force": "N", "azimuth": "rad", "seed": ""}
    shape_in_words = "a force on the body that comes and goes at random"

    def resist(self, loads: WheelLoads) -> None:
        blows = int(np.searchsorted(_phases(self._given["seed"], 3.0, 8.0), self._elapsed)) % 2
        azimuth = self._given["azimuth"]
        loads.push[:2] += (
            blows * self._given["force"] * np.array([math.cos(azimuth), math.sin(azimuth)])
        )


class StickyPlace(Beyond):
    """Dry resistance of the wheels within a radius of a place on the floor [N m]."""

    units: ClassVar = {"torque": "N m", "x": "m", "y": "m", "radius": "m"}
    shape_in_words = "resistance depends on the place on the floor: a round patch"

    def resist(self, loads: WheelLoads) -> None:
        place = np.array([self._given["x"], self._given["y"]])
        away = np.hypot(*(loads.contact - place).T)
        loads.dry += self._present * self._given["torque"] * (away < self._given["radius"])


class Consumer(Beyond):
    """A consumer at the supply that comes and goes, some seconds each [W]."""

    units: ClassVar = {"power": "W", "seed": ""}
    shape_in_words = "power drawn at the supply by what comes and goes at random"

    def bill(self, drivers: DriverPower) -> None:
        super().bill(drivers)
        draws = int(np.searchsorted(_phases(self._given["seed"], 3.0, 8.0), self._elapsed)) % 2
        drivers.other += draws * self._given["power"]


class FastDriver(Beyond):
    """power * (omega / speed)^2 beyond a speed that drivers draw besides [W]."""

    units: ClassVar = {"power": "W", "speed": "rad/s"}
    shape_in_words = "power lost in the driver by the speed of its wheel"

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot, present, given)
        self._speed = np.zeros(WHEELS)

    def resist(self, loads: WheelLoads) -> None:
        self._speed = np.abs(loads.speed)

    def bill(self, drivers: DriverPower) -> None:
        super().bill(drivers)
        drivers.power += (
            self._present
            * self._given["power"]
            * ((self._speed / self._given["speed"]) ** 2 * (self._speed > self._given["speed"]))
        )


class AfterStand(Beyond):
    """Dry friction that dies out with the time since the wheel last stood: torque * exp(-t / T)."""

    units: ClassVar = {"torque": "N m", "time_constant": "s"}
    shape_in_words = "dry friction that dies out over the seconds after standing still"
    _STANDING = 0.05  # rad/s

    def __init__(self, robot: Robot, present: Vector, given: Mapping[str, float]) -> None:
        super().__init__(robot, present, given)
        self._since = np.zeros(WHEELS)

    def resist(self, loads: WheelLoads) -> None:
        moves = np.abs(loads.speed) > self._STANDING
        self._since = np.where(moves, self._since + _PERIOD, 0.0)
        fading = np.exp(-self._since / self._given["time_constant"])
        loads.dry += self._present * self._given["torque"] * fading


def _tethered(size: float, units: Scales, random: np.random.Generator) -> dict[str, float]:
    x, y = random.uniform(-0.5, 0.5, 2)
    stiffness = 0.03 * size * units.mass * GRAVITY
    return {"stiffness": stiffness, "slack": 0.5, "x": float(x), "y": float(y)}


def _windy(size: float, units: Scales, random: np.random.Generator) -> dict[str, float]:
    azimuth = random.uniform(-math.pi, math.pi)
    x, y = 0.6 * math.cos(azimuth), 0.6 * math.sin(azimuth)
    return {"coefficient": 0.05 * size * units.mass * GRAVITY, "x": x, "y": y}


def _gusty(size: float, units: Scales, random: np.random.Generator) -> dict[str, float]:
    azimuth, seed = random.uniform(-math.pi, math.pi), float(random.integers(1, 10_000))
    force = 0.03 * size * units.mass * GRAVITY
    return {"force": force, "azimuth": float(azimuth), "seed": seed}


def _sticky(size: float, units: Scales, random: np.random.Generator) -> dict[str, float]:
    x, y = random.uniform(-0.3, 0.3, 2)
    return {"torque": 4.0 * size * units.torque, "x": float(x), "y": float(y), "radius": 0.5}


def _drawing(size: float, units: Scales, random: np.random.Generator) -> dict[str, float]:
    return {"power": 3.0 * size * units.power, "seed": float(random.integers(1, 10_000))}


SURROUNDINGS: Mapping[str, Outside] = {
    "x.tether": Outside.of(Tether, Recipe(_tethered, USUAL)),
    "x.wind": Outside.of(Wind, Recipe(_windy, USUAL)),
    "x.gust": Outside.of(Gust, Recipe(_gusty, USUAL)),
    "x.sticky_place": Outside.of(StickyPlace, Recipe(_sticky, USUAL)),
    "x.consumer": Outside.of(Consumer, Recipe(_drawing, USUAL)),
    "x.fast_driver": Outside.of(
        FastDriver,
        Recipe(lambda s, u, _: {"power": 0.5 * s * u.power, "speed": 0.5 * u.speed}, USUAL),
    ),
    "x.after_stand": Outside.of(
        AfterStand,
        Recipe(lambda s, u, _: {"torque": 3.0 * s * u.torque, "time_constant": 1.0}, USUAL),
    ),
}
