"""Tables of points: CSV text to rows of three numbers."""

from __future__ import annotations

import re

from devcad.errors import JobError

COLUMNS = 3
_BEGINS = re.compile(r"[+-]?\.?\d", re.ASCII)
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def parse_points(text: str, *, place: str) -> list[list[float]]:
    """The points of a CSV text, n rows of (x, y, z) in the file's own unit.

    Columns are separated by commas, or by semicolons if the first line has one; decimals are
    written with a point. A first line where no cell begins like a number is a header; empty lines
    are skipped.

    Raises:
        JobError with the line number where a row has not three finite numbers, or there is none.
    """
    lines = [(k, line.strip()) for k, line in enumerate(text.splitlines(), start=1)]
    lines = [(k, line) for k, line in lines if line]
    separator = ";" if lines and ";" in lines[0][1] else ","
    rows = [(k, [cell.strip() for cell in line.split(separator)]) for k, line in lines]
    if rows and not any(_BEGINS.match(cell) for cell in rows[0][1]):
        rows = rows[1:]
    if not rows:
        raise JobError(
            "the file has no points",
            place=place,
            value=0,
            limit="rows of x, y, z",
            remedy="write one point a line",
        )
    return [_row(cells, f"{place} > line {k}") for k, cells in rows]


def _row(cells: list[str], place: str) -> list[float]:
    """Three finite numbers, or a JobError."""
    if len(cells) != COLUMNS:
        raise JobError(
            f"the row has {len(cells)} column{'s' if len(cells) != 1 else ''}, must have 3",
            place=place,
            value=len(cells),
            limit=COLUMNS,
            remedy="write x, y and z, decimals with a point, between commas or semicolons",
        )
    for cell in cells:
        if not _NUMBER.fullmatch(cell) or float(cell) in (float("inf"), float("-inf")):
            raise JobError(
                f'"{cell[:40]}" is not a finite number',
                place=place,
                value=cell[:40],
                limit="a finite number",
                remedy="write decimals with a point and nothing else in the cell",
            )
    return [float(cell) for cell in cells]
