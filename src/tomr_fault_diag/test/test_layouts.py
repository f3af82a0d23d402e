"""Configurations for other tools name topics and statuses that there are."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import yaml

from tomr_fault_diag.classifier.messages import NAME
from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.residuals.frame import residual_names
from tomr_fault_diag.residuals.messages import TOPIC as RESIDUALS
from tomr_power_model.robot import shipped_robot
from tomr_power_model.robot.parameters import NAMELESS
from tomr_power_model.topics.predictions import prediction_topics

CONFIG = Path(__file__).parents[1] / "config"
ROBOT = shipped_robot("reference")
TOPICS = {
    "/joint_states",
    "/diagnostics",
    f"/{RESIDUALS}",
    *(f"/{wheel}/power" for wheel in ROBOT.wheel_topics),
    *(f"/{topic}" for topic in prediction_topics(ROBOT)),
}


def test_foxglove_layout_shows_what_there_is() -> None:
    layout = json.loads((CONFIG / "foxglove.json").read_text())
    panels = layout["configById"]
    text = json.dumps(panels)
    used = set(re.findall(r'"(/[\w/]+?)(?:[.\[][^"]*)?"', text))
    assert used <= TOPICS
    assert len(used) > 8
    shown = re.findall(r'"(\w+![\w]+)"', json.dumps(layout["layout"]))
    assert sorted(shown) == sorted(panels)
    assert panels["DiagnosticStatusPanel!drive"]["selectedName"] == NAME


def test_plotjuggler_layout_shows_what_there_is() -> None:
    root = ElementTree.parse(CONFIG / "plotjuggler.xml").getroot()
    curves = [str(curve.get("name")) for curve in root.iter("curve")]
    assert len(curves) == 38
    statuses = {f"/{RESIDUALS}/{NAMELESS}/{name}" for name in residual_names(ROBOT.wheel_topics)}
    states = {f"/diagnostics/{NAMELESS}/{NAME}/p {state.name}" for state in STATES}
    shown = {f"{status}/{key}" for status in statuses for key in ("residual", "band", "modelled")}
    for curve in curves:
        joint = re.fullmatch(r"(.*)/(wheel_\d_joint)/velocity", curve)
        topic = joint[1] if joint else curve.removesuffix("/current")
        assert topic in TOPICS or curve in shown | states
        assert joint is None or joint[2] in ROBOT.wheel_names


def test_aggregator_takes_the_statuses_of_every_robot() -> None:
    document = yaml.safe_load((CONFIG / "aggregator.yaml").read_text())
    analyzers = document["/**"]["ros__parameters"]["analyzers"].values()
    names = (
        NAME,
        f"/robot_2/{NAME}",
        "inputs: joint_states",
        "/robot_2/inputs: cmd_vel",
        "slip_odometry",
    )
    for name in names:
        taking = [a for a in analyzers if any(part in name for part in a["contains"])]
        assert len(taking) == 1, name


def test_aggregator_of_several_robots_takes_the_statuses_of_each() -> None:
    document = yaml.safe_load((CONFIG / "aggregator_fleet.yaml").read_text())
    groups = document["/**"]["ros__parameters"]["analyzers"]
    for robot, group in groups.items():
        starts = [
            start
            for analyzer in group["analyzers"].values()
            for key in ("startswith", "find_and_remove_prefix")
            for start in analyzer.get(key, [])
        ]
        for name in (NAME, "inputs: joint_states", "slip_odometry"):
            assert sum(f"/{robot}/{name}".startswith(start) for start in starts) == 1, name
            assert not any(f"/another/{name}".startswith(start) for start in starts)
