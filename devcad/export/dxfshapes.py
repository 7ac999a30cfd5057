"""Entities of a drawing that somebody wrote, as lines and arcs in its plane, and the contours
that they form end to end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.flatten import loops
from devcad.flatten.loops import Loop, Path
from devcad.geometry.taylor import Array

FLATTENED = 1e-4
"""mm between a spline or an ellipse and the polygon that stands for it."""
JOINED = 1e-6
"""mm, beside 1e-9 of the drawing's size: ends as near are one."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What an entity draws: a path from its start to its end, ``closed`` where the entity itself
    says so. ``whole`` means that the path's segments are not the entity's own: it is one curve."""

    entity: Any
    path: Path
    closed: bool
    whole: bool = False

    @property
    def lengths(self) -> Array:
        """The lengths of its segments, mm."""
        path = self.path
        each = loops.lengths(path.points[:-1], path.points[1:], path.bulges)
        return np.array([each.sum()]) if self.whole else each


def shape(entity: Any) -> Shape | None:
    """What an entity draws, None for what is no line."""
    kind = entity.dxftype()
    if kind == "LINE":
        points = np.array([tuple(entity.dxf.start)[:2], tuple(entity.dxf.end)[:2]])
        return Shape(entity, Path(points, np.zeros(1), False, 0.0), False)
    if kind in ("ARC", "CIRCLE"):
        return Shape(entity, _round(entity), kind == "CIRCLE", True)
    if kind in ("LWPOLYLINE", "POLYLINE"):
        return _polyline(entity)
    if kind in ("SPLINE", "ELLIPSE"):
        points = np.array([tuple(p)[:2] for p in entity.flattening(FLATTENED)])
        return Shape(entity, Path(points, np.zeros(len(points) - 1), False, 0.0), False, True)
    return None


def _round(entity: Any) -> Path:
    centre, radius = np.array(tuple(entity.dxf.center))[:2], float(entity.dxf.radius)
    if entity.dxftype() == "CIRCLE":
        return loops.arc_path(centre, radius, 0.0, 2.0 * np.pi)
    first, last = (float(np.radians(a)) for a in (entity.dxf.start_angle, entity.dxf.end_angle))
    sweep = (last - first) % (2.0 * np.pi)
    return loops.arc_path(centre, radius, first, sweep or 2.0 * np.pi)


def _polyline(entity: Any) -> Shape | None:
    if entity.dxftype() == "LWPOLYLINE":
        rows, closed = np.array(entity.get_points("xyb"), dtype=float), bool(entity.closed)
    elif entity.is_2d_polyline:
        rows = np.array([[*list(v.dxf.location)[:2], v.dxf.bulge] for v in entity.vertices])
        closed = bool(entity.is_closed)
    else:
        return None
    if len(rows) < 2:
        return None
    points, bulges = rows[:, :2], rows[:, 2]
    if closed:
        points = np.vstack([points, points[:1]])
    else:
        bulges = bulges[:-1]
    return Shape(entity, _halved(Path(points, bulges, False, 0.0)), closed)


def _halved(path: Path) -> Path:
    """The path with arcs of more than half a turn in two."""
    if not np.any(np.abs(path.bulges) > 1.0 + 1e-9):
        return path
    points, bulges = [path.points[:1]], []
    for start, end, bulge in zip(path.points[:-1], path.points[1:], path.bulges, strict=True):
        parts = 2 if abs(bulge) > 1.0 + 1e-9 else 1
        inner, part = loops.split(start, float(bulge), end, parts)
        points += [inner, end[None]]
        bulges += [part] * parts
    return Path(np.concatenate(points), np.array(bulges), path.exact, path.deviation)


def contour_loops(
    shapes: Sequence[Shape], size: float
) -> tuple[list[tuple[list[int], Loop]], list[tuple[float, float]]]:
    """The closed contours, each with the numbers of its entities, and the ends that meet no
    other, in a drawing of that ``size`` (mm).

    Entities that are not closed by themselves are joined end to end where exactly two meet.
    """
    near = JOINED + 1e-9 * size
    found = [([k], _loop(s.path)) for k, s in enumerate(shapes) if s.closed]
    left = [k for k, s in enumerate(shapes) if not s.closed]
    chains, loose = _chains([shapes[k].path for k in left], near)
    for chain in chains:
        paths = [_way(shapes[left[k]].path, forward) for k, forward in chain]
        points = np.concatenate([path.points[:-1] for path in paths])
        loop = Loop(points, np.concatenate([path.bulges for path in paths]))
        found.append(([left[k] for k, _ in chain], loop))
    return found, loose


def _loop(path: Path) -> Loop:
    return Loop(path.points[:-1], path.bulges, path.exact)


def _way(path: Path, forward: bool) -> Path:
    """A path, or the same run the other way."""
    if forward:
        return path
    return Path(path.points[::-1], -path.bulges[::-1], path.exact, path.deviation)


def _chains(
    paths: list[Path], near: float
) -> tuple[list[list[tuple[int, bool]]], list[tuple[float, float]]]:
    """Closed runs of paths, each (number, whether it is run forward), and loose ends."""
    if not paths:
        return [], []
    ends = np.array([[path.points[0], path.points[-1]] for path in paths]).reshape(-1, 2)
    node = _clusters(ends, near)
    meeting: dict[int, list[int]] = {}
    for end, at in enumerate(node.tolist()):
        meeting.setdefault(at, []).append(end)
    loose = [ends[those[0]] for those in meeting.values() if len(those) != 2]
    chains, seen = [], set()
    for first in range(len(paths)):
        if first in seen:
            continue
        chain, end = [], 2 * first
        while end // 2 not in seen:
            seen.add(end // 2)
            chain.append((end // 2, end % 2 == 0))
            out = end ^ 1
            those = meeting[int(node[out])]
            if len(those) != 2:
                break
            end = those[0] if those[1] == out else those[1]
        if end == 2 * first and len(meeting[int(node[end])]) == 2:
            chains.append(chain)
    return chains, [(float(x), float(y)) for x, y in loose]


def _clusters(points: Array, near: float) -> NDArray[np.intp]:
    """The same number for points that are within ``near`` of each other, (n,)."""
    cells: dict[tuple[int, int], list[int]] = {}
    number = np.arange(len(points))
    columns = np.floor(points / (2.0 * near)).astype(int).tolist()
    for k, (column, row) in enumerate(columns):
        around = ((column + dx, row + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1))
        for other in (i for cell in around for i in cells.get(cell, ())):
            if np.hypot(*(points[other] - points[k])) <= near:
                number[k] = number[other]
                break
        cells.setdefault((column, row), []).append(k)
    return number
