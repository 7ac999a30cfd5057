"""glTF 2.0 binary: metres, Y up, UV0 = the flat pattern; one node and one mesh a panel.

A vertex (x, y, z) in mm is written as (x, z, -y) / 1000, its pattern place (X, Y) as
((X - xmin + dx) / L, 1 - (Y - ymin + dy) / L). L is one number for the whole file, so that a
texture has one scale: the larger side of the pattern or, of several, of the atlas in which they
lie side by side. xmin and ymin are each panel's own; (dx, dy) is 0 for one panel and stands in
its ``uv_offset_mm`` for several.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from devcad import __version__
from devcad.checks import Check, at_most
from devcad.export import Options, Written
from devcad.export.atlas import atlas
from devcad.export.binary import FLOAT32_STEP, apart, blocks, bounds, demanded, opened, torn
from devcad.export.glbfile import write_container
from devcad.export.glbread import (
    CHECK,
    Json,
    Stored,
    accessor,
    parse,
)
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part
from devcad.units import METRES_PER_MM

if TYPE_CHECKING:
    from devcad.export.glbcrease import Rig
    from devcad.export.glbmotion import Skeleton
    from devcad.export.glbrigid import Swing

Floats = NDArray[np.float32]

VERTEX_TARGET, INDEX_TARGET = 34962, 34963
FLOAT = 5126
INDEX_TYPES = {2: 5123, 4: 5125}  # bytes an index -> component type
MOST_SHORT_VERTICES = 0xFFFF  # 65535 restarts a strip and is no index

METALLIC, ROUGHNESS = 0.2, 0.6  # a metal of 1.0 is black in a viewer without an environment
NORMAL_LIMIT = 1e-6
"""A unit vector rounded to float32 is off by 6e-8 a component; the mesh's own by far less."""


