"""Clamped borders: a wall that keeps the sheet's tangent plane where the border is.

Behind every edge of a clamped border stands one point of the wall for each wing of the cell beside
it, the wing's image beyond the border: a hinge along the edge, flat as it is put on, resists the
turning of the first cell. Its cell beyond does not bend, so that K = 2 D L / h of half a cell of
width h; all hinges together are the trapezoidal rule of the sheet's bending from the border on, and
the free length begins there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices, areas
from devcad.simulate.freedoms import Supports
from devcad.simulate.model import Model
from devcad.simulate.path import padded
from devcad.simulate.stiffnesses import BENDING, COEFFICIENTS, Lines
from devcad.simulate.topology import RULING, Edges


@dataclass(frozen=True, slots=True)
class Grip:
    """A sheet as it is held: ``model`` with hinges to the wall after its own, ``supports`` with the
    wall's points after the sheet's, ``wall`` (w, 3) those points, ``ends`` (w, 2) the nodes of the
    border's edge before each and ``foot`` (w,) where between these two its foot lies."""

    model: Model
    supports: Supports
    wall: Array
    ends: Indices
    foot: Array

    def whole(self, points: Array) -> Array:
        """(n, 3) places of all nodes of the model from those of the sheet's."""
        own = replace(self.model, flat=self.model.flat[: len(self.model.flat) - len(self.wall)])
        return np.concatenate([padded(own, points), self.wall])

    def spread(self, values: Array) -> Array:
        """(n, 3) values of all nodes, such as loads, from those of the sheet's: else 0."""
        out = np.zeros((len(self.model.flat), 3))
        out[: len(values)] = values
        return out

    def rest(self, own: Array) -> Array:
        """(h,) rest angles of all hinges from the sheet's own."""
        return np.concatenate([own, np.zeros(len(self.wall))])

    def borne(self, positions: Array, reactions: Array, count: int) -> tuple[Array, Array]:
        """Reactions (n, 3) in N and moments (n, 3) in N mm on the sheet's ``count`` nodes: what the
        wall's points bear is taken to the border, statically the same."""
        force = reactions[len(reactions) - len(self.wall) :]
        shares = np.stack([1 - self.foot, self.foot], axis=1)
        foot = np.einsum("wk,wki->wi", shares, positions[self.ends])
        out, moments = reactions[:count].copy(), np.zeros((count, 3))
        np.add.at(out, self.ends, shares[:, :, None] * force[:, None])
        turning = np.cross(self.wall - foot, force)
        np.add.at(moments, self.ends, 0.5 * np.repeat(turning[:, None], 2, axis=1))
        return out, moments


def gripped(
    model: Model, points: Array, supports: Supports, borders: Indices, coefficients: str
) -> Grip:
    """The sheet held where its nodes ``points`` (n, 3) are, its ``borders`` (c, 2) clamped there.

    Args:
        borders: pairs of nodes that are edges of one cell each; others are left out.
        coefficients: the set whose hinges between cells the wall's are made as.
    """
    rows, cells = _wings(model, borders)
    start, wing = rows[:, :2], rows[:, 2]
    x = padded(model, points)
    wall, foot = _mirrored(x, start, wing)
    behind, _ = _mirrored(model.flat, start, wing)
    length = np.linalg.norm(model.flat[start[:, 1]] - model.flat[start[:, 0]], axis=1)
    none = np.zeros(len(rows))
    lines = Lines(length, _areas(model)[cells] / 2, none, none, none, np.full(len(rows), 0.5))
    stiffness = BENDING[COEFFICIENTS[coefficients].rulings](lines, model.material)
    number = len(model.flat) + np.arange(len(rows))
    held = Supports.fixing(number)
    return Grip(
        model=replace(
            model,
            flat=np.concatenate([model.flat, behind]),
            hinges=np.concatenate([model.hinges, np.stack([*start.T, number, wing], axis=1)]),
            kinds=np.concatenate([model.kinds, np.full(len(rows), RULING)]),
            stiffness=np.concatenate([model.stiffness, stiffness]),
        ),
        supports=Supports(
            np.concatenate([supports.nodes, held.nodes]),
            np.concatenate([supports.axes, held.axes]),
            np.concatenate([supports.displacements, held.displacements]),
        ),
        wall=wall,
        ends=start,
        foot=foot,
    )


def _wings(model: Model, borders: Indices) -> tuple[Indices, Indices]:
    """Two rows a border's edge, (r, 3): its ends, the cell on their left, and the cell's corner
    next to either of them; the cell's number (r,). Of crossed panels the wing is their centre."""
    quads, tips = (
        np.asarray(cells, dtype=np.int64) for cells in (model.sheet.quads, model.sheet.triangles)
    )
    numbers = np.arange(len(quads) + len(tips))
    edges = Edges.of(quads.reshape(-1, 4), numbers[: len(quads)]).and_of(
        Edges.of(tips.reshape(-1, 3), numbers[len(quads) :])
    )
    wanted = np.sort(np.asarray(borders, dtype=np.int64).reshape(-1, 2), axis=1)
    size = len(model.flat)
    key = np.minimum(edges.start, edges.stop) * size + np.maximum(edges.start, edges.stop)
    found = np.flatnonzero(np.isin(key, wanted[:, 0] * size + wanted[:, 1]))
    crossed = len(model.flat) > len(model.sheet.flat)
    pairs = [
        np.stack([edges.start, edges.stop, corner], axis=1)[found]
        for corner in (edges.before, edges.after)
    ]
    rows, cells = np.concatenate(pairs), np.tile(edges.cell[found], 2)
    if crossed:
        rows[:, 2] = len(model.sheet.flat) + cells
    return rows, cells


def _areas(model: Model) -> Array:
    """(cells,) mm^2 in the pattern, quads first."""
    quads, flat = model.sheet.quads, model.sheet.flat
    halves = areas(flat, quads[:, [0, 1, 2]]) + areas(flat, quads[:, [0, 2, 3]])
    return np.concatenate([halves, areas(flat, model.sheet.triangles)])


def _mirrored(x: Array, ends: Indices, wings: Indices) -> tuple[Array, Array]:
    """The images (r, k) of points beyond the lines through two others, in their plane, and where
    their feet lie between these, 0 at the first and 1 at the second."""
    first, wing = x[ends[:, 0]], x[wings]
    edge = x[ends[:, 1]] - first
    foot = np.einsum("ri,ri->r", wing - first, edge) / np.einsum("ri,ri->r", edge, edge)
    return np.asarray(2 * (first + foot[:, None] * edge) - wing), np.asarray(foot)
