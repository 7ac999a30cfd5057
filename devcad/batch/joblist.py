"""Lists of jobs as spreadsheets save them: CSV text to orders."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator, Sequence
from datetime import date
from pathlib import Path

from devcad.batch.orders import PLAIN, TITLES, Order, refuse
from devcad.errors import DevcadError, JobError
from devcad.export import FORMATS
from devcad.importers.files import decode, read_bytes

MAX_BYTES = 16_000_000  # 100 000 rows of 160 characters
MAX_CELL = 100_000
DELIMITERS = ",;\t"
KEYS = {
    "name",
    "units",
    "tolerance",
    "thickness",
    "reference",
    "material",
    "pipeline",
    "bend",
}
"""Keys without a dot that a job file has."""
TABLES = {"meta", "recipe", "surface", "panel", "place", "edges", "cutout", "mark", "trim", "seam"}
"""First words of dotted keys."""
OWN = {"job", "outputs", "due"}
"""Columns that are no keys of the job."""
_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_WHOLE = re.compile(r"\+?(\d+)(?:[.,]0{0,2})?")  # 1,000 is a thousand to some
_ISO = re.compile(r"(\d{4})-(\d\d?)-(\d\d?)(?:[T ].*)?")
_DOTTED = re.compile(r"(\d\d?)\.(\d\d?)\.(\d{4})")


def read_list(path: str) -> list[Order]:
    """The orders of a list, one a row; job files are named relative to the list.

    The first row names the columns: ``job``, and any of quantity, material, thickness, pipeline,
    outputs (formats, semicolons between), revision, due and keys of the job such as
    surface.radius. An empty cell leaves the job's own value. Commas, semicolons or tabs stand
    between cells; where no comma does, decimals may have one.

    Raises:
        JobError: a row or column that is wrong, all of them told; FileError: unreadable;
        LimitError: larger than 16 MB.
    """
    text = _text(read_bytes(Path(path), limit=MAX_BYTES, place=path), path)
    delimiter, text = _delimiter(text)
    rows = list(_rows(text, delimiter, path))
    if not rows:
        raise _wrong("the list is empty", path, "", "a row of column names, then a row a part")
    columns = _columns(*rows[0], path)
    problems: list[DevcadError] = []
    orders: list[Order] = []
    for number, cells in rows[1:]:
        try:
            orders.append(_order(cells, columns, f"{path} > row {number}", path, delimiter))
        except DevcadError as error:
            problems += [error, *getattr(error, "others", ())]
    refuse(problems)
    if not orders:
        raise _wrong("the list has no rows below the names", path, 0, "a row a part")
    return orders


def _text(data: bytes, path: str) -> str:
    """The text of a list; spreadsheets also save UTF-16, with its mark."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            return data.decode("utf-16")
        except UnicodeDecodeError:
            raise _wrong("not UTF-16 text, as its first bytes say", path, "", "UTF-8") from None
    return decode(data, place=path)


def _delimiter(text: str) -> tuple[str, str]:
    """What stands between cells, by a line sep=; or by the first row; and the rest of the text."""
    said = re.match(r"\s*sep=(.)\r?\n", text)
    if said:
        return said.group(1), text[said.end() :]  # spreadsheets do not show this line
    first = next((line for line in text.splitlines() if line.strip(" \t,;")), "")
    return max(DELIMITERS, key=first.count), text


def _rows(text: str, delimiter: str, path: str) -> Iterator[tuple[int, list[str]]]:
    """The rows that hold something, with their numbers as spreadsheets count."""
    before = csv.field_size_limit(MAX_CELL)
    lines = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    number = 0
    try:
        for number, row in enumerate(lines, start=1):
            cells = [_clean(cell) for cell in row]
            if any(cells):
                yield number, cells
    except csv.Error as error:
        where = f"{path} > row {number + 1}"
        raise _wrong(f"not CSV: {error}", where, str(error), "quotes that close") from None
    finally:
        csv.field_size_limit(before)


def _clean(cell: str) -> str:
    """A cell without the spaces around it, and without the apostrophe that guards a formula."""
    return cell.replace("\u00a0", " ").strip().removeprefix("'")


