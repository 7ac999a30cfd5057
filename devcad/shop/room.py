"""Room on a pattern: where a box fits inside the outline, clear of holes, lines and drawings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.pattern import Edge, Line, Pattern
from devcad.geometry.taylor import Array

CENTRES, MOST_CENTRES = 500, 20_000
"""Points on the sheet that are tried as the middle of a box, about, and all around it at most."""
PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of a sequence that fills a square evenly and has no period that holes could share: 1/g and
1/g^2 with g^3 = g + 1. Source: M. Roberts, The unreasonable effectiveness of quasirandom
sequences, 2018."""
PUSHES = (0.5, 0.25)
"""Of the points' distance: how far they go away from the nearest border, one after the other, so
that in a narrow place some stand in the middle."""

BATCH = 200
"""Boxes that are tried at a time."""
STEPS, HALVINGS = 16, 12
"""Chords of an edge between two of its u's to begin with; how often they are halved at most."""
STRAIGHT = 1e-6
"""Of that: an edge that leaves its chord by no more is straight."""
PINS = 500
"""Points of borders and drawings, about, that no box may hold: most are refused for one of them."""


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle about ``centre`` (2,), ``width`` along ``angle`` (radians from +x)."""

    centre: Array
    angle: float
    width: float
    height: float

    def corners(self) -> Array:
        """The four corners counterclockwise, (4, 2)."""
        angle = np.array([self.angle])
        return np.asarray(_corners(self.centre[None], angle, self.width, self.height)[0])


@dataclass(frozen=True, slots=True)
class Room:
    """A sheet as a polygon, within ``bound`` mm of the true one, and what is drawn on it.

    ``centres`` (n, 2) are points of the sheet, ``clear`` (n,) their distances from its border,
    ``along`` (n,) the direction of the border next to them, ``middle`` (2,) where a box stands
    best. ``drawn`` is never crossed; ``lines`` may be, ``bends`` among them if need be.
    """

    sheet: Any
    borders: Any
    pins: Array
    bound: float
    middle: Array
    centres: Array
    clear: Array
    along: Array
    drawn: Any
    rulings: Any
    bends: Any
    taken: tuple[Box, ...] = ()

    @property
    def levels(self) -> tuple[int, ...]:
        """The values of ``cross`` (see :meth:`fit`) that differ here."""
        lined = [0] if len(self.rulings) else []
        bent = [2] if len(self.bends) else []
        return (*lined, 1, *bent)

    def without(self, box: Box) -> Room:
        """What is left when a box is taken."""
        return replace(self, taken=(*self.taken, box))

    def fit(self, boxes: Sequence[Box], *, cross: int = 0) -> Iterator[Box]:
        """Those of the boxes that lie inside the sheet and on nothing drawn, in their order.

        ``cross``: 0 clear of rulings and bend lines, 1 of bend lines, 2 of neither.
        """
        if boxes:
            corners = np.stack([box.corners() for box in boxes])
            yield from (boxes[k] for k in np.flatnonzero(self._free(corners, cross)).tolist())

    def best(
        self, width: float, height: float, *, angle: float | None = None, cross: int = 0
    ) -> Box | None:
        """The box of that size that fits, as near to the middle as it can be; None where none does.

        Without an ``angle`` level if it can be, else along the border next to it, else upright.
        """
        rows = np.flatnonzero(self.clear >= 0.5 * min(width, height))
        away = np.hypot(*(self.centres[rows] - self.middle).T)
        rows = rows[np.argsort(np.round(away, 6), kind="stable")]
        flat = np.zeros(len(rows))
        ways = (flat, self.along[rows], flat + 0.5 * np.pi) if angle is None else (flat + angle,)
        for angles in ways:
            for first in range(0, len(rows), BATCH):
                some = slice(first, first + BATCH)
                corners = _corners(self.centres[rows[some]], angles[some], width, height)
                found = np.flatnonzero(self._free(corners, cross))
                if found.size:
                    k = first + int(found[0])
                    return Box(self.centres[rows[k]], float(angles[k]), width, height)
        return None

    def holds(self, points: Array, margin: float) -> bool:
        """Whether points (n, 2) lie on the sheet, so far from its border at least."""
        import shapely

        inside = shapely.contains_xy(self.sheet, points[:, 0], points[:, 1])
        near = self.borders.query(
            shapely.points(points), predicate="dwithin", distance=margin + self.bound
        )
        return bool(inside.all()) and near.shape[1] == 0

    def _free(self, corners: Array, cross: int) -> NDArray[np.bool_]:
        """Which of the quadrilaterals (n, 4, 2) are free."""
        import shapely

        free = ~_held(corners, self.pins)
        shapes = shapely.polygons(corners)
        free[free] = shapely.contains_properly(self.sheet, shapes[free])
        for box in self.taken:
            free &= ~shapely.intersects(shapes, shapely.Polygon(box.corners()))
        for level, tree in ((0, self.rulings), (1, self.bends), (2, self.drawn)):
            left = np.flatnonzero(free)
            if level >= cross and left.size:
                hit = tree.query(shapes[left], predicate="intersects")[0]
                free[left[hit]] = False
        return free


def free_room(
    pattern: Pattern,
    sagitta: float,
    *,
    net: tuple[Edge, ...] = (),
    obstacles: Sequence[Edge] = (),
) -> Room | None:
    """The room inside a pattern's outline and inside ``net``, if given (the seam line of a piece
    with allowances), outside its holes; None where nothing is left.

    Curves become polygons within ``sagitta`` mm. Drawings of the pattern and ``obstacles`` are
    what nothing may lie on.
    """
    import shapely

    contours = (pattern.outline, *pattern.holes, *((net,) if net else ()))
    rings = [_ring(contour, sagitta) for contour in contours]
    sheet = _mended(shapely.Polygon(rings[0], rings[1 : 1 + len(pattern.holes)]))
    if net:
        sheet = _mended(shapely.intersection(sheet, _mended(shapely.Polygon(rings[-1]))))
    if sheet.is_empty or not sheet.area > 0.0:
        return None
    shapely.prepare(sheet)
    borders = shapely.STRtree(_segments(sheet))
    centres, clear, along = _centres(sheet, borders)
    drawn = [_points(edge, sagitta) for edge in (*pattern.drawings, *obstacles)]
    lines = pattern.lines
    return Room(
        sheet,
        borders,
        _pins(sheet, drawn),
        sagitta,
        np.array(shapely.get_coordinates(shapely.centroid(sheet))[0]),
        centres,
        clear,
        along,
        shapely.STRtree([shapely.LineString(points) for points in drawn]),
        _tree(line for line in lines if line.layer == "RULING"),
        _tree(line for line in lines if line.layer != "RULING"),
    )


def _tree(lines: Iterable[Line]) -> Any:
    import shapely

    return shapely.STRtree([shapely.LineString([line.start, line.end]) for line in lines])


def _ring(contour: tuple[Edge, ...], sagitta: float) -> Array:
    """A closed contour as a polygon, (n, 2)."""
    return np.concatenate([_points(edge, sagitta)[:-1] for edge in contour])


def _points(edge: Edge, sagitta: float) -> Array:
    """Points on an edge in the order of its run, so dense that the middle of no chord is farther
    from it than that, (n, 2)."""
    share = np.arange(STEPS) / STEPS
    u = np.append((edge.u[:-1, None] + np.diff(edge.u)[:, None] * share).ravel(), edge.u[-1])
    points = edge.curve(u)[0]
    if _off(points[[0]], points[[-1]], points).max() <= STRAIGHT * sagitta:
        return points[[0, -1]]
    for _ in range(HALVINGS):
        middle = 0.5 * (u[:-1] + u[1:])
        between = edge.curve(middle)[0]
        wide = np.flatnonzero(_off(points[:-1], points[1:], between) > sagitta)
        if not wide.size:
            break
        u = np.insert(u, wide + 1, middle[wide])
        points = np.insert(points, wide + 1, between[wide], axis=0)
    return points


def _off(a: Array, b: Array, p: Array) -> Array:
    """The distances of p (n, 2) from the segments a b."""
    along, away = b - a, p - a
    share = (along * away).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
    return np.asarray(np.hypot(*(away - np.clip(share, 0.0, 1.0)[:, None] * along).T))


def _mended(polygon: Any) -> Any:
    """The largest valid polygon of one whose samples touch or cross at a tip."""
    import shapely

    if not polygon.is_valid:
        polygon = shapely.make_valid(polygon)
    parts = [one for one in shapely.get_parts(polygon) if one.geom_type == "Polygon"]
    return max(parts, key=lambda one: float(one.area)) if parts else shapely.Polygon()


def _segments(sheet: Any) -> Any:
    """The sides of a polygon's rings, one line each."""
    import shapely

    rings = [shapely.get_coordinates(ring) for ring in (sheet.exterior, *sheet.interiors)]
    return shapely.linestrings(
        np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in rings])
    )


