"""Triangles along the rulings: an open sheet, or the watertight body between its layers."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import taylor
from devcad.geometry.chain import Chain
from devcad.geometry.layers import layer_ends
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.mesh import Mesh

Index = NDArray[np.int32]
Places = NDArray[np.intp]
Flat = Callable[[int, Array, Array], Array]
"""patch number, t (n,), v (n,) -> the places in the pattern (n, 2)."""
COLLAPSED = 1e-12
"""Points closer than this share of the part are one point: an apex, or a tip without a ruling."""


@dataclass(frozen=True, slots=True)
class _Strip:
    """Two rails with their normals, places in the pattern and point numbers.

    Seen from outside, ``left`` to ``right`` and then onwards turns counterclockwise.
    """

    left: Array
    right: Array
    normal_left: Array
    normal_right: Array
    flat_left: Array
    flat_right: Array
    id_left: Index
    id_right: Index


def build_mesh(
    chain: Chain,
    rulings: tuple[Array, ...],
    layers: tuple[float, ...],
    flat: Flat,
    deviation: float,
) -> Mesh:
    """The mesh of a chain on its certified rulings.

    Args:
        rulings: per patch, the increasing parameters (n_k,) of its rulings.
        layers: (0,) for an open sheet facing +n; (-T/2, +T/2) for the solid between the two.
        flat: where a surface point lies in the pattern; a skin's vertex has its middle's place.
        deviation: the certified distance to the true surface, carried on.
    """
    stations = [
        _Stations(k, patch, t, layers, flat, chain)
        for k, (patch, t) in enumerate(zip(chain.patches, rulings, strict=True))
    ]
    _share(stations, chain)
    if len(layers) == 1:
        strips = [s.skin(0, front=True) for s in stations]
    else:
        strips = [s.skin(1, front=True) for s in stations]
        strips += [s.skin(0, front=False) for s in stations]
        strips += [s.rim(end) for s in stations for end in (0, 1) if not s.collapsed(end)]
        if not chain.closed:
            strips += [stations[0].wall(last=False), stations[-1].wall(last=True)]
    return _joined(strips, watertight=len(layers) > 1, deviation=deviation)


class _Stations:
    """The corner points of one patch's rulings: ``points[layer][end]`` is (n, 3).

    ``tips`` are the rows (0, -1) whose ruling is a point.
    """

    def __init__(
        self,
        number: int,
        patch: Patch,
        t: Array,
        layers: tuple[float, ...],
        flat: Flat,
        chain: Chain,
    ) -> None:
        self.patch = patch
        inside = t.copy()
        inside[0], inside[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
        self.t = inside
        self.frame = patch.frame(inside)
        self.points = [list(layer_ends(chain, number, self.frame, distance)) for distance in layers]
        self.flat = [flat(number, t, self.frame.v_from), flat(number, t, self.frame.v_to)]
        size = np.linalg.norm(np.ptp(np.concatenate(self.points[0]), axis=0))
        self._point_like = [
            all(
                np.linalg.norm(rail - rail[0], axis=1).max() <= COLLAPSED * size
                for rail in (layer[end] for layer in self.points)
            )
            for end in (0, 1)
        ]
        for layer in self.points:
            for end in (0, 1):
                if self._point_like[end]:
                    layer[end] = np.broadcast_to(layer[end][0], layer[end].shape).copy()
        self.tips = [
            row
            for row in (0, -1)
            if all(np.linalg.norm(a[row] - b[row]) <= COLLAPSED * size for a, b in self.points)
        ]
        for layer in self.points:
            for row in self.tips:
                layer[1][row] = layer[0][row]
        self.ids: list[list[Index]] = []

    def collapsed(self, end: int) -> bool:
        """Whether the rail at v_from (0) or v_to (1) is a point on every layer."""
        return self._point_like[end]

    def skin(self, layer: int, *, front: bool) -> _Strip:
        """The surface at a layer, facing +n or -n."""
        left, right = (0, 1) if front else (1, 0)
        normal = self.frame.n if front else -self.frame.n
        return self._strip(
            (layer, left), (layer, right), normal, normal, self.flat[left], self.flat[right]
        )

    def rim(self, end: int) -> _Strip:
        """The wall at one end of the extent, facing out."""
        jet = self.patch.jet(self.t, 1)
        v = jet.v_to if end else jet.v_from
        along = taylor.mul(v, jet.e)[1] + jet.c0[1]
        normal = rows_cross(along, self.frame.n)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.where(length > 0.0, normal / np.maximum(length, 1e-300), self.frame.e)
        normal = normal if end else -normal
        first, second = (1, 0) if end else (0, 1)
        return self._strip(
            (first, end), (second, end), normal, normal, self.flat[end], self.flat[end]
        )

    def wall(self, *, last: bool) -> _Strip:
        """The wall on the first ruling (facing back) or on the last one (facing onwards)."""
        k = -1 if last else 0
        first, second = (0, 1) if last else (1, 0)
        normal = self.frame.m[[k, k]] if last else -self.frame.m[[k, k]]
        flat = np.stack([self.flat[0][k], self.flat[1][k]])

        def side(layer: int) -> tuple[Array, Index]:
            rails, ids = self.points[layer], self.ids[layer]
            return np.stack([rails[0][k], rails[1][k]]), np.stack([ids[0][k], ids[1][k]])

        (left, id_left), (right, id_right) = side(first), side(second)
        return _Strip(left, right, normal, normal, flat, flat, id_left, id_right)

    def _strip(
        self,
        left: tuple[int, int],
        right: tuple[int, int],
        normal_left: Array,
        normal_right: Array,
        flat_left: Array,
        flat_right: Array,
    ) -> _Strip:
        return _Strip(
            self.points[left[0]][left[1]],
            self.points[right[0]][right[1]],
            normal_left,
            normal_right,
            flat_left,
            flat_right,
            self.ids[left[0]][left[1]],
            self.ids[right[0]][right[1]],
        )


def _share(stations: list[_Stations], chain: Chain) -> None:
    """Number the points; neighbours and a closed seam take over each other's to the bit."""
    layers = len(stations[0].points)
    total = sum(len(s.t) - 1 for s in stations) + 1
    start = 0
    for s in stations:
        number = np.arange(start, start + len(s.t))
        if chain.closed:
            number = number % (total - 1)
        s.ids = [
            [
                _merged(number + (2 * layer + end) * total, collapsed=s.collapsed(end))
                for end in (0, 1)
            ]
            for layer in range(layers)
        ]
        for low, high in s.ids:
            for row in s.tips:
                high[row] = low[row]
        start += len(s.t) - 1
    for before, after in itertools.pairwise(stations):
        _take_over(before, -1, after, 0)
    if chain.closed:
        _take_over(stations[0], 0, stations[-1], -1)
        for end in (0, 1):  # a rail that is one point hands the seam's on to the one before
            for before, after in reversed(list(itertools.pairwise(stations))):
                if not after.collapsed(end):
                    break
                _take_over(after, 0, before, -1, (end,))


