"""What is wrong with contours that a stranger drew: segments that lie on one another, contours
that cross themselves or each other, and which contour lies in which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from devcad.flatten import loops
from devcad.flatten.polygons import cross, winding
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]

SAMPLES = 17
"""Places on a segment that are looked at: two neighbours on another segment are a shared run."""
SAME = 1e-3
"""Of the distance that counts between contours: on one contour that runs back on itself. The two
sides of a tip without an angle come nearer to each other than any other limit."""
MOST_PAIRS = 2_000_000
SAG = 0.25
"""Of the width of a crossing that counts: how far the polygons' chords keep from their arcs."""


@dataclass(frozen=True, slots=True)
class Segments:
    """Lines and arcs side by side: starts and ends (n, 2), bulges (n,), ``owner`` (n,) the number
    of the entity each belongs to and ``contour`` (n,) that of its contour."""

    starts: Array
    ends: Array
    bulges: Array
    owner: Index
    contour: Index


@dataclass(frozen=True, slots=True)
class Shared:
    """Two owners run on each other near ``place``; ``whole`` where one of them does all along."""

    one: int
    other: int
    place: tuple[float, float]
    whole: bool


def shared_runs(segments: Segments, near: float, shortest: float) -> list[Shared]:
    """The pairs of owners, one of them twice too, whose segments lie within ``near`` (mm) of each
    other over more than ``shortest`` (mm), in order; on one contour, to rounding and over half a
    segment."""
    if not len(segments.bulges):
        return []
    i, j = _close(segments, near)
    points = _samples(segments)
    length = loops.lengths(segments.starts, segments.ends, segments.bulges)
    owner, count = segments.owner, np.bincount(segments.owner)
    covered: dict[tuple[int, int], dict[int, NDArray[np.bool_]]] = {}
    for a, b in ((i, j), (j, i)):  # the places of a that lie on b
        on = _lying(segments, points, a, b, near)
        steps = (on[:, 1:] & on[:, :-1]).sum(axis=1)
        counts = (steps > SAMPLES // 2) | (segments.contour[a] != segments.contour[b])
        runs = counts * steps * length[a] / (SAMPLES - 1)
        for row in np.flatnonzero(runs > shortest).tolist():
            on_it = covered.setdefault((int(owner[a[row]]), int(owner[b[row]])), {})
            on_it[int(a[row])] = on[row] | on_it.get(int(a[row]), False)
    found: dict[tuple[int, int], Shared] = {}
    for (one, other), places in covered.items():
        whole = one != other and len(places) == count[one] and all(map(np.all, places.values()))
        key = min(one, other), max(one, other)
        if key not in found or (whole and not found[key].whole):
            segment, lying = next(iter(places.items()))
            x, y = points[segment, lying].mean(axis=0).tolist()
            found[key] = Shared(*key, (x, y), bool(whole))
    return [found[key] for key in sorted(found)]


def _lying(segments: Segments, points: Array, a: Index, b: Index, near: float) -> NDArray[np.bool_]:
    """Which of the places on segments a lie on segments b, (n, SAMPLES)."""
    starts, ends, bulges = segments.starts[b], segments.ends[b], segments.bulges[b]
    limit = np.where(segments.contour[a] == segments.contour[b], SAME * near, near)
    columns = [
        loops.segment_distance(starts, ends, bulges, points[a, k]) <= limit for k in range(SAMPLES)
    ]
    return np.stack(columns, axis=1)


def _samples(segments: Segments) -> Array:
    """Points on every segment at equal steps, (n, SAMPLES, 2)."""
    half = loops.half_sweeps(segments.bulges)[:, None]
    share = np.linspace(0.0, 1.0, SAMPLES)
    flat = np.abs(half) < 1e-9
    safe = np.where(flat, 1.0, half)
    size = np.where(flat, share, np.sin(share * safe) / np.sin(safe))
    turn = np.where(flat, 0.0, half * (share - 1.0))
    chord = (segments.ends - segments.starts)[:, None]
    along = loops.direction(turn) * size[..., None]
    x = along[..., 0] * chord[..., 0] - along[..., 1] * chord[..., 1]
    y = along[..., 0] * chord[..., 1] + along[..., 1] * chord[..., 0]
    return segments.starts[:, None] + np.stack([x, y], axis=-1)


def _close(segments: Segments, near: float) -> tuple[Index, Index]:
    """Pairs i < j of segments whose boxes are within ``near`` of each other."""
    points = _samples(segments)
    sag = 0.02 * np.hypot(*(segments.ends - segments.starts).T) * np.abs(segments.bulges)
    low = points.min(axis=1) - (near + sag)[:, None]
    high = points.max(axis=1) + (near + sag)[:, None]
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    last = np.searchsorted(low[:, 0], high[:, 0], side="right")
    count = np.maximum(last - np.arange(len(order)) - 1, 0)
    found = []
    for rows in np.split(np.arange(len(order)), _batches(count)):
        a = np.repeat(rows, count[rows])
        b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(count[rows]) - count[rows], count[rows])
        meet = (low[a, 1] <= high[b, 1]) & (low[b, 1] <= high[a, 1])
        found.append(np.stack([order[a[meet]], order[b[meet]]]))
    i, j = np.concatenate(found, axis=1)
    return i, j