@dataclass(frozen=True, slots=True)
class _Piece:
    """A panel with its indices, flat (3 m,) unsigned, and the affine map of its pattern to UV:
    ``corner`` is where the atlas begins, ``offset`` how far the pattern lies from there."""

    panel: Panel
    indices: NDArray[Any]
    corner: tuple[float, float]
    side: float
    offset: tuple[float, float] | None = None

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """Bytes of positions, normals, texture places and indices, each a multiple of 4."""
        n = len(self.panel.mesh.vertices)
        return 12 * n, 12 * n, 8 * n, _padded(self.indices.nbytes)


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One file ``<part>.glb`` in the folder, read back.

    With ``options.glb_animate`` the part folds (glbmotion.py), a mechanism moves (glbrigid.py);
    where it is None a part with a motion of its own does, as long as that keeps the tolerance.
    ``max_deviation`` is the mesh's own certified deviation plus the measured rounding to float32,
    the largest over the panels, and what the joints add to the part as built and to the flat one;
    what lies between the keys of a motion has a limit of its own. ``checks`` holds that rounding
    for each panel as ``glb-readback``, behind them that of the motion; normals, texture places,
    indices and bounds that were read are compared too. Triangles that use a vertex twice are left
    out. Normals are written with unit length.

    Raises:
        CheckFailed: ``glb-readback``, the file does not hold the mesh.
        LimitError: more than 4 GiB.
        FileError: the file cannot be written.
    Source:
        Khronos, glTF 2.0 Specification, sections 3.6 to 3.9 and 4.4.
    """
    path = folder / f"{part.name}.glb"
    if options.glb_animate is not None:
        return [_written(part, path, animate=options.glb_animate)]
    file = _written(part, path, animate=_has_motion(part))
    if _has_motion(part) and file.max_deviation > part.tolerance:
        note = f"stands still: joints put its points {file.max_deviation:.3g} mm off"
        file = replace(_written(part, path, animate=False), note=note)
    return [file]


def _has_motion(part: Part) -> bool:
    """Whether the part has a motion of its own: curved creases, or a mechanism."""
    return bool(part.linkages) or any(panel.folds for panel in part.panels)


def _written(part: Part, path: Path, *, animate: bool) -> Written:
    pieces = _pieces(part)
    document = _document(part, pieces)
    motion = b""
    bones: list[Skeleton | Rig | None] = []
    size = sum(sum(piece.sizes) for piece in pieces)
    swung: list[Swing] = []
    if animate and part.linkages:
        from devcad.export import glbrigid  # few parts are mechanisms

        swung = glbrigid.swings(part)
        motion = glbrigid.animated(document, swung, size)
    elif animate:
        from devcad.export.glbmotion import animated, skeletons  # few jobs ask for it

        bones = skeletons(part)
        motion = animated(document, bones, size)
    size += len(motion)

    def binary(stream: BinaryIO) -> None:
        for piece in pieces:
            _write_piece(stream, piece)
        stream.write(motion)

    total = write_container(path, document, size, binary, "raise the tolerance")
    checks, placed = _read_back(path, pieces, total, bones)
    deviation = max(
        piece.panel.mesh.deviation + check.value
        for piece, check in zip(pieces, checks, strict=False)
    )
    deviation += max(placed, default=0.0)
    if swung:
        checks += glbrigid.proven(path, part, total, swung)
    return Written(path, "glb", float(deviation), checks)


def linear(colour: tuple[float, float, float]) -> list[float]:
    """The linear intensities of an sRGB colour, components 0..1, as glTF wants them.

    Source: IEC 61966-2-1.
    """
    return [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]


def _padded(size: int) -> int:
    return -(-size // 4) * 4


def _pieces(part: Part) -> list[_Piece]:
    """The panels in order, side by side on one texture."""
    placed = atlas([p.pattern for p in part.panels], [p.mesh.deviation for p in part.panels])
    pieces = []
    for panel, (dx, dy) in zip(part.panels, placed.offsets.tolist(), strict=True):
        x, y = panel.pattern.bbox[:2]
        offset = (dx, dy) if len(part.panels) > 1 else None
        pieces.append(_Piece(panel, _indices(panel), (x - dx, y - dy), placed.side, offset))
    return pieces


def _indices(panel: Panel) -> NDArray[Any]:
    """The triangles' indices in the shortest type that holds them."""
    triangles = panel.mesh.triangles
    a, b, c = triangles.T
    degenerate = (a == b) | (b == c) | (c == a)
    if degenerate.any():
        triangles = triangles[~degenerate]
    if len(panel.mesh.vertices) <= MOST_SHORT_VERTICES:
        return triangles.astype("<u2").ravel()
    return np.ascontiguousarray(triangles, "<i4").view("<u4").ravel()  # no copy


def _positions(points: Array) -> Floats:
    """Points (k, 3) in mm -> metres, Y up."""
    out = np.empty(points.shape, "<f4")
    x, y, z = points.T
    out[:, 0] = x * METRES_PER_MM
    out[:, 1] = z * METRES_PER_MM
    out[:, 2] = y * -METRES_PER_MM
    out += np.float32(0.0)  # -0 + 0 = +0, so that equal points have equal bits
    return out


def _normals(normals: Array) -> Floats:
    """Normals (k, 3), Y up, unit."""
    x, y, z = normals.T
    length = np.sqrt(x * x + y * y + z * z)
    length[length == 0.0] = np.nan  # no direction: the read-back refuses it
    out = np.empty(normals.shape, "<f4")
    out[:, 0] = x / length
    out[:, 1] = z / length
    out[:, 2] = y / -length
    return out


def _texture(piece: _Piece) -> Callable[[Array], Floats]:
    """The map from pattern places (k, 2) in mm to UV0; glTF counts v downwards."""

    def places(flat: Array) -> Floats:
        out = np.empty(flat.shape, "<f4")
        out[:, 0] = (flat[:, 0] - piece.corner[0]) / piece.side
        out[:, 1] = 1.0 - (flat[:, 1] - piece.corner[1]) / piece.side
        return np.clip(out, 0.0, 1.0, out=out)  # rounding only: the bounding box is exact

    return places


