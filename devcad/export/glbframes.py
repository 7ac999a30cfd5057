"""glTF that moves through given shapes: morph targets, one for every frame, and one animation.

For motions that no skeleton has: a sheet that a simulation folds, or a curved crease whose rulings
turn. A mesh rests as one of its frames, so that a viewer without animation shows that one; the
other frames are morph targets, differences of positions and normals, and the animation's weights
lead from frame to frame. Between two frames every point goes straight on (LINEAR). Metres, Y up
and UV0 as in glb.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad import __version__
from devcad.checks import Check, at_most
from devcad.export import Written
from devcad.export.binary import FLOAT32_STEP, demanded, opened
from devcad.export.glb import (
    FLOAT,
    INDEX_TARGET,
    INDEX_TYPES,
    METALLIC,
    MOST_SHORT_VERTICES,
    ROUGHNESS,
    VERTEX_TARGET,
    linear,
)
from devcad.export.glbfile import write_container
from devcad.export.glbread import (
    CHECK,
    Json,
    accessor,
    parse,
)
from devcad.geometry.taylor import Array
from devcad.units import METRES_PER_MM

Key = tuple[float, int]
"""Seconds, and the number of the frame that is seen then."""
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # (x, y, z) -> (x, z, -y)


@dataclass(frozen=True, slots=True)
class Moving:
    """A mesh in all its shapes: ``frames`` (f, n, 3) mm, ``triangles`` (m, 3) counterclockwise seen
    from the front, ``flat`` (n, 2) the points' places in the pattern, mm. Points are repeated where
    the mesh is to look sharp."""

    name: str
    frames: Array
    triangles: NDArray[np.integer[Any]]
    flat: Array
    extras: Mapping[str, Any] = field(default_factory=dict)


def write_frames(
    path: Path,
    meshes: Sequence[Moving],
    keys: Sequence[Key],
    *,
    rest: int,
    colour: tuple[float, float, float],
    name: str = "fold",
    extras: Mapping[str, Any] | None = None,
) -> Written:
    """One GLB file with these meshes and one animation, read back.

    ``keys`` are in order of time, the first at 0; all meshes show the same frames at the same
    times and rest as frame ``rest``. ``max_deviation`` is the largest rounding of a position, in
    mm, over all frames.

    Raises:
        CheckFailed: ``glb-readback``, the file does not hold the frames.
        LimitError: more than 4 GiB. FileError: the file cannot be written.
    Source:
        Khronos, glTF 2.0 Specification, sections 3.7.2.2 (morph targets) and 3.11 (animations).
    """
    book = _Book()
    document = _document(meshes, keys, rest, colour, name, dict(extras or {}), book)
    document["buffers"] = [{"byteLength": len(book.data)}]
    total = write_container(
        path,
        document,
        len(book.data),
        lambda stream: stream.write(book.data),
        "take fewer frames or fewer cells",
    )
    checks = _read_back(path, total, meshes, keys)
    return Written(path, "glb", max(check.value for check in checks), checks)


class _Book:
    """Accessors, views and bytes as they are added."""

    def __init__(self) -> None:
        self.views: list[Json] = []
        self.accessors: list[Json] = []
        self.data = bytearray()

    def add(self, values: NDArray[Any], shape: str, target: int | None = None) -> int:
        """The number of a new accessor of float32 or unsigned integers."""
        raw = np.ascontiguousarray(values)
        kind = FLOAT if raw.dtype.kind == "f" else INDEX_TYPES[raw.itemsize]
        view: Json = {"buffer": 0, "byteOffset": len(self.data), "byteLength": raw.nbytes}
        if target is not None:
            view["target"] = target
        self.accessors.append(
            {"bufferView": len(self.views), "componentType": kind, "count": len(raw), "type": shape}
        )
        self.views.append(view)
        self.data += raw.tobytes() + bytes(-raw.nbytes % 4)
        return len(self.accessors) - 1

    def bounded(self, values: NDArray[Any], shape: str, target: int | None = None) -> int:
        """As ``add``, with the bounds that positions and times must tell."""
        number = self.add(values, shape, target)
        rows = values.reshape(len(values), -1)
        ends = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors[number] |= ends
        return number


def _document(
    meshes: Sequence[Moving],
    keys: Sequence[Key],
    rest: int,
    colour: tuple[float, float, float],
    name: str,
    extras: Json,
    book: _Book,
) -> Json:
    """The JSON chunk but for its buffer, its keys in a fixed order."""
    side = max(float(np.ptp(mesh.flat, axis=0).max()) for mesh in meshes)
    common = {"mm_per_uv": side, "units": "mm"} | extras
    drawn = [_mesh(mesh, rest, side, common, book) for mesh in meshes]
    times = book.bounded(np.array([time for time, _ in keys], "<f4"), "SCALAR")
    samplers, channels = [], []
    for number, mesh in enumerate(meshes):
        seen = np.array([frame for _, frame in keys])
        targets = np.delete(np.arange(len(mesh.frames)), rest)
        weights = (seen[:, None] == targets).astype("<f4").ravel()
        samplers.append(
            {"input": times, "interpolation": "LINEAR", "output": book.add(weights, "SCALAR")}
        )
        channels.append({"sampler": number, "target": {"node": number, "path": "weights"}})
    return {
        "asset": {"generator": f"devcad {__version__}", "version": "2.0"},
        "extras": common,
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes)))}],
        "nodes": [
            {"name": mesh.name, "mesh": k, "extras": {**common, **mesh.extras}}
            for k, mesh in enumerate(meshes)
        ],
        "meshes": drawn,
        "animations": [{"name": name, "channels": channels, "samplers": samplers}],
        "materials": [
            {
                "name": "sheet",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*linear(colour), 1.0],
                    "metallicFactor": METALLIC,
                    "roughnessFactor": ROUGHNESS,
                },
                "doubleSided": True,
            }
        ],
        "accessors": book.accessors,
        "bufferViews": book.views,
    }


def _mesh(mesh: Moving, rest: int, side: float, common: Json, book: _Book) -> Json:
    """A mesh as the JSON has it, its numbers added to the book."""
    places = _placed(mesh.frames)
    normals = np.stack([_normals(frame, mesh.triangles) for frame in places]).astype("<f4")
    points = places.astype("<f4")
    corner = mesh.flat.min(axis=0)
    uv = np.stack(
        [
            (mesh.flat[:, 0] - corner[0]) / side,
            1.0 - (mesh.flat[:, 1] - corner[1]) / side,
        ],
        axis=1,
    )
    attributes = {
        "POSITION": book.bounded(points[rest], "VEC3", VERTEX_TARGET),
        "NORMAL": book.add(normals[rest], "VEC3", VERTEX_TARGET),
        "TEXCOORD_0": book.add(np.clip(uv, 0.0, 1.0).astype("<f4"), "VEC2", VERTEX_TARGET),
    }
    short = len(points[rest]) <= MOST_SHORT_VERTICES
    index = mesh.triangles.astype("<u2" if short else "<u4").ravel()
    indices = book.add(index, "SCALAR", INDEX_TARGET)
    targets = [
        {
            "POSITION": book.bounded(points[k] - points[rest] + 0.0, "VEC3", VERTEX_TARGET),
            "NORMAL": book.add(normals[k] - normals[rest] + 0.0, "VEC3", VERTEX_TARGET),
        }
        for k in range(len(points))
        if k != rest
    ]
    primitive = {"attributes": attributes, "indices": indices, "material": 0, "targets": targets}
    names = [f"frame {k}" for k in range(len(points)) if k != rest]
    return {
        "name": mesh.name,
        "primitives": [primitive],
        "weights": [0.0] * len(targets),
        "extras": {**common, **mesh.extras, "targetNames": names},
    }


def _placed(frames: Array) -> Array:
    """Points in mm as glTF has them; no zero is negative."""
    return np.asarray(frames @ UP.T * METRES_PER_MM + 0.0)


def _normals(points: Array, triangles: NDArray[np.integer[Any]]) -> Array:
    """The unit normals (n, 3) of a mesh: of each point the mean over its triangles, by their area.

    A point of no triangle, or of triangles without an area, gets the direction up.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    out = np.zeros_like(points)
    for k in range(3):
        np.add.at(out, triangles[:, k], across)
    length = np.linalg.norm(out, axis=1, keepdims=True)
    return np.where(length > 0.0, out / np.where(length > 0.0, length, 1.0), [0.0, 1.0, 0.0])


