"""Cells of a flat sheet -> triangles, and the hinge between every two of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices, areas

FOLD, RULING, DIAGONAL = range(3)
KINDS = ("fold", "ruling", "diagonal")
"""What a hinge is: of a crease, between two cells, inside a cell."""

EQUAL = 1e-9  # relative: diagonals of one length in exact numbers, told apart by rounding only


def _none(columns: int) -> Indices:
    """No rows."""
    return np.zeros((0, columns), dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Sheet:
    """A flat sheet cut into cells.

    ``flat`` (n, 2) nodes in the pattern, mm; ``quads`` (m, 4) and ``triangles`` (k, 3) node
    numbers counter-clockwise as the front shows them; a triangle is a whole cell, where a strip
    ends in a tip. ``creases`` (c, 2) edges between two cells that are folded.
    """

    flat: Array
    quads: Indices
    triangles: Indices = field(default_factory=lambda: _none(3))
    creases: Indices = field(default_factory=lambda: _none(2))


@dataclass(frozen=True, slots=True)
class Faces:
    """Triangles of the cells: ``flat`` (n, 2), ``triangles`` (m, 3), ``cells`` (m,) the cell of
    each, ``areas`` of the cells mm^2; ``centres`` is how many nodes were added in the middle."""

    flat: Array
    triangles: Indices
    cells: Indices
    areas: Array
    quads: Indices
    centres: int

    def spans(self, hinges: Indices, cells: Indices) -> tuple[Array, Array]:
        """Of hinges inside quads: the whole diagonal's length, and the corners it does not touch.

        Two (h,) arrays, mm and radians; of hinges between cells they mean nothing.
        """
        if len(self.quads) == 0:
            return np.zeros(len(hinges)), np.zeros(len(hinges))
        quad = self.quads[np.minimum(cells, len(self.quads) - 1)]
        touches = np.any(quad[:, [0, 2], None] == hinges[:, None, :2], axis=(1, 2))
        turned = np.where(touches[:, None], quad, np.roll(quad, -1, axis=1))  # diagonal 0-2
        corner = self.flat[turned]
        before, after = np.roll(corner, 1, axis=1) - corner, np.roll(corner, -1, axis=1) - corner
        cross = after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]
        angle = np.arctan2(cross, np.einsum("hki,hki->hk", after, before))
        diagonal = np.linalg.norm(corner[:, 2] - corner[:, 0], axis=1)
        return np.asarray(diagonal), np.asarray(angle[:, 1] + angle[:, 3])


@dataclass(frozen=True, slots=True)
class Hinges:
    """``hinges`` (h, 4), ``cells`` (h, 2) beside each, ``kinds`` (h,), ``creases`` (c, k) those of
    each crease; ``share`` (h,) of its line's stiffness that a hinge has."""

    hinges: Indices
    cells: Indices
    kinds: NDArray[np.int64]
    creases: Indices
    share: Array


@dataclass(frozen=True, slots=True)
class Edges:
    """Directed edges of polygons, each (e,): from ``start`` to ``stop``, the corners ``before``
    and ``after`` them, and the polygon's cell."""

    start: Indices
    stop: Indices
    before: Indices
    after: Indices
    cell: Indices

    @classmethod
    def of(cls, polygons: Indices, cells: Indices) -> Edges:
        """Every edge of (m, k) polygons."""
        start, stop, before, after = (
            np.roll(polygons, shift, axis=1).reshape(-1) for shift in (0, -1, 1, -2)
        )
        return cls(start, stop, before, after, np.repeat(cells, polygons.shape[1]))

    def and_of(self, other: Edges) -> Edges:
        """Both."""
        return Edges(
            *(
                np.concatenate([getattr(self, name), getattr(other, name)])
                for name in self.__slots__
            )
        )


