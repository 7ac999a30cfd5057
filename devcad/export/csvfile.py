"""Tables for spreadsheets: comma separated, UTF-8, one line a row, the same bytes every time.

A text that a spreadsheet would run as a formula gets an apostrophe before it, which it shows as
text; a reader takes one off again. Numbers are never texts: -1.5 stays -1.5.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from devcad.checks import Check, at_most
from devcad.export import Written

DECIMALS = 9
"""Of a number in a cell; a picometre, a billionth of a degree."""
DIGITS = 15
MOST_DECIMALS = 24
"""Of a figure in a cell: its significant digits, and its decimals however small it is."""
RISKY = ("=", "+", "-", "@", "'")
"""What a text must not begin with: four signs of a formula, and the apostrophe that guards."""
_NUMBER = re.compile(r"-?\d+(\.\d+)?")
_CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]+")

Cell = str | int | float | bool | None


class Figure(float):
    """A number whose size is not known before, such as a force: 15 significant digits of it."""


def to_bytes(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    """The file's bytes: a line of names, then a line for each row.

    Raises:
        ValueError: a row of another length than the header, or a number that is not finite.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        if len(row) != len(header):
            raise ValueError(f"a row of {len(row)} cells below {len(header)} names")
        writer.writerow([cell_text(cell) for cell in row])
    return text.getvalue().encode("utf-8")


def cell_text(cell: Cell) -> str:
    """A cell as it is written: "" for None, at most 9 decimals (15 digits of a figure), texts on
    one line and guarded.

    Raises:
        ValueError: a number that is not finite.
    """
    if cell is None:
        return ""
    if isinstance(cell, str):
        return _guarded(cell)
    if isinstance(cell, bool):
        return "true" if cell else "false"
    if isinstance(cell, int):
        return str(cell)
    if not math.isfinite(cell):
        raise ValueError(f"{cell} is no number of a table")
    decimals = DECIMALS
    if isinstance(cell, Figure):
        size = math.floor(math.log10(abs(cell))) if cell else 0
        decimals = min(max(DIGITS - 1 - size, 1), MOST_DECIMALS)
    text = f"{cell:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _guarded(text: str) -> str:
    """The text with spaces for line ends and other controls, its apostrophe where it needs one.

    Half a surrogate pair has no bytes in UTF-8: a question mark stands for it.
    """
    line = _CONTROLS.sub(" ", text).encode("utf-8", "replace").decode("utf-8").strip()
    return f"'{line}" if line.startswith(RISKY) else line


def from_bytes(data: bytes) -> list[list[str]]:
    """The cells of a file, the names first, without the apostrophes that guard.

    Raises:
        ValueError: no UTF-8, or quotes that do not close.
    """
    lines = csv.reader(io.StringIO(data.decode("utf-8"), newline=""), strict=True)
    try:
        return [[cell.removeprefix("'") for cell in row] for row in lines]
    except csv.Error as error:
        raise ValueError(f"this is no table: {error}") from None


def write_table(
    path: Path, name: str, header: Sequence[str], rows: Sequence[Sequence[Cell]]
) -> Written:
    """Write a table as format ``name``, read it back and compare cell by cell.

    The largest deviation is that of a number from the one that was to be written.
    """
    path.write_bytes(to_bytes(header, rows))
    found = from_bytes(path.read_bytes())
    worst = 0.0
    wrong = int(found[:1] != [list(header)]) + abs(len(found) - 1 - len(rows))
    for cells, row in zip(found[1:], rows, strict=False):
        for cell, meant in zip(cells, row, strict=False):
            wrong += cell != cell_text(meant).removeprefix("'")
            if isinstance(meant, float) and _NUMBER.fullmatch(cell):
                worst = max(worst, abs(float(cell) - meant))
    return Written(path, name, worst, (_same(path, wrong),))


def _same(path: Path, wrong: int) -> Check:
    """That the file, read back, is the table."""
    return at_most(
        "csv-readback",
        "",
        float(wrong),
        0.0,
        "",
        says=f"{path.name}, read back, differs in {wrong} places",
        remedy="write it again to a disk that keeps what is written",
    )