def _batches(count: Index) -> Index:
    """Where rows are divided so that the pairs of each part fit the memory."""
    group = np.cumsum(count) // MOST_PAIRS
    return np.flatnonzero(np.diff(group)) + 1


def polygon(loop: loops.Loop, width: float) -> Array:
    """A loop as a polygon whose sides keep to a quarter of ``width`` (mm), (k, 2)."""
    half = np.abs(loops.half_sweeps(loop.bulges))
    radii = np.hypot(*(loop.ends - loop.points).T) / (2.0 * np.maximum(np.sin(half), 1e-300))
    steps = np.sqrt(8.0 * SAG * width / np.maximum(radii, width))
    parts = np.where(loop.bulges == 0.0, 1.0, np.ceil(2.0 * half / steps)).astype(int)
    out = []
    for k in range(len(parts)):
        out.append(loop.points[k : k + 1])
        if parts[k] > 1:
            start, end, bulge = loop.points[k], loop.ends[k], float(loop.bulges[k])
            out.append(loops.split(start, bulge, end, int(parts[k]))[0])
    return np.concatenate(out)


def crossings(
    polygons: Sequence[Array], width: float
) -> list[tuple[int, int, tuple[float, float]]]:
    """The pairs of polygons that cross, one of them twice where it crosses itself, with a place.

    What they have in common where they cross must be wider than ``width`` (mm): less is lost in
    the kerf of any cutter.
    """
    if not polygons or not cross(list(polygons)):
        return []
    from shapely import LineString, polygonize, unary_union  # only drawings in trouble pay

    rings = unary_union([LineString(np.vstack([p, p[:1]])) for p in polygons])
    wound, places = [], []
    for piece in polygonize([rings]).geoms:
        if 2.0 * piece.area <= width * piece.length:
            continue
        point = np.array(piece.representative_point().coords[0])
        wound.append([winding(p, point) if _boxed(p, point) else 0 for p in polygons])
        places.append((float(point[0]), float(point[1])))
    return _tangled(np.array(wound).reshape(-1, len(polygons)), places)


def _boxed(polygon: Array, point: Array) -> bool:
    return bool(np.all(polygon.min(axis=0) <= point) and np.all(point <= polygon.max(axis=0)))


def _tangled(
    wound: Array, places: list[tuple[float, float]]
) -> list[tuple[int, int, tuple[float, float]]]:
    """Which polygons cross, by how often they go round each piece of the plane: (pieces, n)."""
    low, high = (f(np.vstack([wound, np.zeros_like(wound[:1])]), axis=0) for f in (np.min, np.max))
    out = []
    for k in np.flatnonzero(high - low > 1).tolist():
        row = int(np.argmax(np.abs(wound[:, k])))
        out.append((k, k, places[row]))
    inside = wound != 0
    common = {
        (i, j): row
        for row in range(len(places) - 1, -1, -1)
        for i, j in combinations(np.flatnonzero(inside[row]).tolist(), 2)
    }
    for (i, j), row in sorted(common.items()):
        a, b = inside[:, i], inside[:, j]
        if (a & ~b).any() and (b & ~a).any():
            out.append((i, j, places[row]))
    return out


def depths(polygons: Sequence[Array]) -> list[int]:
    """In how many of the others each polygon lies, where none cross; they may touch."""
    low = np.array([p.min(axis=0) for p in polygons]).reshape(-1, 2)
    high = np.array([p.max(axis=0) for p in polygons]).reshape(-1, 2)
    found = []
    for k, polygon in enumerate(polygons):
        place = _inside(polygon)
        near = np.all((low <= place) & (place <= high), axis=1)
        around = [j for j in np.flatnonzero(near).tolist() if j != k]
        found.append(sum(winding(polygons[j], place) != 0 for j in around))
    return found


def _inside(polygon: Array) -> Array:
    """A point just inside a polygon, beside the middle of its longest side, (2,)."""
    sides = np.roll(polygon, -1, axis=0) - polygon
    k = int(np.argmax(np.linalg.norm(sides, axis=1)))
    moment = polygon - polygon[0]
    area = np.sum(moment[:, 0] * sides[:, 1] - moment[:, 1] * sides[:, 0])
    inward = np.sign(area) * np.array([-sides[k, 1], sides[k, 0]])
    return np.asarray(polygon[k] + 0.5 * sides[k] + 1e-3 * inward)