def _read_back(
    path: Path, total: int, meshes: Sequence[Moving], keys: Sequence[Key]
) -> tuple[Check, ...]:
    """How far the points are, in mm, from their frames at the times of all keys when the weights
    that were read act on the positions that were read; a check a mesh."""
    checks = []
    with opened(path, "rb") as stream:
        document, start = parse(stream, path, total)

        def read(index: int) -> Array:
            found = accessor(stream, start, document, index)
            return found.rows(slice(0, found.count)).astype(float)

        (animation,) = document["animations"]
        for number, mesh in enumerate(meshes):
            (primitive,) = document["meshes"][number]["primitives"]
            base = read(primitive["attributes"]["POSITION"])
            moves = [read(target["POSITION"]) for target in primitive["targets"]]
            sampler = animation["samplers"][animation["channels"][number]["sampler"]]
            weights = read(sampler["output"]).reshape(len(keys), len(moves))
            true = _placed(mesh.frames)
            worst = 0.0
            for row, (_, frame) in zip(weights, keys, strict=True):
                seen = base + sum((w * move for w, move in zip(row, moves, strict=True) if w), 0.0)
                worst = max(worst, float(np.linalg.norm(seen - true[frame], axis=1).max()))
            size = float(np.abs(true).max())
            checks.append(_near(mesh.name, worst / METRES_PER_MM, size / METRES_PER_MM))
    return demanded(checks, path)


def _near(name: str, worst: float, size: float) -> Check:
    """A position and a difference are rounded to float32 each."""
    return at_most(
        CHECK,
        name,
        worst,
        3.0 * FLOAT32_STEP * size,
        "mm",
        says=f"the frames read lie up to {worst:.3g} mm from those written",
        remedy="move the part nearer to the origin",
    )
