"""3MF: the solids for slicers, with unit, names and a colour.

A zip of three files: what types there are, where the model is, and the model, an XML text of one
object a panel with its own vertices and triangles. Numbers are single precision, as every reader
has them, in the nine digits that bring their bits back. The text is written here, because lib3mf
gives each file new identifiers and the time; its reader, at its strictest, is the judge.
"""

from __future__ import annotations

import ctypes
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, BinaryIO
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile, ZipInfo

import lib3mf
import numpy as np
from numpy.typing import NDArray

from devcad import __version__
from devcad.checks import Check
from devcad.errors import GeometryError
from devcad.export import Options, Written
from devcad.export.binary import blocks, demanded, opened, torn
from devcad.export.bodies import Body, area_and_volume, rounded_body, rounding_checks, volume_kept
from devcad.part import Part

CHECK = "3mf-readback"

MODEL_FILE = "3D/3dmodel.model"
XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
TYPES = (
    f'{XML}<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">\n'
    '<Default Extension="rels"'
    ' ContentType="application/vnd.openxmlformats-package.relationships+xml"/>\n'
    '<Default Extension="model"'
    ' ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>\n'
    "</Types>\n"
)
RELATIONS = (
    f'{XML}<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">\n'
    f'<Relationship Id="model" Target="/{MODEL_FILE}"'
    ' Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>\n'
    "</Relationships>\n"
)
OPENING = (
    f'{XML}<model unit="millimeter" xml:lang="en-US"'
    ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
)
VERTEX = '<vertex x="%.9g" y="%.9g" z="%.9g"/>\n'
TRIANGLE = '<triangle v1="%d" v2="%d" v3="%d"/>\n'
LONGEST = 80  # characters a line of these
ZIP64 = 2**31  # bytes from which a file in a zip needs the large form
MATERIAL = 1  # the id of the one material; the objects follow
UNIX = 3  # the system that the zip names as its maker, whichever made it
READABLE = 0o644 << 16


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One file ``<part>.3mf`` in the folder, read back by lib3mf: an object and a build item for
    every panel, named as the panel. Equal input gives equal bytes.

    ``max_deviation`` is the mesh's own certified deviation plus the measured rounding to float32,
    the largest over the panels. ``checks`` holds that rounding for each panel as ``3mf-readback``
    in mm; where rounding made distinct points one, a second entry in points tells how many.

    Raises:
        GeometryError: a panel without thickness: an open sheet is no body that can be printed.
        CheckFailed: ``3mf-readback`` when a solid is not closed after rounding or lost its volume,
            when lib3mf objects to anything, or reads other numbers than were written.
        FileError: the file cannot be written.
    Source:
        3MF Consortium, 3D Manufacturing Format, Core Specification 1.4, chapters 2 to 5.
    """
    for panel in part.panels:
        if not panel.mesh.watertight:
            raise GeometryError(
                "3MF holds solids, and this panel is an open sheet",
                panel=panel.name,
                remedy="give the job a thickness, or write it as stl",
            )
    path = folder / f"{part.name}.3mf"
    bodies = [_compact(rounded_body(panel, CHECK, path)) for panel in part.panels]
    for body in bodies:
        demanded([volume_kept(body, *area_and_volume(body))], path)
    with opened(path, "wb") as stream:
        _write_package(stream, part, bodies)
    checks = _read_back(path, part, bodies)
    deviation = max(body.mesh.deviation + body.rounding for body in bodies)
    return [Written(path, "3mf", float(deviation), checks)]


def display_colour(colour: tuple[float, float, float]) -> str:
    """An sRGB colour, components 0 to 1, as #RRGGBB."""
    return "#" + bytes(round(255.0 * c) for c in colour).hex().upper()


def _compact(body: Body) -> Body:
    """The body without points that no facet uses."""
    used = np.zeros(len(body.points), dtype=bool)
    used[body.triangles] = True
    if used.all():
        return body
    number = np.cumsum(used, dtype=np.int32) - 1
    return replace(body, points=body.points[used], triangles=number[body.triangles])


