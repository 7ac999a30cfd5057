"""Long edges that run back upon one another: a rail that turns, an edge that two sheets share.

Where the long edge of one strip is that of an earlier one run backwards, both faces stand on one
edge of the body: two edges in one place would be a fault to every kernel.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from devcad.export._step_body import Arc, Curve, Ellipse, Straight, Stretch, Trace
from devcad.export._step_strips import Strip
from devcad.geometry.fit import FLOOR, Course, Spline
from devcad.geometry.taylor import Array

Side = tuple[int, int]
"""The number of a strip and its side (0 from, 1 to)."""
Folds = dict[Side, Side]
"""Long edges that are an earlier strip's run backwards: the later one -> the earlier one."""

SHARES = np.linspace(0.0, 1.0, 33)
ROUNDS = 4
"""How often strips are split because of splits before."""


def folds(parts: list[Strip], size: float) -> Folds:
    """The long edges of a surface without thickness that lie on one another, run backwards, at
    equal shares of their courses."""
    found: Folds = {}
    if parts[0].layers != (0.0,):
        return found
    paths = [s.rails(s.course(_spread(s)))[:, :, 0] for s in parts]  # (33, 2, 3) each
    free = [(k, side) for k, s in enumerate(parts) for side in (0, 1) if not s.tips[side]]
    for later, (k, side) in enumerate(free):
        back = paths[k][::-1, side]
        for i, other in free[:later]:
            if (i, other) in found or (i, other) in found.values():
                continue
            if np.abs(paths[i][[0, -1], other] - back[[0, -1]]).max() > FLOOR * size:
                continue
            if np.abs(paths[i][:, other] - back).max() <= FLOOR * size:
                found[k, side] = (i, other)
                break
    return found


def split(parts: list[Strip], count: int, size: float) -> tuple[list[Strip], int]:
    """The strips, and the number of stations, after every strip is split where a long edge that
    runs back upon one of its own ends: then the two are one edge from vertex to vertex."""
    if parts[0].layers != (0.0,):
        return parts, count
    around = count == len(parts)
    for _ in range(ROUNDS):  # a split makes a vertex on the other side, and so may ask for more
        ends = [part.rails(part.ends)[:, :, 0] for part in parts]
        cuts = [_overlaps(parts, k, ends, size) for k in range(len(parts))]
        if not any(len(c) for c in cuts):
            break
        pieces = [(s, c) for s, cut in zip(parts, cuts, strict=True) for c in _courses(s, cut)]
        parts = [
            replace(s, course=course, first=k, last=k + 1) for k, (s, course) in enumerate(pieces)
        ]
    count = len(parts) if around else len(parts) + 1
    parts[-1] = replace(parts[-1], last=parts[-1].last % count)
    return parts, count


def _overlaps(parts: list[Strip], k: int, ends: list[Array], size: float) -> Array:
    """The places s strictly within strip k's course where another long edge ends that lies on
    one of its own from there on, run backwards with the same parameter. ``ends`` (2, 2, 3) are
    those of all strips' long edges."""
    own, found = parts[k], []
    for side in (0, 1):
        if own.tips[side]:
            continue
        looks = own.rails(own.course(_spread(own)))[:, side, 0]
        longest = float(np.linalg.norm(np.diff(looks, axis=0), axis=1).max())
        for i, other in ((i, s) for i, s in enumerate(parts) if i != k):
            for b in (b for b in (0, 1) if not other.tips[b]):
                for end in (0, 1):
                    point = ends[i][end, b]
                    if np.linalg.norm(looks - point, axis=1).min() > 2.0 * longest:
                        continue  # far from the whole edge
                    place = _foot(own, side, point, size)
                    if place is not None and _runs_back((own, side), place, (other, b), end, size):
                        found.append(place)
    places = np.sort(np.array(found))
    near = 1e-7 * (own.course.s[-1] - own.course.s[0])
    return np.asarray(places[np.diff(places, prepend=-np.inf) > near])


