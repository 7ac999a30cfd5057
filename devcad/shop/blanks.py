"""Blanks: contours to be laid on a sheet, with the angles at which each may lie there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten.pattern import Edge, length_bound
from devcad.geometry.taylor import Array
from devcad.shop.placing import turn
from devcad.shop.polygons import fine_polygon

FINE = 2e-6
"""Of a blank's size: the sagitta of the polygon that stands for it."""
STEPS = 64  # places between two of an edge's u's at which its direction is looked at
TURN_STEPS = 8  # of the Illinois rule, order 1.44: from 1/64 of an edge to below 1e-12 of it
SMALLER = 0.999
"""A rectangle that is no smaller than by this is not worth an odd angle."""
AS_ANGLE = 9
"""Digits of a degree: 1e-9 degrees move a point by 2e-11 of its distance."""


@dataclass(frozen=True, slots=True)
class Blank:
    """One contour to lay ``quantity`` times.

    ``angles`` in degrees, counterclockwise; ``boxes`` (k, 4): xmin, ymin, xmax, ymax at each
    angle, turned about the origin, exact. ``polygon`` (n, 2) has its vertices on the contour,
    which leaves it by ``bound`` mm at most. ``area`` in mm2 without holes, for the utilisation.
    """

    name: str
    quantity: int
    angles: tuple[float, ...]
    boxes: Array
    polygon: Array
    bound: float
    area: float

    def sizes(self) -> Array:
        """Width and height at each angle, (k, 2)."""
        return self.boxes[:, 2:] - self.boxes[:, :2]


def blank(
    name: str,
    contour: tuple[Edge, ...],
    *,
    quantity: int,
    grain: float | None,
    room: tuple[float, float],
    area: float,
) -> Blank:
    """The blank of a contour for a sheet with ``room`` (width, height) between its margins, mm.

    With a ``grain`` (radians from +x in the pattern) that direction lies along the sheet's x, one
    way or the other. Without it the blank may be turned by quarter turns, and by those that
    square the smallest rectangle around it; where none of these fits, by every degree that does.
    Blanks are never mirrored. No angle at all may fit: that is not looked at here.
    """
    size = max(length_bound(edge) for edge in contour)
    polygon, bound = fine_polygon(contour, FINE * size)
    if grain is not None:
        angles = _angles([-np.degrees(grain)], 180.0)
        return Blank(name, quantity, angles, boxes(contour, angles), polygon, bound, area)
    angles = _angles([0.0, _squared(polygon)], 90.0)
    found = boxes(contour, angles)
    if not _fit(found, room).any():
        every = tuple(float(degree) for degree in range(360))
        all_boxes = boxes(contour, every)
        fitting = np.flatnonzero(_fit(all_boxes, room))
        if fitting.size:
            angles, found = tuple(every[k] for k in fitting), all_boxes[fitting]
    return Blank(name, quantity, angles, found, polygon, bound, area)


def _fit(found: Array, room: tuple[float, float]) -> Array:
    """Which boxes (k, 4) fit into the room, (k,)."""
    return np.asarray(((found[:, 2:] - found[:, :2]) <= np.array(room) + 1e-9).all(axis=1))


def _angles(starts: Sequence[float], step: float) -> tuple[float, ...]:
    """Each start and what lies steps from it, once, in [0, 360)."""
    turns = [start + step * k for start in starts for k in range(round(360.0 / step))]
    return tuple(dict.fromkeys(float(round(angle % 360.0, AS_ANGLE)) % 360.0 for angle in turns))


def _squared(polygon: Array) -> float:
    """The angle in degrees that lays the smallest rectangle around a polygon along the axes; 0
    where the one that stands is as small."""
    import shapely

    hull = np.asarray(shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(polygon))))
    sides = np.diff(hull, axis=0)
    angles = np.arctan2(sides[:, 1], sides[:, 0])
    best, least = 0.0, float(np.prod(np.ptp(hull, axis=0)))
    for angle in angles[np.hypot(*sides.T) > 0.0]:  # one side lies on an edge of the hull
        cos, sin = np.cos(-angle), np.sin(-angle)
        width, height = np.ptp(hull @ np.array([[cos, sin], [-sin, cos]]), axis=0)
        if width * height < SMALLER * least:
            best, least = float(angle), float(width * height)
    return -float(np.degrees(best))


def boxes(contour: tuple[Edge, ...], angles: Sequence[float]) -> Array:
    """The boxes xmin, ymin, xmax, ymax (k, 4) of a contour turned about the origin by angles in
    degrees, exact: the extremes of every edge."""
    axes = np.concatenate([turn(angle) for angle in angles])  # rows: x, y at each angle
    both = np.concatenate([axes, -axes])
    reach = np.max([_reach(edge, both) for edge in contour], axis=0)
    high, low = reach[: len(axes)].reshape(-1, 2), -reach[len(axes) :].reshape(-1, 2)
    return np.column_stack([low, high])


def _reach(edge: Edge, directions: Array) -> Array:
    """How far an edge reaches in directions (m, 2), (m,).

    A turn between two samples is a zero of the slope, found by the Illinois rule; an error of
    1e-7 in the parameter is one of 1e-14 in the reach.
    """
    knots = np.sort(edge.u)
    starts = [np.linspace(a, b, STEPS, endpoint=False) for a, b in pairwise(knots)]
    u = np.concatenate([*starts, knots[-1:]])
    points, slopes = edge.curve(u)
    best = (points @ directions.T).max(axis=0)
    along = slopes @ directions.T  # (n, m)
    at, which = np.nonzero((along[:-1] > 0.0) & (along[1:] < 0.0))
    low, high, below, above = u[at], u[at + 1], along[at, which], along[at + 1, which]
    for _ in range(TURN_STEPS if at.size else 0):
        rise = above - below
        part = np.divide(above, rise, out=np.zeros_like(rise), where=rise != 0.0)
        middle = high - part * (high - low)
        found, slope = edge.curve(middle)
        np.maximum.at(best, which, (found * directions[which]).sum(axis=1))
        value = (slope * directions[which]).sum(axis=1)
        passed = value * above <= 0.0
        low, below = np.where(passed, high, low), np.where(passed, above, 0.5 * below)
        high, above = middle, value
    return np.asarray(best)
