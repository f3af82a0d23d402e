"""A picture of the simulated robot (PNG), rendered by MuJoCo without a screen."""

import os
import subprocess
import sys
from io import BytesIO
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

from tomr_power_model.errors import InputError
from tomr_power_model.files import write_bytes
from tomr_power_model.robot import Robot, load_robot
from tomr_sim_bridge.plant import scenery
from tomr_sim_bridge.plant.design import PlantDesign
from tomr_sim_bridge.plant.effects import make_effects
from tomr_sim_bridge.plant.engine import Engine

BACKENDS = ("egl", "osmesa", "glfw")
_TIMEOUT = 120.0  # s


def save_picture(robot: str, path: Path) -> None:
    """Render a robot, given by its shipped name or file, into a PNG file.

    MuJoCo binds itself to one GL library when it is imported, and a missing one may end the
    process: so each is tried in a process of its own.

    Raises:
        InputError: no GL library works here, or the file cannot be written.
    """
    load_robot(robot)
    if path.suffix.lower() != ".png":
        raise InputError(f"{path}: the picture is a PNG: name it so, e.g. robot.png")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}: create it first")
    chosen = os.environ.get("MUJOCO_GL")
    for backend in (chosen,) if chosen else BACKENDS:
        command = [sys.executable, "-m", __name__, robot, str(path)]
        environment = {**os.environ, "MUJOCO_GL": backend}
        try:
            result = subprocess.run(
                command, env=environment, capture_output=True, timeout=_TIMEOUT, check=False
            )
        except subprocess.TimeoutExpired:
            continue
        if result.returncode == 0:
            return
    raise InputError(
        f"{path}: no picture: none of {', '.join((chosen,) if chosen else BACKENDS)} can render "
        "here: install libegl1 or libosmesa6, or set MUJOCO_GL"
    )


def render(robot: Robot) -> NDArray[np.uint8]:
    """Render a robot standing on its floor, shape (height, width, 3)."""
    design = PlantDesign.of(robot)
    for effect in make_effects(robot):
        effect.shape(design)
    engine = Engine(robot, design, 0.001, np.zeros(3))
    width, height = scenery.PICTURE_SIZE
    with mujoco.Renderer(engine.model, height, width) as renderer:
        renderer.update_scene(engine.data, camera=scenery.CAMERA)
        return np.asarray(renderer.render(), dtype=np.uint8)


def main(arguments: list[str]) -> int:
    """Write the picture of robot `arguments[0]` to the file `arguments[1]`."""
    robot, path = arguments
    picture = BytesIO()
    imsave(picture, render(load_robot(robot)), format="png")
    write_bytes(Path(path), picture.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
