"""Where the points of a mesh lie on the hinged strip of its panel: cell, rigid body, place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers
from devcad.mesh.mesh import Mesh

Places = NDArray[np.intp]
WIDER = 0.05
"""How far beyond the corners of a cell its points may lie, in its size: rails are curved."""
NEAR = 1e-7
"""Points nearer to a ruling than this share of the strip lie on it."""
ON = 1e-9
"""Points nearer to the diagonal of a cell than this share of it lie on it."""
BESIDE = 1e3
"""What a distance beyond a ruling counts against one in space: beside a crease a skin may lie
nearer to the wrong face."""
FRONT = 0.5
"""The least cosine between a skin's normals and the strip's; a wall's is 0."""


class Lodging:
    """The cells of a strip as seen from the pattern: triangles (g, 2, 3), the first and the last of
    every cell, and the affine maps that give the weights of their corners."""

    def __init__(self, strip: Hinged) -> None:
        cells = np.unique(strip.cell)
        first = np.searchsorted(strip.cell, cells)
        last = np.searchsorted(strip.cell, cells, side="right") - 1
        self.strip = strip
        self.cells = cells
        self.pair = np.stack([first, last], axis=1)
        self.corners = strip.triangles[self.pair]  # (g, 2, 3)
        self.pattern = strip.pattern.reshape(-1, 2)
        here, there = self.corners[:, 0], self.corners[:, 1]
        self.lone = np.argmax((here[:, :, None] != there[:, None, :]).all(axis=2), axis=1)
        self.single = first == last

    def weights(self, cell: Places, flat: Array) -> tuple[Places, Array]:
        """Of points (n, 2) of the pattern in these cells (by their rows): the triangle, and the
        weights (n, 3) of its corners."""
        first = _weights(self.pattern[self.corners[cell, 0]], flat)
        last = _weights(self.pattern[self.corners[cell, 1]], flat)
        later = (self.across(cell, first) < 0.0) & ~self.single[cell]
        return (
            self.pair[cell, later.astype(np.intp)],
            np.asarray(np.where(later[:, None], last, first)),
        )

    def across(self, cell: Places, weights: Array) -> Array:
        """How far points are from the diagonals of their cells: above 0 in the first triangle.

        ``weights`` (n, 3) are those of the first triangle; 0 within rounding is 0.
        """
        s = np.take_along_axis(weights, self.lone[cell][:, None], axis=1)[:, 0]
        return np.asarray(np.where(np.abs(s) < ON, 0.0, s))

    def found(self, flat: Array, space: Array) -> Places:
        """The cells, by their rows, of points (n, 2) of the pattern that lie in ``space`` (n, 3).

        Where patterns lie over one another the nearer one in space is meant.
        """
        point, row = self._near(flat)
        away = self._away(row, flat[point], space[point])
        order = np.lexsort((away, point))
        point, row = point[order], row[order]
        return row[np.searchsorted(point, np.arange(len(flat)))]

    def _near(self, flat: Array) -> tuple[Places, Places]:
        """Pairs of a point (n, 2) and a cell, by its row, within whose box it lies."""
        box = self.pattern[self.corners].reshape(len(self.cells), -1, 2)
        low, high = box.min(axis=1), box.max(axis=1)
        room = WIDER * (high - low).max(axis=1, keepdims=True)
        low, high = low - room, high + room
        order = np.argsort(flat[:, 0], kind="stable")
        start = np.searchsorted(flat[order, 0], low[:, 0])
        count = np.searchsorted(flat[order, 0], high[:, 0], side="right") - start
        row = np.repeat(np.arange(len(self.cells)), count)
        point = order[np.arange(len(row)) + np.repeat(start - np.cumsum(count) + count, count)]
        y = flat[point, 1]
        kept = (y >= low[row, 1]) & (y <= high[row, 1])
        return point[kept], row[kept]

    def _away(self, row: Places, flat: Array, space: Array) -> Array:
        """How far points are from cells: beyond their rulings, and off their place in space."""
        out = np.zeros(len(flat))
        for after, sign in ((0, -1.0), (1, 1.0)):
            low, high = self.strip.pattern[:, self.cells[row] + after]
            e, d = high - low, flat - low
            length = np.maximum(np.hypot(*e.T), 1e-300)
            out = np.maximum(out, sign * (e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / length)
        triangle, weights = self.weights(row, flat)
        corners = self.strip.space.reshape(-1, 3)[self.strip.triangles[triangle]]
        place = np.einsum("nk,nkj->nj", weights, corners)
        return np.asarray(BESIDE * out + np.linalg.norm(place - space, axis=1))


def _weights(corner: Array, flat: Array) -> Array:
    """The barycentric coordinates (n, 3) of points (n, 2) in triangles (n, 3, 2)."""
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]

    def twice(x: Array, y: Array) -> Array:
        return np.asarray(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])

    area = twice(b - a, c - a)
    area = np.where(np.abs(area) > 1e-300, area, 1e-300)
    second, third = twice(flat - a, c - a) / area, twice(b - a, flat - a) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