def _foot(strip: Strip, side: int, point: Array, size: float) -> float | None:
    """The place s strictly within a strip's course where its long edge passes a point (3,)."""
    s = strip.course.s
    ends = strip.rails(strip.ends)[:, side, 0]
    if np.abs(ends - point).max(axis=1).min() <= 10.0 * FLOOR * size:
        return None  # an edge that stands still at its end meets every neighbour there
    places = _spread(strip)[1:-1]  # at an end the edge may stand still
    points = strip.rails(strip.course(places))[:, side, 0]
    place = float(places[np.linalg.norm(points - point, axis=1).argmin()])
    span, off = float(s[-1] - s[0]), np.full(3, np.inf)
    for _ in range(25):
        t = strip.course(np.array([place]))
        off, way = strip.rails(t)[0, side, 0] - point, strip.slopes(t)[0, side, 0]
        speed = float(way @ way)
        if speed <= 0.0:
            return None
        rate = float(np.diff(strip.course(place + 1e-6 * span * np.array([-1.0, 1.0])))[0])
        step = float(off @ way) / speed * 2e-6 * span / rate
        place -= step
        if abs(step) <= 1e-12 * span:  # the next one is below rounding
            break
        if not s[0] + 1e-6 * span < place < s[-1] - 1e-6 * span:
            return None
    return place if np.abs(off).max() <= FLOOR * size else None


def _runs_back(
    mine: tuple[Strip, int], place: float, its: tuple[Strip, int], end: int, size: float
) -> bool:
    """Whether from ``place`` on the one long edge is the other, from its ``end`` on, backwards."""
    (own, side), (other, b) = mine, its
    s, u = own.course.s, other.course.s
    room = place - s[0] if end == 0 else s[-1] - place
    length = min(float(room), float(u[-1] - u[0]))
    way = length * SHARES if end == 0 else -length * SHARES
    here = own.rails(own.course(place - way))[:, side, 0]
    there = other.rails(other.course(u[-end] + way))[:, b, 0]
    return bool(np.abs(here - there).max() <= FLOOR * size)


def _courses(strip: Strip, cuts: Array) -> list[Course]:
    """The parts of a strip's course between places s."""
    s = strip.course.s
    ends = np.concatenate([s[:1], cuts, s[-1:]])
    out = []
    for low, high in pairwise(ends):
        places = np.concatenate([[low], s[(s > low) & (s < high)], [high]])
        out.append(Course(strip.course(places), places))
    return out


def mirrored_knots(knots: Array, strip: Strip) -> Array | None:
    """The distinct knots of an earlier strip's fit laid on this strip's course, backwards; None
    where the course has breaks elsewhere."""
    s = strip.course.s
    distinct = np.unique(knots)
    share = (distinct[-1] - distinct[::-1]) / (distinct[-1] - distinct[0])
    out = s[0] + (s[-1] - s[0]) * share
    nearest = np.abs(out[:, None] - s).argmin(axis=0)
    if np.abs(out[nearest] - s).max() > FLOOR * (s[-1] - s[0]):
        return None
    out[nearest] = s
    return np.asarray(out)


def reversed_equal(own: Curve, other: Curve, size: float) -> bool:
    """Whether one curve is the other run backwards, to a hundredth of what edges may gape."""
    near = 1e-2 * max(1e-7, FLOOR * size)
    if isinstance(own, Arc) and isinstance(other, Arc):
        return (
            float(np.abs(own.centre - other.centre).max()) <= near
            and abs(own.radius - other.radius) <= near
        )
    if isinstance(own, Ellipse) and isinstance(other, Ellipse):
        return (
            float(np.abs(own.centre - other.centre).max()) <= near
            and max(abs(own.major - other.major), abs(own.minor - other.minor)) <= near
        )
    if not (isinstance(own, Spline) and isinstance(other, Spline)):
        return False
    if own.degree != other.degree or own.knots.shape != other.knots.shape:
        return False
    first, last = other.knots[[0, -1]]
    share = (last - other.knots[::-1]) / (last - first)
    mine = (own.knots - own.knots[0]) / (own.knots[-1] - own.knots[0])
    same = np.abs(share - mine).max() <= 1e-12 and _weights_match(own, other)
    return bool(same and np.abs(own.poles - other.poles[::-1]).max() <= near)


def _weights_match(own: Spline, other: Spline) -> bool:
    if own.weights is None or other.weights is None:
        return own.weights is other.weights
    return bool(np.abs(own.weights - other.weights[::-1]).max() <= 1e-9)


def reversed_trace(
    trace: Trace | None, span: tuple[float, float], other: tuple[float, float]
) -> Trace | None:
    """The trace of an edge over ``span`` run backwards, over the ``other`` edge's span."""
    if isinstance(trace, Spline):
        share = (span[1] - trace.knots[::-1]) / (span[1] - span[0])
        knots = other[0] + share * (other[1] - other[0])
        return replace(trace, knots=knots, poles=trace.poles[::-1])
    if not isinstance(trace, Straight):
        return None
    low, high = (trace.origin + x * trace.direction for x in span)
    return Stretch(high, low)


def _spread(strip: Strip) -> Array:
    s = strip.course.s
    return np.asarray(s[0] + (s[-1] - s[0]) * SHARES)
