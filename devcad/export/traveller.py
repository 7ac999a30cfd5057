"""The traveller: one PDF a job, one A4 page a panel, that goes through the shop with the part.

A picture to scale with overall dimensions, the blank, material and lengths, the bends, the stitches
and edges, the checks with their limits, the files with their hashes, and boxes to sign.
"""

from __future__ import annotations

import hashlib
import math
import zlib
from collections.abc import Sequence
from pathlib import Path

from devcad import __version__
from devcad.checks import Check
from devcad.export import Options, Written
from devcad.export.binary import opened, torn
from devcad.export.outline import contours, fitted_strokes
from devcad.export.pdf import READBACK, pattern_groups
from devcad.export.pdfcanvas import POINT, Page, date, written
from devcad.export.pdflayout import Box
from devcad.export.pdfpages import Groups, Item, ordered
from devcad.export.pdfread import read
from devcad.export.travellerpages import (
    Table,
    footer,
    heading,
    height,
    picture,
    shown,
    sign_off,
)
from devcad.flatten.pattern import STITCH, Line
from devcad.part import Panel, Part
from devcad.shop.materials import material
from devcad.shop.settings import PAPERS
from devcad.shop.stock import stock_words

WIDE, HIGH = PAPERS["A4"]
EDGE = 12.0  # mm, the margin of the page
FINEST = 0.01  # mm; a picture need not be nearer
SMALLEST = 55.0  # mm, the least height of the picture
MOST_BENDS, MOST_STITCHES, MOST_NOTES, MOST_CHECKS, MOST_FILES = 24, 12, 4, 28, 12
"""Rows of the tables, at most; all shrink by :data:`SHRUNK` where the page is full."""
SHRUNK = (1.0, 0.75, 0.5, 0.34, 0.2)
FOOT = 30.0  # mm for the boxes to sign and the last line
GAP = 3.0  # mm between the blocks
STITCHES = ("edge", "mate", "holes", "pitch", "hole", "inset")
EDGES = ("edge", "finish", "allowance", "corner")


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """JOB-traveller.pdf, written and read back; the pictures are within 0.01 mm on the sheet.

    Raises:
        JobError: SOURCE_DATE_EPOCH is no number; CheckFailed: pdf-readback; FileError: the file
        cannot be written.
    """
    files = _files(part, folder)
    made = [_page(part, k, files) for k in range(len(part.panels))]
    layers = ordered([name for _, names in made for name in names])
    path = folder / f"{part.name}-traveller.pdf"
    with opened(path, "wb") as stream:
        stream.write(written(f"{part.name} traveller", [page for page, _ in made], layers))
    _read_back(path, len(made))
    return [Written(path, "traveller", 2.0 * FINEST)]


def _read_back(path: Path, count: int) -> None:
    """CheckFailed unless the file has so many A4 pages."""
    try:
        with opened(path, "rb") as stream:
            pages = read(stream.read()).pages
        sizes = {(round(page.width / POINT, 3), round(page.height / POINT, 3)) for page in pages}
        if len(pages) != count or sizes != {(WIDE, HIGH)}:
            raise ValueError(f"{len(pages)} pages, not {count} of A4")
    except (ValueError, KeyError, IndexError, zlib.error) as error:
        raise torn(READBACK, path, f"not readable: {error}") from error


def _page(part: Part, number: int, files: Sequence[tuple[str, str]]) -> tuple[Page, list[str]]:
    """The page of a panel, and the layers that its picture has."""
    panel = part.panels[number]
    left, right, top = EDGE, WIDE - EDGE, HIGH - EDGE
    items: list[Item] = list(heading(_names(part, panel), (left, top - 16.0, right, top)))
    top -= 16.0 + GAP
    for share in SHRUNK:
        blocks = [block for block in _tables(part, panel, files, share) if block.rows]
        room = top - EDGE - FOOT - sum(height(block) + GAP for block in blocks)
        if room >= SMALLEST:
            break
    room = max(SMALLEST, room)
    groups = _picture(panel)
    marks = [0.5 * (bend.start + bend.end) for bend in _bend_lines(panel)[:MOST_BENDS]]
    items += picture(groups, _box(panel), (left, top - room, right, top), marks)
    top -= room + GAP
    for block in blocks:
        items += shown(block, left, top, right - left)
        top -= height(block) + GAP
    items += sign_off(_operations(part, panel), (left, EDGE + 5.0, right, EDGE + FOOT - GAP))
    items += footer(_last_line(part, number), left, EDGE, right)
    return Page(WIDE, HIGH, tuple(items)), list(groups)


