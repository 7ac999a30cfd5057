"""What a person or a script reads from the command line: lines, error lines, error entries."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from typing import Any

from devcad.errors import CheckFailed, DevcadError, FileError, LimitError

BUG = DevcadError.code
LAST_STREAM = 2  # stdin, stdout, stderr


def settle() -> None:
    """Make the streams fit to write to: a closed one swallows, no name is beyond any of them.

    A file that is opened later must not get the number of a closed stream, into which a library
    may print.
    """
    while (handle := os.open(os.devnull, os.O_RDWR)) <= LAST_STREAM:
        pass
    os.close(handle)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
        if hasattr(stream := getattr(sys, name), "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def say(line: str) -> None:
    """A line on stdout; nothing happens where its reader has gone.

    Raises:
        FileError: stdout cannot be written for another reason; it swallows from then on.
    """
    _write(f"{line}\n")


def say_json(told: list[dict[str, Any]] | dict[str, Any]) -> None:
    """One JSON array or object on stdout; as ``say``."""
    say(json.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))


def flush() -> None:
    """Let what was said be read; as ``say``."""
    _write("")


def _write(text: str) -> None:
    """Write to stdout, or only flush it where there is no text."""
    try:
        if text:
            sys.stdout.write(text)
        else:
            sys.stdout.flush()
    except BrokenPipeError:
        _close_stdout()
    except OSError as error:
        _close_stdout()
        raise FileError(
            f"cannot write: {error.strerror or error}",
            place="stdout",
            value=error.strerror,
            remedy="make room where it leads",
        ) from None


def tell(error: DevcadError) -> None:
    """An error line on stderr, after what was said so far; control characters are escaped.

    Raises:
        FileError: what was said so far cannot be written to stdout.
    """
    shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
    try:
        flush()
    finally:
        with suppress(OSError):  # nobody is left to be told
            sys.stderr.write(f"{shown}\n")


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
    if isinstance(error, OSError):
        return _broken(error)
    return DevcadError(
        f"internal error: {type(error).__name__}: {error}",
        value=type(error).__name__,
        remedy="please report it with the job file; DEVCAD_DEBUG=1 shows the details",
    )


def _broken(error: OSError) -> FileError:
    """What the system refused to read or write."""
    reason = error.strerror or str(error)
    return FileError(
        f"cannot read or write: {reason}",
        place=os.fsdecode(error.filename) if isinstance(error.filename, str | bytes) else "",
        value=reason,
        remedy="check the space on the disk and the permissions",
    )


def failures(error: Exception, path: str) -> list[DevcadError]:
    """The errors of one job, each a line that names the job file."""
    first = failure(error)
    found = [first, *getattr(first, "others", ())]
    for each in found:
        if each.place != path and not each.place.startswith(f"{path} > "):
            each.place = f"{path} > {each.place}" if each.place else path
    return found


def entry(error: DevcadError, job: str | None) -> dict[str, Any]:
    """An error as the JSON array has it, with the path of its job where there is one."""
    panel = f"panel {error.panel}" if error.panel else ""
    check, t = (error.check, error.t) if isinstance(error, CheckFailed) else ("", None)
    told = {
        "code": error.code,
        "place": " > ".join(part for part in (error.place, panel) if part),
        "value": _plain(error.value),
        "limit": _plain(error.limit),
        "remedy": error.remedy,
        "message": str(error),
        "check": check or None,
        "t": _plain(t),
    }
    return {"job": job, "error": told}


def _plain(value: float | str | None) -> float | str | None:
    """A value that JSON has: numpy's numbers turned, NaN and infinity None."""
    if value is None or isinstance(value, str):
        return value
    return float(value) if abs(value) < float("inf") else None
