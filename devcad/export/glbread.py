"""GLB files read back: the JSON chunk, and accessors' numbers where they lie in the file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from devcad.export.binary import torn

Json = dict[str, Any]

CHECK = "glb-readback"
MAGIC, VERSION = 0x46546C67, 2  # "glTF"
JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942  # "JSON", "BIN"
KINDS = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True, slots=True)
class Stored:
    """An accessor's numbers in the open file, (count, width) from ``offset`` on."""

    stream: BinaryIO
    offset: int
    kind: np.dtype[Any]
    count: int
    width: int

    def rows(self, rows: slice) -> NDArray[Any]:
        """Some of its rows, read now."""
        size = self.kind.itemsize * self.width
        self.stream.seek(self.offset + rows.start * size)
        numbers = np.fromfile(self.stream, self.kind, (rows.stop - rows.start) * self.width)
        return numbers.reshape(-1, self.width)


def parse(stream: BinaryIO, path: Path, total: int) -> tuple[Json, int]:
    """The JSON of a GLB file whose lengths agree with one another; where its numbers start."""
    actual = path.stat().st_size
    if actual != total:
        raise torn(CHECK, path, f"{actual} bytes, not {total}")
    *head, told, size, kind = np.fromfile(stream, "<u4", 5).tolist()
    if (*head, told, kind) != (MAGIC, VERSION, total, JSON_CHUNK) or 28 + size > total:
        raise torn(CHECK, path, "damaged header")
    try:
        document: Json = json.loads(stream.read(size))
    except ValueError:
        raise torn(CHECK, path, "damaged JSON") from None
    length, binary = np.fromfile(stream, "<u4", 2).tolist()
    if (28 + size + length, binary) != (total, BIN_CHUNK):
        raise torn(CHECK, path, "damaged chunk header")
    return document, 28 + size


def accessor(stream: BinaryIO, start: int, document: Json, index: int) -> Stored:
    """Where an accessor's numbers are."""
    table = document["accessors"][index]
    view = document["bufferViews"][table["bufferView"]]
    kind, width = np.dtype(KINDS[table["componentType"]]), WIDTHS[table["type"]]
    offset = start + view["byteOffset"] + table.get("byteOffset", 0)
    return Stored(stream, offset, kind, table["count"], width)