def _columns(number: int, cells: Sequence[str], path: str) -> list[str]:
    """The columns as keys; "" for those without a name, which must stay empty."""
    from devcad.job.invalid import did_you_mean

    out: list[str] = []
    problems: list[DevcadError] = []
    known = sorted(OWN | KEYS | set(PLAIN))
    for cell in cells:
        low = cell.lower()
        key = low if low in OWN | KEYS else PLAIN.get(low, cell)
        place = f"{path} > row {number}, column {cell}"
        dotted = "." in key and _KEY.fullmatch(key) and key.split(".")[0] in TABLES
        if key and key not in OWN | KEYS and not dotted:
            what = f'there is no column "{cell[:60]}" and no key of that name'
            remedy = did_you_mean(low, known)
            problems.append(JobError(what, place, "", cell[:60], ", ".join(known), remedy))
        elif key and key in out:
            problems.append(_wrong("the column is there twice", place, cell, "once"))
        out.append(key)
    if "job" not in out and not problems:
        problems.append(_wrong('there is no column "job"', f"{path} > row {number}", "", "job"))
    refuse(problems)
    return out


def _order(
    cells: Sequence[str], columns: Sequence[str], place: str, path: str, delimiter: str
) -> Order:
    """The order of a row; every cell that is wrong is told."""
    values: dict[str, str] = {}
    problems: list[DevcadError] = []
    if any(cells[len(columns) :]):
        what = f"the row has {len(cells)} cells, the first row names {len(columns)} columns"
        problems.append(_wrong(what, place, len(cells), f"at most {len(columns)} cells"))
    for key, cell in zip(columns, cells, strict=False):
        if not cell:
            continue
        where = f"{place}, column {TITLES.get(key, key)}"
        try:
            values[key] = _read(key)(cell, where, delimiter)
        except DevcadError as error:
            problems.append(error)
    if "job" not in values:
        problems.append(_wrong("no job file is named", f"{place}, column job", "", "a job file"))
    refuse(problems)
    formats = tuple(values.get("outputs", "").split(";")) if "outputs" in values else ()
    return Order(
        path=str(Path(path).parent / values["job"]),
        place=place,
        changes=tuple((key, text) for key, text in values.items() if key not in OWN),
        formats=formats,
        due=values.get("due", ""),
    )


# --- cells ---------------------------------------------------------------------------------

Reader = Callable[[str, str, str], str]
"""Cell, place and delimiter to the text of the value."""


def _read(key: str) -> Reader:
    return {
        "": _nameless,
        "job": _job,
        "outputs": _outputs,
        "due": _due,
        "meta.quantity": _quantity,
    }.get(key, _value)


def _nameless(cell: str, place: str, delimiter: str) -> str:
    raise _wrong("the column has no name", place, cell[:60], "a name in the first row")


def _job(cell: str, place: str, delimiter: str) -> str:
    """The path of the job file; a backslash may stand for a slash."""
    if "\0" in cell:
        raise _wrong("the name has a NUL in it", place, "", "the name of a job file")
    return cell.replace("\\", "/")


def _outputs(cell: str, place: str, delimiter: str) -> str:
    from devcad.job.invalid import did_you_mean

    names = [name.strip().lower() for name in re.split("[;,]", cell) if name.strip()]
    for name in names:
        if name not in FORMATS:
            raise JobError(
                f'this version knows no format "{name[:60]}"',
                place=place,
                value=name[:60],
                limit=", ".join(FORMATS),
                remedy=did_you_mean(name, FORMATS),
            )
    return ";".join(dict.fromkeys(names))


def _due(cell: str, place: str, delimiter: str) -> str:
    """An ISO date; 24.12.2026 is one day only, 12/11/2026 could be two."""
    iso, dotted = _ISO.fullmatch(cell), _DOTTED.fullmatch(cell)
    numbers = iso.groups() if iso else dotted.groups()[::-1] if dotted else ()
    try:
        return date(*(int(number) for number in numbers)).isoformat()
    except (TypeError, ValueError):
        what = f'"{cell[:60]}" is no date'
        raise _wrong(what, place, cell[:60], "year-month-day, such as 2026-12-24") from None


def _quantity(cell: str, place: str, delimiter: str) -> str:
    """A whole number; spreadsheets write 3 as 3.0 where the column has decimals."""
    found = _WHOLE.fullmatch(cell)
    if not found or int(found.group(1)) < 1:
        what = f'"{cell[:60]}" is no quantity'
        raise _wrong(what, place, cell[:60], "a whole number, 1 or more")
    return found.group(1).lstrip("0")


def _value(cell: str, place: str, delimiter: str) -> str:
    """The text of a key's value; a decimal comma becomes a point where it can be nothing else."""
    if not _COMMA.fullmatch(cell):
        return cell
    if delimiter == ",":
        what = f'"{cell[:60]}" may be a decimal or thousands'
        raise _wrong(what, place, cell[:60], "a decimal point")
    return cell.replace(",", ".")


def _wrong(what: str, place: str, value: str | float, limit: str) -> JobError:
    return JobError(what, place=place, value=value, limit=limit, remedy=f"give {limit}")
