"""The points that the mesh of a sheet with cuts uses, patch by patch, and which are one point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.cells import Cell, Piece, Run
from devcad.geometry.chain import Chain, Joint
from devcad.geometry.taylor import Array
from devcad.mesh.contours import Contours
from devcad.mesh.stations import Flat, Stations

Numbers = NDArray[np.intp]
CORNERS = {0: ((0, 0), (0, 1)), 1: ((0, 1), (1, 1)), 2: ((1, 1), (1, 0)), 3: ((1, 0), (0, 0))}
"""Where a cell's side starts and ends: its first or last ruling, there v_from (0) or v_to (1)."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Where the pieces of runs lie among the rows of the contours."""

    starts: list[int]
    us: list[dict[float, int]]
    lines: dict[tuple[int, int], int]

    def of(self, piece: Piece) -> range:
        """The rows of a piece, its two ends included."""
        line = self.lines[piece.cut, piece.track]
        start, u = self.starts[line], self.us[line]
        return range(start + u[piece.u[0]], start + u[piece.u[1]] + 1)


@dataclass(frozen=True, slots=True)
class Meeting:
    """A row that lies on a border of a cell of a patch."""

    row: int
    patch: int
    cell: int
    side: int


@dataclass(slots=True)
class Nodes:
    """The points of one patch: n corners at v_from, n at v_to, then rows of contours.

    t, v (k,); points (layers, k, 3) and ids (layers, k), equal to the bit and equal where points
    are one; normals of the surface (k, 3); flats (k, 2). ``node`` (rows,) finds a contour's row,
    -1 where it lies on another patch. ``borders[i]`` are the nodes on ruling i, v rising, without
    the corners.
    """

    number: int
    stations: Stations
    t: Array
    v: Array
    points: Array
    ids: NDArray[np.int64]
    normals: Array
    flats: Array
    node: Numbers
    borders: list[list[int]] = field(default_factory=list)

    def corner(self, cell: int, place: tuple[int, int]) -> int:
        """The node at a corner of a cell."""
        ruling, end = place
        return end * len(self.stations.t) + cell + ruling


def rows_of(contours: Contours, lines: dict[tuple[int, int], int]) -> Rows:
    """The finder of rows."""
    starts = np.searchsorted(contours.line, np.arange(len(lines) + 1))
    us = [
        {u: k for k, u in enumerate(contours.u[a:b].tolist())} for a, b in pairwise(starts.tolist())
    ]
    return Rows(starts[:-1].tolist(), us, lines)


def meetings(parts: Sequence[Sequence[Cell]], rows: Rows) -> list[Meeting]:
    """Where the runs of all cells of all patches meet the cells' borders."""
    out = []
    for number, found in enumerate(parts):
        for index, cell in enumerate(found):
            for run in (item for loop in cell.loops for item in loop if isinstance(item, Run)):
                if run.first is not None and run.last is not None:
                    first, last = rows.of(run.pieces[0])[0], rows.of(run.pieces[-1])[-1]
                    out.append(Meeting(first, number, index, run.first.side))
                    out.append(Meeting(last, number, index, run.last.side))
    return out


def welded(
    contours: Contours, stations: list[Stations], found: list[Meeting], least: float
) -> tuple[Array, NDArray[np.int64]]:
    """The contours' points (layers, n, 3) and their numbers (layers, n); those too near to the
    corner of a cell that they meet are that corner."""
    layers = len(contours.points)
    points = contours.points.copy()
    used = 1 + max(int(ids.max()) for s in stations for rails in s.ids for ids in rails)
    groups = int(contours.group.max()) + 1
    ids = used + groups * np.arange(layers)[:, None] + contours.group
    for number, s in enumerate(stations):
        here = [m for m in found if m.patch == number]
        rows = np.array([m.row for m in here], dtype=np.intp)
        for nth in (0, 1):
            places = np.array([CORNERS[m.side][nth] for m in here], dtype=np.intp).reshape(-1, 2)
            at = np.array([m.cell for m in here], dtype=np.intp) + places[:, 0]
            corners = np.stack([np.stack(s.points[k])[places[:, 1], at] for k in range(layers)])
            gap = np.abs(corners - contours.points[:, rows]).max(axis=2).min(axis=0)
            for i in np.flatnonzero(gap < least).tolist():
                same = contours.group == contours.group[rows[i]]
                for k in range(layers):
                    points[k, same] = corners[k, i]
                    ids[k, same] = s.ids[k][places[i, 1]][at[i]]
    return points, ids


