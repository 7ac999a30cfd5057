"""Clipping what is drawn on a pattern by what is cut out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.flatten import loops
from devcad.flatten.loops import SHORTEST
from devcad.flatten.pattern import CUTOUT, Edge, Line, length_bound
from devcad.flatten.polygons import winding
from devcad.geometry.taylor import Array

PARTS = 64
"""Sides of a polygon for an edge, from one of its u's to the next."""
SLACK = 0.05
"""Of a side of a polygon: how far beyond its ends a crossing is still looked for."""
NEWTON = 8
"""Steps from where two polygons cross to where the curves do."""
MET = 1e-9
"""Of the pattern's size: two curves as near to each other meet."""


@dataclass(frozen=True, slots=True)
class Sides:
    """Sides of polygons: from ``start`` to ``end``, each (n, 2), their parameters ``u`` (n, 2)
    and the number of the edge that each is of, (n,)."""

    start: Array
    end: Array
    u: Array
    edge: NDArray[np.intp]

    def near(self, other: Sides) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The pairs of sides whose boxes meet: rows of this and of the other."""
        (low, high), (low2, high2) = self._boxes(), other._boxes()
        rows = np.flatnonzero(np.all((low2 <= high.max(0)) & (high2 >= low.min(0)), axis=1))
        meet = (low[:, None] <= high2[rows]) & (high[:, None] >= low2[rows])
        i, j = np.nonzero(meet.all(axis=2))
        return i, rows[j]

    def passes(self, point: Array, near: float) -> bool:
        """Whether a side is as near to a point as that."""
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        rows = np.flatnonzero(np.all((low - near <= point) & (point <= high + near), axis=1))
        start, end = self.start[rows], self.end[rows]
        many = np.broadcast_to(point, start.shape)
        away = loops.segment_distance(start, end, np.zeros(len(rows)), many)
        return bool((away <= near).any())

    def _boxes(self) -> tuple[Array, Array]:
        margin = SLACK * np.abs(self.end - self.start).max(axis=1, keepdims=True)
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        return low - margin, high + margin


@dataclass(frozen=True, slots=True)
class Sheet:
    """What cuts leave of a pattern: the edges that are cut, and all contours as polygons; the
    outline None where it is not cut. ``near`` is when two points are one, in mm."""

    cuts: tuple[Edge, ...]
    sides: Sides
    outline: Array | None
    holes: tuple[Array, ...]
    boxes: Array
    near: float

    def line(self, line: Line) -> tuple[Line, ...]:
        """The parts of a straight line that lie on the sheet."""
        way = line.end - line.start

        def curve(u: Array) -> tuple[Array, Array]:
            return line.start + u[:, None] * way, np.broadcast_to(way, (len(u), 2))

        parts = self.edge(Edge("start", curve, np.array([0.0, 1.0])))
        ends = [part.curve(part.u)[0][[0, -1]] for part in parts]
        return tuple(replace(line, start=a, end=b) for a, b in ends)

    def edge(self, edge: Edge) -> tuple[Edge, ...]:
        """The parts of a curve (u increasing) that lie on the sheet, itself if that is all."""
        at = self._divided(edge)
        lengths = np.hypot(*np.diff(edge.curve(at)[0], axis=0).T)
        kept = self._covers(edge.curve(0.5 * (at[1:] + at[:-1]))[0])
        kept |= (lengths < SHORTEST) & (len(at) > 2)  # no line is interrupted by as little
        if kept.all():
            return (edge,)
        changes = at[np.flatnonzero(np.diff(kept.astype(int), prepend=0, append=0))].tolist()
        parts = []
        for low, high in zip(changes[::2], changes[1::2], strict=True):
            inner = edge.u[(edge.u > low) & (edge.u < high)]
            parts.append(replace(edge, u=np.concatenate([[low], inner, [high]])))
        return tuple(part for part in parts if length_bound(part) > SHORTEST)

    def _divided(self, edge: Edge) -> Array:
        """The ends of a curve and, between them, where it crosses a cut, increasing."""
        crossed = self._crossings(edge)
        points, ends = edge.curve(crossed)[0], edge.curve(edge.u[[0, -1]])[0]
        kept: list[int] = []
        for k, point in enumerate(points):
            before = points[kept[-1]] if kept else ends[0]
            if min(np.hypot(*(point - before)), np.hypot(*(point - ends[1]))) > self.near:
                kept.append(k)
        return np.concatenate([edge.u[:1], crossed[kept], edge.u[-1:]])

    def _crossings(self, edge: Edge) -> Array:
        """Where a curve meets the cuts, increasing, some of them several times."""
        sides = _sides([edge])
        mine, others = sides.near(self.sides)
        a, b = sides.start[mine], sides.end[mine]
        c, d = self.sides.start[others], self.sides.end[others]
        width = loops.cross(b - a, d - c)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = loops.cross(c - a, d - c) / width
            other = loops.cross(c - a, b - a) / width
        met = np.maximum(np.abs(share - 0.5), np.abs(other - 0.5)) <= 0.5 + SLACK
        mine, others, share, other = mine[met], others[met], share[met], other[met]
        u = sides.u[mine, 0] + share * np.ptp(sides.u[mine], axis=1)
        w = self.sides.u[others]
        start = w[:, 0] + other * (w[:, 1] - w[:, 0])
        which = self.sides.edge[others]
        found = [
            _meeting(edge, self.cuts[k], u[which == k], start[which == k], self.near)
            for k in np.unique(which).tolist()
        ]
        return np.sort(np.concatenate([np.zeros(0), *found]))

    def _covers(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (n, 2) lie on the sheet and on no cut."""
        return np.array([self._covers_one(point) for point in points])

    def _covers_one(self, point: Array) -> bool:
        low, high = self.boxes[:, :2], self.boxes[:, 2:]
        around = np.flatnonzero(np.all((low <= point) & (point <= high), axis=1)).tolist()
        if self.outline is not None and winding(self.outline, point) == 0:
            return False
        if any(winding(self.holes[i], point) for i in around):
            return False
        return not self.sides.passes(point, self.near)


