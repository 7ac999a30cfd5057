"""Circles and ellipses as edges, and their images on the faces that end there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import Arc, Cone, Cylinder, Ellipse
from devcad.export._step_chart import heights
from devcad.geometry.conic import conic_through
from devcad.geometry.fit import Course, Demand, Ends, Spline, fit
from devcad.geometry.polynomial import MAX_DEGREE, ROUNDING, settled
from devcad.geometry.taylor import Array

TRACE_TOLERANCE = 1e-8  # mm along a face's edge: a tenth of what the kernels tell apart
FINEST = 3e-12  # of the length: rounding
FLATTEST = 1e-9  # 1 - cos of half the angle: the centre of a flatter arc is too far away
ROUND = 1e-12  # relative: an ellipse whose radii differ less is a circle
Round = tuple[Arc | Ellipse, tuple[float, float]]
"""A circle or an ellipse with the span of its parameter."""


def arc_edge(rail: Spline) -> tuple[Round, Spline] | None:
    """A rail of one span of degree 2 with weights as a circle or an ellipse, and the rail's
    parameter against that of the edge, a spline of one column; None for other conics.

    Source: Farin, Curves and Surfaces for CAGD, section 12.6 (the centre from the weight).
    """
    if rail.weights is None or len(rail.poles) != 3:
        return None
    ends, weights = rail.poles[[0, 2]], rail.weights[:, 0]
    cosine = float(weights[1] / np.sqrt(weights[0] * weights[2]))  # of half the eccentric angle
    if not (np.ptp(rail.poles, axis=0).any() and 1.0 - cosine > FLATTEST):
        return None
    half = float(np.arccos(cosine))
    middle = ends.mean(axis=0)
    shoulder = (middle + cosine * rail.poles[1]) / (1.0 + cosine)
    centre = (middle - cosine**2 * rail.poles[1]) / (1.0 - cosine**2)
    found = _round(centre, shoulder - centre, (ends[1] - ends[0]) / (2.0 * np.sin(half)), half)
    low, high = float(rail.knots[0]), float(rail.knots[-1])
    skew = float(np.sqrt(weights[2] / weights[0]))  # 1 where the weights are alike at both ends

    def place(angle: Array) -> Array:
        share = np.tan(0.5 * (angle - found[1][0] - half)) / np.tan(0.5 * half)
        start, end = skew * (1.0 - share), 1.0 + share
        return np.asarray(length * end / (start + end))[:, None]

    length = float(np.linalg.norm(np.diff(rail.poles, axis=0), axis=1).sum())
    fitted = _fitted(place, found[1], length)
    if fitted is None:
        return None
    trace = replace(fitted, poles=low + fitted.poles / length * (high - low))
    angles = np.linspace(*found[1], 17)
    off = round_points(found[0], angles) - rail(trace(angles)[:, 0])
    return (found, trace) if np.abs(off).max() <= 2.0 * _closeness(length) else None


def ellipse_edge(
    points: Array, skin: Cylinder | Cone | None, angles: Array
) -> tuple[Round, Spline | None] | None:
    """The ellipse through all points (n, 3) of an edge in their order, and its image on a
    cylinder or cone; None where there is none.

    ``angles`` (n,) are the points' own places u on that skin, to a fraction of a turn.
    """
    near = 4.0 * ROUNDING * float(np.abs(points).max())
    conic = conic_through(points, near)
    if conic is None or conic.curvature <= 0.0:
        return None
    centre, first, second = conic.diameters
    turn = conic.angles(points)
    if turn[-1] < turn[0]:
        second, turn = -second, -turn
    if not (np.diff(turn) > 0.0).all():
        return None
    half = 0.5 * float(turn[-1] - turn[0])
    c, s = np.cos(turn[0] + half), np.sin(turn[0] + half)
    found = _round(centre, c * first + s * second, c * second - s * first, half)
    edge = turn - turn[0] + found[1][0]
    if np.abs(round_points(found[0], edge) - points).max() > near:
        return None
    if skin is None:
        return found, None
    scale = skin.radius

    def image(angle: Array) -> Array:
        there = round_points(found[0], angle)
        arms = there - skin.point
        raw = np.arctan2(arms @ np.cross(skin.axis, skin.x), arms @ skin.x)
        close = np.interp(angle, edge, angles)
        u = raw + 2.0 * np.pi * np.round((close - raw) / (2.0 * np.pi))
        return np.stack([scale * u, heights(skin, there)], axis=1)

    trace = _fitted(image, found[1], float(np.abs(points - centre).max()))
    return None if trace is None else (found, replace(trace, poles=trace.poles / [scale, 1.0]))


def round_points(curve: Arc | Ellipse, angle: Array) -> Array:
    """The points of a circle or an ellipse at its parameters (n,), (n, 3)."""
    major, minor = (
        (curve.radius, curve.radius) if isinstance(curve, Arc) else (curve.major, curve.minor)
    )
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    y = np.cross(curve.axis, curve.x)
    return np.asarray(curve.centre + major * c * curve.x + minor * s * y)


def _round(centre: Array, first: Array, second: Array, half: float) -> Round:
    """The circle or ellipse centre + ``first`` cos x + ``second`` sin x over -half <= x <= half."""
    axis = np.cross(first, second)
    axis /= np.linalg.norm(axis)
    product, rest = 2.0 * float(first @ second), float(first @ first - second @ second)
    size = float(np.abs(centre).max() + np.linalg.norm(first) + np.linalg.norm(second))
    centre, axis = settled(centre, size, ROUNDING), settled(axis, 1.0, ROUNDING)
    if np.hypot(product, rest) <= ROUND * float(first @ first):
        start = np.cos(half) * first - np.sin(half) * second
        return Arc(centre, axis, *_arm(start, size)), (0.0, 2.0 * half)
    lag = 0.5 * float(np.arctan2(product, rest))
    x = np.cos(lag) * first + np.sin(lag) * second
    y = np.cos(lag) * second - np.sin(lag) * first
    start = float(np.remainder(-half - lag, 2.0 * np.pi))
    ellipse = Ellipse(centre, axis, *_arm(x, size), _arm(y, size)[1])
    return ellipse, (start, start + 2.0 * half)


def _arm(arm: Array, size: float) -> tuple[Array, float]:
    """The direction and the length of a radius, without the rounding of short decimals."""
    length = np.linalg.norm(arm)
    return settled(arm / length, 1.0, ROUNDING), float(settled(np.array(length), size, ROUNDING))


def _fitted(
    curve: Callable[[Array], Array], span: tuple[float, float], length: float
) -> Spline | None:
    """A fit of columns in mm over the span, None where it is out of reach."""
    ends = np.array(span)
    rows = curve(ends)
    columns = tuple(slice(k, k + 1) for k in range(rows.shape[1]))
    demand = Demand(MAX_DEGREE, _closeness(length), columns)
    try:
        return fit(curve, Course(ends, ends), Ends((rows[0], rows[1])), demand).spline
    except GeometryError:  # an image that bends too sharply: the edge itself is fitted, too
        return None


def _closeness(length: float) -> float:
    return max(TRACE_TOLERANCE, FINEST * length)
