"""What a pattern proves about itself: isometry, fold-back, no overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.development import Development
from devcad.flatten.fold import fold_chain
from devcad.flatten.pattern import Edge, Pattern
from devcad.flatten.trace import trace
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Patch
from devcad.geometry.regularity import Extreme
from devcad.geometry.taylor import Array, rows_dot

STENCIL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Central difference of order 8, weights at -4 .. 4 steps."""
ROUNDING = 8.0 * np.finfo(float).eps
"""Of a pattern coordinate, several operations and nine summands of the stencil on."""
TRACED = 1e-5
"""Share of the pattern's size to which its outline is traced in the search for overlaps."""
STEPS_PER_PANEL = 800.0
"""A step of the stencil is this share of a panel: 129 nodes resolve nothing that is finer."""


def isometry(patch: Patch, development: Development) -> Extreme:
    """The largest difference between the surface's metric and the pattern's, relative.

    The surface's first fundamental form comes from the series of c0 and e; the pattern's from
    distances between pattern points a small step in t apart (differences of order 8), at
    parameters of its own, on both ends and the middle of the extent. Relative to the largest
    speed on the ruling, so that an apex does not divide by zero; what rounding of the pattern's
    coordinates makes of the differences, on a strip much narrower than its place, is taken off.
    """
    knots = development.series.knots
    share = 0.02 + 0.96 * ((np.arange(40) * 0.618033988749895 + 0.1) % 1.0)
    low, width = knots[:-1, None], np.diff(knots)[:, None]
    t = (low + width * share).ravel()
    step = np.repeat(width[:, 0] / STEPS_PER_PANEL, len(share))
    jet = patch.jet(t, 1)
    ends = (jet.v_from[0], 0.5 * (jet.v_from[0] + jet.v_to[0]), jet.v_to[0])
    direction = development.direction(t)
    tangents = [jet.c0[1] + v[:, None] * jet.e[1] for v in ends]
    speed = np.max([np.linalg.norm(tangent, axis=1) for tangent in tangents], axis=0)
    speed = np.maximum(speed, 1e-12 * speed.max())
    worst = Extreme(0.0, float(t[0]), float(ends[0][0]))
    for v, tangent in zip(ends, tangents, strict=True):
        slope = _slope(development, t, v, step)
        place = np.abs(development.origin(t)).max(axis=1) + np.abs(v)
        rounding = ROUNDING * place / (step * speed)
        error = np.maximum(
            np.abs(rows_dot(slope, slope) - rows_dot(tangent, tangent)) / speed**2,
            np.abs(rows_dot(slope, direction) - rows_dot(tangent, jet.e[0])) / speed,
        )
        error = np.maximum(error - rounding, 0.0)
        k = int(np.nanargmax(error)) if not np.isnan(error).all() else 0
        if not error[k] <= worst.value:
            worst = Extreme(float(error[k]), float(t[k]), float(v[k]))
    return worst


def fold_back(chain: Chain, developments: tuple[Development, ...]) -> tuple[Extreme, float]:
    """The largest distance in mm between the surface and the pattern folded up again.

    Only the pattern and its bending enter the folding (and where the first ruling stands);
    the patch is asked for its own points alone. Returns the worst place and the part's size.
    """
    first = chain.patches[0].frame([chain.patches[0].domain[0]])
    worst, size = Extreme(0.0, chain.patches[0].domain[0], 0.0), 0.0
    for patch, folded in zip(
        chain.patches, fold_chain(developments, chain, first, 1.0), strict=True
    ):
        knots = folded.motion.knots
        share = np.arange(1, 8) / 8.0
        t = (knots[:-1, None] + np.diff(knots)[:, None] * share).ravel()
        jet = patch.jet(t, 0)
        for v in (jet.v_from[0], jet.v_to[0]):
            points = patch.point(t, v)
            size = max(size, float(np.linalg.norm(np.ptp(points, axis=0))))
            away = np.linalg.norm(folded.points(t, v) - points, axis=1)
            k = int(np.argmax(away))
            if not away[k] <= worst.value:
                worst = Extreme(float(away[k]), float(t[k]), float(v[k]))
    return worst, size