def _picture(panel: Panel) -> Groups:
    """The path operators of the pattern in its own coordinates."""
    cuts = contours(panel.pattern, FINEST, "arcs")
    drawn = fitted_strokes(panel.pattern, FINEST, "arcs")
    return pattern_groups(panel, cuts, drawn, FINEST)


def _box(panel: Panel) -> Box:
    x0, y0, x1, y1 = panel.pattern.bbox
    return float(x0), float(y0), float(x1), float(y1)


# --- what it says --------------------------------------------------------------------------


def _names(part: Part, panel: Panel) -> list[str]:
    """The name of the piece, and what else names it."""
    name = part.name if len(part.panels) == 1 else f"{part.name} {panel.name}"
    words = [
        f"part number {part.part_number}" if part.part_number else "",
        f"revision {part.revision}" if part.revision else "no revision",
        f"quantity {part.quantity}",
        part.description,
    ]
    return [name, *(word for word in words if word)]


def _tables(
    part: Part, panel: Panel, files: Sequence[tuple[str, str]], share: float
) -> list[Table]:
    """The blocks below the picture, with that share of the rows that they may have at most."""

    def table(
        title: str, header: tuple[str, ...], rows: list[tuple[str, ...]], most: int, where: str
    ) -> Table:
        return Table(title, header, _cut(rows, max(2, int(share * most)), where), 2)

    checks = [_check(check) for check in part.checks if check.panel in ("", panel.name)]
    notes: list[tuple[str, ...]] = [(str(note),) for note in panel.facts.get("notes") or ()]
    report = "report.json"
    return [
        Table("blank", ("", ""), _data(part, panel), 2),
        table("bends", *_bends(panel), MOST_BENDS, "the drawing"),
        table("stitches", STITCHES, _stitches(panel), MOST_STITCHES, report),
        Table("edges", EDGES, _edges(panel), 2),
        Table("notes", ("",), _cut(notes, MOST_NOTES, report), 1),
        table("checks", ("check", "value", "limit", ""), checks, MOST_CHECKS, report),
        table("files", ("file", "sha256"), list(files), MOST_FILES, report),
    ]


def _data(part: Part, panel: Panel) -> list[tuple[str, ...]]:
    """What the sheet is and what is done to it, as far as it is known."""
    x0, y0, x1, y1 = _box(panel)
    facts = panel.facts
    stitches = sum(hole[0].name == STITCH for hole in panel.pattern.holes)
    rows = [
        ("blank", f"{x1 - x0:.2f} x {y1 - y0:.2f} mm"),
        ("material", _material(part.material)),
        ("thickness", f"{panel.thickness:g} mm" if panel.thickness else ""),
        ("stock", stock_words(part.material, panel.thickness) if part.material else ""),
        ("area", _amount(facts.get("flat_area", panel.pattern.area), "mm2", 1)),
        ("mass", _amount(facts.get("mass_g"), "g", 1)),
        ("cut length", _amount(facts.get("cut_length"), "mm", 1)),
        ("pierces", f"{1 + len(panel.pattern.holes)}"),
        ("stitch holes", f"{stitches}" if stitches else ""),
        ("smallest radius", _amount(facts.get("min_radius"), "mm, middle", 2)),
        ("neutral fibre K", _amount(facts.get("k_neutral"), facts.get("k_source") or "", 3)),
        ("grain", _grain(part.grain)),
        ("finish", f"on the {part.finish}" if part.finish else ""),
    ]
    return [row for row in rows if row[1]]


def _material(name: str) -> str:
    """The material's title, and that its numbers have no source where they have none."""
    if not name:
        return "not named"
    found = material(name)
    return f"{found.title}" if found.verified else f"{found.title} (numbers not verified)"


def _amount(value: float | None, unit: str, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f} {unit}".rstrip()


