"""Pages to the bytes of a PDF, by reportlab. Everything is in mm, from a page's lower left corner.

No byte depends on the clock. Layers are optional content
groups, which viewers can show and hide; a form is a drawing that stands once in the file and is
shown through windows on any page.
"""

from __future__ import annotations

import io
import os
import re
import time
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import accumulate, takewhile
from typing import Any, Literal

from reportlab.pdfbase import pdfdoc
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas

from devcad import __version__
from devcad.errors import JobError
from devcad.export.pdfpaths import number, numbers
from devcad.units import MM_PER_INCH

POINT = 72.0 / MM_PER_INCH
"""PDF's unit of length: so many points a mm."""
REGULAR, BOLD = "Helvetica", "Helvetica-Bold"
FORM = "pattern"  # the name of the one form of a file
LINE = 1.25  # of the size, from one line of words to the next
LAST_SECOND = 253_402_300_800  # of the year 9999
SMALLEST = 0.8  # mm; words that do not fit at this size are cut off


@dataclass(frozen=True, slots=True)
class Text:
    """A line of words at (x, y), the left end, middle or right end of its base line; ``size`` of
    the letters in mm, ``grey`` from 0 black to 1, ``upright`` False: read from below."""

    x: float
    y: float
    words: str
    size: float = 3.0
    bold: bool = False
    anchor: Literal["start", "middle", "end"] = "start"
    grey: float = 0.0
    upright: bool = True


@dataclass(frozen=True, slots=True)
class Page:
    """A page of ``width`` x ``height`` mm: path operators in mm and texts, in their order."""

    width: float
    height: float
    items: tuple[str | Text, ...]


@dataclass(frozen=True, slots=True)
class Form:
    """A drawing in its own mm within (left, bottom, right, top), as path operators."""

    box: tuple[float, float, float, float]
    operators: str


def plain(words: str) -> str:
    """The words in the letters that PDF's own fonts have: accents that they lack are dropped, what
    is no letter of theirs becomes a question mark, control characters become spaces."""
    return "".join(_letter(c) for c in unicodedata.normalize("NFC", words))


@cache
def _letter(character: str) -> str:
    """What stands for one character."""
    if character.isspace() or unicodedata.category(character).startswith("C"):
        return " "
    named = re.match(r"LATIN (SMALL|CAPITAL) LETTER (\w) WITH", unicodedata.name(character, ""))
    base = "" if named is None else named[2].lower() if named[1] == "SMALL" else named[2]
    folded = unicodedata.normalize("NFKD", character)
    for wish in (character, folded, folded.encode("ascii", "ignore").decode(), base):
        try:
            if wish and wish.encode("cp1252"):
                return wish
        except UnicodeEncodeError:
            continue
    return "?"


def width(words: str, size: float, *, bold: bool = False) -> float:
    """The length of a line of words, mm."""
    return size * sum(_advance(letter, bold) for letter in plain(words))


@cache
def _advance(letter: str, bold: bool) -> float:
    """The width of one letter, over its size."""
    return float(stringWidth(letter, BOLD if bold else REGULAR, 1000)) / 1000.0


def shortened(words: str, room: float, size: float, *, bold: bool = False) -> str:
    """The words if they are no longer than the room in mm, else their beginning and dots."""
    words = plain(words)
    if width(words, size, bold=bold) <= room:
        return words
    kept = _that_fit(words, room - width("...", size, bold=bold), size, bold)
    return f"{words[:kept].rstrip()}..."


def _that_fit(words: str, room: float, size: float, bold: bool) -> int:
    """How many letters, from the first, fit into a room."""
    ends = accumulate(size * _advance(letter, bold) for letter in words)
    return sum(1 for _ in takewhile(lambda end: end <= room, ends))


def fitted(
    lines: Sequence[tuple[str, float, bool]], box: tuple[float, float, float, float], size: float
) -> tuple[list[Text], float]:
    """Lines (words, size relative to ``size``, bold) from the top of a box down, wrapped to its
    width and smaller where they would not fit; and the height that they leave, mm."""
    left, bottom, right, top = box
    while True:
        rows = [
            (row, share * size, bold)
            for words, share, bold in lines
            for row in _wrapped(words, right - left, share * size, bold)
        ]
        needed = sum(LINE * each for _, each, _ in rows)
        if needed <= top - bottom or size < SMALLEST:
            break
        size *= 0.93
    out, y = [], top
    for row, each, bold in rows:
        y -= LINE * each
        if y < bottom - 1e-9:
            break
        out.append(Text(left, y + 0.3 * each, row, each, bold))
    return out, y - bottom


def _wrapped(words: str, room: float, size: float, bold: bool) -> Iterator[str]:
    """The words in rows no longer than the room; a word that is longer is cut."""
    row = ""
    for word in plain(words).split():
        longer = f"{row} {word}".strip()
        if width(longer, size, bold=bold) <= room:
            row = longer
            continue
        if row:
            yield row
        row = word
        while (cut := max(1, _that_fit(row, room, size, bold))) < len(row):
            yield row[:cut]
            row = row[cut:]
    yield row


def date() -> str:
    """The day of SOURCE_DATE_EPOCH in UTC, "" where that is not set: no other date is told."""
    seconds = _epoch()
    return "" if seconds is None else time.strftime("%Y-%m-%d", time.gmtime(seconds))


