"""The cases, as data. A new case is one more entry; nothing else knows their names."""

import hashlib
from collections.abc import Iterator, Mapping
from typing import Literal

from attrs import evolve, frozen

from concealed.recipes import RECIPES
from tomr_power_model.effects import EFFECTS

Where = Literal["all_wheels", "one_wheel", "body", "supply"]
ALL: Where = "all_wheels"
ONE: Where = "one_wheel"
BODY: Where = "body"
SUPPLY: Where = "supply"
SIZES = ("large", "medium", "small")
PARAMETER = "parameter."


@frozen
class Concealed:
    """One effect of a case.

    `size` names one of its recipe's sizes or gives it in the recipe's own unit; of a `parameter.*`
    it is the relative error of the value.
    """

    effect: str
    where: Where = ALL
    size: str | float = "large"


@frozen
class Case:
    """What is concealed in which robot on which mission."""

    name: str
    group: str
    effects: tuple[Concealed, ...] = ()
    family: str | None = None  # None: drawn
    style: str = "varied"  # of the missions
    noise: Literal["white", "autocorrelated"] = "white"
    total_only: bool = False
    says_so: bool = True  # whether robot.yaml states that there is no power of single motors
    stiffness: float = 1.0  # times the usual gains of the speed loop
    balanced: bool = False  # the second effect is scaled until the mean power is that of neither
    quick: bool = False  # belongs to the group `small`

    def identity(self, seed: int) -> str:
        """Opaque name of its folder: six hexadecimal digits."""
        return hashlib.sha256(f"{seed}:{self.name}".encode()).hexdigest()[:6]

    @property
    def letters(self) -> str:
        """Kind in the letters of the practice set, h: at one wheel."""
        at_one = any(item.where == ONE for item in self.effects)
        return _LETTERS[self.group] + ("h" if at_one else "")


# Groups, with the letter of the practice set nearest to each.
_LETTERS: Mapping[str, str] = {
    "sizes": "a",
    "parameter": "a",
    "hidden_state": "b",
    "closed_loop": "c",
    "two": "d",
    "frictionless": "d",
    "cancelling": "l",
    "masked": "e",
    "seldom": "f",
    "total_only": "g",
    "unknown": "i",
    "null_white": "j",
    "null_autocorrelated": "j",
    "sensor": "k",
}
GROUPS = tuple(_LETTERS)
SMALL = "small"
_LIVELY = ("electrical.winding_heating", "electrical.regeneration_loss")


def _sizes() -> Iterator[Case]:
    """Every effect of the vocabulary at three sizes; those of wheels by turns on all and on one."""
    turn = 0
    for effect in RECIPES:
        place = EFFECTS[effect].place
        turn += place == "wheel"
        for number, size in enumerate(SIZES):
            on_wheels: Where = ALL if (turn + number) % 2 else ONE
            places: Mapping[str, Where] = {"wheel": on_wheels, "body": BODY, "supply": SUPPLY}
            case = Case(f"{effect} {size}", "sizes", (Concealed(effect, places[place], size),))
            if effect in _LIVELY:
                case = evolve(case, family="heavy", style="lively")
            yield case


_C, _P = Concealed, PARAMETER
_COULOMB = f"{_P}physics.friction.coulomb.torque"
_VISCOUS = f"{_P}physics.friction.viscous.coefficient"
_STANDBY = f"{_P}physics.electrical.driver_standby.power"
_MASS = f"{_P}robot.mass"
_RESISTANCE = f"{_P}motor.resistance"
_HEATING = "electrical.winding_heating"
_DRAG = "contact.roller_drag"
_LOAD = "friction.load_dependent"
_BIAS = "sensor.power_bias"
_AUXILIARY = f"{_P}supply.auxiliary_power"
_CONSTANT = f"{_P}motor.torque_constant"

