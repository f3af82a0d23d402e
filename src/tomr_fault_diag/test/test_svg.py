"""Paths of the time line: broken where nothing is known, thinned without losing a peak."""

import numpy as np
import pytest

from tomr_fault_diag.diagnosis.svg import HEIGHT, Panel, area, line, reach, scaled, thinned

NAN = float("nan")


def test_a_line_is_broken_where_values_are_unknown() -> None:
    ms = np.array([0.0, 50.0, 100.0, 150.0])
    assert line(ms, np.array([1.0, 2.0, NAN, 4.0])) == "M0 1.0L50 2.0M150 4.0"
    assert line(ms, np.full(4, NAN)) == ""


def test_an_area_goes_there_and_back_for_each_known_piece() -> None:
    ms = np.array([0.0, 50.0, 100.0, 150.0])
    top, bottom = np.array([1.0, 2.0, NAN, 4.0]), np.array([5.0, 6.0, 7.0, 8.0])
    assert area(ms, top, bottom) == "M0 1.0L50 2.0L50 6.0L0 5.0ZM150 4.0L150 8.0Z"


def test_thinning_keeps_every_peak() -> None:
    values = np.zeros(50_000)
    values[31_234], values[40_001] = 7.0, -3.0
    ms, kept = thinned(np.arange(50_000.0), values)
    assert len(ms) <= 4100
    assert kept.max() == 7.0
    assert kept.min() == -3.0
    assert ms[kept.argmax()] == 31_234.0


def test_values_beyond_a_panel_are_drawn_at_its_edge() -> None:
    assert scaled(np.array([-9.0, 0.0, 9.0]), -1.0, 1.0) == pytest.approx([HEIGHT, HEIGHT / 2, 0.0])
    panel = Panel("", -1.0, 3.0, "W", ())
    assert panel.zero == pytest.approx(0.75 * HEIGHT)
    assert Panel("", 1.0, 3.0, "W", ()).zero is None


def test_a_few_outliers_do_not_stretch_a_panel() -> None:
    values = np.append(np.ones(1000), [500.0, NAN])
    assert reach(values, 0.1) == pytest.approx(1.1)
    assert reach(np.array([NAN]), 0.1) == 0.1