def _merged(ids: NDArray[np.int64], *, collapsed: bool) -> Index:
    return np.asarray(np.where(collapsed, ids[0], ids), dtype=np.int32)


def _take_over(
    source: _Stations, i: int, target: _Stations, j: int, ends: tuple[int, ...] = (0, 1)
) -> None:
    for layer, (theirs, ours) in enumerate(zip(source.points, target.points, strict=True)):
        for end in ends:
            if target.collapsed(end):  # the whole rail is this one point
                ours[end][:] = theirs[end][i]
                target.ids[layer][end][:] = source.ids[layer][end][i]
            else:
                ours[end][j] = theirs[end][i]
                target.ids[layer][end][j] = source.ids[layer][end][i]


def _joined(strips: list[_Strip], *, watertight: bool, deviation: float) -> Mesh:
    """All strips as one mesh, triangles that are no triangles left out."""
    vertices, normals, flats, ids, triangles = [], [], [], [], []
    start = 0
    for s in strips:
        n = len(s.left)
        i = np.arange(n - 1)
        near_left, near_right = start + i, start + n + i
        far_left, far_right = near_left + 1, near_right + 1
        number = np.concatenate([s.id_left, s.id_right])
        corners = _divided(s, near_left, near_right, far_left, far_right)
        named = number[corners - start]
        real = (
            (named[:, 0] != named[:, 1])
            & (named[:, 1] != named[:, 2])
            & (named[:, 2] != named[:, 0])
        )
        vertices += [s.left, s.right]
        normals += [s.normal_left, s.normal_right]
        flats += [s.flat_left, s.flat_right]
        ids.append(number)
        triangles.append(corners[real])
        start += 2 * n
    _, weld = np.unique(np.concatenate(ids), return_inverse=True)
    return Mesh(
        np.concatenate(vertices),
        np.concatenate(normals),
        np.concatenate(flats),
        np.concatenate(triangles).astype(np.int32),
        weld.astype(np.int32),
        watertight,
        deviation,
    )


def _divided(
    s: _Strip, near_left: Places, near_right: Places, far_left: Places, far_right: Places
) -> Places:
    """Two triangles of every quad, (2 (n - 1), 3), along the diagonal that folds nothing over.

    Near a regression curve a quad is not convex: the diagonal must start at its inward corner.
    The one from near left is taken unless the smaller of its triangles, seen from outside, is
    smaller than the other diagonal's by a hundredth.
    """
    a, b, c, d = s.left[:-1], s.right[:-1], s.right[1:], s.left[1:]
    normal = s.normal_left[:-1] + s.normal_left[1:]

    def seen(x: Array, y: Array, z: Array) -> Array:
        return np.asarray(np.einsum("ij,ij->i", rows_cross(y - x, z - x), normal))

    first = np.minimum(seen(a, b, c), seen(a, c, d))
    other = np.minimum(seen(a, b, d), seen(b, c, d))
    crossed = (other - first > 0.01 * np.abs(other))[:, None, None]
    plain = np.stack([near_left, near_right, far_right, near_left, far_right, far_left], axis=1)
    turned = np.stack([near_left, near_right, far_left, near_right, far_right, far_left], axis=1)
    return np.where(crossed, turned.reshape(-1, 2, 3), plain.reshape(-1, 2, 3)).reshape(-1, 3)


def volume(mesh: Mesh) -> float:
    """The signed volume inside a closed mesh, mm3, by the divergence theorem."""
    corner = mesh.vertices[mesh.triangles] - mesh.vertices.mean(axis=0)
    return float(
        np.einsum("ij,ij->i", corner[:, 0], rows_cross(corner[:, 1], corner[:, 2])).sum() / 6.0
    )
