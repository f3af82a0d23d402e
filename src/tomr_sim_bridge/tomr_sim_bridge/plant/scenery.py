"""What is only seen, never felt: floor pattern, light, camera and the robot's shell.

Sizes follow the robot's radius R and its wheels' radius r, so that any robot looks like one.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np

from tomr_power_model.robot import Robot
from tomr_sim_bridge.plant.wheels import Vector, wheel_angles

CAMERA = "portrait"
PICTURE_SIZE = (1280, 960)  # pixels

_COLOURS = {
    "shell": "0.86 0.87 0.89 1",
    "plate": "0.16 0.18 0.21 1",
    "accent": "0.95 0.45 0.10 1",
    "metal": "0.62 0.65 0.69 1",
    "rubber": "0.10 0.10 0.11 1",
    "hub": "0.20 0.42 0.68 1",
    "glass": "0.05 0.07 0.10 1",
}


def add_assets(root: ET.Element) -> None:
    """Textures, materials and rendering quality."""
    visual = ET.SubElement(root, "visual")
    width, height = PICTURE_SIZE
    ET.SubElement(visual, "global", offwidth=str(width), offheight=str(height))
    ET.SubElement(
        visual, "quality", shadowsize="4096", offsamples="8", numslices="96", numstacks="32"
    )
    ET.SubElement(
        visual, "headlight", ambient="0.42 0.42 0.44", diffuse="0.16 0.16 0.16", specular="0 0 0"
    )
    ET.SubElement(visual, "map", znear="0.01", zfar="60", shadowscale="0.8")
    asset = ET.SubElement(root, "asset")
    ET.SubElement(
        asset, "texture", name="sky", type="skybox", builtin="gradient", width="256",
        height="1536", rgb1="0.93 0.95 0.98", rgb2="0.62 0.70 0.80",
    )  # fmt: skip
    ET.SubElement(
        asset, "texture", name="floor", type="2d", builtin="checker", width="512", height="512",
        rgb1="0.79 0.81 0.83", rgb2="0.73 0.75 0.78", mark="edge", markrgb="0.66 0.68 0.71",
    )  # fmt: skip
    ET.SubElement(
        asset, "material", name="floor", texture="floor", texrepeat="4 4", texuniform="true",
        reflectance="0", specular="0.1", shininess="0.1",
    )  # fmt: skip
    for name, rgba in _COLOURS.items():
        ET.SubElement(asset, "material", name=name, rgba=rgba, specular="0.35", shininess="0.5")


def add_surroundings(world: ET.Element, robot: Robot) -> None:
    """Two lamps, and a camera in front of the robot, to its left and above."""
    reach = robot.robot_radius + robot.wheel_radius
    ET.SubElement(
        world, "light", pos=_numbers(np.array([2.5, -2.0, 6.0]) * reach), dir="-0.38 0.30 -0.9",
        cutoff="60", exponent="1", diffuse="0.50 0.49 0.46", specular="0.3 0.3 0.3",
        castshadow="true",
    )  # fmt: skip
    ET.SubElement(
        world, "light", directional="true", pos="0 0 3", dir="0.6 -0.5 -0.5",
        diffuse="0.14 0.16 0.20", specular="0 0 0", castshadow="false",
    )  # fmt: skip
    eye = np.array([1.95, 1.3, 1.75]) * reach
    target = np.array([0.0, 0.0, 1.1 * robot.wheel_radius])
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    ET.SubElement(
        world, "camera", name=CAMERA, pos=_numbers(eye), xyaxes=_numbers(right, up), fovy="42"
    )


def add_body(base: ET.Element, robot: Robot) -> None:
    """Chassis plates, shell, motors, a lidar, and an arrow along +x."""
    reach, wheel = robot.robot_radius, robot.wheel_radius
    inner = reach - 0.75 * wheel
    floor, top = 0.55 * wheel, 2.25 * wheel
    _cylinder(base, "plate", inner, floor, floor + 0.12 * wheel)
    up = np.array([0.0, 0.0, wheel])
    for angle in wheel_angles(robot):
        direction = np.array([math.cos(angle), math.sin(angle), 0.0])
        ends = [direction * 0.30 * reach, direction * (reach - 0.45 * wheel)]
        _seen(
        base, type="cylinder", material="metal", size=_numbers([0.40 * wheel]),
            fromto=_numbers(*(end + up for end in ends)),
        )  # fmt: skip
    _cylinder(base, "shell", 0.62 * inner, floor, top)
    deck = reach - 0.45 * wheel
    _cylinder(base, "plate", deck, top, top + 0.14 * wheel)
    _cylinder(base, "accent", 1.012 * deck, top + 0.14 * wheel, top + 0.24 * wheel)
    _cylinder(base, "shell", deck, top + 0.24 * wheel, top + 0.85 * wheel)
    roof = top + 0.85 * wheel
    _cylinder(base, "plate", 0.28 * reach, roof, roof + 0.12 * wheel)
    _cylinder(base, "glass", 0.22 * reach, roof + 0.12 * wheel, roof + 0.75 * wheel)
    _cylinder(base, "plate", 0.24 * reach, roof + 0.75 * wheel, roof + 0.87 * wheel)
    for side in (1.0, -1.0):
        tip = np.array([0.72 * reach, 0.0, roof])
        tail = np.array([0.48 * reach, side * 0.20 * reach, roof])
        _seen(
        base, type="capsule", material="accent", size=_numbers([0.06 * wheel]),
            fromto=_numbers(tip, tail),
        )  # fmt: skip


def add_hub(hub: ET.Element, radius: float) -> None:
    """Two side discs with a cap and bolts; the axle is x."""
    for side in (-1.0, 1.0):
        _disc(hub, "hub", 0.74 * radius, side * 0.13 * radius, 0.03 * radius)
    _disc(hub, "plate", 0.60 * radius, 0.0, 0.15 * radius)
    _disc(hub, "metal", 0.22 * radius, 0.18 * radius, 0.06 * radius)
    for number in range(5):
        turn = 2.0 * math.pi * number / 5
        _seen(
        hub, type="sphere", material="metal", size=_numbers([0.05 * radius]),
            pos=_numbers(
                [0.16 * radius, 0.45 * radius * math.cos(turn), 0.45 * radius * math.sin(turn)]
            ),
        )  # fmt: skip


def add_roller(roller: ET.Element, wheel_radius: float, ring_radius: float) -> None:
    """A barrel, smaller than the ellipsoid that touches the floor: neighbours must not overlap.

    Its frame lies on a ring of `ring_radius` [m], z outward and y along the roller's axis.
    """
    radial = 0.2 * wheel_radius
    _seen(
        roller, type="ellipsoid", material="rubber",
        size=_numbers([radial, 0.285 * wheel_radius, radial]),
        pos=_numbers([0.0, 0.0, wheel_radius - radial - ring_radius]),
    )  # fmt: skip


def _cylinder(base: ET.Element, material: str, radius: float, low: float, high: float) -> None:
    _seen(
        base, type="cylinder", material=material,
        size=_numbers([radius, (high - low) / 2.0]), pos=_numbers([0.0, 0.0, (low + high) / 2.0]),
    )  # fmt: skip


def _disc(hub: ET.Element, material: str, radius: float, place: float, half: float) -> None:
    _seen(
        hub, type="cylinder", material=material, size=_numbers([radius, half]),
        pos=_numbers([place, 0.0, 0.0]), zaxis="1 0 0",
    )  # fmt: skip


def _seen(parent: ET.Element, **attributes: str) -> None:
    """Add a geometry that touches nothing."""
    ET.SubElement(parent, "geom", {"contype": "0", "conaffinity": "0", "group": "1", **attributes})


def _numbers(*rows: Sequence[float] | Vector) -> str:
    return " ".join(repr(float(value)) for row in rows for value in row)
