"""STL: binary triangles in mm, all panels in one file.

84 + 50 n bytes: a header of 80, the count n, and for each facet a unit normal, three corners
(float32) and two zero bytes. The format has no vertices, so readers weld corners that are
bitwise equal: equal weld numbers are written as equal bits, a facet is left out only where two
of its corners became one point, and then its neighbours meet along the edge that is left.
Facets of no area with three distinct corners stay, for without them a crack would open.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from devcad.checks import Check, at_most
from devcad.export import Options, Written
from devcad.export.binary import BLOCK, FLOAT32_STEP, apart, blocks, bounds, demanded, opened, torn
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh
from devcad.part import Panel, Part

CHECK = "stl-readback"

HEADER_BYTES = 80

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PACKED = np.dtype([("normal", "V12"), ("corners", "V36"), ("attribute", "<u2")])  # copied whole

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
class _Body:
    """A panel's distinct points, rounded (k, 3), and its facets (m, 3).

    ``rounding`` is the largest distance in mm from a vertex of the mesh to its rounded point,
    ``merged`` the number of distinct points that rounding made equal to another one.
    """

    panel: str
    mesh: Mesh
    points: Rounded
    triangles: Triangles
    rounding: float
    merged: int


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One file ``<part>.stl`` in the folder, read back.

    ``max_deviation`` is the mesh's own certified deviation plus the measured rounding to
    float32, the largest over the panels. ``checks`` holds that rounding for each panel as
    ``stl-readback`` in mm; where rounding made distinct points one, a second entry in points
    tells how many. That a mesh called watertight is so before rounding is not checked here.

    Raises:
        CheckFailed: ``stl-readback`` when a solid is not closed after rounding or lost its
            volume, or when what is read is not bit by bit what was written.
        FileError: the file cannot be written.
    Source:
        3D Systems, StereoLithography Interface Specification (1989), the binary form.
    """
    path = folder / f"{part.name}.stl"
    bodies = [_body(panel, path) for panel in part.panels]
    with opened(path, "wb") as stream:
        stream.write(header(part.name))
        stream.write(np.array(sum(len(b.triangles) for b in bodies), "<u4").tobytes())
        sizes = [_write_body(stream, body) for body in bodies]
    for body, (area, volume) in zip(bodies, sizes, strict=True):
        if body.mesh.watertight:
            demanded([_volume_kept(body, area, volume)], path)
    checks = _read_back(path, bodies)
    deviation = max(body.mesh.deviation + body.rounding for body in bodies)
    return [Written(path, "stl", float(deviation), checks)]


def header(name: str) -> bytes:
    """The 80 ASCII bytes of the header; never "solid", which would announce the text form."""
    return f"devcad {name} mm".encode("ascii", "replace")[:HEADER_BYTES].ljust(HEADER_BYTES)


def _body(panel: Panel, path: Path) -> _Body:
    """The panel's mesh rounded to float32, without the facets that collapsed."""
    mesh = panel.mesh
    points = np.zeros((int(mesh.weld.max()) + 1, 3), np.float32)
    points[mesh.weld] = mesh.vertices
    points += np.float32(0.0)  # -0 + 0 = +0: one zero, equal bits
    same = _first_equal(points)
    merged = 0 if same is None else int(np.count_nonzero(same != np.arange(len(same))))
    rounding = apart(lambda rows: _rows(points, mesh.weld[rows]), AXES, mesh.vertices)
    triangles = _rows(mesh.weld if same is None else same[mesh.weld], mesh.triangles)
    a, b, c = triangles.T
    collapsed = (a == b) | (b == c) | (c == a)
    if collapsed.any():
        triangles = triangles[~collapsed]
    body = _Body(panel.name, mesh, points, triangles, rounding, merged)
    if mesh.watertight and merged:
        demanded([_closed(body)], path)
    return body


def _rows(values: NDArray[Any], indices: Triangles) -> NDArray[Any]:
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


def _closed(body: _Body) -> Check:
    """Whether each directed edge occurs once and meets its reverse."""
    a = body.triangles.astype(np.int64)
    b = np.roll(a, -1, axis=1)
    edges = np.sort((a * len(body.points) + b).ravel())
    reverse = (b * len(body.points) + a).ravel()
    lone = np.count_nonzero(edges[1:] == edges[:-1]) + np.setdiff1d(edges, reverse).size
    return at_most(
        CHECK,
        body.panel,
        float(lone if edges.size else 1),
        0.0,
        "edges",
        says=f"{lone} edges without exactly one partner: float32 makes {body.merged} points "
        "equal to others, and the solid is not closed any more",
        remedy=REMEDY,
    )


