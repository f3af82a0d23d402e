"""The URDF of a robot, against its description."""

import math
from xml.etree import ElementTree

import pytest
from attrs import evolve

from tomr_power_model.robot import shipped_robot, shipped_robots
from tomr_power_model.robot.urdf import urdf_of


def numbers(text: str | None) -> list[float]:
    return [float(part) for part in str(text).split()]


def test_wheels_stand_and_turn_as_the_geometry_says() -> None:
    root = ElementTree.fromstring(urdf_of(shipped_robot("reference")))
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    assert list(joints) == ["wheel_1_joint", "wheel_2_joint", "wheel_3_joint"]
    origin = joints["wheel_2_joint"].find("origin")
    # 120 degrees: 0.2 cos 120, 0.2 sin 120; hub at the wheel's radius
    assert numbers(origin.get("xyz")) == pytest.approx([-0.1, 0.1732051, 0.05])
    assert numbers(origin.get("rpy")) == pytest.approx([0.0, 0.0, 2.0943951])
    # Outwards: a wheel at +x that turns so drives towards -y, r omega = -v_y.
    assert joints["wheel_2_joint"].find("axis").get("xyz") == "1 0 0"
    assert joints["wheel_2_joint"].get("type") == "continuous"


def test_wheels_turn_with_their_offset() -> None:
    robot = evolve(shipped_robot("reference"), wheel_offset=math.pi / 6)
    joint = ElementTree.fromstring(urdf_of(robot)).find("joint/origin")
    assert numbers(joint.get("xyz")) == pytest.approx([0.1732051, 0.1, 0.05])
    assert numbers(joint.get("rpy")) == pytest.approx([0.0, 0.0, math.pi / 6])


@pytest.mark.parametrize("name", shipped_robots())
def test_masses_add_up_and_inertias_are_physical(name: str) -> None:
    robot = shipped_robot(name)
    inertials = ElementTree.fromstring(urdf_of(robot)).findall("link/inertial")
    masses = [float(inertial.find("mass").get("value")) for inertial in inertials]
    assert sum(masses) == pytest.approx(robot.mass, rel=1e-6)
    for inertial in inertials:
        given = inertial.find("inertia")
        x, y, z = sorted(float(given.get(key)) for key in ("ixx", "iyy", "izz"))
        assert x > 0.0
        assert z <= x + y + 1e-12  # of any body


def test_the_name_of_a_joint_may_be_anything() -> None:
    text = urdf_of(shipped_robot("reference"), name='a "<robot>" & co')
    assert ElementTree.fromstring(text).get("name") == 'a "<robot>" & co'
    assert text.count("<link") == 4
