"""STEP files: shapes with names and a colour out, a fresh reader's shapes in."""

from __future__ import annotations

import io
import itertools
import os
import re
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.collections import DataMap_TCollection_AsciiString_TCollection_AsciiString as Settings
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Messenger
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Reader
from OCP.StepData import StepData_Protocol, StepData_StepWriter
from OCP.TCollection import (
    TCollection_AsciiString,
    TCollection_ExtendedString,
    TCollection_HAsciiString,
)
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from devcad import __version__
from devcad.errors import CheckFailed, FileError, JobError
from devcad.export._step_lean import lean

SCHEMAS = {"AP214": "AP214IS", "AP242": "AP242DIS"}
_LONG_REAL = re.compile(rb"-?\d\.\d{16}E[+-]\d+")
_LINK = re.compile(rb"NEXT_ASSEMBLY_USAGE_OCCURRENCE\(\s*'\d+'")
_PAINT = re.compile(  # the kernel breaks its lines between any two words
    rb"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION \( '' , \( #(\d+) \) , #(\d+) \) ;"
    rb" #\d+ = STYLED_ITEM \( 'color' , \( #(\d+) \) , #(\d+) \) ;".replace(b" ", rb"\s*")
)
EPOCH = "1970-01-01T00:00:00"
_SETTINGS: dict[str, str | int] = {
    "write.step.unit": "MM",
    "write.surfacecurve.mode": 1,
    "write.precision.mode": 0,
}

_READING = {"FixShape.FixSelfIntersectionMode": "0"}


def write_step(
    path: Path,
    name: str,
    bodies: list[tuple[str, TopoDS_Shape]],
    colour: tuple[float, float, float],
    schema: str,
    *,
    sparing: bool = False,
) -> None:
    """One STEP file in mm: one body is the product ``name``; several are the named products of
    one assembly ``name``. ``colour`` is sRGB, 0 to 1; ``sparing`` writes equal points once. Equal
    input gives equal bytes.

    Raises:
        JobError: no such schema. FileError: the file could not be written.
    """
    if schema not in SCHEMAS:
        raise JobError(
            f"no STEP schema {schema!r}", value=schema, remedy=f"use {' or '.join(SCHEMAS)}"
        )
    settings = _SETTINGS | {"write.step.schema": SCHEMAS[schema]}
    with _quiet(), _static(settings):
        document = _document(name, bodies, colour)
        writer = STEPCAFControl_Writer()
        writer.Transfer(document, STEPControl_AsIs)
        session = writer.ChangeWriter()
        _header(APIHeaderSection_MakeHeader(session.Model()), name)
        text = _printed(StepData_StepWriter(session.Model()), session.WS().Protocol())
    text = _settled(text)
    try:
        path.write_bytes(lean(text) if sparing else text)
    except OSError as error:
        raise FileError(
            f"cannot write {path.name}: {error.strerror}",
            remedy="is the disk full, the folder locked?",
        ) from error


def read_step(path: Path) -> TopoDS_Shape:
    """The shape in a STEP file, read by a new reader after the model's own check.

    Edges that cross are not mended: our files must not need it, and to look for them takes a time
    that grows with the square of a face's holes.

    Raises:
        CheckFailed: the file does not read, or its model is inconsistent.
    """
    with _quiet():
        reader = STEPControl_Reader()
        settings = Settings()
        for name, value in _READING.items():
            settings.Bind(TCollection_AsciiString(name), TCollection_AsciiString(value))
        reader.SetShapeFixParameters(settings)
        read = reader.ReadFile(str(path)) == IFSelect_RetDone
        sound = read and reader.WS().ModelCheckList(True).IsEmpty(True)
        if not (sound and reader.TransferRoots() > 0):
            raise CheckFailed("step-valid: the file does not read back", value=path.name)
        return reader.OneShape()


def ascii_name(name: str) -> str:
    """The name in plain ASCII: accents dropped, anything else as an underscore."""
    plain = unicodedata.normalize("NFKD", name)
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    return re.sub(r"[^ -~]|'", "_", plain)


