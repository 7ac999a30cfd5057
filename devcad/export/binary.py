"""What the binary mesh formats share: opening, blocks of rows, float32 rounding, read-back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from devcad.checks import Check
from devcad.errors import CheckFailed, FileError
from devcad.geometry.taylor import Array

BLOCK = 65536
"""Rows handled at a time: large against the cost of a call, small against the cache."""

FLOAT32_STEP = 2.0**-23
"""Relative distance of neighbouring float32 numbers; rounding moves by half of it at most."""


def blocks(n: int) -> Iterator[slice]:
    """Consecutive slices that cover n rows, none longer than BLOCK."""
    return (slice(start, min(start + BLOCK, n)) for start in range(0, n, BLOCK))


def bounds(read: Callable[[slice], NDArray[Any]], n: int) -> NDArray[Any]:
    """The lowest and the highest coordinates of n points, (2, 3), as ``read(rows)`` gives them."""
    ends = []
    for rows in blocks(n):
        columns = read(rows).T
        ends.append([[c.min() for c in columns], [c.max() for c in columns]])
    return np.stack([np.min(ends, axis=0)[0], np.max(ends, axis=0)[1]])


Axis = tuple[int, float, float]
"""Column, factor and offset: how one coordinate is restored from what was read."""


def apart(read: Callable[[slice], NDArray[Any]], axes: Sequence[Axis], true: Array) -> float:
    """A bound on the distance between each row of ``true`` (n, d) and what restores it.

    ``read(rows)`` gives the rows read, a block at a time. Column k of ``true`` is compared with
    factor * read[:, column] + offset of ``axes[k]``; the bound is the length of the vector of
    largest differences, at most sqrt(d) too long. It is nan if anything is.
    """
    worst = np.zeros(true.shape[1])
    for rows in blocks(len(true)):
        block, expected = read(rows), true[rows]
        for k, (column, factor, offset) in enumerate(axes):
            step = block[:, column].astype(float)
            step *= factor
            if offset:
                step += offset
            step -= expected[:, k]
            worst[k] = np.maximum(worst[k], np.maximum(step.max(), -step.min()))
    return float(np.sqrt(worst @ worst))


@contextmanager
def opened(path: Path, mode: str) -> Iterator[BinaryIO]:
    """The open file; what the system reports meanwhile becomes a FileError.

    Raises:
        FileError: the file cannot be opened, written or read, or the disk is full.
    """
    try:
        with path.open(mode) as stream:
            yield stream  # type: ignore[misc]
    except FileError:
        raise
    except OSError as error:
        verb = "write" if "w" in mode else "read back"
        raise FileError(
            f"cannot {verb} {path.name}: {error.strerror or error}",
            place=path.name,
            remedy="check that the output folder is writable and the disk is not full",
        ) from error


def demanded(checks: Iterable[Check], path: Path) -> tuple[Check, ...]:
    """The checks as they are, if all of them hold.

    Raises:
        CheckFailed: for the first one that does not.
    """
    kept = tuple(checks)
    for check in kept:
        if not check.passed:
            raise check.failure().at(place=path.name)
    return kept


def torn(check: str, path: Path, what: str, *, panel: str = "") -> CheckFailed:
    """The failure of a file that does not hold what was written to it."""
    return CheckFailed(
        f"{check}: {what}",
        place=path.name,
        panel=panel,
        remedy="write again; if it stays, the disk or its driver damages files",
    )
