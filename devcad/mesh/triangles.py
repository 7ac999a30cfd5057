"""Triangulation of polygons with holes in the plane: every corner kept, no triangle folded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array

Numbers = NDArray[np.intp]
FLIPPED = 1e-10
"""Two triangles whose angles miss a circle by less, in shares, are left as they are."""
FLAT = 1e-12
"""A triangle of less area than this share of its sides' squares has none."""
ROUNDS = 1000
"""Rounds of flips that no triangulation needs: 14 do for 400 holes in one rectangle."""


def triangulated(polygons: Sequence[Array]) -> Numbers:
    """The triangles (m, 3) of polygons, each (n, 2): outer ones counterclockwise, holes clockwise.

    Corners are numbered through all polygons and all used. Where polygons touch or cross each
    other the triangles still meet edge by edge; a few then have no area or are turned over.
    Source: ear clipping of manifold3d, which clips corners on a straight side as well.
    """
    import manifold3d

    return np.asarray(manifold3d.triangulate(list(polygons)), dtype=np.intp).reshape(-1, 3)


def delaunay(points: Array, triangles: Numbers) -> Numbers:
    """The triangles (m, 3) of points (n, 2) with edges flipped until none is locally better.

    No triangle without area stays that another diagonal could mend. Border edges are kept.
    Source: Lawson 1977; the two angles opposite an edge add up to 180 degrees at most.
    """
    triangles = triangles.copy()
    changed = np.ones(len(triangles), dtype=bool)
    for _ in range(ROUNDS):
        quads = _quads(triangles, changed, len(points))
        better, gain = _better(points, quads)
        chosen = _apart(quads.one[better], quads.other[better], gain[better], len(triangles))
        if not len(chosen):
            break
        a, b, c, d = (corner[better][chosen] for corner in (quads.a, quads.b, quads.c, quads.d))
        one, other = quads.one[better][chosen], quads.other[better][chosen]
        triangles[one] = np.stack([a, d, c], axis=1)
        triangles[other] = np.stack([d, b, c], axis=1)
        changed[:] = False
        changed[one] = changed[other] = True
    return triangles


def areas(points: Array, triangles: Numbers) -> Array:
    """The areas of triangles (m, 3) of points (n, 2), positive counterclockwise, (m,)."""
    a, b, c = (points[corner] for corner in triangles.T)
    return 0.5 * _cross(b - a, c - a)


class _Quads:
    """Pairs of triangles abc (number ``one``) and bad (``other``) with the edge ab between."""

    def __init__(self, triangles: Numbers, first: Numbers, second: Numbers) -> None:
        self.one, self.other = first // 3, second // 3
        corner, opposite = first % 3, second % 3
        self.a = triangles[self.one, corner]
        self.b = triangles[self.one, (corner + 1) % 3]
        self.c = triangles[self.one, (corner + 2) % 3]
        self.d = triangles[self.other, (opposite + 2) % 3]


def _quads(triangles: Numbers, changed: NDArray[np.bool_], count: int) -> _Quads:
    """The pairs of neighbours of which at least one has changed."""
    ends = np.roll(triangles, -1, axis=1)
    code = (np.minimum(triangles, ends) * count + np.maximum(triangles, ends)).ravel()
    order = np.argsort(code, kind="stable")
    twice = np.flatnonzero(code[order[1:]] == code[order[:-1]])
    first, second = order[twice], order[twice + 1]
    fresh = changed[first // 3] | changed[second // 3]
    return _Quads(triangles, first[fresh], second[fresh])


def _better(points: Array, quads: _Quads) -> tuple[Numbers, Array]:
    """Which pairs the other diagonal suits better, and for all how much (more below zero)."""
    a, b, c, d = (points[corner] for corner in (quads.a, quads.b, quads.c, quads.d))
    at_c, turn_c = _dot(a - c, b - c), _cross(a - c, b - c)
    at_d, turn_d = _dot(b - d, a - d), _cross(b - d, a - d)
    sine = at_c * turn_d + turn_c * at_d  # of the two angles' sum
    size = np.abs(at_c * turn_d) + np.abs(turn_c * at_d)
    least = FLAT * (_dot(b - a, b - a) + _dot(d - c, d - c))
    convex = (_cross(d - a, c - a) > least) & (_cross(b - d, c - d) > least)
    gain = sine / np.maximum(size, 1e-300)
    return np.flatnonzero((gain < -FLIPPED) & convex), gain


def _apart(one: Numbers, other: Numbers, gain: Array, count: int) -> Numbers:
    """Those pairs that are the best for both of their triangles, so that none is in two."""
    rank = np.empty(len(gain), dtype=np.intp)
    rank[np.argsort(gain, kind="stable")] = np.arange(len(gain))
    best = np.full(count, len(gain))
    np.minimum.at(best, one, rank)
    np.minimum.at(best, other, rank)
    return np.flatnonzero((best[one] == rank) & (best[other] == rank))


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])
