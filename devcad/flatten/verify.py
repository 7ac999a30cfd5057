"""What a pattern proves about itself: isometry, fold-back, no overlap."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from devcad.flatten.development import Development
from devcad.flatten.fold import Folded, fold_chain
from devcad.flatten.images import TrackImage
from devcad.flatten.neutral import Fibre
from devcad.flatten.pattern import Pattern
from devcad.flatten.polygons import cross, polygon, winding
from devcad.flatten.rings import twice_area
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Patch
from devcad.geometry.regularity import Extreme
from devcad.geometry.taylor import Array, rows_dot

STENCIL = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""Central difference of order 8, weights at -4 .. 4 steps."""
ROUNDING = 8.0 * np.finfo(float).eps
"""Of a pattern coordinate, several operations and nine summands of the stencil on."""
TRACED = (1e-5, 1e-7, 1e-9)
"""Shares of the pattern's size to which its outline is traced in the search for overlaps."""
CUT_PARTS = 12
"""Steps of a cut's edge, between two of its u's, at which it is folded back."""
STEPS_PER_PANEL = 800.0
"""A step of the stencil is this share of a panel: 129 nodes resolve nothing that is finer."""


def isometry(patch: Patch, development: Development, fibre: Fibre | None = None) -> Extreme:
    """The largest difference between the surface's metric and the pattern's, relative.

    The surface's first fundamental form comes from the series of c0 and e; the pattern's from
    distances between pattern points a small step in t apart (differences of order 8), at
    parameters of its own, on both ends and the middle of the extent. Relative to the largest
    speed on the ruling, so that an apex does not divide by zero; what rounding of the pattern's
    coordinates makes of the differences, on a strip much narrower than its place, is taken off.
    With a ``fibre`` the surface is that of the neutral fibre.
    """
    knots = development.series.knots
    share = 0.02 + 0.96 * ((np.arange(40) * 0.618033988749895 + 0.1) % 1.0)
    low, width = knots[:-1, None], np.diff(knots)[:, None]
    t = (low + width * share).ravel()
    step = np.repeat(width[:, 0] / STEPS_PER_PANEL, len(share))
    jet = patch.jet(t, 1)
    ends = (jet.v_from[0], 0.5 * (jet.v_from[0] + jet.v_to[0]), jet.v_to[0])
    direction = development.direction(t)
    along = jet.c0[1] if fibre is None else jet.c0[1] - _retreat(patch, t, fibre)
    tangents = [along + v[:, None] * jet.e[1] for v in ends]
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


def fold_back(
    chain: Chain,
    developments: tuple[Development, ...],
    pattern: Pattern | None = None,
    fibres: Sequence[Fibre | None] = (),
) -> tuple[Extreme, float]:
    """The largest distance in mm between the surface and the pattern folded up again.

    Only the pattern and its bending enter the folding (and where the first ruling stands);
    the patch is asked for its own points alone. Of the cuts in ``pattern`` the points of the
    edges themselves are folded. With neutral ``fibres`` the surface is the one that keeps its
    lengths: c0 - the integral of the shift along m. Returns the worst place and the part's size.
    """
    first = chain.patches[0].frame([chain.patches[0].domain[0]])
    worst, size = Extreme(0.0, chain.patches[0].domain[0], 0.0), 0.0
    lag = np.zeros(3)
    for number, (patch, folded) in enumerate(
        zip(chain.patches, fold_chain(developments, chain, first, 1.0), strict=True)
    ):
        behind = _lag(patch, fibres[number] if fibres else None, lag)
        lag = behind(np.array(patch.domain[1:]))[0]
        knots = folded.motion.knots
        share = np.arange(1, 8) / 8.0
        t = (knots[:-1, None] + np.diff(knots)[:, None] * share).ravel()
        jet = patch.jet(t, 0)
        rails = [(t, v, folded.points(t, v)) for v in (jet.v_from[0], jet.v_to[0])]
        size = max(size, *(_extent(patch.point(t, v)) for t, v, _ in rails))
        for at, v, points in (*rails, *_cut_points(pattern, number, folded)):
            away = np.linalg.norm(points - (patch.point(at, v) - behind(at)), axis=1)
            k = int(np.argmax(away))
            if not away[k] <= worst.value:
                worst = Extreme(float(away[k]), float(at[k]), float(v[k]))
    return worst, size


def _lag(patch: Patch, fibre: Fibre | None, before: Array) -> Callable[[Array], Array]:
    """How far the neutral surface has fallen behind the middle at t (n,) of a patch, (n, 3),
    when it was ``before`` (3,) behind at the start."""
    if fibre is None:
        return lambda t: np.broadcast_to(before, (len(t), 3))
    knots = np.array([patch.domain[0], *fibre.breaks(patch), patch.domain[1]])
    reach = float(np.abs(np.diff(patch.point(patch.domain, [0.0, 0.0]), axis=0)).max())
    scale = 1e-3 * (reach + fibre.thickness) / (knots[-1] - knots[0])
    rate = chebyshev.resolve(lambda t: _retreat(patch, t, fibre), knots, scale=scale)
    total = rate.antiderivative()
    return lambda t: before + total(t)


