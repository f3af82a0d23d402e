"""The suggested drive is a mission that the simulator takes."""

from pathlib import Path

import pytest
from attrs import evolve

from tomr_reality_gap.explanation import Rival
from tomr_reality_gap.suggest import suggested
from tomr_sim_bridge.missions import load_mission

from .conftest import finding


@pytest.mark.parametrize(
    "rival",
    ["contact.roller_drag", "parameter.robot.mass", "sensor.power_bias", "friction.viscous"],
)
def test_a_mission_for_every_rival(rival: str, tmp_path: Path) -> None:
    found = evolve(finding(), rivals=(Rival(rival, ("all_wheels",), -1.0, "drive"),))
    path = tmp_path / "next.yaml"
    path.write_text(suggested([found]), encoding="utf-8")
    assert rival in load_mission(path).description


def test_no_rivals_no_drive() -> None:
    assert suggested([evolve(finding(), rivals=())]) == ""
