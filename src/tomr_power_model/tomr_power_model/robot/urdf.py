"""The robot as URDF, for tools that show or plan with it: body, wheels, masses."""

import math
from xml.etree import ElementTree

from tomr_power_model.robot.description import Robot

_BODY_COLOUR, _WHEEL_COLOUR = "0.35 0.45 0.55 1", "0.15 0.15 0.15 1"


def urdf_of(robot: Robot, name: str = "robot") -> str:
    """URDF of a robot: `base_link` on the floor below its centre, x forwards, and a continuous
    joint for each wheel under the name that joint_states has, which turns as the wheel does."""
    root = ElementTree.Element("robot", name=name)
    radius, width = robot.wheel_radius, 0.5 * robot.wheel_radius
    body_radius = max(robot.robot_radius - width, 0.5 * robot.robot_radius)
    height = max(2.0 * robot.mass_center[2] - radius, radius)
    wheels = len(robot.wheel_names)
    # Its wheels are part of the robot's mass, which the description does not divide: as discs.
    wheel_mass = min(2.0 * robot.wheel_inertia / radius**2, 0.5 * robot.mass / wheels)
    x, y, z = robot.mass_center
    body = _link(root, "base_link", _BODY_COLOUR, _cylinder(body_radius, height))
    _place(body.find("visual"), (0.0, 0.0, 0.5 * radius + 0.5 * height))
    about_z = max(robot.inertia_z - wheels * wheel_mass * robot.robot_radius**2, 1e-6)
    across = (robot.mass - wheels * wheel_mass) * (body_radius**2 / 4.0 + height**2 / 12.0)
    inertias = (max(across, 0.5 * about_z), max(across, 0.5 * about_z), about_z)
    _inertial(body, robot.mass - wheels * wheel_mass, (x, y, z), inertias)
    for index, joint in enumerate(robot.wheel_names):
        angle = robot.wheel_offset + 2.0 * math.pi * index / wheels
        link = joint.removesuffix("_joint") + "_link"
        wheel = _link(root, link, _WHEEL_COLOUR, _cylinder(radius, width))
        _place(wheel.find("visual"), (0.0, 0.0, 0.0), (0.0, 0.5 * math.pi, 0.0))
        about = max(robot.wheel_inertia, 1e-9)
        _inertial(wheel, max(wheel_mass, 1e-6), (0.0,) * 3, (about, 0.6 * about, 0.6 * about))
        element = ElementTree.SubElement(root, "joint", name=joint, type="continuous")
        ElementTree.SubElement(element, "parent", link="base_link")
        ElementTree.SubElement(element, "child", link=link)
        ElementTree.SubElement(element, "axis", xyz="1 0 0")  # outwards
        at = (robot.robot_radius * math.cos(angle), robot.robot_radius * math.sin(angle), radius)
        _place(element, at, (0.0, 0.0, angle))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _cylinder(radius: float, length: float) -> ElementTree.Element:
    return ElementTree.Element("cylinder", radius=f"{radius:g}", length=f"{length:g}")


def _link(
    root: ElementTree.Element, name: str, colour: str, shape: ElementTree.Element
) -> ElementTree.Element:
    link = ElementTree.SubElement(root, "link", name=name)
    visual = ElementTree.SubElement(link, "visual")
    ElementTree.SubElement(visual, "geometry").append(shape)
    material = ElementTree.SubElement(visual, "material", name=f"{name}_colour")
    ElementTree.SubElement(material, "color", rgba=colour)
    return link


def _place(
    element: ElementTree.Element | None,
    xyz: tuple[float, ...],
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> None:
    assert element is not None
    texts = {"xyz": xyz, "rpy": rpy}
    place = {key: " ".join(f"{value:.9g}" for value in values) for key, values in texts.items()}
    element.insert(0, ElementTree.Element("origin", place))


def _inertial(
    link: ElementTree.Element,
    mass: float,
    centre: tuple[float, ...],
    inertias: tuple[float, float, float],
) -> None:
    inertial = ElementTree.SubElement(link, "inertial")
    _place(inertial, centre)
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.9g}")
    names = ("ixx", "iyy", "izz")
    values = {key: f"{value:.9g}" for key, value in zip(names, inertias, strict=True)}
    ElementTree.SubElement(inertial, "inertia", {**values, "ixy": "0", "ixz": "0", "iyz": "0"})
