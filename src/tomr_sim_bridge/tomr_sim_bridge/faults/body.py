"""Forces on the body, from outside. They act at the height of the mass centre."""

import math

import numpy as np

from tomr_sim_bridge.faults.base import (
    Fault,
    FaultActions,
    Vector,
    register,
    setting_spec,
    severity_spec,
    size_spec,
)

_CREEP = 0.05  # m/s: slower motion is resisted by less than the whole drag
_AIR_DENSITY = 1.2  # kg/m^3
AZIMUTH_SPEC = setting_spec(
    "azimuth",
    "direction of the force in the world, anti-clockwise from x",
    "rad",
    0.0,
    -2.0 * math.pi,
    2.0 * math.pi,
)


def _along(azimuth: float) -> Vector:
    return np.array([math.cos(azimuth), math.sin(azimuth)])


@register
class Pushed(Fault):
    """A shove or a lean of a person, a cable on the floor: nothing is wrong with the robot."""

    fault_id = "pushed"
    description = "body pushed"
    nature = "disturbance"
    parameters = (
        severity_spec("0: off; share of the force"),
        size_spec("force", "N/kg", 3.0, 20.0, "force over the mass of the robot"),
        AZIMUTH_SPEC,
        setting_spec(
            "lever",
            "of the force about the vertical through base_link, anti-clockwise",
            "m",
            0.0,
            -2.0,
            2.0,
        ),
        setting_spec("rise", "time in which the force grows; 0: at once", "s", 0.0, 0.0, 1e4),
    )

    _begin: float | None = None  # s

    def apply(self, actions: FaultActions) -> bool:
        now, rise = actions.body.time, self.number("rise")
        if self._begin is None:
            self._begin = now
        grown = 1.0 if rise == 0.0 else min(1.0, (now - self._begin) / rise)
        force = grown * self.sized("force") * actions.body.mass
        actions.push[:2] += force * _along(self.number("azimuth"))
        actions.push[2] += force * self.number("lever")
        return True


@register
class LoadTowed(Fault):
    """A cart hangs on the robot: dry drag at a hitch, against its motion."""

    fault_id = "load_towed"
    description = "robot tows a load"
    nature = "unknown"
    parameters = (
        severity_spec("0: off; share of the drag"),
        size_spec("drag", "N", 15.0, 100.0, "force against the motion of the hitch"),
        setting_spec(
            "hitch", "place of the hitch on the x axis of base_link", "m", -0.2, -5.0, 5.0
        ),
    )

    def apply(self, actions: FaultActions) -> bool:
        body = actions.body
        arm = self.number("hitch") * _along(body.yaw)
        velocity = body.velocity + body.yaw_rate * np.array([-arm[1], arm[0]])
        force = -self.sized("drag") * velocity / math.hypot(*velocity, _CREEP)
        actions.push[:2] += force
        actions.push[2] += arm[0] * force[1] - arm[1] * force[0]
        return True


@register
class Tethered(Fault):
    """A cable holds the robot where it was when the fault began: slack first, then a spring."""

    fault_id = "tethered"
    description = "cable holds the robot"
    nature = "unknown"
    parameters = (
        severity_spec("0: off; share of the stiffness"),
        size_spec("stiffness", "N/m", 20.0, 200.0, "force over the length beyond the slack"),
        setting_spec("slack", "length that costs no force", "m", 0.2, 0.0, 1e3),
    )

    _anchor: Vector | None = None  # m

    def apply(self, actions: FaultActions) -> bool:
        if self._anchor is None:
            self._anchor = actions.body.position.copy()
        way = self._anchor - actions.body.position
        length = math.hypot(*way)
        stretched = length - self.number("slack")
        if stretched <= 0.0:
            return False
        actions.push[:2] += self.sized("stiffness") * stretched * way / length
        return True


@register
class Windy(Fault):
    """Wind, or the stream of a fan: a force that grows with the square of the air's speed."""

    fault_id = "windy"
    description = "wind on the body"
    nature = "unknown"
    parameters = (
        severity_spec("0: off; share of the wind's speed"),
        size_spec("speed", "m/s", 10.0, 50.0, "of the wind"),
        AZIMUTH_SPEC,
        setting_spec("drag_area", "drag coefficient times frontal area", "m^2", 0.2, 0.0, 10.0),
    )

    def apply(self, actions: FaultActions) -> bool:
        wind = self.sized("speed") * _along(self.number("azimuth"))
        relative = wind - actions.body.velocity
        half = 0.5 * _AIR_DENSITY * self.number("drag_area")
        actions.push[:2] += half * math.hypot(*relative) * relative
        return True
