"""Strips between two rails, and faces of any shape: joined to one mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.mesh import Mesh

Index = NDArray[np.int32]
Places = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Strip:
    """Two rails with their normals, places in the pattern and point numbers.

    Seen from outside, ``left`` to ``right`` and then onwards turns counterclockwise. Quads lie
    between the rows ``near[i]`` and ``far[i]``; without these between every row and the next.
    """

    left: Array
    right: Array
    normal_left: Array
    normal_right: Array
    flat_left: Array
    flat_right: Array
    id_left: Index
    id_right: Index
    near: Places | None = None
    far: Places | None = None

    def rows(self) -> tuple[Places, Places]:
        """Where each quad begins and ends."""
        if self.near is not None and self.far is not None:
            return self.near, self.far
        i = np.arange(len(self.left) - 1)
        return i, i + 1


@dataclass(frozen=True, slots=True)
class Faces:
    """Triangles (m, 3) between points with normals, places in the pattern and numbers.

    Points of equal number are one point, equal to the bit.
    """

    points: Array
    normals: Array
    flats: Array
    ids: Index
    triangles: Places


def faces(strip: Strip) -> Faces:
    """The triangles of a strip."""
    return Faces(
        np.concatenate([strip.left, strip.right]),
        np.concatenate([strip.normal_left, strip.normal_right]),
        np.concatenate([strip.flat_left, strip.flat_right]),
        np.concatenate([strip.id_left, strip.id_right]),
        divided(strip),
    )


def divided(s: Strip) -> Places:
    """Two triangles of every quad, (2 k, 3), along the diagonal that folds nothing over.

    Near a regression curve a quad is not convex: the diagonal must start at its inward corner.
    The one from near left is taken unless the smaller of its triangles, seen from outside, is
    smaller than the other diagonal's by a hundredth.
    """
    near, far = s.rows()
    n = len(s.left)
    near_left, near_right, far_left, far_right = near, n + near, far, n + far
    a, b, c, d = s.left[near], s.right[near], s.right[far], s.left[far]
    normal = s.normal_left[near] + s.normal_left[far]

    def seen(x: Array, y: Array, z: Array) -> Array:
        return np.asarray(np.einsum("ij,ij->i", rows_cross(y - x, z - x), normal))

    first = np.minimum(seen(a, b, c), seen(a, c, d))
    other = np.minimum(seen(a, b, d), seen(b, c, d))
    crossed = (other - first > 0.01 * np.abs(other))[:, None, None]
    plain = np.stack([near_left, near_right, far_right, near_left, far_right, far_left], axis=1)
    turned = np.stack([near_left, near_right, far_left, near_right, far_right, far_left], axis=1)
    return np.where(crossed, turned.reshape(-1, 2, 3), plain.reshape(-1, 2, 3)).reshape(-1, 3)


def joined(parts: list[Faces], *, watertight: bool, deviation: float) -> Mesh:
    """All faces as one mesh, triangles that are no triangles left out."""
    triangles = []
    start = 0
    for part in parts:
        a, b, c = part.ids[part.triangles].T
        triangles.append(start + part.triangles[(a != b) & (b != c) & (c != a)])
        start += len(part.points)
    _, weld = np.unique(np.concatenate([part.ids for part in parts]), return_inverse=True)
    return Mesh(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.flats for part in parts]),
        np.concatenate(triangles).astype(np.int32),
        weld.astype(np.int32),
        watertight,
        deviation,
    )