def nodes_of(
    chain: Chain,
    stations: list[Stations],
    contours: Contours,
    points: Array,
    ids: NDArray[np.int64],
    found: list[Meeting],
    flat: Flat,
    least: float,
) -> list[Nodes]:
    """The nodes of every patch, those on its rulings told."""
    out = []
    for number, s in enumerate(stations):
        rows = np.flatnonzero(contours.patch == number)
        node = np.full(len(contours.t), -1)
        node[rows] = 2 * len(s.t) + np.arange(len(rows))
        own = _corners(number, s, node)
        _extend(own, contours.t[rows], contours.v[rows], points[:, rows], ids[:, rows], flat)
        out.append(own)
    on = [_on_rulings(nodes, least) for nodes in out]
    for meeting in found:
        if meeting.side in (0, 2):
            ruling = meeting.cell + meeting.side // 2
            on[meeting.patch][ruling].append(int(out[meeting.patch].node[meeting.row]))
    around = [*chain.joints, *([chain.closing] if chain.closing else [])]
    for k, joint in enumerate(around):
        after = (k + 1) % len(out)
        _exchange(out[k], on[k][-1], out[after], on[after][0], joint, flat)
    for nodes, borders in zip(out, on, strict=True):
        nodes.borders = [_sorted(nodes, i, border) for i, border in enumerate(borders)]
    return out


def _corners(number: int, s: Stations, node: Numbers) -> Nodes:
    return Nodes(
        number,
        s,
        np.concatenate([s.t, s.t]),
        np.concatenate([s.frame.v_from, s.frame.v_to]),
        np.stack([np.concatenate(rails) for rails in s.points]),
        np.stack([np.concatenate(ids) for ids in s.ids]).astype(np.int64),
        np.concatenate([s.frame.n, s.frame.n]),
        np.concatenate(s.flat),
        node,
    )


def _extend(
    nodes: Nodes, t: Array, v: Array, points: Array, ids: NDArray[np.int64], flat: Flat
) -> None:
    """Add nodes at (t, v)."""
    if not len(t):
        return
    nodes.t, nodes.v = np.concatenate([nodes.t, t]), np.concatenate([nodes.v, v])
    nodes.points = np.concatenate([nodes.points, points], axis=1)
    nodes.ids = np.concatenate([nodes.ids, ids], axis=1)
    nodes.normals = np.concatenate([nodes.normals, nodes.stations.patch.frame(t).n])
    nodes.flats = np.concatenate([nodes.flats, flat(nodes.number, t, v)])


def _on_rulings(nodes: Nodes, least: float) -> list[list[int]]:
    """Per ruling the nodes that are no corners and nearer to it than ``least`` in mm."""
    s = nodes.stations
    first = 2 * len(s.t)
    out: list[list[int]] = [[] for _ in s.t]
    t = nodes.t[first:]
    after = np.clip(np.searchsorted(s.t, t), 1, len(s.t) - 1)
    points = nodes.points[0, first:]
    for ruling in (after - 1, after):
        low, high = s.points[0][0][ruling], s.points[0][1][ruling]
        along = high - low
        square = np.maximum((along**2).sum(axis=1), 1e-300)
        share = ((points - low) * along).sum(axis=1) / square
        foot = low + np.clip(share, 0.0, 1.0)[:, None] * along
        near = np.flatnonzero(np.linalg.norm(points - foot, axis=1) < least)
        for k, i in zip((first + near).tolist(), ruling[near].tolist(), strict=True):
            out[i].append(k)
    return out


def _exchange(
    before: Nodes, ours: list[int], after: Nodes, theirs: list[int], joint: Joint, flat: Flat
) -> None:
    """Nodes that only one of two neighbours knows on their joint become nodes of the other."""
    mine, known = _ids(before, ours), _ids(after, theirs)
    pairs = (
        (before, ours, after, theirs, known, 0, 1.0),
        (after, theirs, before, ours, mine, -1, -1.0),
    )
    fresh = [
        [k for k, number in zip(nodes, _ids(source, nodes), strict=True) if number not in held]
        for source, nodes, _, _, held, _, _ in pairs
    ]
    for new, (source, _, target, list_, _, row, sign) in zip(fresh, pairs, strict=True):
        start = len(target.t)
        t = np.full(len(new), target.stations.t[row])
        v = source.v[new] + sign * joint.shift
        _extend(target, t, v, source.points[:, new], source.ids[:, new], flat)
        list_ += range(start, start + len(new))


def _ids(nodes: Nodes, numbers: list[int]) -> list[int]:
    return [int(x) for x in nodes.ids[0, numbers]]


def _sorted(nodes: Nodes, ruling: int, border: list[int]) -> list[int]:
    """The nodes on a ruling, v rising, each point once and without the ruling's corners."""
    if not border:
        return []
    n = len(nodes.stations.t)
    seen = {int(nodes.ids[0, ruling]), int(nodes.ids[0, n + ruling])}
    out = []
    for k in sorted(border, key=lambda k: float(nodes.v[k])):
        number = int(nodes.ids[0, k])
        if number not in seen:
            seen.add(number)
            out.append(k)
    return out
