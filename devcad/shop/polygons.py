"""Contours as polygons so fine that what they leave out is known."""

from __future__ import annotations

import numpy as np

from devcad.flatten.pattern import Edge
from devcad.flatten.polygons import places
from devcad.geometry.taylor import Array

STRAIGHT = 1e-12  # of an edge's length: what leaves its chord by no more is a straight line
LEVELS = 12  # halvings at most: a sagitta falls by four with each
SAFE = 2.0  # the sagitta at the middle of a chord is the largest one but for skewness


def fine_polygon(contour: tuple[Edge, ...], sagitta: float) -> tuple[Array, float]:
    """A closed contour as a polygon (k, 2) with its vertices on it, each edge's ends among them,
    and a bound in mm on how far the contour leaves it: at most ``sagitta``, 0 for straight sides.
    """
    sides = [_side(edge, sagitta) for edge in contour]
    points = np.concatenate([side[:-1] for side, _ in sides])
    return points, max(found for _, found in sides)


def _side(edge: Edge, sagitta: float) -> tuple[Array, float]:
    """Points on an edge in the order of its run, and the bound."""
    u = places(edge, sagitta)
    points = edge.curve(u)[0]
    many = np.ones((len(points), 1))
    chord = _distance(many * points[0], many * points[-1], points)
    if chord.max() <= STRAIGHT * np.hypot(*(points[-1] - points[0])):
        return points[[0, -1]], 0.0
    found = np.inf
    for _ in range(LEVELS):
        middle = 0.5 * (u[:-1] + u[1:])
        between = edge.curve(middle)[0]
        off = SAFE * _distance(points[:-1], points[1:], between)
        found = float(off.max(initial=0.0))
        if found <= sagitta:
            break
        wide = np.flatnonzero(off > sagitta)
        u = np.insert(u, wide + 1, middle[wide])
        points = np.insert(points, wide + 1, between[wide], axis=0)
    return points, found


def _distance(a: Array, b: Array, p: Array) -> Array:
    """The distances of p (n, 2) from the segments a b."""
    along, away = b - a, p - a
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip((along * away).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(away - share[:, None] * along).T))