def _write_package(stream: BinaryIO, part: Part, bodies: list[Body]) -> None:
    """The zip, its files in a fixed order and at a fixed time."""
    rows = sum(len(body.points) + len(body.triangles) for body in bodies)
    with ZipFile(stream, "w") as package:
        for name, text in (("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)):
            package.writestr(_entry(name), text)
        large = LONGEST * rows >= ZIP64
        with package.open(_entry(MODEL_FILE), "w", force_zip64=large) as model:
            _write_model(model, part, bodies)


def _entry(name: str) -> ZipInfo:
    """A file of the zip, dated as early as zips go."""
    entry = ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    entry.compress_type, entry.create_system, entry.external_attr = ZIP_DEFLATED, UNIX, READABLE
    return entry


def _write_model(stream: IO[bytes], part: Part, bodies: list[Body]) -> None:
    """The model's XML, block by block."""
    stream.write(_head(part).encode())
    for number, body in enumerate(bodies, start=MATERIAL + 1):
        stream.write(_object_head(number, part, body).encode())
        for line, rows in ((VERTEX, body.points), (TRIANGLE, body.triangles)):
            for block in blocks(len(rows)):
                numbers = tuple(rows[block].ravel().tolist())
                stream.write((line * (len(numbers) // 3) % numbers).encode())
            if line is VERTEX:
                stream.write(b"</vertices>\n<triangles>\n")
        stream.write(b"</triangles>\n</mesh>\n</object>\n")
    items = [f'<item objectid="{MATERIAL + 1 + k}"/>\n' for k in range(len(bodies))]
    stream.write(f"</resources>\n<build>\n{''.join(items)}</build>\n</model>\n".encode())


def _head(part: Part) -> str:
    """What stands before the objects: metadata and the material."""
    told = {"Title": part.name, "Application": f"devcad {__version__}"}
    if part.description:
        told["Description"] = part.description
    metadata = "".join(
        f"<metadata name={quoteattr(name)}>{escape(text)}</metadata>\n"
        for name, text in told.items()
    )
    base = f'<base name="sheet" displaycolor="{display_colour(part.colour)}"/>'
    material = f'<basematerials id="{MATERIAL}">\n{base}\n</basematerials>\n'
    return f"{OPENING}{metadata}<resources>\n{material}"


def _object_head(number: int, part: Part, body: Body) -> str:
    """What stands before an object's vertices."""
    ordered = f" partnumber={quoteattr(part.part_number)}" if part.part_number else ""
    return (
        f'<object id="{number}" type="model" name={quoteattr(body.panel)}{ordered}'
        f' pid="{MATERIAL}" pindex="0">\n<mesh>\n<vertices>\n'
    )


def _read_back(path: Path, part: Part, bodies: list[Body]) -> tuple[Check, ...]:
    """Read the file with lib3mf and compare it with the rounded meshes, bit by bit."""
    try:
        _demand_xml(path)  # lib3mf lets a text pass that ends early
        model = _strictly_read(path)
    except (BadZipFile, KeyError, EOFError, zlib.error, expat.ExpatError) as error:
        raise torn(CHECK, path, f"the package is damaged: {error}") from None
    except lib3mf.ELib3MFException as error:
        raise torn(CHECK, path, f"lib3mf refuses it: {error}") from None
    if model.GetUnit() != lib3mf.ModelUnit.MilliMeter:
        raise torn(CHECK, path, "another unit than millimetres was read")
    items = list(_each(model.GetBuildItems()))  # the model has to outlive them
    if len(items) != len(bodies):
        raise torn(CHECK, path, f"{len(items)} objects were read, {len(bodies)} written")
    checks: list[Check] = []
    for item, body in zip(items, bodies, strict=True):
        fault = _fault(item, body)
        if fault:
            raise torn(CHECK, path, fault, panel=body.panel)
        checks += demanded(rounding_checks(body), path)
    return tuple(checks)


def _demand_xml(path: Path) -> None:
    """Read the model through the zip's checksum and an XML parser; they raise what they find."""
    parser = expat.ParserCreate()
    with ZipFile(path) as package, package.open(MODEL_FILE) as model:
        parser.ParseFile(model)


def _strictly_read(path: Path) -> Any:
    """lib3mf's model of a file that it reads without a warning."""
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    if reader.GetWarningCount():
        raise torn(CHECK, path, f"lib3mf warns: {reader.GetWarning(0)}")
    return model


def _fault(item: Any, body: Body) -> str:
    """What differs between a build item and the body that was written, or nothing."""
    found = item.GetObjectResource()
    if item.HasObjectTransform() or not found.IsMeshObject():
        return "an object is moved, or is no mesh"
    if found.GetName() != body.panel:
        return f"the name {found.GetName()!r} was read"
    points = _rows(found, lib3mf.Position, np.float32, found.GetVertexCount())
    triangles = _rows(found, lib3mf.Triangle, np.uint32, found.GetTriangleCount())
    if not np.array_equal(points.view(np.uint32), body.points.view(np.uint32)):
        return "the vertices read differ"
    return "" if np.array_equal(triangles, body.triangles) else "the triangles read differ"


def _rows(mesh: Any, kind: Any, number: Any, count: int) -> NDArray[Any]:
    """A mesh's vertices or triangles, (count, 3): the binding's own methods make an object of
    every row, which takes ten times the memory and the time."""
    rows, told, wrapper = (kind * count)(), ctypes.c_uint64(0), mesh._wrapper
    fill = {
        lib3mf.Position: wrapper.lib.lib3mf_meshobject_getvertices,
        lib3mf.Triangle: wrapper.lib.lib3mf_meshobject_gettriangleindices,
    }[kind]
    wrapper.checkError(mesh, fill(mesh._handle, ctypes.c_uint64(count), told, rows))
    return np.frombuffer(rows, number).reshape(-1, 3)


def _each(iterator: Any) -> Iterator[Any]:
    """What one of lib3mf's iterators runs through."""
    while iterator.MoveNext():
        yield iterator.GetCurrent()