def _epoch() -> int | None:
    """The seconds of SOURCE_DATE_EPOCH, None where it is not set; reportlab reads it too."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "").strip()
    if not seconds:
        return None
    if not (seconds.isdecimal() and int(seconds) < LAST_SECOND):
        raise JobError(
            f'SOURCE_DATE_EPOCH is "{seconds[:60]}", no number of seconds since 1970',
            value=seconds[:60],
            limit=f"0 to {LAST_SECOND - 1}",
            remedy="unset it, or set it to seconds",
        )
    return int(seconds)


@contextmanager
def layer(items: list[str | Text], name: str) -> Iterator[None]:
    """What is added to the items meanwhile lies on a layer and leaves the pen as it was."""
    items.append(f"/OC /{name} BDC q")
    yield
    items.append("Q EMC")


def written(
    title: str, pages: Sequence[Page], layers: Sequence[str] = (), form: Form | None = None
) -> bytes:
    """The file of these pages, to be printed without scaling. ``layers`` are the names of all
    layers, letters and underscores, in the order in which a viewer lists them.

    Raises:
        JobError: SOURCE_DATE_EPOCH is no number of seconds.
    """
    _epoch()
    canvas = Canvas(
        io.BytesIO(),
        pageCompression=0,
        invariant=1,
        pdfVersion=(1, 5),  # the first with optional content
        initialFontName=REGULAR,
        initialFontSize=12,
        initialLeading=14,
        lang="en",
    )
    canvas.setViewerPreference("PrintScaling", "None")
    canvas.setViewerPreference("DisplayDocTitle", "true")
    document = canvas._doc
    document.info.format = _information(plain(title)).format
    groups = _groups(document, layers)
    for page in pages:
        _show(canvas, page)
    for page, made in zip(pages, document.Pages.pages, strict=True):
        size = (number(page.width * POINT), number(page.height * POINT))
        made.MediaBox = pdfdoc.PDFArray(["0", "0", *size])  # reportlab would round it
        made.Trans = None
        made.Resources = _resources(groups, form is not None)
        made.Contents = pdfdoc.PDFStream(content=made.stream, filters=[pdfdoc.PDFZCompress])
    if form is not None:
        _add_form(document, form, groups)
        document.updateSignature(form.operators)
    return bytes(canvas.getpdfdata())


def _show(canvas: Any, page: Page) -> None:
    """Add a page to the canvas."""
    canvas.setPageSize((page.width * POINT, page.height * POINT))
    canvas.addLiteral(f"{POINT!r} 0 0 {POINT!r} 0 0 cm")
    for item in page.items:
        if isinstance(item, str):
            canvas.addLiteral(item)
        else:
            _write(canvas, item)
    canvas.showPage()


def _write(canvas: Any, text: Text) -> None:
    """Add a text to the canvas."""
    words = plain(text.words)
    back = {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor]
    shift = back * width(words, text.size, bold=text.bold)
    turn = "1 0 0 1" if text.upright else "0 1 -1 0"
    x, y = (text.x - shift, text.y) if text.upright else (text.x, text.y - shift)
    canvas.addLiteral(f"q {numbers(text.grey)} g {turn} {numbers(x, y)} cm")
    canvas.setFont(BOLD if text.bold else REGULAR, text.size)
    canvas.drawString(0, 0, words)
    canvas.addLiteral("Q")


def _information(title: str) -> Any:
    """What the file says of itself; a date only where SOURCE_DATE_EPOCH gives one."""
    maker = f"devcad {__version__}"
    said = {"Title": title, "Creator": maker, "Producer": f"{maker}, ReportLab"}
    seconds = _epoch()
    if seconds is not None:
        said["CreationDate"] = time.strftime("D:%Y%m%d%H%M%SZ", time.gmtime(seconds))
    return pdfdoc.PDFDictionary({key: pdfdoc.PDFString(text) for key, text in said.items()})


def _groups(document: Any, layers: Sequence[str]) -> dict[str, Any]:
    """The optional content group of every layer, all of them on."""
    groups = {
        name: document.Reference(
            pdfdoc.PDFDictionary({"Type": "/OCG", "Name": pdfdoc.PDFString(name)}), f"layer.{name}"
        )
        for name in layers
    }
    if groups:
        every = pdfdoc.PDFArray(list(groups.values()))
        shown = pdfdoc.PDFDictionary({"Order": every, "ON": every})
        catalog = document.Catalog
        catalog.__NoDefault__ = [*catalog.__NoDefault__, "OCProperties"]
        catalog.OCProperties = pdfdoc.PDFDictionary({"OCGs": every, "D": shown})
    return groups


def _resources(groups: dict[str, Any], formed: bool) -> Any:
    """What the operators of a page or a form may name."""
    resources = pdfdoc.PDFResourceDictionary(Properties=groups)
    resources.basicFonts()
    if formed:
        resources.XObject = {FORM: pdfdoc.PDFObjectReference(pdfdoc.xObjectName(FORM))}
    return resources


def _add_form(document: Any, form: Form, groups: dict[str, Any]) -> None:
    made = pdfdoc.PDFFormXObject(*form.box)
    made.Contents = pdfdoc.PDFStream(content=form.operators, filters=[pdfdoc.PDFZCompress])
    made.Resources = _resources(groups, False)
    document.addForm(FORM, made)