def _pins(sheet: Any, drawn: list[Array]) -> Array:
    """Some points of every ring and every drawing, (n, 2)."""
    import shapely

    rings = [shapely.get_coordinates(ring)[:-1] for ring in (sheet.exterior, *sheet.interiors)]
    runs = [*rings, *drawn]
    step = 1 + sum(map(len, runs)) // PINS
    return np.concatenate([run[::step] for run in runs])


def _held(corners: Array, pins: Array) -> NDArray[np.bool_]:
    """Which of the boxes (n, 4, 2) hold one of the points."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    pins = pins[np.all((pins > low) & (pins < high), axis=1)]
    held = np.ones((len(corners), len(pins)), dtype=bool)
    for side in (1, 3):
        way = corners[:, side] - corners[:, 0]  # (n, 2)
        along = way[:, :1] * pins[:, 0] + way[:, 1:] * pins[:, 1]
        along -= (way * corners[:, 0]).sum(axis=1, keepdims=True)
        held &= (along > 0.0) & (along < (way**2).sum(axis=1, keepdims=True))
    return np.asarray(held.any(axis=1))


def _centres(sheet: Any, borders: Any) -> tuple[Array, Array, Array]:
    """Points of a sheet, their distances from its border and the border's directions there."""
    import shapely

    x0, y0, x1, y1 = sheet.bounds
    box = (x1 - x0) * (y1 - y0)
    count = min(int(CENTRES * box / sheet.area) + 1, MOST_CENTRES)
    step = np.sqrt(box / count)
    spread = (np.arange(1, count + 1)[:, None] * PLASTIC) % 1.0
    spread = np.array([x0, y0]) + spread * np.array([x1 - x0, y1 - y0])
    points = np.concatenate([shapely.get_coordinates(shapely.centroid(sheet)), spread])
    points = points[shapely.contains_xy(sheet, points[:, 0], points[:, 1])]
    inner = shapely.get_coordinates(shapely.point_on_surface(sheet))
    points = np.concatenate([points, inner])
    found = [points]
    for share in PUSHES:
        feet, _ = _feet(borders, points)
        away = points - feet
        length = np.hypot(*away.T)
        points = points + share * step * away / np.maximum(length, 1e-300)[:, None]
        found.append(points)
    points = np.concatenate(found)
    points = points[shapely.contains_xy(sheet, points[:, 0], points[:, 1])]
    feet, along = _feet(borders, points)
    return points, np.hypot(*(points - feet).T), along


def _feet(borders: Any, points: Array) -> tuple[Array, Array]:
    """The nearest points (n, 2) of a border and its directions there, upright, (n,)."""
    import shapely

    pairs = borders.query_nearest(shapely.points(points), all_matches=False)
    ends = shapely.get_coordinates(borders.geometries[pairs[1]]).reshape(-1, 2, 2)
    start, way = ends[:, 0], ends[:, 1] - ends[:, 0]
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((points - start) * way).sum(axis=1) / square, 0.0, 1.0)
    return start + share[:, None] * way, upright(np.arctan2(way[:, 1], way[:, 0]))


def upright(angle: Array) -> Array:
    """Directions turned by half a turn where text along them would stand on its head: in
    (-90, 90] degrees, but for rounding."""
    return np.asarray(angle - np.pi * np.ceil(angle / np.pi - 0.5 - 1e-9))


def _corners(centres: Array, angles: Array, width: float, height: float) -> Array:
    """The corners of boxes, (n, 4, 2)."""
    x = 0.5 * width * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    y = 0.5 * height * np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    return np.stack([centres - x - y, centres + x - y, centres + x + y, centres - x + y], axis=1)