def divided(sheet: Sheet) -> Faces:
    """Every quad divided along its shorter diagonal (the one from corner 0 if they are equal).

    Raises:
        GeometryError: a cell that is not convex or not counter-clockwise.
    """
    flat, quads = _checked(sheet)
    corner = flat[quads]
    first = np.linalg.norm(corner[:, 2] - corner[:, 0], axis=1)
    second = np.linalg.norm(corner[:, 3] - corner[:, 1], axis=1)
    turned = np.where((first <= second * (1 + EQUAL))[:, None], quads, np.roll(quads, -1, axis=1))
    halves = np.stack([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    return _faces(sheet, flat, halves, 2, 0)


def crossed(sheet: Sheet) -> Faces:
    """Every quad with a node where its diagonals cross (N5B8), side 0 to side 3 in order.

    Raises:
        GeometryError: as ``divided``; triangles, which have no diagonals.
    """
    flat, quads = _checked(sheet)
    if len(sheet.triangles):
        raise GeometryError(
            "crossed panels have four sides, and this sheet has cells of three",
            value=len(sheet.triangles),
            limit=0,
            remedy='coefficients = "exact"',
        )
    a, b, c, d = np.moveaxis(flat[quads], 1, 0)
    share = _cross(b - a, d - b) / _cross(c - a, d - b)
    centre = a + share[:, None] * (c - a)
    middle = len(flat) + np.arange(len(quads))
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2)  # (m, 4, 2)
    spoke = np.broadcast_to(middle[:, None, None], (len(quads), 4, 1))
    around = np.concatenate([sides, spoke], axis=2).reshape(-1, 3)
    return _faces(sheet, np.concatenate([flat, centre]), around, 4, len(quads))


def joined(faces: Faces, creases: Indices) -> Hinges:
    """One hinge for every edge between two triangles.

    Raises:
        GeometryError: an edge with three faces or two that run the same way; a crease that is not
            an edge between two cells.
    """
    edges = Edges.of(faces.triangles, faces.cells)
    left, right, key = _meetings(edges, faces.flat)
    hinges = np.stack(
        [edges.start[left], edges.stop[left], edges.after[right], edges.after[left]], axis=1
    )
    cells = np.stack([edges.cell[left], edges.cell[right]], axis=1)
    within = cells[:, 0] == cells[:, 1]
    kinds = np.where(within, DIAGONAL, RULING)
    found = _found(creases, key, len(faces.flat))
    kinds[found] = FOLD
    share = np.where(within & (faces.centres > 0), 0.5, 1.0)
    return Hinges(hinges, cells, kinds, found[:, None], share)


def paired(sheet: Sheet, faces: Faces) -> Hinges:
    """Two hinges on every edge between two cells, one with the wings at each of its ends, and one
    on each diagonal of a quad; all have half their line's stiffness.

    A twisted cell w = x y turns the two hinges of a line by opposite angles about the true one: by
    their mean neither the bending about rulings nor the side on which the sheet curls depends on
    how the quads are divided.

    Raises:
        GeometryError: as ``joined``.
    """
    quads = faces.quads
    tips = np.asarray(sheet.triangles, dtype=np.int64).reshape(-1, 3)
    numbers = np.arange(len(quads) + len(tips))
    edges = Edges.of(quads, numbers[: len(quads)]).and_of(Edges.of(tips, numbers[len(quads) :]))
    left, right, key = _meetings(edges, faces.flat)
    start, stop = edges.start[left], edges.stop[left]
    rows = [
        np.stack([start, stop, edges.after[right], edges.before[left]], axis=1),
        np.stack([start, stop, edges.before[right], edges.after[left]], axis=1),
        quads[:, [0, 2, 1, 3]],
        quads[:, [1, 3, 2, 0]],
    ]
    between = np.stack([edges.cell[left], edges.cell[right]], axis=1)
    inside = np.repeat(np.arange(len(quads))[:, None], 2, axis=1)
    kinds = np.full(2 * len(left) + 2 * len(quads), DIAGONAL)
    kinds[: 2 * len(left)] = RULING
    found = _found(sheet.creases, key, len(faces.flat))
    both = np.stack([found, found + len(left)], axis=1)
    kinds[both] = FOLD
    hinges = np.concatenate(rows)
    cells = np.concatenate([between, between, inside, inside])
    return Hinges(hinges, cells, kinds, both, np.full(len(hinges), 0.5))


def _meetings(edges: Edges, flat: Array) -> tuple[Indices, Indices, Indices]:
    """Pairs of edges that run against each other: numbers of both, and a key in rising order.

    The polygon of the first lies on the left of its edge, that of the second on its right.
    """
    start, stop = edges.start, edges.stop
    key = np.minimum(start, stop) * len(flat) + np.maximum(start, stop)
    order = np.lexsort((start > stop, key))
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[same], order[same + 1]
    wrong = np.concatenate(
        [np.flatnonzero(start[one] == start[two]), np.flatnonzero(np.diff(same) == 1)]
    )
    if len(wrong):
        at = flat[start[one[wrong[0]]]]
        raise GeometryError(
            f"cells overlap or turn over at ({at[0]:.6g}, {at[1]:.6g}) mm of the pattern: an edge"
            " has two cells on one side",
            remedy="each cell counter-clockwise, neighbours sharing exactly one edge",
        )
    return one, two, key[one]


def _found(creases: Indices, key: Indices, count: int) -> Indices:
    """(c,) where the creases stand among the edges between two cells, by their keys."""
    rows = np.asarray(creases, dtype=np.int64).reshape(-1, 2)
    wanted = rows.min(axis=1) * count + rows.max(axis=1)
    found = np.minimum(np.searchsorted(key, wanted), max(len(key) - 1, 0))
    missing = np.flatnonzero(key[found] != wanted) if len(key) else np.arange(len(rows))
    if len(missing):
        bad = rows[missing[0]]
        raise GeometryError(
            f"the crease between nodes {bad[0]} and {bad[1]} is not an edge between two cells",
            remedy="creases run along edges of cells, inside the sheet",
        )
    return np.asarray(found, dtype=np.int64)


def _checked(sheet: Sheet) -> tuple[Array, Indices]:
    """Nodes and quads of a sheet whose cells are convex and counter-clockwise."""
    flat = np.asarray(sheet.flat, dtype=float)
    quads = np.asarray(sheet.quads, dtype=np.int64).reshape(-1, 4)
    corners = [quads[:, [k, (k + 1) % 4, (k + 2) % 4]] for k in range(4)]
    every = np.concatenate([*corners, np.asarray(sheet.triangles, dtype=np.int64).reshape(-1, 3)])
    area = areas(flat, every)
    size = float(np.max(np.abs(area), initial=0.0))
    if len(every) == 0 or not np.all(area > 1e-12 * size):
        worst = every[int(np.argmin(area))] if len(every) else np.zeros(1, dtype=np.int64)
        at = flat[worst[0]] if len(flat) else np.zeros(2)
        raise GeometryError(
            f"the cell at ({at[0]:.6g}, {at[1]:.6g}) mm of the pattern has no area or turns over",
            value=float(np.min(area, initial=0.0)),
            limit=0.0,
            remedy="convex cells, their nodes counter-clockwise as the front shows them",
        )
    return flat, quads


def _faces(sheet: Sheet, flat: Array, halves: Indices, each: int, centres: int) -> Faces:
    """Triangles of the quads, ``each`` of them, then the cells that are triangles."""
    quads = np.asarray(sheet.quads, dtype=np.int64).reshape(-1, 4)
    tips = np.asarray(sheet.triangles, dtype=np.int64).reshape(-1, 3)
    triangles = np.concatenate([halves, tips])
    cells = np.concatenate(
        [np.repeat(np.arange(len(quads)), each), len(quads) + np.arange(len(tips))]
    )
    area = np.zeros(len(quads) + len(tips))
    np.add.at(area, cells, areas(flat, triangles))
    return Faces(flat, triangles, cells, area, quads, centres)


def _cross(a: Array, b: Array) -> Array:
    """Plane cross products of rows."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