def sheet(outline: tuple[Edge, ...], holes: Sequence[tuple[Edge, ...]]) -> Sheet:
    """The sheet inside an outline, counterclockwise, and outside holes, clockwise, of which the
    edges named "cutout" are the cuts."""
    cuts = tuple(e for contour in (outline, *holes) for e in contour if e.name == CUTOUT)
    notched = sum(edge.name == CUTOUT for edge in outline)
    sides = _sides(cuts)
    last = np.cumsum([notched, *(len(hole) for hole in holes)])
    rows = np.searchsorted(sides.edge, last)
    polygons = tuple(sides.start[a:b] for a, b in pairwise(rows.tolist()))
    boxes = [np.concatenate([p.min(axis=0), p.max(axis=0)]) for p in polygons]
    corners = np.concatenate([edge.curve(edge.u)[0] for edge in outline])
    return Sheet(
        cuts,
        sides,
        _sides(outline).start if notched else None,
        polygons,
        np.array(boxes).reshape(-1, 4),
        MET * float(np.hypot(*np.ptp(corners, axis=0))),
    )


def _sides(edges: Sequence[Edge]) -> Sides:
    """Edges as polygons, side by side in the order of their run."""
    share = np.arange(PARTS) / PARTS
    places = [
        np.append((e.u[:-1, None] + np.diff(e.u)[:, None] * share).ravel(), e.u[-1]) for e in edges
    ]
    points = [edge.curve(u)[0] for edge, u in zip(edges, places, strict=True)]
    return Sides(
        np.concatenate([p[:-1] for p in points]),
        np.concatenate([p[1:] for p in points]),
        np.concatenate([np.column_stack([u[:-1], u[1:]]) for u in places]),
        np.repeat(np.arange(len(edges)), [len(u) - 1 for u in places]),
    )


def _meeting(edge: Edge, cut: Edge, u: Array, w: Array, near: float) -> Array:
    """Where on an edge it meets a cut, by Newton steps from places u and w near to that."""
    ends = [(e.u.min(), e.u.max()) for e in (edge, cut)]
    for _ in range(NEWTON):
        u, w = np.clip(u, *ends[0]), np.clip(w, *ends[1])
        (p, dp), (q, dq) = edge.curve(u), cut.curve(w)
        width = loops.cross(dp, dq)
        safe = np.where(width != 0.0, width, np.inf)
        u = u + loops.cross(q - p, dq) / safe
        w = w + loops.cross(q - p, dp) / safe
    u, w = np.clip(u, *ends[0]), np.clip(w, *ends[1])
    return np.asarray(u[np.hypot(*(edge.curve(u)[0] - cut.curve(w)[0]).T) <= near])
