"""Texture atlas: where the patterns of several panels lie side by side, moved but never turned.

xatlas puts charts into each other's hollows on a grid of cells, here in the smallest square that
it can fill. It also stretches every chart to whole cells, so only the cell of its corner is taken,
and that no two patterns overlap is proven here on their own outlines. Where it is not so, or a
larger square is needed, the patterns' boxes stand on shelves instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.pattern import Pattern
from devcad.flatten.polygons import places
from devcad.geometry.taylor import Array, rows_dot

CELLS = 512
"""The atlas of patterns that fill their boxes is about so many cells wide; it may be more."""
PADDING = 3
"""Cells between charts: two are left where stretching a chart takes one."""
THINNED = 0.1
"""Of a cell: how far a chart's polygon may keep from the outline."""
FOLLOWED = 1e-3
"""Of a cell: how closely the outline is followed first; then that is measured."""
TRIALS = 7
"""Squares tried, each half way between one that is too small and one that is not."""

Triangles = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Atlas:
    """``offsets`` (n, 2) in mm: how far each pattern's lower left corner lies from that of the
    square of ``side`` mm that holds all of them."""

    offsets: Array
    side: float


@dataclass(frozen=True, slots=True)
class _Chart:
    """An outline (k, 2) with its box's corner at the origin, mm; ``off`` is how far the true
    outline and the mesh's chords may lie from it."""

    outline: Array
    size: Array
    off: float


def atlas(patterns: Sequence[Pattern], deviations: Sequence[float]) -> Atlas:
    """Where each pattern lies, none overlapping another: the same for the same patterns.

    ``deviations`` (mm) are how far the chords of each panel's mesh may leave its outline.
    """
    boxes = np.array([pattern.bbox for pattern in patterns])
    sizes = boxes[:, 2:] - boxes[:, :2]
    if len(patterns) == 1:
        return Atlas(np.zeros((1, 2)), float(sizes.max()))
    cell = _round(float(np.sqrt(sizes.prod(axis=1).sum())) / CELLS)
    charts = [
        _chart(pattern, box, cell, deviation)
        for pattern, box, deviation in zip(patterns, boxes, deviations, strict=True)
    ]
    shelves = _shelves(sizes, PADDING * cell + 2.0 * max(chart.off for chart in charts))
    largest = _side_of(shelves, sizes)
    packed = _packed(charts, cell, largest)
    if packed is None or _side_of(packed, sizes) >= largest or not disjoint(charts, packed):
        return Atlas(shelves, largest)
    return Atlas(packed, _side_of(packed, sizes))


def _side_of(offsets: Array, sizes: Array) -> float:
    """The side of the square that boxes fill, mm."""
    return float((offsets + sizes).max())


def _round(length: float) -> float:
    """The next larger of 1, 2, 5, 10, 20, ..."""
    decade = 10.0 ** np.floor(np.log10(length))
    return float(decade * next(f for f in (1.0, 2.0, 5.0, 10.0) if f * decade >= length))


def _chart(pattern: Pattern, box: Array, cell: float, deviation: float) -> _Chart:
    size = box[2:] - box[:2]
    if not pattern.outline:
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) * size
        return _Chart(corners, size, deviation)
    runs, bulge = [], 0.0
    for edge in pattern.outline:
        u = places(edge, FOLLOWED * cell)
        points = edge.curve(u)[0] - box[:2]
        middles = edge.curve(0.5 * (u[1:] + u[:-1]))[0] - box[:2]
        bulge = max(bulge, float(np.abs(middles - 0.5 * (points[1:] + points[:-1])).max()))
        runs.append(points[:-1])
    thin = THINNED * cell
    return _Chart(_thinned(np.concatenate(runs), thin), size, thin + 2.0 * bulge + deviation)


def _packed(charts: Sequence[_Chart], cell: float, largest: float) -> Array | None:
    """xatlas's places for the charts' corners, (n, 2) in mm, in the smallest square below
    ``largest`` (mm) that it finds; None where it finds none."""
    found: Array | None = None
    least = np.sqrt(sum(float(c.size.prod()) for c in charts)) / 2.0
    low = int(max(least, *(float(c.size.max()) for c in charts)) / cell)
    high = int(largest / cell) + 2 * PADDING
    given = [((c.outline / cell).astype(np.float32), _triangles(c.outline)) for c in charts]
    for _ in range(TRIALS):
        cells = (low + high) // 2
        trial = _filled(given, cells)
        low, high = (cells, high) if trial is None else (low, cells)
        found = found if trial is None else cell * trial
        if high - low <= 1:
            break
    return found


def _filled(
    given: Sequence[tuple[NDArray[np.float32], Triangles | None]], cells: int
) -> Array | None:
    """Where xatlas puts charts, measured in cells, in one square of so many, (n, 2); None if they
    need more, or if it does not keep each in one piece, upright and of its size but for a cell."""
    import xatlas

    packer = xatlas.Atlas()
    for outline, triangles in given:
        if triangles is None:
            return None
        packer.add_uv_mesh(outline, triangles)
    options = xatlas.PackOptions()
    options.resolution, options.texels_per_unit = cells, 1.0
    options.padding = PADDING
    options.rotate_charts = options.rotate_charts_to_axis = options.bilinear = False
    options.bruteForce = True
    packer.generate(pack_options=options)
    if packer.atlas_count != 1:
        return None
    corners = []
    for k, (outline, _) in enumerate(given):
        vertices, _, uv = packer[k]
        there = uv * np.array([packer.width, packer.height])
        corner = np.round(there.min(axis=0))
        moved = np.abs(there - corner - outline[vertices])
        if packer.get_mesh_chart_count(k) != 1 or moved.max() > 1.5:
            return None
        corners.append(corner)
    placed = np.array(corners)
    return np.asarray(placed - placed.min(axis=0))


