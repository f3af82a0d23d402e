"""The suggested drive is a mission that the simulator takes."""

from pathlib import Path

import pytest
import yaml
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


def _phases(*effects: str) -> list[dict[str, object]]:
    """What is driven to distinguish the first from the others."""
    first, *others = effects
    rivals = tuple(Rival(other, ("all_wheels",), -1.0, "drive") for other in others)
    mission = yaml.safe_load(suggested([evolve(finding(), effect=first, rivals=rivals)]))
    return list(mission["phases"])


def test_the_drive_holds_what_shows_each_of_them() -> None:
    """Rollers drag by the heading, a driver draws its standby at rest, a mass when it speeds up."""
    drag = _phases("contact.roller_drag", "electrical.driver_standby")
    headings = {move["heading_deg"] for phase in drag if (move := phase.get("move"))}
    assert len(headings) >= 12
    assert max(phase.get("pause", 0.0) for phase in drag) >= 10.0
    mass = _phases("body.payload_mass", "parameter.robot.mass")
    starts = [phase for phase in mass if "move" in phase]
    assert len(starts) >= 6
    assert max(phase.get("pause", 0.0) for phase in mass) < 10.0


def test_only_what_has_rivals_is_separated() -> None:
    alone = evolve(finding(), effect="friction.stribeck", rivals=())
    rival = Rival("sensor.power_bias", ("all_wheels",), -1.0, "drive")
    text = suggested([alone, evolve(finding(), effect="friction.viscous", rivals=(rival,))])
    said = yaml.safe_load(text)["description"]
    assert said == "Distinguishes friction.viscous from sensor.power_bias."
