"""Bodies: a panel's triangles in single precision, as the mesh formats carry them.

Points that the mesh welds get equal bits; facets that rounding drew together are left out where
two of their corners became one point, and then their neighbours meet along the edge that is left.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.checks import Check, at_most
from devcad.export.binary import FLOAT32_STEP, apart, blocks, bounds, demanded
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh
from devcad.part import Panel

MIX = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], dtype=np.uint64)
"""Odd 64-bit constants (splitmix64): products with them spread a point's bits over a key."""

AXES = [(k, 1.0, 0.0) for k in range(3)]

REMEDY = (
    "move the part nearer to the origin, or raise the tolerance or the thickness: "
    "near its coordinates float32 cannot tell the mesh's points apart"
)

Rounded = NDArray[np.float32]
Triangles = NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Body:
    """A panel's distinct points, rounded (k, 3), and its facets (m, 3), for the read-back check
    of that name.

    ``rounding`` is the largest distance in mm from a vertex of the mesh to its rounded point,
    ``merged`` the number of distinct points that rounding made equal to another one.
    """

    check: str
    panel: str
    mesh: Mesh
    points: Rounded
    triangles: Triangles
    rounding: float
    merged: int


def rounded_body(panel: Panel, check: str, path: Path) -> Body:
    """The panel's mesh rounded to float32, without the facets that collapsed.

    Raises:
        CheckFailed: ``check``, when a solid is not closed after rounding.
    """
    mesh = panel.mesh
    points = np.zeros((int(mesh.weld.max()) + 1, 3), np.float32)
    points[mesh.weld] = mesh.vertices
    points += np.float32(0.0)  # -0 + 0 = +0: one zero, equal bits
    same = _first_equal(points)
    merged = 0 if same is None else int(np.count_nonzero(same != np.arange(len(same))))
    rounding = apart(lambda rows: picked(points, mesh.weld[rows]), AXES, mesh.vertices)
    triangles = picked(mesh.weld if same is None else same[mesh.weld], mesh.triangles)
    a, b, c = triangles.T
    collapsed = (a == b) | (b == c) | (c == a)
    if collapsed.any():
        triangles = triangles[~collapsed]
    body = Body(check, panel.name, mesh, points, triangles, rounding, merged)
    if mesh.watertight and merged:
        demanded([_closed(body)], path)
    return body


def picked(values: NDArray[Any], indices: Triangles) -> NDArray[Any]:
    """``values[indices]``, three times as fast: clipping spares the search for bad indices."""
    return np.take(values, indices, axis=0, mode="clip")


def _first_equal(points: Rounded) -> Triangles | None:
    """For each point the number of the first bitwise equal one; None when all differ.

    Sorting 64-bit keys proves in one pass that all points differ; only if two keys agree the
    points themselves are sorted.
    """
    keys = np.sort(points.view(np.uint32).astype(np.uint64) @ MIX)
    if not (keys[1:] == keys[:-1]).any():
        return None
    _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    same: Triangles = first[inverse.ravel()].astype(np.int32)
    return same


def _closed(body: Body) -> Check:
    """Whether each directed edge occurs once and meets its reverse."""
    a = body.triangles.astype(np.int64)
    b = np.roll(a, -1, axis=1)
    edges = np.sort((a * len(body.points) + b).ravel())
    reverse = (b * len(body.points) + a).ravel()
    lone = np.count_nonzero(edges[1:] == edges[:-1]) + np.setdiff1d(edges, reverse).size
    return at_most(
        body.check,
        body.panel,
        float(lone if edges.size else 1),
        0.0,
        "edges",
        says=f"{lone} edges without exactly one partner: float32 makes {body.merged} points "
        "equal to others, and the solid is not closed any more",
        remedy=REMEDY,
    )


def columns(corners: NDArray[Any]) -> Array:
    """Corners (k, 3, 3) as [corner][coordinate] rows of k: whole columns are fast, triples slow."""
    return corners.transpose(1, 2, 0).astype(float, order="C")


def cross(u: Array, v: Array) -> Array:
    """The vector product of (3, k) and (3, k)."""
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def six_volumes(a: Array, b: Array, c: Array, z: Array) -> float:
    """Six times the volume between the facets with corners a, b, c (3, k) and the plane z = 0.

    ``z`` (k,) is the third component of the facets' normals, whose length is twice the area.
    """
    return float(np.einsum("i,i->", a[2] + b[2] + c[2], z))  # not @: BLAS would start threads


def _mesh_volume(mesh: Mesh) -> float:
    """The volume in mm3 that the mesh encloses, before rounding."""
    total = 0.0
    for rows in blocks(len(mesh.triangles)):
        a, b, c = columns(picked(mesh.vertices, mesh.triangles[rows]))
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        total += six_volumes(a, b, c, z)
    return total / 6.0


def area_and_volume(body: Body) -> tuple[float, float]:
    """The area in mm2 of the rounded facets and the volume in mm3 that they enclose."""
    twice_area = total = 0.0
    for rows in blocks(len(body.triangles)):
        a, b, c = columns(picked(body.points, body.triangles[rows]))
        normal = cross(b - a, c - a)
        twice_area += float(np.sqrt(np.einsum("ij,ij->j", normal, normal)).sum())
        total += six_volumes(a, b, c, normal[2])
    return twice_area / 2.0, total / 6.0


def volume_kept(body: Body, area: float, volume: float) -> Check:
    """The volume written against the mesh's.

    No point moved by more than a step, so the volume by area times step; twice that leaves
    room for facets that grew, and for the sums.
    """
    change = abs(volume - _mesh_volume(body.mesh))
    limit = 2.0 * area * _step(body)
    says = f"rounding to float32 changes the volume by {change:.3g} mm3"
    return at_most(body.check, body.panel, change, limit, "mm3", says=says, remedy=REMEDY)


def _step(body: Body) -> float:
    """The distance in mm of neighbouring float32 numbers at the panel's largest coordinate."""
    ends = bounds(lambda rows: body.points[rows], len(body.points))
    return FLOAT32_STEP * float(np.abs(ends).max())


def rounding_checks(body: Body) -> list[Check]:
    """How far rounding moved the points, and how many it made one."""
    says = f"the points read lie up to {body.rounding:.3g} mm from the mesh's"
    limit = _step(body)
    moved = at_most(body.check, body.panel, body.rounding, limit, "mm", says=says, remedy=REMEDY)
    if not body.merged:
        return [moved]
    says = f"float32 makes {body.merged} points equal to others"
    count = float(len(body.points))
    merged = at_most(body.check, body.panel, float(body.merged), count, "points", says=says)
    return [moved, merged]