def _shelves(sizes: Array, gap: float) -> Array:
    """Boxes (n, 2) in rows from the tallest on, ``gap`` apart: their corners, (n, 2)."""
    width = max(float(sizes[:, 0].max()), 1.1 * float(np.sqrt((sizes + gap).prod(axis=1).sum())))
    corners = np.zeros_like(sizes)
    x = y = tallest = 0.0
    for k in np.argsort(-sizes[:, 1], kind="stable"):
        if x and x + sizes[k, 0] > width:
            x, y, tallest = 0.0, y + tallest + gap, 0.0
        corners[k] = x, y
        x, tallest = x + sizes[k, 0] + gap, max(tallest, sizes[k, 1])
    return corners


def disjoint(charts: Sequence[_Chart], offsets: Array) -> bool:
    """Whether no two charts overlap: their boxes do not, or their outlines keep apart and none
    lies inside another."""
    low, high = offsets, offsets + [chart.size for chart in charts]
    for i, j in combinations(range(len(charts)), 2):
        off = charts[i].off + charts[j].off
        if (low[i] > high[j] + off).any() or (low[j] > high[i] + off).any():
            continue
        one, other = (charts[k].outline + offsets[k] for k in (i, j))
        if _distance(one, other) <= off or _inside(one[0], other) or _inside(other[0], one):
            return False
    return True


def _distance(one: Array, other: Array) -> float:
    """The smallest distance between two closed polygons that do not cross, 0 if they do."""
    nearest = min(_from_points(one, other), _from_points(other, one))
    return 0.0 if _cross(one, other) else nearest


def _from_points(points: Array, closed: Array) -> float:
    """The smallest distance from points (n, 2) to a closed polygon (k, 2)."""
    best = np.inf
    along = np.roll(closed, -1, axis=0) - closed
    length = np.maximum(rows_dot(along, along), 1e-300)
    for start in range(0, len(points), CELLS):
        away = points[start : start + CELLS, None] - closed
        share = np.clip((away * along).sum(axis=2) / length, 0.0, 1.0)
        best = min(best, float(np.linalg.norm(away - share[..., None] * along, axis=2).min()))
    return best


def _cross(one: Array, other: Array) -> bool:
    """Whether sides of two closed polygons cross."""
    a, b = one[:, None], np.roll(one, -1, axis=0)[:, None]
    c, d = other[None], np.roll(other, -1, axis=0)[None]
    return bool(
        ((_side(a, b, c) * _side(a, b, d) < 0.0) & (_side(c, d, a) * _side(c, d, b) < 0.0)).any()
    )


def _side(a: Array, b: Array, p: Array) -> Array:
    """Twice the area of the triangles a, b, p: positive where p lies to the left."""
    u, w = b - a, p - a
    return np.asarray(u[..., 0] * w[..., 1] - u[..., 1] * w[..., 0])


def _inside(point: Array, closed: Array) -> bool:
    """Whether a point lies inside a closed polygon."""
    a, b = closed - point, np.roll(closed, -1, axis=0) - point
    turn = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], rows_dot(a, b))
    return bool(abs(turn.sum()) > np.pi)


def _thinned(closed: Array, off: float) -> Array:
    """A closed polygon with as few of its points as keep it within ``off`` (Douglas-Peucker)."""
    far = int(np.argmax(np.linalg.norm(closed - closed[0], axis=1)))
    kept = [0, far]
    runs = [(0, far), (far, len(closed))]
    around = np.concatenate([closed, closed[:1]])
    while runs:
        i, j = runs.pop()
        if j - i < 2:
            continue
        chord, away = around[j] - around[i], around[i + 1 : j] - around[i]
        share = np.clip(away @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
        distance = np.linalg.norm(away - share[:, None] * chord, axis=1)
        k = i + 1 + int(np.argmax(distance))
        if distance[k - i - 1] > off:
            kept.append(k)
            runs += [(i, k), (k, j)]
    return np.asarray(closed[sorted(kept)])


def _triangles(closed: Array) -> Triangles | None:
    """A polygon that runs counterclockwise cut into triangles, ear by ear; None if it crosses
    itself."""
    left = list(range(len(closed)))
    made = []
    while len(left) > 3:
        ring = closed[left]
        before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
        area = _side(before, ring, after)
        for k in np.argsort(-area, kind="stable"):
            a, b, c = before[k], ring[k], after[k]
            inside = (
                (_side(a, b, ring) > 0.0) & (_side(b, c, ring) > 0.0) & (_side(c, a, ring) > 0.0)
            )
            if area[k] > 0.0 and not inside.any():
                break
        else:
            return None
        made.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[int(k)]
    return np.array([*made, tuple(left)], dtype=np.uint32)