def overlap_area(pattern: Pattern) -> float:
    """The area in mm2 that the pattern covers more than once, 0.0 when its outline is simple.

    A disc laid in the plane without folding overlaps itself only if its boundary crosses
    itself; the outline is looked at as a polygon, and only a true crossing costs the areas.
    """
    size = float(np.hypot(*np.subtract(pattern.bbox[2:], pattern.bbox[:2])))
    polygon = np.concatenate([_run(edge, size)[:-1] for edge in pattern.outline])
    if not _crosses(polygon):
        return 0.0
    return _crossing_area(polygon)


def _crossing_area(polygon: Array) -> float:
    """The area wound more than once, from the pieces that the outline cuts the plane into."""
    from shapely import LineString, polygonize, unary_union  # only a pattern in trouble pays

    ring = unary_union(LineString(np.vstack([polygon, polygon[:1]])))
    total = 0.0
    for piece in polygonize([ring]).geoms:
        point = piece.representative_point()
        wound = _winding(polygon, np.array([point.x, point.y]))
        total += max(wound - 1, 0) * piece.area
    return total


def _winding(polygon: Array, point: Array) -> int:
    """How often a closed polygon runs counterclockwise around a point."""
    away = polygon - point
    after = np.roll(away, -1, axis=0)
    turn = np.arctan2(
        away[:, 0] * after[:, 1] - away[:, 1] * after[:, 0], (away * after).sum(axis=1)
    )
    return round(float(turn.sum()) / (2.0 * np.pi))


def _slope(development: Development, t: Array, v: Array, step: Array) -> Array:
    """The derivative in t of the pattern point (t, v), from nine pattern points."""
    total = np.zeros((len(t), 2))
    for k, weight in zip(range(-4, 5), STENCIL, strict=True):
        if weight:
            total += weight * development.points(t + k * step, v)
    return total / step[:, None]


def _run(edge: Edge, size: float) -> Array:
    """An edge as a polygon: traced, so that no wave is missed, and eight steps between."""
    if edge.name in ("start", "end"):
        return edge.curve(edge.u)[0]
    u = trace(edge, TRACED * size).u
    between = u[:-1, None] + np.diff(u)[:, None] * (np.arange(8) / 8.0)
    return edge.curve(np.append(between.ravel(), u[-1]))[0]


def _crosses(polygon: Array) -> bool:
    """Whether two sides of a closed polygon cross properly (touching does not count)."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    size = float(np.linalg.norm(np.ptp(polygon, axis=0)))
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.argsort(low[:, 0])
    start, end, low, high = start[order], end[order], low[order], high[order]
    last = np.searchsorted(low[:, 0], high[:, 0], side="right")
    count = np.maximum(last - np.arange(len(start)) - 1, 0)
    for rows in _batches(count):
        i = np.repeat(rows, count[rows])
        offset = np.arange(len(i)) - np.repeat(np.cumsum(count[rows]) - count[rows], count[rows])
        j = i + 1 + offset
        near = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
        i, j = i[near], j[near]
        first = _side(start[i], end[i], start[j]) * _side(start[i], end[i], end[j])
        second = _side(start[j], end[j], start[i]) * _side(start[j], end[j], end[i])
        # below rounding of the coordinates a point lies on the line, not beside it
        noise = (1e-12 * size) ** 2
        if ((first < -noise) & (second < -noise)).any():
            return True
    return False


def _batches(count: NDArray[np.intp], most: int = 2_000_000) -> list[NDArray[np.intp]]:
    """Rows in groups whose pairs fit the memory."""
    group = (np.cumsum(count) // most).astype(int)
    return [np.flatnonzero(group == g) for g in range(int(group[-1]) + 1)]


def _side(a: Array, b: Array, p: Array) -> Array:
    """The signed distance of p from the line a b, (n,)."""
    along = b - a
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-300)
    away = p - a
    return np.asarray((along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / length)
