"""What the picture of a drive shows."""

import numpy as np
from odometry_drives import drive, play

from tomr_odometry.grip import Grid
from tomr_odometry.picture import draw_plane
from tomr_odometry.reference import Path2D
from tomr_odometry.summary import estimated_path
from tomr_power_model.canvas import sheet


def test_the_whole_of_each_path_is_seen_whatever_was_learnt_of_the_floor() -> None:
    items = list(play(drive(length=2.0)))[::20]
    ours = estimated_path(items)
    far = np.linspace([0.0, 0.0, 0.0], [9.0, -2.0, 0.0], len(items))
    floor = Grid((0.0, 0.0), np.zeros((2, 3), dtype=np.int8))
    with sheet(1, 1, 4.0) as (page, (plane,)):
        draw_plane(plane, items, Path2D(ours.stamps, far), None, floor)
        page.canvas.draw()
        (left, right), (bottom, top) = plane.get_xlim(), plane.get_ylim()
    assert left < ours.pose[:, 0].min()
    assert bottom < -2.0
    assert right > 9.0
    assert top > ours.pose[:, 1].max()
    # Not the ellipses, which are as wide as doubt makes them.
    assert right - left < 30.0
    assert abs((right - left) - (top - bottom)) < 1e-9  # a metre is a metre, and none is added