def _grain(grain: float | None) -> str:
    """The grain's direction, and how the piece may be turned on the sheet: as the nest does it."""
    return "" if grain is None else f"{math.degrees(grain):g} deg from +x; may turn by 180"


def _bends(panel: Panel) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of the bends that the pattern shows, in its order; with the inside radius at
    both ends and the place in the order of bending where the bends have them."""
    lines = _bend_lines(panel)
    header: tuple[str, ...] = ("bend", "from x, y", "to x, y", "deg", "")
    radii, ordered = (
        any(getattr(a, key) is not None for a in lines) for key in ("radius", "order")
    )
    header += ("radius",) * radii + ("order",) * ordered
    digits = 1 if radii else 2
    rows = []
    for number, line in enumerate(lines, start=1):
        row = (
            f"{number}",
            *(f"{at[0]:.{digits}f}, {at[1]:.{digits}f}" for at in (line.start, line.end)),
            f"{math.degrees(abs(line.angle)):.2f}",
            "up" if line.layer == "BEND_UP" else "down",
        )
        row += (_radius(line),) * radii
        row += ("" if line.order is None else f"{line.order}",) * ordered
        rows.append(row)
    return header, rows


def _radius(line: Line) -> str:
    """The inside radii of a bend at its start and its end, one number where they are one."""
    words = [f"{radius:.1f}" for radius in line.radius or ()]
    return " / ".join(dict.fromkeys(words))


def _stitches(panel: Panel) -> list[tuple[str, ...]]:
    """How each edge of a panel is sewn to its mate: holes, their real pitch, form and inset."""
    return [
        (
            each["edge"],
            each["mate"],
            f"{each['count']}",
            _amount(each["pitch"], "", 3),
            each["hole"],
            f"{each['inset']:g}",
        )
        for each in panel.facts.get("stitches") or ()
    ]


def _edges(panel: Panel) -> list[tuple[str, ...]]:
    """What is done with the edges of a panel."""
    return [
        (name, each["finish"], f"{each['allowance']:g}", each["corner"])
        for name, each in (panel.facts.get("edges") or {}).items()
    ]


def _bend_lines(panel: Panel) -> list[Line]:
    return [line for line in panel.pattern.lines if line.layer in ("BEND_UP", "BEND_DOWN")]


def _check(check: Check) -> tuple[str, ...]:
    state = "ok" if check.passed else "ALLOWED"
    limit = f"{check.limit:.3g} {check.unit}".rstrip()
    value = f"{check.value:.3g}" if math.isfinite(check.value) else "-"
    return check.name, value, limit, state


def _cut(rows: list[tuple[str, ...]], most: int, where: str) -> list[tuple[str, ...]]:
    """The rows, or the first of them and how many more stand elsewhere."""
    if len(rows) <= most:
        return rows
    rest, columns = len(rows) - most + 1, len(rows[0])
    last = (f"+{rest}", f"in {where}", *[""] * (columns - 2))
    return [*rows[: most - 1], last if columns > 1 else (" ".join(last),)]


def _files(part: Part, folder: Path) -> list[tuple[str, str]]:
    """The files of the part that are there already, and the beginnings of their hashes."""
    own = f"{part.name}-traveller.pdf"
    paths = sorted(path for path in folder.iterdir() if path.is_file() and path.name != own)
    return [(path.name, hashlib.sha256(path.read_bytes()).hexdigest()[:12]) for path in paths]


def _operations(part: Part, panel: Panel) -> list[str]:
    """What is done and signed for."""
    bent = panel.facts.get("type") != "plane"
    joined = len(part.panels) > 1 or bool(panel.facts.get("closed"))
    steps = ["cut", "bent" if bent else "", "joined" if joined else "", "inspected"]
    return [step for step in steps if step]


def _last_line(part: Part, number: int) -> list[str]:
    """Where the sheet comes from, and its page."""
    job = f"job sha256 {part.job_sha256[:16]}" if part.job_sha256 else ""
    words = [f"devcad {__version__}", job, date(), "compare revision and hash before use"]
    return [", ".join(w for w in words if w), f"page {number + 1} of {len(part.panels)}"]
