"""DXF: the closed contours of a drawing, exact.

Read is the model space as seen from above. Lines that follow each other end to end are joined,
block references are resolved, annotations (texts, dimensions, points, hatches) left out. The
coordinates come in mm by the drawing's own unit, or the job's where it has none.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from devcad.errors import DevcadError, FileError, JobError, LimitError
from devcad.flatten.rings import Contour, meeting, polygon_of, self_crossing
from devcad.importers.dxflines import LINES
from devcad.importers.strokes import SNAP, Stroke, joined
from devcad.libraries import load_ezdxf, silent
from devcad.units import MM_PER_UNIT

MAX_BYTES = 4_000_000
MAX_ENTITIES = 20_000
"""Entities looked at, those of blocks each time that they are drawn; and smooth lines taken."""
MAX_DEPTH = 16
"""Blocks within blocks."""
LARGEST = 1e9
"""mm; no sheet is as large, and squares of it are exact enough."""

INCH = MM_PER_UNIT["in"]
UNITS = {
    1: INCH,
    2: 12.0 * INCH,
    4: 1.0,
    5: MM_PER_UNIT["cm"],
    6: MM_PER_UNIT["m"],
    9: 1e-3 * INCH,
    10: 36.0 * INCH,
    13: 1e-3,
    14: 100.0,
}
"""mm per unit by $INSUNITS: in, ft, mm, cm, m, mil, yd, um, dm."""
ANNOTATIONS = {
    "ACAD_TABLE",
    "ARC_DIMENSION",
    "ATTDEF",
    "ATTRIB",
    "DIMENSION",
    "HATCH",
    "IMAGE",
    "LARGE_RADIAL_DIMENSION",
    "LEADER",
    "MTEXT",
    "MULTILEADER",
    "POINT",
    "RAY",
    "TEXT",
    "TOLERANCE",
    "VIEWPORT",
    "WIPEOUT",
    "XLINE",
}
"""Entities that bound nothing: left out."""


def read_contours(
    data: bytes, *, layer: str | None, mm_per_unit: float, place: str
) -> tuple[Contour, ...]:
    """The closed contours of a drawing in mm, each counterclockwise, in the drawing's order.

    Args:
        layer: the one to be read, upper and lower case alike; None for all that are shown.
        mm_per_unit: of a drawing that does not say its unit.
        place: of the file, for messages.
    Raises:
        FileError: damaged, binary, or no DXF; LimitError: too many entities.
        JobError: no closed contour; one that is open, crosses itself, or meets or holds another;
        an entity that is no plane line.
    """
    with silent("ezdxf"):
        return _contours(_document(data, place), layer, mm_per_unit, place)


def _contours(
    document: Any, layer: str | None, mm_per_unit: float, place: str
) -> tuple[Contour, ...]:
    """The contours of a drawing that could be read."""
    mm = _unit(document, mm_per_unit, place)
    reader = _Reader(document, layer.lower() if layer is not None else None, mm, place)
    try:
        strokes = [stroke for entity in reader.entities() for stroke in reader.strokes(entity)]
    except DevcadError as error:
        raise error.at(place=place) from None
    except Exception as error:  # whatever the library says of an entity that is none
        raise _damaged(error, place) from None
    if not strokes:
        raise _nothing(reader, layer, place)
    contours = joined(strokes, mm, place=place)
    _refuse_unclear(contours, mm, place)
    return contours


def _unit(document: Any, mm_per_unit: float, place: str) -> float:
    """mm per unit of the drawing."""
    code = document.header.get("$INSUNITS", 0) or 0
    if code and code not in UNITS:
        raise JobError(
            f"the drawing's unit, $INSUNITS {code}, is none of a workshop's",
            place=place,
            value=str(code),
            limit="mm, cm, dm, m, um, in, mil, ft, yd",
            remedy="save it in mm",
        )
    return UNITS.get(code, mm_per_unit)


def _document(data: bytes, place: str) -> Any:
    """The drawing, as the library reads it without repairing anything."""
    if data.startswith(b"AutoCAD Binary DXF"):
        raise FileError(
            "the file is a binary DXF", place=place, remedy="save it as a DXF of text (ASCII)"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")  # of names alone: R12 to R2004
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if text.rstrip().rpartition("\n")[2].strip() != "EOF":
        raise FileError(
            "the file is no whole DXF: it does not end with EOF",
            place=place,
            value="no EOF",
            limit="a DXF file",
            remedy="save it again",
        )
    try:
        return load_ezdxf().read(io.StringIO(text))
    except Exception as error:
        raise _damaged(error, place) from None


def _damaged(error: Exception | str, place: str) -> FileError:
    reason = (str(error) or type(error).__name__).split("\n")[0][:120]
    return FileError(
        f"the DXF is damaged: {reason}",
        place=place,
        value=reason,
        limit="a DXF file",
        remedy="open it in a CAD program and save it again",
    )


@dataclass(slots=True)
class _Reader:
    """One drawing on its way to strokes; ``left`` counts down what may still be looked at."""

    document: Any
    layer: str | None
    mm: float
    place: str
    left: int = MAX_ENTITIES

    def entities(self) -> Iterator[Any]:
        """The entities that may bound something, block references resolved."""
        for entity in self.document.modelspace():
            yield from self._resolved(entity, None, 0)

    def _resolved(self, entity: Any, outer: str | None, depth: int) -> Iterator[Any]:
        """An entity, or those of the block that it draws, on the layers where they show."""
        self._count(1)
        kind = entity.dxftype()
        layer = str(entity.dxf.get("layer", "0"))
        layer = outer if layer == "0" and outer is not None else layer
        if kind == "INSERT":
            if depth >= MAX_DEPTH:
                raise _too_many(f"blocks within blocks, more than {MAX_DEPTH} deep", self.place)
            yield from self._inserted(entity, layer, depth)
        elif kind not in ANNOTATIONS and self._wanted(layer):
            if kind not in LINES:
                raise JobError(
                    f"an entity {kind[:40]} bounds no plane contour",
                    place=self.place,
                    value=kind[:40],
                    limit=", ".join(LINES),
                    remedy="explode it to lines and arcs, or name the contours' layer",
                )
            yield entity

    def _inserted(self, insert: Any, layer: str, depth: int) -> Iterator[Any]:
        """What a block reference draws."""
        if insert.block() is None:
            name = str(insert.dxf.get("name", ""))[:40]
            raise _damaged(f'the block "{name}" is missing', self.place)
        self._count(insert.mcount)
        skipped: list[str] = []
        single = (insert,) if insert.mcount <= 1 else insert.multi_insert()
        for one in single:
            for entity in one.virtual_entities(
                skipped_entity_callback=lambda e, _why: skipped.append(e.dxftype())
            ):
                yield from self._resolved(entity, layer, depth + 1)
        bounding = [kind for kind in skipped if kind not in ANNOTATIONS]
        if bounding:
            raise JobError(
                f"an entity {bounding[0][:40]} in a block cannot be scaled with it",
                place=self.place,
                value=bounding[0][:40],
                remedy="explode the block in the drawing",
            )

    def _wanted(self, layer: str) -> bool:
        """Whether what lies on a layer is to be read."""
        if self.layer is not None:
            return layer.lower() == self.layer
        if not self.document.layers.has_entry(layer):
            return True
        entry = self.document.layers.get(layer)
        return not (entry.is_off() or entry.is_frozen())

    def _count(self, number: int) -> None:
        self.left -= number
        if self.left < 0:
            raise _too_many(f"more than {MAX_ENTITIES} entities", self.place)

    def strokes(self, entity: Any) -> Iterator[Stroke]:
        """The smooth lines of an entity that have a length, in mm."""
        what: str = entity.dxftype()
        edges = LINES[what](entity, self.mm)
        self._count(len(edges))
        points = [polygon_of((edge,)) for edge in edges]
        if not all(np.isfinite(p).all() and np.abs(p).max() <= LARGEST for p in points):
            raise _damaged(f"a {what} has coordinates that are no lengths", self.place)
        for edge, found in zip(edges, points, strict=True):
            if np.ptp(found, axis=0).max() > SNAP:
                yield Stroke(edge, what)


def _too_many(what: str, place: str) -> LimitError:
    return LimitError(
        f"the drawing has {what}",
        place=place,
        value=what,
        limit=MAX_ENTITIES,
        remedy="split it, or keep only what is to be cut",
    )


def _nothing(reader: _Reader, layer: str | None, place: str) -> JobError:
    """The error of a drawing in which nothing was found."""
    layers = sorted({str(e.dxf.get("layer", "0")) for e in reader.document.modelspace()})
    names = ", ".join(layers)[:200]
    if layer is None:
        what, remedy = "the drawing has no contour", "draw one in the model space"
    else:
        what = f'the drawing has no contour on the layer "{layer[:60]}"'
        remedy = f"its layers: {names}" if names else "its model space is empty"
    return JobError(what, place=place, value=0, limit=1, remedy=remedy)


def _refuse_unclear(contours: tuple[Contour, ...], mm: float, place: str) -> None:
    """JobError for contours that do not say what is to be cut out."""
    polygons = [polygon_of(contour) for contour in contours]
    for polygon in polygons:
        crossing = self_crossing(polygon)
        if crossing is not None:
            x, y = crossing[0] / mm, crossing[1] / mm
            raise JobError(
                f"a contour crosses or touches itself at ({x:.6g}, {y:.6g})",
                place=place,
                value="self-crossing",
                remedy="draw each hole as one simple contour",
            )
    pair = meeting(polygons)
    if pair is not None:
        spots = [polygons[k][0] / mm for k in pair]
        at = " and ".join(f"({x:.6g}, {y:.6g})" for x, y in spots)
        raise JobError(
            f"two contours meet, or one holds the other: those through {at}",
            place=place,
            value="two contours",
            remedy="an island inside a hole would fall out: leave it out, or join it by a bridge",
        )