def time_stamp() -> str:
    """The time in the header: SOURCE_DATE_EPOCH in UTC, else a fixed one."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not seconds.isdigit():
        return EPOCH
    return datetime.fromtimestamp(int(seconds), UTC).strftime("%Y-%m-%dT%H:%M:%S")


def _document(
    name: str, bodies: list[tuple[str, TopoDS_Shape]], colour: tuple[float, float, float]
) -> TDocStd_Document:
    """The product structure with names and colours."""
    document = TDocStd_Document(TCollection_ExtendedString("devcad"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    paint = Quantity_Color(*colour, Quantity_TOC_sRGB)
    root = shapes.NewShape() if len(bodies) > 1 else None
    for panel, shape in bodies:
        label = shapes.AddShape(shape, False)
        _name(label, panel if root is not None else name)
        colours.SetColor(label, paint, XCAFDoc_ColorSurf)
        if root is not None:
            _name(shapes.AddComponent(root, label, TopLoc_Location()), panel)
    if root is not None:
        _name(root, name)
    shapes.UpdateAssemblies()
    return document


def _name(label: TDF_Label, name: str) -> None:
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(ascii_name(name)))


def _header(header: APIHeaderSection_MakeHeader, name: str) -> None:
    """Who and what wrote the file, and a time that does not change."""

    def text(value: str) -> TCollection_HAsciiString:
        return TCollection_HAsciiString(value)

    header.SetName(text(ascii_name(name)))
    header.SetTimeStamp(text(time_stamp()))
    header.SetAuthorValue(1, text("devcad"))
    header.SetOrganizationValue(1, text("devcad"))
    header.SetOriginatingSystem(text(f"devcad {__version__}"))
    header.SetAuthorisation(text("none"))
    header.SetDescriptionValue(1, text("developable surface, mm"))


def _printed(writer: StepData_StepWriter, protocol: StepData_Protocol) -> bytes:
    """The file's text, every real with the digits it needs to read back the same: the kernel's
    own 12 would cost exact faces theirs, and its suppression of zeros damages longer ones."""
    writer.FloatWriter().SetFormat("%.16E")
    writer.SendModel(protocol)
    out = io.BytesIO()
    writer.Print(out)
    real = cache(_real)  # most numbers stand in a file more than once
    return _LONG_REAL.sub(lambda m: real(m[0]), out.getvalue())


def _real(text: bytes) -> bytes:
    """A real in the exchange format: shortest digits, always a point, no negative zero."""
    mantissa, _, exponent = repr(float(text) + 0.0).partition("e")
    mantissa = mantissa.removesuffix("0") if mantissa.endswith(".0") else mantissa
    point = "" if "." in mantissa else "."
    return f"{mantissa}{point}{'E' if exponent else ''}{exponent}".encode()


def _settled(text: bytes) -> bytes:
    """What the kernel leaves to chance, put in order.

    It counts assembly links over the whole process, so they are numbered from 1; and it lists the
    coloured bodies by their addresses. All bodies have one colour, so that their blocks differ
    only in context and body: those pairs are dealt out again in the order of the bodies.
    """
    count = itertools.count(1)
    text = _LINK.sub(lambda _: b"NEXT_ASSEMBLY_USAGE_OCCURRENCE('%d'" % next(count), text)
    pairs = iter(sorted((int(m[4]), int(m[2])) for m in _PAINT.finditer(text)))

    def dealt(m: re.Match[bytes]) -> bytes:
        body, context = next(pairs)
        return (
            b"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',(\n"
            b"    #%s),#%d);\n#%s = STYLED_ITEM('color',(#%s),#%d);"
            % (m[1], context, m[1], m[3], body)
        )

    return _PAINT.sub(dealt, text)


@contextmanager
def _quiet() -> Iterator[None]:
    """Take the kernel's printers away, so that nothing reaches stdout, and put them back."""
    messenger: Message_Messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


@contextmanager
def _static(settings: dict[str, str | int]) -> Iterator[None]:
    """Set the kernel's process-wide writing parameters and put them back."""
    STEPCAFControl_Writer()  # the parameters exist once a first writer was made
    before: dict[str, str | int] = {}
    for key, value in settings.items():
        if isinstance(value, str):
            before[key] = str(Interface_Static.CVal_s(key))
            Interface_Static.SetCVal_s(key, value)
        else:
            before[key] = int(Interface_Static.IVal_s(key))
            Interface_Static.SetIVal_s(key, value)
    try:
        yield
    finally:
        for key, value in before.items():
            if isinstance(value, str):
                Interface_Static.SetCVal_s(key, value)
            else:
                Interface_Static.SetIVal_s(key, value)
