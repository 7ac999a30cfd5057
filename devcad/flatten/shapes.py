"""Contours of holes and lines of marks about their own origin, from lines and arcs.

Contours are closed and run counterclockwise, each edge's end the next one's start; every edge is
a straight line or an arc of a circle, exactly. Lengths are mm, angles radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from devcad.flatten.pattern import CUTOUT, Edge
from devcad.flatten.rings import Contour, twice_area
from devcad.geometry.taylor import Array

MARK = "MARK"
"""The layer of marks."""
HEAD, HEAD_ANGLE, LARGEST_HEAD = 0.25, np.radians(20.0), 12.0
"""The strokes of an arrow's head: a share of its length, at most so many mm, and their angle."""


def line(start: Array, end: Array, name: str = CUTOUT) -> Edge:
    """The straight edge between two points (2,), its parameter from 0 to 1."""
    start, step = np.asarray(start, dtype=float), np.subtract(end, start, dtype=float)
    stop = np.asarray(end, dtype=float)

    def curve(u: Array) -> tuple[Array, Array]:
        points = start + u[:, None] * step
        points[u == 1.0] = stop  # to the bit: the next edge starts there
        return points, np.broadcast_to(step, points.shape).copy()

    return Edge(name, curve, np.array([0.0, 1.0]))


def conic_arc(
    center: Array, x: Array, y: Array, angles: tuple[float, float], name: str = CUTOUT
) -> Edge:
    """The arc center + cos(u) x + sin(u) y of an ellipse, u in radians between two angles.

    ``x`` and ``y`` (2,) are conjugate half diameters: of equal length and square to each other
    for a circle.
    """
    center, x, y = (np.asarray(v, dtype=float) for v in (center, x, y))

    def curve(u: Array) -> tuple[Array, Array]:
        cos, sin = np.cos(u)[:, None], np.sin(u)[:, None]
        return center + cos * x + sin * y, cos * y - sin * x

    return Edge(name, curve, np.array(angles))


def arc(center: Array, radius: float, angles: tuple[float, float], name: str = CUTOUT) -> Edge:
    """The arc of a circle, its parameter the angle from +x."""
    return conic_arc(center, np.array([radius, 0.0]), np.array([0.0, radius]), angles, name)


def circle(diameter: float) -> Contour:
    """The circle, one edge from 0 to 2 pi."""
    return (arc(np.zeros(2), 0.5 * diameter, (0.0, 2.0 * np.pi)),)


def slot(length: float, width: float) -> Contour:
    """Two straight sides along x and two half circles; ``length`` is overall, >= width."""
    reach, radius = 0.5 * (length - width), 0.5 * width
    if reach <= 0.0:
        return circle(width)
    right, left = np.array([reach, 0.0]), np.array([-reach, 0.0])
    up = np.array([0.0, radius])
    return (
        line(left - up, right - up),
        arc(right, radius, (-0.5 * np.pi, 0.5 * np.pi)),
        line(right + up, left + up),
        arc(left, radius, (0.5 * np.pi, 1.5 * np.pi)),
    )


def rectangle(width: float, height: float, corner_radius: float = 0.0) -> Contour:
    """The rectangle, ``width`` along x, its corners rounded; the radius at most half a side."""
    half = 0.5 * np.array([width, height])
    signs = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    if corner_radius <= 0.0:
        return polygon((signs * half).tolist())
    centers = signs * np.maximum(half - corner_radius, 0.0)
    edges: list[Edge] = []
    for k, center in enumerate(centers):
        start = 0.5 * np.pi * (k - 1)
        side = np.array([np.cos(start), np.sin(start)]).round()  # outward from the side before
        before = centers[k - 1]
        if np.abs(center - before).max() > 0.0:
            edges.append(line(before + corner_radius * side, center + corner_radius * side))
        edges.append(arc(center, corner_radius, (start, start + 0.5 * np.pi)))
    return tuple(edges)


def polygon(points: Sequence[Sequence[float]]) -> Contour:
    """The straight edges between the points (n, 2), run counterclockwise."""
    corners = np.array(points, dtype=float)
    if twice_area(corners) < 0.0:
        corners = corners[::-1]
    return tuple(line(a, b) for a, b in pairwise([*corners, corners[0]]))


def line_mark(length: float) -> tuple[Edge, ...]:
    """A line along x from the origin."""
    return (line(np.zeros(2), np.array([length, 0.0]), MARK),)


def arrow_mark(length: float) -> tuple[Edge, ...]:
    """An arrow along x from the origin; its head is two strokes that meet at the tip."""
    tip = np.array([length, 0.0])
    stroke = min(HEAD * length, LARGEST_HEAD)
    back = stroke * np.array([np.cos(HEAD_ANGLE), np.sin(HEAD_ANGLE)])
    return (
        line(np.zeros(2), tip, MARK),
        line(tip - back * [1.0, -1.0], tip, MARK),
        line(tip, tip - back, MARK),
    )