@dataclass(frozen=True, slots=True)
class Sheet:
    """The sheet of a panel as triangles that move with the bodies of its strip.

    A point belongs to one cell: points on rulings are there twice. ``body`` (n,) and ``flat``
    (n, 2) say where it is on the strip, ``cell`` (n,) and ``share`` (n,), 0 to 1, between which
    rulings; ``weights`` (n, 3) and ``corners`` (n, 3) are of rows of the strip's ``space``.
    ``triangles`` (m, 3) are counterclockwise in front.
    """

    body: Numbers
    flat: Array
    cell: Numbers
    share: Array
    corners: Numbers
    weights: Array
    triangles: Numbers


def whole(strip: Hinged) -> Sheet:
    """The sheet of a panel without holes: the strip's own triangles, as built to rounding."""
    n = strip.rulings
    key = strip.cell[:, None].astype(np.int64) * (2 * n) + strip.triangles
    kept, first, triangles = np.unique(key, return_index=True, return_inverse=True)
    row = (kept % (2 * n)).astype(np.int32)
    cell = (kept // (2 * n)).astype(np.int32)
    corners = np.repeat(row[:, None], 3, axis=1)
    weights = np.zeros((len(row), 3))
    weights[:, 0] = 1.0
    return Sheet(
        strip.body[first // 3],
        strip.flat.reshape(-1, 2)[row],
        cell,
        # a point that stands for a whole rail, such as an apex, lies on no one ruling
        np.where(row % n == cell, 0.0, np.where(row % n == cell + 1, 1.0, 0.5)),
        corners,
        weights,
        triangles.reshape(-1, 3).astype(np.int32),
    )


def perforated(strip: Hinged, mesh: Mesh) -> Sheet:
    """The sheet of a panel with holes: the front of its mesh, every triangle on one facet of the
    strip, hence off the mesh by as much as the facet is."""
    lodging = Lodging(strip)
    corner = mesh.flat[mesh.triangles]
    a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    triangles = mesh.triangles[a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0.0]
    middle = mesh.flat[triangles].mean(axis=1)
    cell = lodging.found(middle, mesh.vertices[triangles].mean(axis=1))
    facing = mesh.normals[triangles].mean(axis=1)
    straight = strip.normal[1][lodging.cells[cell]]
    front = (facing * straight).sum(axis=1) > FRONT
    triangles, cell = triangles[front].astype(np.int64), cell[front]
    key = cell[:, None] * len(mesh.flat) + triangles
    kept, numbers = np.unique(key, return_inverse=True)
    flat = mesh.flat[kept % len(mesh.flat)]
    place = kept // len(mesh.flat)
    flat, place, numbers = _divided(lodging, flat, place, numbers.reshape(-1, 3))
    return _lodged(lodging, flat, place, numbers)


def _divided(
    lodging: Lodging, flat: Array, cell: Places, triangles: Places
) -> tuple[Array, Places, Places]:
    """The points, their cells and the triangles, those that lie across a diagonal divided by it."""
    side = lodging.across(cell, _weights(lodging.pattern[lodging.corners[cell, 0]], flat))
    side[lodging.single[cell]] = 0.0
    s = side[triangles]
    crossed = (s.min(axis=1) < 0.0) & (s.max(axis=1) > 0.0)
    kept, cut = triangles[~crossed], triangles[crossed]
    signs = np.sign(s[crossed])
    # the corner that is alone on its side, or before the one that lies on the diagonal, comes first
    alone = np.argmax(signs == -np.sign(signs.sum(axis=1, keepdims=True)), axis=1)
    touches = (signs == 0.0).any(axis=1)
    alone = np.where(touches, (np.argmax(signs == 0.0, axis=1) + 1) % 3, alone)
    turned = (alone[:, None] + np.arange(3)) % 3
    cut = np.take_along_axis(cut, turned, axis=1)
    one, two, three = cut.T
    edges = np.sort(np.concatenate([cut[:, [0, 1]], cut[:, [0, 2]][~touches]]), axis=1)
    edges, number = np.unique(edges, axis=0, return_inverse=True)
    number = len(flat) + number.reshape(-1)
    first, second = number[: len(cut)], three.copy()  # a corner on the diagonal is the third
    second[~touches] = number[len(cut) :]
    i, j = edges.T
    share = (side[i] / (side[i] - side[j]))[:, None]
    pieces = [
        np.stack([one, first, second], axis=1),
        np.stack([first, two, three], axis=1),
        np.stack([first, three, second], axis=1)[~touches],
    ]
    return (
        np.concatenate([flat, flat[i] + share * (flat[j] - flat[i])]),
        np.concatenate([cell, cell[i]]),
        np.concatenate([kept, *pieces]),
    )


def _lodged(lodging: Lodging, flat: Array, cell: Places, triangles: Places) -> Sheet:
    """The sheet of points of the pattern in their cells, those that no triangle has left out."""
    used, triangles = np.unique(triangles, return_inverse=True)
    flat, cell = flat[used], cell[used]
    strip = lodging.strip
    triangle, weights = lodging.weights(cell, flat)
    corners = strip.triangles[triangle]
    own = np.einsum("nk,nkj->nj", weights, strip.flat.reshape(-1, 2)[corners])
    row = lodging.cells[cell].astype(np.int32)
    return Sheet(
        strip.body[triangle],
        own,
        row,
        share_of(strip, row, flat),
        corners,
        weights,
        triangles.reshape(-1, 3).astype(np.int32),
    )


def share_of(strip: Hinged, cell: Numbers, flat: Array) -> Array:
    """How far points (n, 2) of the pattern are from the first ruling of their cell to the last."""

    def beyond(ruling: Numbers) -> Array:
        low, high = strip.pattern[:, ruling]
        e, d = high - low, flat - low
        length = np.maximum(np.hypot(*e.T), 1e-300)
        return np.asarray(np.abs(e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / length)

    before, after = beyond(cell), beyond(cell + 1)
    return np.asarray(before / np.maximum(before + after, 1e-300))


def edges(strip: Hinged, sheet: Sheet) -> tuple[Numbers, Numbers]:
    """The pieces of rulings that lie on the sheet, (k, 2), and its border, (l, 2), the sheet on its
    left as the front shows it."""
    first, last = (_on(strip.flat, sheet.flat, sheet.cell + k) for k in (0, 1))
    around = np.concatenate([sheet.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    key = np.sort(around, axis=1) @ np.array([len(sheet.flat), 1], dtype=np.int64)
    _, numbers, counts = np.unique(key, return_inverse=True, return_counts=True)
    single = around[counts[numbers.reshape(-1)] == 1]
    cell = sheet.cell[single[:, 0]]
    starts, ends = first[single].all(axis=1), last[single].all(axis=1)
    inner = (starts & (cell > sheet.cell.min())) | (ends & (cell < sheet.cell.max()))
    rulings = single[starts | (ends & (cell == sheet.cell.max()))]
    return rulings.astype(np.int32), single[~inner].astype(np.int32)


def _on(ends: Array, flat: Array, ruling: Numbers) -> NDArray[np.bool_]:
    """Whether points (n, 2) lie on these rulings (n,) of a plane with their ``ends`` (2, r, 2)."""
    low, high = ends[:, ruling]
    e, d = high - low, flat - low
    size = float(np.linalg.norm(np.ptp(ends.reshape(-1, 2), axis=0)))
    length = np.hypot(*e.T)
    away = np.abs(e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / np.maximum(length, 1e-300)
    return np.asarray(np.where(length > 0.0, away, np.hypot(*d.T)) <= NEAR * size)


def carriers(strip: Hinged, mesh: Mesh) -> tuple[Numbers, Array]:
    """The bodies (n, 2) that carry a mesh's points, and how much each does (n, 2).

    A point on a ruling, or above one on a skin, hangs half on the faces on either side: as built
    and on the surface itself both agree. Any other is carried by its facet alone.
    """
    lodging = Lodging(strip)
    row = lodging.found(mesh.flat, mesh.vertices)
    triangle, _ = lodging.weights(row, mesh.flat)
    cell = lodging.cells[row].astype(np.int32)
    bodies = np.repeat(strip.body[triangle][:, None], 2, axis=1)
    beside = strip.beside().T
    for after in (0, 1):
        on = _on(strip.pattern, mesh.flat, cell + after)
        bodies[on] = beside[cell[on] + after]
    same = bodies[:, 0] == bodies[:, 1]
    weights = np.where(same[:, None], [1.0, 0.0], [0.5, 0.5])
    bodies[same, 1] = 0
    return bodies.astype(np.int32), weights
