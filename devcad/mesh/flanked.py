"""One mesh of the flanks of a folded sheet: welded along their creases, or bodies side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh

Rail = NDArray[np.intp]
"""Numbers of vertices along an edge."""
Tie = tuple[int, Rail, int, Rail]
"""A mesh and vertices of it; another one and those of its vertices that are the same points."""


def rail_vertices(rulings: Sequence[Array], end: int) -> Rail:
    """The vertices at v_from (0) or v_to (1) in the mesh of a chain without thickness and cuts, in
    the order of its rulings; both sides of every joint."""
    counts = [len(t) for t in rulings]
    starts = np.concatenate([[0], 2 * np.cumsum(counts)])
    return np.concatenate(
        [starts[k] + end * n + np.arange(n) for k, n in enumerate(counts)], dtype=np.intp
    )


def nearest_vertices(mesh: Mesh, points: Array) -> Rail:
    """The vertices of a mesh next to points (n, 3) that are some of them, to rounding."""
    from scipy.spatial import cKDTree  # only sheets with cutouts have vertices in another order

    return np.asarray(cKDTree(mesh.vertices).query(points)[1], dtype=np.intp)


def side_by_side(meshes: Sequence[Mesh], ties: Sequence[Tie] = ()) -> Mesh:
    """The meshes as one. In every tie (number, vertices, number, vertices) the second's vertices
    become the first's points, to the bit."""
    starts = np.concatenate([[0], np.cumsum([len(mesh.vertices) for mesh in meshes])])
    above = np.concatenate([[0], np.cumsum([mesh.weld.max() + 1 for mesh in meshes])])
    whole = Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.flat for mesh in meshes]),
        np.concatenate(
            [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=False)]
        ).astype(np.int32),
        np.concatenate([mesh.weld + start for mesh, start in zip(meshes, above, strict=False)]),
        all(mesh.watertight for mesh in meshes),
        max(mesh.deviation for mesh in meshes),
    )
    vertices, weld = whole.vertices.copy(), whole.weld.astype(np.int64)
    for one, kept, other, moved in ties:
        source, target = kept + starts[one], moved + starts[other]
        number = np.arange(weld.max() + 1)
        number[weld[target]] = weld[source]
        place = np.full(len(number), -1)
        place[weld[target]] = source
        changed = np.flatnonzero(place[weld] >= 0)
        vertices[changed] = vertices[place[weld[changed]]]
        weld = number[weld]
    _, weld = np.unique(weld, return_inverse=True)
    return replace(whole, vertices=vertices, weld=weld.astype(np.int32))