def _write_body(stream: BinaryIO, body: _Body) -> tuple[float, float]:
    """Append the facets; their area in mm2 and the volume in mm3 that they enclose."""
    records = np.zeros(min(len(body.triangles), BLOCK), PACKED)
    twice_area = six_volumes = 0.0
    for rows in blocks(len(body.triangles)):
        corners = _rows(body.points, body.triangles[rows])
        a, b, c = _columns(corners)
        normal = _cross(b - a, c - a)
        x, y, z = normal
        length = np.sqrt(x * x + y * y + z * z)
        twice_area += float(length.sum())
        six_volumes += _six_volumes(a, b, c, z)
        length[length == 0.0] = 1.0  # no area, no direction: the normal stays zero
        block = records[: len(corners)]
        block["normal"] = (normal / length).T.astype("<f4", order="C").view("V12")[:, 0]
        block["corners"] = corners.reshape(-1, 9).view("V36")[:, 0]
        stream.write(block.data)
    return twice_area / 2.0, six_volumes / 6.0


def _columns(corners: NDArray[Any]) -> Array:
    """Corners (k, 3, 3) as [corner][coordinate] rows of k: whole columns are fast, triples slow."""
    return corners.transpose(1, 2, 0).astype(float, order="C")


def _cross(u: Array, v: Array) -> Array:
    """The vector product of (3, k) and (3, k)."""
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def _six_volumes(a: Array, b: Array, c: Array, z: Array) -> float:
    """Six times the volume between the facets with corners a, b, c (3, k) and the plane z = 0.

    ``z`` (k,) is the third component of the facets' normals, whose length is twice the area.
    """
    return float(np.einsum("i,i->", a[2] + b[2] + c[2], z))  # not @: BLAS would start threads


def _mesh_volume(mesh: Mesh) -> float:
    """The volume in mm3 that the mesh encloses, before rounding."""
    total = 0.0
    for rows in blocks(len(mesh.triangles)):
        a, b, c = _columns(_rows(mesh.vertices, mesh.triangles[rows]))
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        total += _six_volumes(a, b, c, z)
    return total / 6.0


def _volume_kept(body: _Body, area: float, volume: float) -> Check:
    """The volume written against the mesh's.

    No point moved by more than a step, so the volume by area times step; twice that leaves
    room for facets that grew, and for the sums.
    """
    change = abs(volume - _mesh_volume(body.mesh))
    limit = 2.0 * area * _step(body)
    says = f"rounding to float32 changes the volume by {change:.3g} mm3"
    return at_most(CHECK, body.panel, change, limit, "mm3", says=says, remedy=REMEDY)


def _read_back(path: Path, bodies: list[_Body]) -> tuple[Check, ...]:
    """Read the file block by block and compare it with the rounded meshes."""
    count = sum(len(body.triangles) for body in bodies)
    expected = HEADER_BYTES + 4 + RECORD.itemsize * count
    checks: list[Check] = []
    with opened(path, "rb") as stream:
        if path.stat().st_size != expected:
            raise torn(CHECK, path, f"{path.stat().st_size} bytes, not {expected}")
        stream.seek(HEADER_BYTES)
        told = int(np.fromfile(stream, "<u4", 1)[0])
        if told != count:
            raise torn(CHECK, path, f"{told} facets announced, not {count}")
        for body in bodies:
            for rows in blocks(len(body.triangles)):
                triangles = body.triangles[rows]
                corners = np.fromfile(stream, RECORD, len(triangles))["corners"]  # (k, 3, 3)
                if not np.array_equal(corners, _rows(body.points, triangles)):
                    raise torn(CHECK, path, "the corners read differ", panel=body.panel)
            checks += demanded(_rounded(body), path)
    return tuple(checks)


def _step(body: _Body) -> float:
    """The distance in mm of neighbouring float32 numbers at the panel's largest coordinate."""
    ends = bounds(lambda rows: body.points[rows], len(body.points))
    return FLOAT32_STEP * float(np.abs(ends).max())


def _rounded(body: _Body) -> list[Check]:
    """How far rounding moved the points, and how many it made one."""
    says = f"the points read lie up to {body.rounding:.3g} mm from the mesh's"
    limit = _step(body)
    moved = at_most(CHECK, body.panel, body.rounding, limit, "mm", says=says, remedy=REMEDY)
    if not body.merged:
        return [moved]
    says = f"float32 makes {body.merged} points equal to others"
    count = float(len(body.points))
    return [moved, at_most(CHECK, body.panel, float(body.merged), count, "points", says=says)]
