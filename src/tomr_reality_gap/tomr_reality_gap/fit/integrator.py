"""Which way the drivers sum their error, asked again once what was left out is named.

As described, a robot that carries more or drags more answers as if its drivers summed the other
way: that counts as much as a few percent of the proportional gain.
"""

from types import MappingProxyType

from attrs import evolve

from tomr_power_model.estimation.parameter import ParameterisedRobot
from tomr_reality_gap.alignment.simulation import Tick
from tomr_reality_gap.fit.backward_elimination import Price
from tomr_reality_gap.fit.dataset import Dataset
from tomr_reality_gap.fit.forward_selection import Selection
from tomr_reality_gap.fit.refine import refine

INTEGRATOR = "controller.integrator"
WAYS = ("forward", "backward")
_LIKELIER = 3.0  # log evidence: twenty times
_GAINS = ("parameter.controller.proportional", "parameter.controller.integral")


def summed_otherwise(base: ParameterisedRobot) -> ParameterisedRobot:
    """The same robot with drivers that sum their error the other way."""
    (other,) = (way for way in WAYS if way != base.robot.controller.integrator)
    return evolve(base, values=MappingProxyType({**base.values, INTEGRATOR: other}))


def sums_otherwise(dataset: Dataset, found: Selection, tick: Tick = lambda done: None) -> bool:
    """Whether the recordings are likelier the other way, with all that was found but the gains of
    the loop, which may only make up for it. Either way is as likely beforehand.
    """
    best = found.best
    model = evolve(best.model, base=summed_otherwise(best.model.base))
    states = [(model.kept([item.effect not in _GAINS for item in model.hypotheses]), best.sensors)]
    (other,) = refine(dataset, states, found.rounds[-1].jacobian, found.noise, tick=tick)
    price = Price.of(dataset, found, best)
    return price.worth(other) > price.worth(best) + _LIKELIER