_PLAIN: Mapping[str, Mapping[str, tuple[Concealed, ...]]] = {
    "parameter": {
        "mass wrong": (_C(_MASS, BODY, 0.3),),
        "one resistance wrong": (_C(_RESISTANCE, ONE, 0.3),),
        "torque constants wrong": (_C(_CONSTANT, ALL, -0.1),),
        "auxiliary power wrong": (_C(_AUXILIARY, SUPPLY, 0.2),),
        "one Coulomb torque wrong": (_C(_COULOMB, ONE, 0.6),),
    },
    "two": {
        "roller drag and switching": (_C(_DRAG), _C("electrical.switching_loss")),
        "stribeck and load": (_C("friction.stribeck"), _C(_LOAD)),
        "slope and asymmetry": (_C("body.slope", BODY, 0.02), _C("friction.asymmetric", ONE)),
        "payload and one viscous": (_C("body.payload_mass", BODY), _C("friction.viscous", ONE)),
        "at two places": (_C("friction.coulomb", ONE), _C("drivetrain.torque_ripple", ONE)),
        "mass and lag": (_C(_MASS, BODY, -0.25), _C("sensor.power_lag", ALL, "medium")),
    },
    "masked": {
        "roller drag, Coulomb too low": (_C(_DRAG), _C(_COULOMB, ALL, -0.4)),
        "quadratic, viscous too low": (_C("friction.quadratic"), _C(_VISCOUS, ALL, -0.5)),
        "one bias, standby too low": (_C(_BIAS, ONE, 0.2), _C(_STANDBY, ALL, -0.15)),
        "payload, resistance too low": (_C("body.payload_mass", BODY), _C(_RESISTANCE, ALL, -0.2)),
    },
    "unknown": {
        "two harmonics": (_C("x.two_harmonics", ONE),),
        "chipped tooth": (_C("x.chipped_tooth", ONE),),
        "running in": (_C("x.running_in"),),
        "striped floor": (_C("x.striped_floor"),),
        "cubic": (_C("x.cubic"),),
        "intermittent": (_C("x.intermittent", ONE),),
        "sticky start": (_C("x.sticky_start"),),
        "overload": (_C("x.overload"),),
        "tether": (_C("x.tether", BODY),),
        "wind": (_C("x.wind", BODY),),
        "gust": (_C("x.gust", BODY),),
        "sticky place": (_C("x.sticky_place"),),
        "consumer": (_C("x.consumer", SUPPLY),),
        "fast driver": (_C("x.fast_driver", ONE),),
        "after stand": (_C("x.after_stand"),),
    },
    "sensor": {
        "scale imitates a motor": (_C("sensor.power_scale", ALL, 0.1),),
        "bias imitates standby": (_C(_BIAS, ALL, 0.2),),
        "late clock at one wheel": (_C("sensor.clock_offset", ONE, "medium"),),
        "slow sensor at one wheel": (_C("sensor.power_lag", ONE, "medium"),),
    },
}
# Cases that ask for a certain robot, mission or measurement.
_PARTICULAR = (
    Case("all windings hot", "hidden_state", (_C(_HEATING, ALL, 2.0),), "heavy", "lively"),
    Case("one winding hot", "hidden_state", (_C(_HEATING, ONE, 3.0),), "light", "lively"),
    Case("stiff, one resistance", "closed_loop", (_C(_RESISTANCE, ONE, 0.35),), stiffness=3.0),
    Case("stiff, one load dependent", "closed_loop", (_C(_LOAD, ONE),), stiffness=3.0),
    Case(
        "stiff, one Coulomb",
        "closed_loop",
        (_C("friction.coulomb", ONE, "medium"),),
        stiffness=3.0,
    ),
    Case(
        "viscous against Coulomb",
        "cancelling",
        (_C("friction.viscous", ALL, "medium"), _C(_COULOMB, ALL, -0.1)),
        balanced=True,
    ),
    Case(
        "switching against standby",
        "cancelling",
        (_C("electrical.switching_loss"), _C(_STANDBY, ALL, -0.1)),
        balanced=True,
    ),
    Case(
        "roller drag against viscous",
        "cancelling",
        (_C(_DRAG), _C(_VISCOUS, ALL, -0.1)),
        balanced=True,
    ),
    Case("one burst of speed", "seldom", (_C("friction.quadratic"),), "light", "one_burst"),
    Case("few starts", "seldom", (_C("body.payload_mass", BODY),), "light", "few_starts"),
    Case("few stops", "seldom", (_C("electrical.regeneration_loss"),), "heavy", "few_starts"),
    Case("total, load dependent", "total_only", (_C(_LOAD),), total_only=True, says_so=False),
    Case("total, one viscous", "total_only", (_C("friction.viscous", ONE),), total_only=True),
    Case("total, payload", "total_only", (_C("body.payload_mass", BODY),), total_only=True),
    Case("total, roller drag", "total_only", (_C(_DRAG),), total_only=True),
)
_NULLS = 5  # of each noise
# A description without any friction, which many are.
_FRICTION = (_C("friction.coulomb"), _C("friction.viscous", ALL, "medium"))
_FRICTIONLESS = 20


def _all_cases() -> Iterator[Case]:
    yield from _sizes()
    for group, named in _PLAIN.items():
        for name, effects in named.items():
            yield Case(name, group, effects)
    yield from _PARTICULAR
    for number in range(1, _FRICTIONLESS + 1):
        yield Case(f"no friction {number}", "frictionless", _FRICTION)
    for number in range(1, _NULLS + 1):
        yield Case(f"null, white {number}", "null_white")
        yield Case(f"null, autocorrelated {number}", "null_autocorrelated", noise="autocorrelated")


_QUICK = {
    "friction.viscous large",
    "friction.stribeck medium",
    "electrical.switching_loss medium",
    "kinematic.wheel_radius large",
    "mass wrong",
    "one winding hot",
    "roller drag, Coulomb too low",
    "slope and asymmetry",
    "total, load dependent",
    "two harmonics",
    "slow sensor at one wheel",
    "null, autocorrelated 1",
}


def catalogue() -> tuple[Case, ...]:
    """All cases in the order in which they are made: the small group, then all groups mixed."""
    cases = [evolve(case, quick=case.name in _QUICK) for case in _all_cases()]
    return tuple(sorted(cases, key=lambda case: (not case.quick, case.identity(0))))
