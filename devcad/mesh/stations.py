"""The corner points of a patch's rulings on every layer, numbered, and the strips between them."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import taylor
from devcad.geometry.chain import Chain
from devcad.geometry.layers import layer_ends
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.strips import Index, Strip

Flat = Callable[[int, Array, Array], Array]
"""patch number, t (n,), v (n,) -> the places in the pattern (n, 2)."""
COLLAPSED = 1e-12
"""Points closer than this share of the part are one point: an apex, or a tip without a ruling."""


class Stations:
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

    def skin(self, layer: int, *, front: bool) -> Strip:
        """The surface at a layer, facing +n or -n."""
        left, right = (0, 1) if front else (1, 0)
        normal = self.frame.n if front else -self.frame.n
        return self._strip(
            (layer, left), (layer, right), normal, normal, self.flat[left], self.flat[right]
        )

    def rim(self, end: int) -> Strip:
        """The wall at one end of the extent, facing out."""
        normal = self._rim_normals(end, self.t, self.frame)
        first, second = (1, 0) if end else (0, 1)
        return self._strip(
            (first, end), (second, end), normal, normal, self.flat[end], self.flat[end]
        )

    def rim_normals(self, end: int, t: Array) -> Array:
        """The normals of that wall at t (n,), (n, 3)."""
        return self._rim_normals(end, t, self.patch.frame(t))

    def _rim_normals(self, end: int, t: Array, frame: Frame) -> Array:
        jet = self.patch.jet(t, 1)
        v = jet.v_to if end else jet.v_from
        along = taylor.mul(v, jet.e)[1] + jet.c0[1]
        normal = rows_cross(along, frame.n)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal = np.where(length > 0.0, normal / np.maximum(length, 1e-300), frame.e)
        return normal if end else -normal

    def wall(self, *, last: bool) -> Strip:
        """The wall on the first ruling (facing back) or on the last one (facing onwards)."""
        k = -1 if last else 0
        first, second = (0, 1) if last else (1, 0)
        normal = self.frame.m[[k, k]] if last else -self.frame.m[[k, k]]
        flat = np.stack([self.flat[0][k], self.flat[1][k]])

        def side(layer: int) -> tuple[Array, Index]:
            rails, ids = self.points[layer], self.ids[layer]
            return np.stack([rails[0][k], rails[1][k]]), np.stack([ids[0][k], ids[1][k]])

        (left, id_left), (right, id_right) = side(first), side(second)
        return Strip(left, right, normal, normal, flat, flat, id_left, id_right)

    def _strip(
        self,
        left: tuple[int, int],
        right: tuple[int, int],
        normal_left: Array,
        normal_right: Array,
        flat_left: Array,
        flat_right: Array,
    ) -> Strip:
        return Strip(
            self.points[left[0]][left[1]],
            self.points[right[0]][right[1]],
            normal_left,
            normal_right,
            flat_left,
            flat_right,
            self.ids[left[0]][left[1]],
            self.ids[right[0]][right[1]],
        )


def share(stations: list[Stations], chain: Chain) -> None:
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
    source: Stations, i: int, target: Stations, j: int, ends: tuple[int, ...] = (0, 1)
) -> None:
    for layer, (theirs, ours) in enumerate(zip(source.points, target.points, strict=True)):
        for end in ends:
            if target.collapsed(end):  # the whole rail is this one point
                ours[end][:] = theirs[end][i]
                target.ids[layer][end][:] = source.ids[layer][end][i]
            else:
                ours[end][j] = theirs[end][i]
                target.ids[layer][end][j] = source.ids[layer][end][i]
