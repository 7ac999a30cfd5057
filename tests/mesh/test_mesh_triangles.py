"""Triangulations of polygons: every corner used, nothing folded, locally Delaunay."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from devcad.mesh.rings import cleaned
from devcad.mesh.triangles import areas, delaunay, triangulated


def circle(x, y, radius, count):
    angle = -np.arange(count) * 2.0 * np.pi / count
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])


def shoelace(polygon):
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def border(polygons):
    starts = np.cumsum([0, *(len(p) for p in polygons)])
    return {
        (int(a), int(b))
        for start, p in zip(starts, polygons, strict=False)
        for a, b in zip(
            start + np.arange(len(p)), start + np.roll(np.arange(len(p)), -1), strict=True
        )
    }


def open_edges(triangles):
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    directed = [tuple(map(int, end)) for end in ends]
    assert len(set(directed)) == len(directed)
    return {(a, b) for a, b in directed if (b, a) not in set(directed)}


SHEET = np.array([[0, 0], [100, 0], [100, 60], [0, 60]], dtype=float)
POLYGONS = {
    "holes in rows": [
        SHEET,
        *(circle(10 + 20 * i, 10 + 20 * j, 6, 16) for i in range(5) for j in range(3)),
    ],
    "corners on straight sides": [
        np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [2, 1], [1, 1], [0, 1]], dtype=float)
    ],
    "three on each side of a triangle": [
        np.array([[0, 0], [1, 0], [2, 0], [4, 0], [2, 2], [1, 3], [0, 4], [0, 2], [0, 1]], float)
    ],
    "a hole that touches the border": [
        np.array([[0, 0], [10, 0], [10, 5], [5, 5], [7, 3], [5, 1], [3, 3], [5, 5], [0, 5]], float)
    ],
}


@pytest.mark.parametrize("name", POLYGONS)
def test_a_triangulation_covers_the_polygon_once(name):
    polygons = POLYGONS[name]
    points = np.concatenate(polygons)
    triangles = delaunay(points, triangulated(polygons))
    assert open_edges(triangles) == border(polygons)
    assert set(np.unique(triangles)) == set(range(len(points)))
    sizes = areas(points, triangles)
    assert sizes.min() > 0.0
    assert sizes.sum() == pytest.approx(sum(shoelace(p) for p in polygons), rel=1e-12)


def test_flips_end_in_the_triangulation_of_delaunay():
    # a convex polygon without four corners on a circle has only one
    angle = np.sort(np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, 40))
    points = np.column_stack([3.0 * np.cos(angle), np.sin(angle) + 0.1 * np.cos(angle)])
    found = {frozenset(map(int, row)) for row in delaunay(points, triangulated([points]))}
    assert found == {frozenset(map(int, row)) for row in Delaunay(points).simplices}


def test_rings_lose_repeated_points_and_spikes():
    ids = list(range(10))
    assert cleaned([0, 1, 1, 2, 3, 0], ids) == [0, 1, 2, 3]
    assert cleaned([0, 1, 2, 1, 3], ids) == [0, 1, 3]
    assert cleaned([4, 0, 1, 2, 0], ids) == [0, 1, 2]
    assert cleaned([0, 1, 2, 3, 2, 1], ids) == []
    assert cleaned([0, 1, 2, 3, 4], [0, 1, 2, 2, 1]) == []
