"""An explanation made by hand: wheel 2 has a Stribeck friction that the description leaves out."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve

from tomr_reality_gap.alignment.channels import Channel
from tomr_reality_gap.explanation import (
    Comparison,
    Estimate,
    Explanation,
    Finding,
    Located,
    Map,
    Rival,
    Score,
)

SECONDS, RATE = 60.0, 50.0
SHOWS = (30.0, 36.0)  # s, where wheel 2 draws more than simulated
EXTRA, NOISE = 1.2, 0.15  # W
WHEELS = ("wheel_1", "wheel_2", "wheel_3")


def comparison(name: str, held_out: bool, seed: int) -> Comparison:
    """One drive; before and after differ only in wheel 2, only from 30 s to 36 s."""
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    speed = np.stack([4.0 * np.sin(0.4 * time + phase) for phase in (0.0, 2.1, 4.2)], axis=1)
    shows = (time >= SHOWS[0]) & (time < SHOWS[1])
    channels, before = [], []
    for wheel, topic in enumerate(WHEELS):
        modelled = 1.5 + 0.1 * speed[:, wheel] ** 2
        extra = EXTRA * shows if wheel == 1 else np.zeros_like(time)
        value = modelled + extra + NOISE * chance.standard_normal(len(time))
        span = np.full(len(time), 0.005)
        channels.append(Channel(f"{topic}/power", "power", wheel, "W", time, span, value))
        before.append(modelled)
    after = [item + EXTRA * shows * (wheel == 1) for wheel, item in enumerate(before)]
    sigma = (NOISE,) * len(channels)
    return Comparison(
        name, held_out, tuple(channels), tuple(before), tuple(after), sigma, speed, time
    )


def finding() -> Finding:
    return Finding(
        effect="friction.stribeck",
        where=("wheel_2_joint",),
        parameters={
            "torque": Estimate(0.0410123, 0.0371, 0.0449, "N m"),
            "speed": Estimate(0.8, 0.55, 1.35, "rad/s"),
        },
        located=Located(0.83, "|omega| < 2 rad/s", (SHOWS,), {"wheel_2/power": 1.0}),
        rivals=(Rival("friction.coulomb", ("wheel_2_joint",), -1.7, "drive slowly for 30 s"),),
        confidence=0.972,
        evidence=321.4,
    )


@pytest.fixture
def mismatch() -> Explanation:
    """One finding, with a rival and a drive that would separate them."""
    edges = np.linspace(-4.0, 4.0, 9)
    level = np.ones((3, 8))
    worse = level.copy()
    worse[1, 3:5] = 9.0
    worse[0, 0] = np.nan
    return Explanation(
        verdict="mismatch",
        sentence="Wheel 2 has a Stribeck friction of 0.041 N m that the description leaves out.",
        findings=(finding(),),
        unexplained_share=0.06,
        comparisons=(comparison("drive", False, 1), comparison("other", True, 2)),
        maps=(
            Map("time [s]", np.linspace(0.0, SECONDS, 9), tuple(WHEELS), level, level),
            Map("wheel speed [rad/s]", edges, tuple(WHEELS), worse, level),
        ),
        alignment={"wheel_2/power": "2.1 ms after the encoders"},
        detection_limits=(("friction.viscous", "wheel_1_joint", "0.0004 N m s/rad"),),
        whiteness={"wheel_2/power": (0.81, 0.02)},
        score=Score(0.21, 0.04, 0.88, 0.96),
        explained="/**:\n  ros__parameters: {}\n",
        suggested="name: slow\nphases: []\n",
        notes=("the gyro has 3 gaps & <odd> stamps",),
        recordings=(Path("tour1"),),
    )


@pytest.fixture
def match(mismatch: Explanation) -> Explanation:
    """Nothing found, nothing held out."""
    only = mismatch.comparisons[0]
    value = [evolve(item, value=item.value) for item in only.channels]
    return evolve(
        mismatch,
        verdict="match",
        sentence="Simulation and recording agree within noise and tolerances.",
        findings=(),
        unexplained_share=0.0,
        comparisons=(evolve(only, channels=tuple(value), before=only.after),),
        score=None,
        explained="",
        suggested="",
        notes=(),
    )


@pytest.fixture
def with_rest(mismatch: Explanation) -> Callable[..., Explanation]:
    """The mismatch with a changed finding."""
    return lambda **changes: evolve(mismatch, findings=(evolve(finding(), **changes),))
