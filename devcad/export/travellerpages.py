"""How the blocks of a traveller are drawn: heading, picture with dimensions, tables, signatures.

Lengths are mm; a box is (left, bottom, right, top).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from devcad.export.pdfcanvas import Text, fitted, shortened, width
from devcad.export.pdflayout import Box
from devcad.export.pdfpages import Groups, Item, pattern_form
from devcad.export.pdfpaths import line, numbers, rectangle
from devcad.geometry.taylor import Array

SCALES = tuple(
    share * 10.0**power for power in range(4) for share in (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.5)
)
"""One to so many, for pictures; where none is small enough the picture fills its room."""
SIZE = 2.5  # mm of the words in a table
ROW = 3.7  # mm from one row to the next
HEAD = 4.6  # mm for a table's title
BETWEEN = 6.0  # mm between the columns of rows
DIMENSION = 9.0  # mm on two sides of a picture for its dimensions
ARROW = 2.0  # mm
FINE = "0.12 w 0 G [] 0 d"
PEN = 0.18  # mm, of the picture


@dataclass(frozen=True, slots=True)
class Table:
    """Rows below a title, beside one another in ``columns``; a header of empty words is none."""

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    columns: int


def heading(names: Sequence[str], box: Box) -> Iterator[Item]:
    """The name of the piece large, what else names it below, and what this sheet is."""
    left, bottom, right, top = box
    yield Text(right, top - 6.0, "TRAVELLER", 5.0, True, "end", 0.5)
    room = right - left - width("TRAVELLER", 5.0, bold=True) - 6.0
    size = 7.0
    while size > 3.5 and width(names[0], size, bold=True) > room:
        size *= 0.9
    yield Text(left, top - 6.0, shortened(names[0], room, size, bold=True), size, True)
    yield Text(left, top - 12.5, shortened("   ".join(names[1:]), right - left, 3.4), 3.4)
    yield f"{FINE} 0.4 w {line(left, bottom, right, bottom)}"


# --- the picture ---------------------------------------------------------------------------


def picture(groups: Groups, box: Box, room: Box, numbered: Sequence[Array]) -> Iterator[Item]:
    """A pattern in the middle of its room, to a round scale, with its overall dimensions, and a
    number, from 1, at each of the points (2,) of the pattern."""
    wide, high = box[2] - box[0], box[3] - box[1]
    left, bottom = room[0] + DIMENSION, room[1] + DIMENSION
    across, up = room[2] - left - DIMENSION, room[3] - bottom - 5.0
    ratio = max(wide / across, high / up)
    one_to = next((scale for scale in SCALES if scale >= ratio), ratio)
    x = left + 0.5 * (across - wide / one_to)
    y = bottom + 0.5 * (up - high / one_to)
    place = f"{1.0 / one_to:.12f} 0 0 {1.0 / one_to:.12f}"
    dx, dy = x - box[0] / one_to, y - box[1] / one_to
    operators = pattern_form(groups, box, one_to).operators
    yield f"q {place} {numbers(dx, dy)} cm {numbers(PEN * one_to)} w\n{operators}\nQ"
    for number, point in enumerate(numbered, start=1):
        at = point / one_to + (dx, dy)
        yield f"1 g {rectangle(at[0] - 1.6, at[1] - 1.3, 3.2, 2.6, 'f')}"
        yield Text(float(at[0]), float(at[1]) - 0.8, f"{number}", 2.3, anchor="middle")
    yield FINE
    yield from _level(x, y - 6.0, wide / one_to, f"{wide:.2f}")
    yield from _upright(x - 6.0, y, high / one_to, f"{high:.2f}")
    scale = f"1:{one_to:g}" if one_to in SCALES else f"1:{one_to:.1f}"
    yield Text(room[2], room[3] - 3.5, f"scale {scale}, front side, mm", 2.8, anchor="end")


def _level(x: float, y: float, length: float, words: str) -> Iterator[Item]:
    """A dimension below what it measures."""
    end = x + length
    yield f"{line(x, y - 1.5, x, y + 5.0)} {line(end, y - 1.5, end, y + 5.0)}"
    yield line(x, y, end, y)
    yield f"{line(x, y, x + ARROW, y + 0.5)} {line(x, y, x + ARROW, y - 0.5)}"
    yield f"{line(end, y, end - ARROW, y + 0.5)} {line(end, y, end - ARROW, y - 0.5)}"
    yield Text(x + 0.5 * length, y - 3.4, words, 2.8, anchor="middle")


def _upright(x: float, y: float, length: float, words: str) -> Iterator[Item]:
    """A dimension to the left of what it measures."""
    end = y + length
    yield f"{line(x - 1.5, y, x + 5.0, y)} {line(x - 1.5, end, x + 5.0, end)}"
    yield line(x, y, x, end)
    yield f"{line(x, y, x + 0.5, y + ARROW)} {line(x, y, x - 0.5, y + ARROW)}"
    yield f"{line(x, end, x + 0.5, end - ARROW)} {line(x, end, x - 0.5, end - ARROW)}"
    yield Text(x - 1.2, y + 0.5 * length, words, 2.8, anchor="middle", upright=False)


# --- tables --------------------------------------------------------------------------------


def height(table: Table) -> float:
    """How high a table stands, mm."""
    return HEAD + ROW * (_depth(table) + any(table.header))


def _depth(table: Table) -> int:
    """The rows in each of its columns."""
    return -(-len(table.rows) // table.columns)


def shown(table: Table, left: float, top: float, room: float) -> Iterator[Item]:
    """A table from its upper left corner, as wide as its room."""
    yield Text(left, top - 3.0, table.title, 3.0, bold=True)
    yield f"{FINE} {line(left, top - HEAD + 0.6, left + room, top - HEAD + 0.6)}"
    depth = _depth(table)
    each = (room - BETWEEN * (table.columns - 1)) / table.columns
    widths = _widths(table, each)
    head = [table.header] if any(table.header) else []
    for k in range(table.columns):
        x, y = left + k * (each + BETWEEN), top - HEAD
        part = table.rows[k * depth : (k + 1) * depth]
        for number, row in enumerate([*head, *part] if part else []):
            y -= ROW
            grey = 0.4 if number < len(head) else 0.0
            yield from _row(row, widths, x, y + 1.0, grey)


def _row(
    row: Sequence[str], widths: Sequence[float], x: float, y: float, grey: float
) -> Iterator[Item]:
    for words, room in zip(row, widths, strict=True):
        if words:
            yield Text(x, y, shortened(words, room - 1.5, SIZE), SIZE, grey=grey)
        x += room


def _widths(table: Table, room: float) -> list[float]:
    """The columns' widths: what their words need, and what is left to share."""
    every = [table.header, *table.rows]
    need = [max(width(row[k], SIZE) for row in every) + 3.0 for k in range(len(table.header))]
    spare = room - sum(need)
    if spare >= 0.0:
        return [each + spare / len(need) for each in need]
    longest = max(range(len(need)), key=lambda k: need[k])
    need[longest] = max(10.0, need[longest] + spare)
    return [each * room / sum(need) for each in need]


# --- the end of the page -------------------------------------------------------------------


def sign_off(operations: Sequence[str], box: Box) -> Iterator[Item]:
    """A box for each operation: how many, when, who."""
    left, bottom, right, top = box
    each = (right - left) / len(operations)
    for k, words in enumerate(operations):
        x = left + k * each
        yield f"{FINE} {rectangle(x, bottom, each, top - bottom)}"
        yield Text(x + 1.5, top - 4.0, words, 3.0, bold=True)
        for row, label in enumerate(("pieces", "date", "name"), start=1):
            y = top - 4.0 - 5.4 * row
            yield Text(x + 1.5, y, label, 2.3, grey=0.4)
            yield f"{FINE} {line(x + 11.0, y - 0.6, x + each - 2.0, y - 0.6)}"


def footer(words: Sequence[str], left: float, bottom: float, right: float) -> Iterator[Item]:
    """The last line: words on the left, the page on the right."""
    texts, _ = fitted(
        [(words[0], 1.0, False)], (left, bottom - 3.0, right - 24.0, bottom + 3.0), 2.3
    )
    yield from texts
    yield Text(right, bottom, words[1], 2.3, anchor="end")
