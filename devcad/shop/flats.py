"""Distances in the flat pattern that decide whether a press brake and a cutter can make it."""

from __future__ import annotations

import itertools

import numpy as np

from devcad.checks import Where
from devcad.flatten.green import bounds
from devcad.flatten.images import TrackImage
from devcad.flatten.pattern import Edge, Line, sample
from devcad.flatten.sheets import moved
from devcad.geometry.taylor import Array
from devcad.part import Panel

FINE = 64
"""Steps of an edge of a hole, between two of its u's."""
ZOOMS = 4
"""How often the place of a least distance is looked at more closely."""
NEARBY = 0.05
"""Radians: the points of an edge tell the direction of the least width as well as this."""
COLLINEAR = 1e-6
"""Of the pattern's size: parts of one bend line."""

Found = tuple[float, Where]
"""A length in mm and where it is."""


def flanges(panel: Panel) -> Found | None:
    """The least distance of the first and the last bend line from the sheet's ends, the edges
    ``start`` and ``end``; None without a bend line. On a tube those edges are its seam."""
    bends = [line for line in panel.pattern.lines if line.angle]
    if not bends:
        return None
    size = float(np.hypot(*np.subtract(panel.pattern.bbox[2:], panel.pattern.bbox[:2])))
    found: list[Found] = []
    for first, name in ((bends[0], "start"), (bends[-1], "end")):
        edges = [edge for edge in panel.pattern.outline if edge.name == name]
        parts = [line for line in bends if _on(line, first, COLLINEAR * size)]
        for edge, line in itertools.product(edges, parts):
            ends = edge.curve(edge.u[[0, -1]])[0]
            distance, place = _between(ends, np.stack([line.start, line.end]))
            found.append((distance, _flat(place)))
    return min(found, key=lambda one: one[0], default=None)


def holes_beside_bends(panel: Panel) -> Found | None:
    """The least distance of a hole's edge from a bend line; None where there is none of the two."""
    bends = [line for line in panel.pattern.lines if line.angle]
    edges = list(itertools.chain(*panel.pattern.holes))
    if not bends or not edges:
        return None
    starts, ends = np.array([b.start for b in bends]), np.array([b.end for b in bends])
    found = [(_nearest(edge, starts, ends), edge) for edge in edges]
    (distance, u), edge = min(found, key=lambda one: one[0][0])
    return distance, place_on(edge, u, panel)


def holes(panel: Panel) -> Found | None:
    """The least width of a hole, the narrower side of the narrowest box around it; None without
    holes."""
    found = [(*_width(hole), hole) for hole in panel.pattern.holes]
    if not found:
        return None
    _, angle, hole = min(found, key=lambda one: one[0])
    return _true_width(hole, angle), place_on(hole[0], float(hole[0].u[0]), panel)


def place_on(edge: Edge, u: float, panel: Panel) -> Where:
    """The place of an edge at u: in the pattern, and for the edge of a cutout in space too."""
    at = np.array([u])
    flat = edge.curve(at)[0][0]
    if not isinstance(edge.curve, TrackImage):
        return _flat(flat)
    track = edge.curve.track
    t, v = track.series(at).T
    x, y, z = panel.chain.patches[track.patch].point(t, v)[0].tolist()
    return Where(float(t[0]), float(v[0]), (x, y, z), (float(flat[0]), float(flat[1])))


def _flat(place: Array) -> Where:
    return Where(flat=(float(place[0]), float(place[1])))


def _on(line: Line, other: Line, near: float) -> bool:
    """Whether a line lies on the straight line through another."""
    way = other.end - other.start
    away = np.stack([line.start, line.end]) - other.start
    across = np.abs(way[0] * away[:, 1] - way[1] * away[:, 0])
    return bool((across <= near * np.hypot(*way)).all())


def _between(first: Array, second: Array) -> tuple[float, Array]:
    """The distance of two straight segments (2, 2) that do not cross, and its place on the
    second: it is taken at an end of one of them."""
    to_second = [_to_segments(point, second[:1], second[1:]) for point in first]
    to_first = [_to_segments(point, first[:1], first[1:]) for point in second]
    options = [(float(d[0]), foot[0]) for d, foot in to_second]
    options += [(float(d[0]), end) for (d, _), end in zip(to_first, second, strict=True)]
    return min(options, key=lambda one: one[0])


def _to_segments(point: Array, starts: Array, ends: Array) -> tuple[Array, Array]:
    """The distances (k,) of a point from segments starts to ends (k, 2), and the feet (k, 2)."""
    way = ends - starts
    share = np.einsum("ij,ij->i", point - starts, way) / np.einsum("ij,ij->i", way, way)
    feet = starts + np.clip(share, 0.0, 1.0)[:, None] * way
    return np.hypot(*(point - feet).T), feet


def _nearest(edge: Edge, starts: Array, ends: Array) -> tuple[float, float]:
    """The least distance of an edge from segments, and at which u."""
    low, high = np.sort(edge.u)[[0, -1]]
    best = np.inf, float(low)
    for _ in range(1 + ZOOMS):
        u = np.linspace(low, high, FINE + 1)
        points = edge.curve(u)[0]
        distances = np.array([_to_segments(point, starts, ends)[0].min() for point in points])
        k = int(np.argmin(distances))
        best = min(best, (float(distances[k]), float(u[k])))
        low, high = u[max(k - 1, 0)], u[min(k + 1, FINE)]
    return best


def _width(hole: tuple[Edge, ...]) -> tuple[float, float]:
    """The least width of a contour over all directions in mm, from points on it, and the angle of
    the direction along which it is so narrow."""
    from shapely import MultiPoint  # only a sheet with holes pays

    points = np.concatenate([sample(edge, FINE) for edge in hole])
    hull = np.array(MultiPoint(points).convex_hull.exterior.coords)
    way = np.diff(hull, axis=0)
    way /= np.hypot(*way.T)[:, None]
    across = np.abs(
        way[:, :1] * (hull[None, :, 1] - hull[:-1, None, 1])
        - way[:, 1:] * (hull[None, :, 0] - hull[:-1, None, 0])
    )
    widths = across.max(axis=1)
    k = int(np.argmin(widths))
    return float(widths[k]), float(np.arctan2(way[k, 1], way[k, 0]))


def _true_width(hole: tuple[Edge, ...], angle: float) -> float:
    """The least width of a contour between straight lines in about the direction of an angle."""
    reach, best = NEARBY, np.inf
    for _ in range(1 + ZOOMS):
        turns = angle + np.linspace(-reach, reach, 9)
        boxes = [bounds(tuple(moved(edge, -turn, np.zeros(2)) for edge in hole)) for turn in turns]
        widths = np.array([top - bottom for _, bottom, _, top in boxes])
        best = min(best, float(widths.min()))
        angle, reach = float(turns[np.argmin(widths)]), 0.25 * reach
    return best
