"""Lines that run on each other and contours that cross, in drawings with a known answer."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.flatten import loops
from devcad.flatten.loops import Loop
from devcad.flatten.tangle import Segments, crossings, depths, polygon, shared_runs
from devcad.geometry.taylor import Array

NEAR, SHORTEST = 1e-3, 0.01


def segments(*paths: loops.Path) -> Segments:
    owner = np.repeat(np.arange(len(paths)), [len(p.bulges) for p in paths])
    return Segments(
        np.concatenate([p.points[:-1] for p in paths]),
        np.concatenate([p.points[1:] for p in paths]),
        np.concatenate([p.bulges for p in paths]),
        owner,
        owner,
    )


def line(*points: tuple[float, float]) -> loops.Path:
    return loops.Path(np.array(points, dtype=float), np.zeros(len(points) - 1), False, 0.0)


def arc(radius: float, start: float, sweep: float) -> loops.Path:
    return loops.arc_path(np.array([3.0, 4.0]), radius, start, sweep)


def found(*paths: loops.Path) -> list[tuple[int, int, bool]]:
    return [(r.one, r.other, r.whole) for r in shared_runs(segments(*paths), NEAR, SHORTEST)]


def test_a_line_drawn_twice_either_way_is_one_whole_run():
    assert found(line((0, 0), (10, 5)), line((10, 5), (0, 0))) == [(0, 1, True)]


def test_lines_that_overlap_in_part_run_on_each_other():
    assert found(line((0, 0), (10, 0)), line((6, 0), (20, 0))) == [(0, 1, False)]


@pytest.mark.parametrize("away", [0.0, 5e-4, 2e-3])
def test_a_parallel_is_a_run_only_within_the_limit(away):
    assert bool(found(line((0, 0), (10, 0)), line((1, away), (9, away)))) == (away <= NEAR)


def test_neighbours_crossings_and_touches_are_no_runs():
    corner = line((0, 0), (10, 0), (10, 10), (0, 10), (0, 0))
    assert found(corner) == []
    assert found(line((0, 0), (10, 0)), line((10, 0), (20, 0))) == []  # end to end
    assert found(line((0, 0), (10, 0)), line((5, -5), (5, 5))) == []
    assert found(line((0, 0), (10, 0)), line((5, 0), (5, 5))) == []


def test_arcs_of_one_circle_run_on_each_other_where_they_overlap():
    assert found(arc(20.0, 0.0, 2.0), arc(20.0, 1.5, 1.0)) == [(0, 1, False)]
    assert found(arc(20.0, 0.0, 2.0), arc(20.0, 2.0, 1.0)) == []
    assert found(arc(20.0, 0.0, 2.0), arc(20.01, 0.0, 2.0)) == []
    assert found(arc(20.0, 0.0, 2 * np.pi), arc(20.0, 1.0, 2 * np.pi)) == [(0, 1, True)]


def test_a_contour_that_runs_back_on_itself_is_found():
    there = line((0, 0), (10, 0), (10, 10), (15, 15), (10, 10), (0, 10), (0, 0))
    assert found(there) == [(0, 0, False)]


def test_the_sides_of_a_tip_without_an_angle_are_no_runs():
    """y = +-x^2 / 200 from x = 0: nearer than a thousandth over 0.4 mm, and that is the shape."""
    x = np.linspace(0.0, 20.0, 400)
    upper, lower = np.stack([x, x**2 / 200.0], axis=1), np.stack([x, -(x**2) / 200.0], axis=1)
    points = np.concatenate([upper[::-1], lower[1:]])
    assert found(loops.Path(points, np.zeros(len(points) - 1), False, 0.0)) == []


def test_many_lines_are_looked_at_in_parts():
    """Two thousand parallel lines, all above one another: two million pairs of boxes."""
    rows = [line((0, 0.5 * k), (100, 0.5 * k)) for k in range(2000)]
    assert found(*rows, line((20, 500), (30, 500))) == [(1000, 2000, True)]


# --- crossings -------------------------------------------------------------------------------


def square(x: float, y: float, side: float) -> Array:
    return np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]])


def test_crossing_squares_are_found_with_a_place_in_what_they_share():
    ((i, j, place),) = crossings([square(0, 0, 10), square(8, 8, 10), square(20, 20, 3)], NEAR)
    assert (i, j) == (0, 1)
    assert min(place) >= 8.0
    assert max(place) <= 10.0


def test_an_eight_crosses_itself():
    eight = np.array([[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0]])
    assert [(i, j) for i, j, _ in crossings([eight], NEAR)] == [(0, 0)]


def test_a_contour_that_winds_twice_crosses_itself():
    t = np.linspace(0.0, 4.0 * np.pi, 200, endpoint=False)
    spiral = (10.0 + np.where(t < 2 * np.pi, 0.0, 3.0) + 0.1 * np.sin(t))[:, None]
    assert [(i, j) for i, j, _ in crossings([spiral * loops.direction(t)], NEAR)] == [(0, 0)]


@pytest.mark.parametrize(("depth", "count"), [(5e-4, 0), (0.1, 1)])
def test_an_overlap_narrower_than_the_limit_is_no_crossing(depth, count):
    assert len(crossings([square(0, 0, 10), square(10 - depth, 3, 5)], NEAR)) == count


def test_nested_and_separate_contours_do_not_cross():
    shapes = [square(0, 0, 10), square(2, 2, 3), square(2.5, 2.5, 1), square(30, 0, 1)]
    assert crossings(shapes, NEAR) == []
    assert depths(shapes) == [0, 1, 2, 0]


@pytest.mark.parametrize("radius", [0.5, 20.0, 5000.0])
def test_the_polygon_of_a_circle_keeps_within_a_quarter_of_the_width(radius):
    path = loops.arc_path(np.zeros(2), radius, 0.3, 2.0 * np.pi)
    made = polygon(Loop(path.points[:-1], path.bulges), NEAR)
    chord = np.hypot(*(made - np.roll(made, 1, axis=0)).T).max()
    assert np.hypot(*made.T) == pytest.approx(radius)
    assert radius - np.sqrt(radius**2 - chord**2 / 4.0) <= 0.25 * NEAR * (1.0 + 1e-6)