def _retreat(patch: Patch, t: Array, fibre: Fibre) -> Array:
    """(1/2 - K) T |c| m at t, (n, 3): what is missing on the neutral surface of the speed of c0.

    From the surface's own points: the turning of its unit normal, and the radii at the ends of
    the extent as speed over turning.
    """
    jet = patch.frame_jet(t, 1)
    turning = jet.n[1]  # n' = -c m
    rate = np.linalg.norm(turning, axis=1)
    ends = [jet.ruling.rail(v)[1] for v in (jet.ruling.v_from, jet.ruling.v_to)]
    speed = np.min([np.abs(rows_dot(end, jet.m[0])) for end in ends], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(speed / rate / fibre.thickness - 0.5, nan=np.inf, posinf=np.inf)
    k = fibre.law(np.maximum(ratio, 0.0))
    return np.asarray(((0.5 - k) * fibre.thickness * rate)[:, None] * jet.m[0])


def _extent(points: Array) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _cut_points(
    pattern: Pattern | None, number: int, folded: Folded
) -> list[tuple[Array, Array, Array]]:
    """t, v and the folded points (n, 3) of all cuts on a patch, in one row or in none."""
    edges = (*pattern.outline, *itertools.chain(*pattern.holes)) if pattern else ()
    share = np.arange(1, CUT_PARTS) / CUT_PARTS
    places, flat = [], []
    for edge in edges:
        if isinstance(edge.curve, TrackImage) and edge.curve.track.patch == number:
            u = (edge.u[:-1, None] + np.diff(edge.u)[:, None] * share).ravel()
            places.append(edge.curve.track.series(u))
            flat.append(edge.curve(u)[0])
    if not places:
        return []
    t, v = np.concatenate(places).T
    return [(t, v, folded.carried(t, np.concatenate(flat)))]


def overlap_area(pattern: Pattern) -> float:
    """The area in mm2 that the pattern covers more than once, or takes away where nothing is; 0.0
    when its contours are simple and each hole lies inside the outline, none in another.

    A disc laid in the plane without folding overlaps itself only if its boundary crosses
    itself; the contours are looked at as polygons, finer where these cross, for edges may be
    nearer to one another than a coarse polygon is to its edge. Only a crossing that remains, or
    a hole in the wrong place, costs the areas.
    """
    size = float(np.hypot(*np.subtract(pattern.bbox[2:], pattern.bbox[:2])))
    for share in TRACED:
        contours = [polygon(edges, share * size) for edges in (pattern.outline, *pattern.holes)]
        if not cross(contours) and not _misplaced(contours[0], contours[1:]):
            return 0.0
    return _crossing_area(contours)


def _misplaced(outer: Array, holes: list[Array]) -> bool:
    """Whether a hole that crosses nothing lies outside the outline or within another hole."""
    if not holes:
        return False
    inner = [_beside(hole) for hole in holes]
    if any(winding(outer, point) != 1 for point in inner):
        return True
    low, high = (np.array([f(hole, axis=0) for hole in holes]) for f in (np.min, np.max))
    for k, point in enumerate(inner):
        around = np.flatnonzero(np.all((low <= point) & (point <= high), axis=1)).tolist()
        if any(winding(holes[i], point) for i in around if i != k):
            return True
    return False


def _beside(hole: Array) -> Array:
    """A point just inside a hole, on the right of its first side, (2,)."""
    start, end = hole[:2]
    right = np.array([1.0, -1.0]) * (end - start)[::-1]
    narrow = abs(twice_area(hole - start)) / float(right @ right)  # of a sliver, its width
    return np.asarray(0.5 * (start + end) + 1e-3 * min(1.0, narrow) * right)


def _crossing_area(contours: list[Array]) -> float:
    """The area wound more than once or backwards, from the pieces into which the contours cut the
    plane."""
    from shapely import LineString, polygonize, unary_union  # only a pattern in trouble pays

    ring = unary_union([LineString(np.vstack([c, c[:1]])) for c in contours])
    total = 0.0
    for piece in polygonize([ring]).geoms:
        point = piece.representative_point()
        wound = sum(winding(contour, np.array([point.x, point.y])) for contour in contours)
        total += max(wound - 1, -wound, 0) * piece.area
    return total


def _slope(development: Development, t: Array, v: Array, step: Array) -> Array:
    """The derivative in t of the pattern point (t, v), from nine pattern points."""
    total = np.zeros((len(t), 2))
    for k, weight in zip(range(-4, 5), STENCIL, strict=True):
        if weight:
            total += weight * development.points(t + k * step, v)
    return total / step[:, None]
