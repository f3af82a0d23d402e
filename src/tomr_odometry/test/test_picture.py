"""What the picture of a drive shows."""

import numpy as np

from tomr_odometry.grip import Grid
from tomr_odometry.picture import _draw_floor, _show_paths
from tomr_power_model.canvas import sheet


def test_the_whole_of_each_path_is_seen_whatever_was_learnt_of_the_floor() -> None:
    path = np.array([[0.0, 0.0], [9.0, -2.0], [1.0, 3.0]])
    with sheet(1, 1, 4.0) as (page, axes):
        (plane,) = np.ravel(axes)
        plane.plot(*path.T)
        _draw_floor(plane, Grid((0.0, 0.0), np.zeros((2, 3), dtype=np.int8)))
        _show_paths(plane, [path, path + 1.0])
        page.canvas.draw()
        (left, right), (bottom, top) = plane.get_xlim(), plane.get_ylim()
    assert left < 0.0
    assert right > 10.0
    assert bottom < -2.0
    assert top > 4.0
