"""What a batch tells in the end: the manifest, and the cut list of all parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from devcad.batch.orders import Order
from devcad.batch.tasks import Record

DUE = "due"


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
