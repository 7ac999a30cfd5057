"""STL: binary triangles in mm, all panels in one file.

84 + 50 n bytes: a header of 80, the count n, and for each facet a unit normal, three corners
(float32) and two zero bytes. The format has no vertices, so readers weld corners that are
bitwise equal: equal weld numbers are written as equal bits (``bodies``). Facets of no area with
three distinct corners stay, for without them a crack would open.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from devcad.checks import Check
from devcad.export import Options, Written
from devcad.export.binary import BLOCK, blocks, demanded, opened, torn
from devcad.export.bodies import (
    Body,
    columns,
    cross,
    picked,
    rounded_body,
    rounding_checks,
    six_volumes,
    volume_kept,
)
from devcad.part import Part

CHECK = "stl-readback"

HEADER_BYTES = 80

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
PACKED = np.dtype([("normal", "V12"), ("corners", "V36"), ("attribute", "<u2")])  # copied whole


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
    bodies = [rounded_body(panel, CHECK, path) for panel in part.panels]
    with opened(path, "wb") as stream:
        stream.write(header(part.name))
        stream.write(np.array(sum(len(b.triangles) for b in bodies), "<u4").tobytes())
        sizes = [_write_body(stream, body) for body in bodies]
    for body, (area, volume) in zip(bodies, sizes, strict=True):
        if body.mesh.watertight:
            demanded([volume_kept(body, area, volume)], path)
    checks = _read_back(path, bodies)
    deviation = max(body.mesh.deviation + body.rounding for body in bodies)
    return [Written(path, "stl", float(deviation), checks)]


def header(name: str) -> bytes:
    """The 80 ASCII bytes of the header; never "solid", which would announce the text form."""
    return f"devcad {name} mm".encode("ascii", "replace")[:HEADER_BYTES].ljust(HEADER_BYTES)


def _write_body(stream: BinaryIO, body: Body) -> tuple[float, float]:
    """Append the facets; their area in mm2 and the volume in mm3 that they enclose."""
    records = np.zeros(min(len(body.triangles), BLOCK), PACKED)
    twice_area = total = 0.0
    for rows in blocks(len(body.triangles)):
        corners = picked(body.points, body.triangles[rows])
        a, b, c = columns(corners)
        normal = cross(b - a, c - a)
        x, y, z = normal
        length = np.sqrt(x * x + y * y + z * z)
        twice_area += float(length.sum())
        total += six_volumes(a, b, c, z)
        length[length == 0.0] = 1.0  # no area, no direction: the normal stays zero
        block = records[: len(corners)]
        block["normal"] = (normal / length).T.astype("<f4", order="C").view("V12")[:, 0]
        block["corners"] = corners.reshape(-1, 9).view("V36")[:, 0]
        stream.write(block.data)
    return twice_area / 2.0, total / 6.0


def _read_back(path: Path, bodies: list[Body]) -> tuple[Check, ...]:
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
                if not np.array_equal(corners, picked(body.points, triangles)):
                    raise torn(CHECK, path, "the corners read differ", panel=body.panel)
            checks += demanded(rounding_checks(body), path)
    return tuple(checks)