def _write_piece(stream: BinaryIO, piece: _Piece) -> None:
    """Append positions, normals, texture places and indices, padded to 4 bytes."""
    mesh = piece.panel.mesh
    for values, convert in (
        (mesh.vertices, _positions),
        (mesh.normals, _normals),
        (mesh.flat, _texture(piece)),
    ):
        for rows in blocks(len(values)):
            stream.write(convert(values[rows]).data)
    stream.write(piece.indices.data)
    stream.write(bytes(piece.sizes[3] - piece.indices.nbytes))


def _document(part: Part, pieces: list[_Piece]) -> Json:
    """The JSON chunk, its keys in a fixed order."""
    number = {"part_number": part.part_number} if part.part_number else {}
    scale = {"mm_per_uv": pieces[0].side, "units": "mm"}
    views, accessors = _tables(pieces)
    return {
        "asset": {"generator": f"devcad {__version__}", "version": "2.0"},
        "extras": scale | number,
        "scene": 0,
        # no scene name: three.js would rename the panel that has the job's name
        "scenes": [{"nodes": list(range(len(pieces)))}],
        "nodes": [
            {"name": piece.panel.name, "mesh": k, "extras": _extras(piece, scale | number)}
            for k, piece in enumerate(pieces)
        ],
        "meshes": [_mesh(piece, k, scale | number) for k, piece in enumerate(pieces)],
        "materials": [_material(part)],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": sum(sum(piece.sizes) for piece in pieces)}],
    }


def _extras(piece: _Piece, common: Json) -> Json:
    """A panel's facts; on node and mesh, for viewers show one of the two."""
    panel = piece.panel
    facts = common | {"thickness": panel.thickness, "area": panel.area}
    return facts if piece.offset is None else facts | {"uv_offset_mm": list(piece.offset)}


def _mesh(piece: _Piece, k: int, common: Json) -> Json:
    attributes = {"POSITION": 4 * k, "NORMAL": 4 * k + 1, "TEXCOORD_0": 4 * k + 2}
    return {
        "name": piece.panel.name,
        "primitives": [{"attributes": attributes, "indices": 4 * k + 3, "material": 0}],
        "extras": _extras(piece, common),
    }


def _material(part: Part) -> Json:
    return {
        "name": "sheet",
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear(part.colour), 1.0],
            "metallicFactor": METALLIC,
            "roughnessFactor": ROUGHNESS,
        },
        "doubleSided": True,
    }


def _tables(pieces: list[_Piece]) -> tuple[list[Json], list[Json]]:
    """Buffer views and accessors, four of each a panel, in the order of the bytes."""
    views: list[Json] = []
    accessors: list[Json] = []
    offset = 0
    for piece in pieces:
        index_type = INDEX_TYPES[piece.indices.itemsize]
        count = len(piece.panel.mesh.vertices)
        rows = [
            (VERTEX_TARGET, FLOAT, count, "VEC3", _bounds(piece.panel.mesh.vertices)),
            (VERTEX_TARGET, FLOAT, count, "VEC3", {}),
            (VERTEX_TARGET, FLOAT, count, "VEC2", {}),
            (INDEX_TARGET, index_type, piece.indices.size, "SCALAR", {}),
        ]
        for (target, kind, number, shape, ends), size in zip(rows, piece.sizes, strict=True):
            length = piece.indices.nbytes if target == INDEX_TARGET else size
            accessors.append(
                {"bufferView": len(views), "componentType": kind, "count": number, "type": shape}
                | ends
            )
            views.append(
                {"buffer": 0, "byteOffset": offset, "byteLength": length, "target": target}
            )
            offset += size
    return views, accessors


