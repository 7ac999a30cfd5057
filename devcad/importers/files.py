"""The door to the disk: bytes of a named file, never more than allowed."""

from __future__ import annotations

import stat
from pathlib import Path, PurePosixPath, PureWindowsPath

from devcad.errors import FileError, JobError, LimitError


def read_bytes(path: Path, *, limit: int, place: str) -> bytes:
    """The content of a file, at most ``limit`` bytes.

    Raises:
        FileError where it is missing, unreadable or no regular file (a pipe would have us wait),
        LimitError where it is larger.
    """
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise OSError(0, "it is no regular file")
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(
            f"cannot read the file: {reason}",
            place=place,
            value=reason,
            remedy="check the name and the permissions",
        ) from None
    if len(data) > limit:
        raise LimitError(
            f"the file is larger than {limit // 1000} kB",
            place=place,
            value=f"over {limit // 1000} kB",
            limit=f"{limit // 1000} kB",
            remedy="split it or give fewer points",
        )
    return data


def decode(data: bytes, *, place: str) -> str:
    """The text of UTF-8 bytes, a byte order mark removed; FileError where it is not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise FileError(
            f"the file is not UTF-8 text: byte 0x{data[error.start]:02x} in line {line}",
            place=place,
            value=f"byte 0x{data[error.start]:02x}",
            limit="UTF-8",
            remedy="save it as UTF-8",
        ) from None


def inside(folder: Path, name: str, *, place: str) -> Path:
    """The path of the file ``name`` that a job in ``folder`` speaks of.

    Raises:
        JobError where it leaves the folder: an absolute name, "..", or a link that leads out.
    """
    parts = PurePosixPath(name.replace("\\", "/")).parts
    rooted = name.startswith(("/", "\\")) or PureWindowsPath(name).drive
    outside = not parts or rooted or ".." in parts or "\0" in name
    path = folder.joinpath(*parts)
    if not outside:
        try:
            outside = not path.resolve().is_relative_to(folder.resolve())
        except RuntimeError:  # a link that leads to itself leads nowhere
            outside = True
    if outside:
        raise JobError(
            f'the file "{name[:80]}" is not under the folder of the job',
            place=place,
            value=name[:80],
            limit="a name relative to the job, without ..",
            remedy="move the file beside the job and name it relative to it",
        )
    return path
