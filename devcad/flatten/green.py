"""Length, area and box of closed contours in the plane, to rounding."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from devcad.flatten.pattern import Edge
from devcad.geometry import chebyshev
from devcad.geometry.taylor import Array

PlaneDensity = Callable[[Array, Array], Array]
"""Points (n, 2) and derivatives (n, 2) -> densities (n,)."""
TURN_STEPS = 8
"""Steps of the Illinois rule, order 1.44: from 1/64 of an edge to below 1e-12 of it."""


def perimeter(contour: tuple[Edge, ...]) -> float:
    """The length of a contour in mm."""
    return float(sum(abs(_integral(e, _speed)) for e in contour))


def enclosed_area(contour: tuple[Edge, ...]) -> float:
    """The area inside a contour by Green's formula, mm2, positive counterclockwise."""
    return float(sum(_integral(e, _moment) for e in contour))


def swept_area(edge: Edge) -> float:
    """The area between an edge and its chord in mm2, positive where the edge bulges out to the
    right of the chord: what the edge adds to the area on its left."""
    start = edge.curve(edge.u[:1])[0]
    return float(_integral(edge, lambda point, slope: _moment(point - start, slope)))


def bounds(contour: tuple[Edge, ...]) -> tuple[float, float, float, float]:
    """The exact bounding box: the extremes of every edge."""
    points = np.concatenate([_extremes(edge) for edge in contour])
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _speed(_point: Array, slope: Array) -> Array:
    return np.asarray(np.hypot(slope[:, 0], slope[:, 1]))


def _moment(point: Array, slope: Array) -> Array:
    return np.asarray(0.5 * (point[:, 0] * slope[:, 1] - point[:, 1] * slope[:, 0]))


def _integral(edge: Edge, density: PlaneDensity) -> float:
    """The integral of a density along an edge in the direction of its run."""
    knots = np.sort(edge.u)
    points, slopes = edge.curve(np.linspace(knots[0], knots[-1], 9))
    # the moment of a line through the origin is rounding: it is nothing beside these sizes
    scale = float(np.abs(slopes).max() * max(np.abs(points).max(), 1.0 if slopes.any() else 0.0))
    series = chebyshev.resolve(
        lambda u: density(*edge.curve(u))[:, None], knots, scale=1e-3 * scale
    )
    value = float(series.antiderivative()(knots[-1:])[0, 0])
    return value if edge.u[-1] > edge.u[0] else -value


def _extremes(edge: Edge) -> Array:
    """Points of an edge, among them all where it turns back in x or in y, (n, 2).

    A turn between two samples is a zero of the slope, found by the Illinois rule; an error of
    1e-7 in the parameter is one of 1e-14 in the coordinate.
    """
    knots = np.sort(edge.u)
    starts = [np.linspace(a, b, 64, endpoint=False) for a, b in itertools.pairwise(knots)]
    u = np.concatenate([*starts, knots[-1:]])
    points, slopes = edge.curve(u)
    at, axis = np.nonzero(slopes[:-1] * slopes[1:] < 0.0)
    low, high = u[at], u[at + 1]
    below, above = slopes[at, axis], slopes[at + 1, axis]
    found = [points]
    for _ in range(TURN_STEPS if at.size else 0):
        rise = above - below
        part = np.divide(above, rise, out=np.zeros_like(rise), where=rise != 0.0)
        middle = high - part * (high - low)
        turn, slope = edge.curve(middle)
        found.append(turn)
        value = slope[np.arange(at.size), axis]
        passed = value * above <= 0.0
        low, below = np.where(passed, high, low), np.where(passed, above, 0.5 * below)
        high, above = middle, value
    return np.concatenate(found)