def _bounds(vertices: Array) -> Json:
    """Exact bounds of the positions written: rounding is monotone, so it may come last."""
    ends = _positions(bounds(lambda rows: vertices[rows], len(vertices)))
    return {"min": ends.min(axis=0).tolist(), "max": ends.max(axis=0).tolist()}


def _read_back(
    path: Path, pieces: list[_Piece], total: int, bones: Sequence[Skeleton | Rig | None]
) -> tuple[tuple[Check, ...], list[float]]:
    """Parse the file by its own tables and compare it with the meshes, then its motion with theirs:
    a check for every panel, then one or two for every panel that moves; and how far the joints of
    these put its points off, mm."""
    moved: list[Check] = []
    folded: list[Sequence[Check]] = []
    with opened(path, "rb") as stream:
        document, start = parse(stream, path, total)
        for node, piece in zip(document["nodes"], pieces, strict=False):  # joints come behind
            (primitive,) = document["meshes"][node["mesh"]]["primitives"]
            named = primitive["attributes"] | {"indices": primitive["indices"]}
            stored = {
                name: accessor(stream, start, document, index) for name, index in named.items()
            }
            told = document["accessors"][named["POSITION"]]
            if not _holds(stored, told, piece):
                raise torn(CHECK, path, "indices or bounds differ", panel=piece.panel.name)
            size = max(map(abs, told["min"] + told["max"])) / METRES_PER_MM
            checks = _checks(piece, size, document["extras"]["mm_per_uv"], stored)
            moved.append(demanded(checks, path)[0])
        for number, skeleton in enumerate(bones):
            if skeleton is not None:
                from devcad.export.glbplayed import folds

                folded.append(demanded(folds(stream, start, document, number, skeleton), path))
    placed = [checks[0].value for checks in folded]
    return (*moved, *(check for checks in folded for check in checks)), placed


def _holds(stored: dict[str, Stored], told: Json, piece: _Piece) -> bool:
    """Whether the indices are the mesh's and the bounds told those of the positions."""
    indices, position = stored["indices"], stored["POSITION"]
    if (indices.count, position.count) != (piece.indices.size, len(piece.panel.mesh.vertices)):
        return False
    return bounds(position.rows, position.count).tolist() == [told["min"], told["max"]] and all(
        np.array_equal(indices.rows(rows)[:, 0], piece.indices[rows])
        for rows in blocks(indices.count)
    )


def _checks(piece: _Piece, size: float, mm_per_uv: float, stored: dict[str, Stored]) -> list[Check]:
    """Distances between what was read and the mesh, each against what float32 allows.

    ``size`` is the largest coordinate in mm.
    """
    mesh, name = piece.panel.mesh, piece.panel.name
    x, y = piece.corner
    moved = apart(
        stored["POSITION"].rows, [(0, 1e3, 0.0), (2, -1e3, 0.0), (1, 1e3, 0.0)], mesh.vertices
    )
    turned = apart(
        stored["NORMAL"].rows, [(0, 1.0, 0.0), (2, -1.0, 0.0), (1, 1.0, 0.0)], mesh.normals
    )
    slid = apart(
        stored["TEXCOORD_0"].rows, [(0, mm_per_uv, x), (1, -mm_per_uv, y + mm_per_uv)], mesh.flat
    )
    return [
        at_most(
            CHECK,
            name,
            moved,
            FLOAT32_STEP * size,
            "mm",
            says=f"the vertices read lie up to {moved:.3g} mm from the mesh's",
            remedy="move the part nearer to the origin",
        ),
        at_most(
            CHECK,
            name,
            slid,
            FLOAT32_STEP * (mm_per_uv + max(abs(x), abs(y))),
            "mm",
            says=f"the texture places read lie up to {slid:.3g} mm from the pattern's",
        ),
        at_most(
            CHECK,
            name,
            turned,
            NORMAL_LIMIT,
            "1",
            says=f"the normals read differ by up to {turned:.3g} from the mesh's, or are not unit",
        ),
    ]
