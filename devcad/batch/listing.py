"""What a batch tells in the end: the manifest, the cut list of all parts, and a page of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from devcad.batch.orders import Order
from devcad.batch.tasks import Record
from devcad.export.folder import PAGE

DUE = "due"
PICTURES = 200
"""Parts of which the overview has a picture; the others have a line and a link."""


def manifest(records: Sequence[Record]) -> dict[str, Any]:
    """What became of every part, in the order of the list; the same for the same outcome, however
    often and in how many runs it was tried. Files are named relative to OUT."""
    return {
        "parts": [
            {
                "job": record.name,
                "state": record.result.state,
                "exit": record.result.exit,
                "message": record.result.message,
                "files": [
                    {
                        "path": f"{record.name}/{file.path}",
                        "format": file.format,
                        "sha256": file.sha256,
                        "bytes": file.bytes,
                    }
                    for file in record.result.files
                ],
            }
            for record in records
        ]
    }


def cutlist(records: Sequence[Record], orders: Sequence[Order]) -> bytes:
    """The rows of all parts that are done, grouped by material and thickness, with their due
    dates; inside a group as in the list."""
    from devcad.export.csvfile import to_bytes
    from devcad.export.cutlist import HEADER

    rows = [
        [*row, order.due]
        for record, order in zip(records, orders, strict=True)
        for row in record.result.rows
    ]
    material, thickness = HEADER.index("material"), HEADER.index("thickness")
    rows.sort(key=lambda row: (row[material], row[thickness]))
    return to_bytes([*HEADER, DUE], rows)


def overview(title: str, records: Sequence[Record], page: Callable[[str], bytes]) -> bytes:
    """The page of a batch: every part with its state, a word on it, its picture and a link.

    ``page`` gives the page of a part that is done, b"" where it cannot be had.
    """
    from devcad.report.page import Row, overview_page, picture_in

    rows: list[Row] = []
    for record in records:
        done = record.result.exit == 0
        picture = picture_in(page(record.name)) if done and len(rows) < PICTURES else ""
        link = f"{record.name}/{PAGE}" if done else ""
        rows.append(Row(record.name, record.result.state, record.result.message, link, picture))
    return overview_page(title, rows)
