"""The container of a glTF 2.0 file: its header, the JSON chunk and the binary chunk."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np

from devcad.errors import LimitError
from devcad.export.binary import opened
from devcad.export.glbread import BIN_CHUNK, JSON_CHUNK, MAGIC, VERSION, Json

MOST_BYTES = 0xFFFFFFFF  # the file's length is a 32-bit number


def write_container(
    path: Path, document: Json, size: int, write: Callable[[BinaryIO], object], remedy: str
) -> int:
    """Write a document and the ``size`` bytes that ``write`` puts behind it; the file's length.

    Raises:
        LimitError: more than 4 GiB, with what helps; FileError: the file cannot be written.
    Source:
        Khronos, glTF 2.0 Specification, section 4.4.
    """
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text = text.ljust(-(-len(text) // 4) * 4)
    total = 12 + 8 + len(text) + 8 + size
    if total > MOST_BYTES:
        raise LimitError(
            f"a GLB file of {total} bytes, limit {MOST_BYTES}",
            place=path.name,
            value=total,
            limit=MOST_BYTES,
            remedy=remedy,
        )
    with opened(path, "wb") as stream:
        stream.write(np.array([MAGIC, VERSION, total, len(text), JSON_CHUNK], "<u4").tobytes())
        stream.write(text)
        stream.write(np.array([size, BIN_CHUNK], "<u4").tobytes())
        write(stream)
    return total
