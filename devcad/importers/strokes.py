"""Strokes: lines of a drawing in any order and direction, joined to closed contours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import JobError
from devcad.flatten.pattern import Edge
from devcad.flatten.rings import Contour, counterclockwise
from devcad.geometry.taylor import Array

SNAP = 1e-4
"""Ends of lines within so many mm are one point."""
ROUNDING = 1e-10
"""Ends as near as this, in mm, are left as they are."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """A smooth line in mm; ``what`` names it to people."""

    edge: Edge
    what: str

    @property
    def ends(self) -> Array:
        """The first and the last point, (2, 2)."""
        return self.edge.curve(self.edge.u[[0, -1]])[0]


def joined(strokes: list[Stroke], mm: float, *, place: str) -> tuple[Contour, ...]:
    """The closed contours that strokes make, counterclockwise, in the order of their first ones.

    Ends within ``SNAP`` meet half way; the lines are moved there in proportion. ``mm`` is the unit
    in which messages tell places.

    Raises:
        JobError: a line that ends alone, or more than two that meet in a point.
    """
    ends = np.array([stroke.ends for stroke in strokes]).reshape(-1, 2)
    point = _clusters(ends)
    _refuse_branches(strokes, ends, point, mm, place)
    other: dict[int, list[int]] = {}
    for end, cluster in enumerate(point.tolist()):
        other.setdefault(cluster, []).append(end)
    contours = []
    used = np.zeros(len(strokes), dtype=bool)
    for first in range(len(strokes)):
        if used[first]:
            continue
        ring: list[tuple[int, bool]] = []
        end = 2 * first  # enter the first stroke at its start
        while not used[end // 2]:
            used[end // 2] = True
            ring.append((end // 2, end % 2 == 1))
            leave = end ^ 1
            here, there = other[int(point[leave])]
            end = there if here == leave else here
        edges = [_run(strokes[k].edge, back) for k, back in ring]
        contours.append(counterclockwise(_closed(edges)))
    return tuple(contours)


def _clusters(points: Array) -> NDArray[np.intp]:
    """The number of the place that each point (n, 2) lies at."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(SNAP, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(points), len(points)))
    return np.asarray(connected_components(graph, directed=False)[1])


def _refuse_branches(
    strokes: list[Stroke], ends: Array, point: NDArray[np.intp], mm: float, place: str
) -> None:
    """JobError where a contour does not go on, or goes on in more than one way."""
    meeting = np.bincount(point)[point]
    wrong = np.flatnonzero(meeting != 2)
    if not len(wrong):
        return
    k = int(wrong[0])
    x, y = ends[k] / mm
    many = int(meeting[k])
    if many == 1:
        lonely = ends[(meeting == 1) & (np.arange(len(ends)) != k)]
        gap = float(np.hypot(*(lonely - ends[k]).T).min(initial=np.inf))
        near = f", {gap:.3g} mm from the next open end" if np.isfinite(gap) else ""
        what = f"the contour is open: the {strokes[k // 2].what} ends alone at ({x:.6g}, {y:.6g})"
        remedy = f"close it within {SNAP:g} mm, or put what is no contour on another layer"
        raise JobError(f"{what}{near}", place=place, value=gap, limit=SNAP, remedy=remedy)
    raise JobError(
        f"{many} lines meet at ({x:.6g}, {y:.6g}), one of them the {strokes[k // 2].what}",
        place=place,
        value=many,
        limit=2,
        remedy="remove what is drawn twice, and put what is no contour on another layer",
    )


def _run(edge: Edge, back: bool) -> Edge:
    """The edge in the direction in which it is passed."""
    return Edge(edge.name, edge.curve, edge.u[::-1]) if back else edge


def _closed(edges: list[Edge]) -> Contour:
    """Edges that follow each other round, their ends moved half way to one another."""
    starts = np.array([edge.curve(edge.u[:1])[0][0] for edge in edges])
    stops = np.array([edge.curve(edge.u[-1:])[0][0] for edge in edges])
    gaps = starts - np.roll(stops, 1, axis=0)  # before each edge
    gaps[np.hypot(*gaps.T) <= ROUNDING] = 0.0
    after = np.roll(gaps, -1, axis=0)
    moves = zip(edges, -0.5 * gaps, 0.5 * after, strict=True)
    return tuple(_moved(edge, first, last) for edge, first, last in moves)


def _moved(edge: Edge, first: Array, last: Array) -> Edge:
    """The edge, its ends moved by so much and what lies between in proportion."""
    if not first.any() and not last.any():
        return edge
    low, span = float(edge.u[0]), float(edge.u[-1] - edge.u[0])

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        share = ((u - low) / span)[:, None]
        return points + (1.0 - share) * first + share * last, slopes + (last - first) / span

    return Edge(edge.name, curve, edge.u)
