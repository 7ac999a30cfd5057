"""What a person or a script reads from the command line: lines, error lines, error entries."""

from __future__ import annotations

import os
import sys
from typing import Any

from devcad.errors import DevcadError, LimitError

BUG = DevcadError.code


def say(line: str) -> None:
    """A line on stdout; nothing happens where its reader has gone."""
    try:
        sys.stdout.write(f"{line}\n")
    except BrokenPipeError:
        _close_stdout()


def flush() -> None:
    """Let what was said be read; nothing happens where the reader has gone."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _close_stdout()


def tell(error: DevcadError) -> None:
    """An error line on stderr, after what was said so far; control characters are escaped."""
    flush()
    shown = (c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
    sys.stderr.write(f"{''.join(shown)}\n")


def _close_stdout() -> None:
    """Let nothing more be written, at exit neither."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def debugging() -> bool:
    """Whether the user asked for tracebacks."""
    return bool(os.environ.get("DEVCAD_DEBUG"))


def failure(error: Exception) -> DevcadError:
    """Any exception as one of ours; what we did not foresee is a bug of ours."""
    if debugging():
        import traceback

        traceback.print_exception(error)
    if isinstance(error, DevcadError):
        return error
    if isinstance(error, MemoryError):
        return LimitError("there is not enough memory", remedy="give a larger tolerance")
    return DevcadError(
        f"internal error: {type(error).__name__}: {error}",
        value=type(error).__name__,
        remedy="please report it with the job file; DEVCAD_DEBUG=1 shows the details",
    )


def failures(error: Exception, path: str) -> list[DevcadError]:
    """The errors of one job, each a line."""
    first = failure(error)
    if first.code == BUG:
        first.place = first.place or path
    return [first, *getattr(first, "others", ())]


def entry(error: DevcadError, job: str) -> dict[str, Any]:
    """An error as the JSON array has it."""
    told = {
        "code": error.code,
        "place": error.place,
        "value": _plain(error.value),
        "limit": _plain(error.limit),
        "remedy": error.remedy,
        "message": str(error),
    }
    return {"job": job, "error": told}


def _plain(value: float | str | None) -> float | str | None:
    """A value that JSON has: numpy's numbers turned, NaN and infinity None."""
    if value is None or isinstance(value, str):
        return value
    return float(value) if abs(value) < float("inf") else None
