"""A folder that appears at once: all its files together by one rename, or not at all."""

from __future__ import annotations

import ctypes
import os
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from devcad.errors import DevcadError, FileError

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # linux/fcntl.h, linux/fs.h
ATTEMPTS = 16  # another process may publish the same folder between two of our steps


@contextmanager
def published(out: Path, name: str) -> Iterator[Path]:
    """A staging folder beside OUT/name, which it replaces when the block ends well.

    Whatever ends the block otherwise, an interrupt included, removes the staging folder and
    leaves OUT/name as it was. Files are synchronised to the disk before the rename.

    Raises:
        FileError: OUT cannot be written, or OUT/name is there and is not an export of ``name``.
    """
    target = out / name
    fresh = not out.exists()
    staging = out / f".{name}-{secrets.token_hex(8)}.part"
    done = False
    try:
        _refuse_foreign(target)
        out.mkdir(parents=True, exist_ok=True)
        staging.mkdir()
        yield staging
        _synchronise(staging)
        _replace(staging, target)
        done = True
    except DevcadError:
        raise
    except OSError as error:
        raise _unwritable(target, error.strerror or str(error)) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        if fresh and not done:
            with suppress(OSError):
                out.rmdir()


def _refuse_foreign(target: Path) -> None:
    """FileError where the target holds something that an export of this name never wrote."""
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        raise _unwritable(target, "it is there already and is not a folder")
    if not target.is_dir() or (target / "report.json").is_file():
        return
    strange = sorted(
        path.name for path in target.iterdir() if not path.name.startswith(target.name)
    )
    if strange:
        raise _unwritable(target, f'it is no export of devcad: it holds "{strange[0]}"')


def _unwritable(target: Path, reason: str) -> FileError:
    return FileError(
        f"cannot write the folder: {reason}",
        place=str(target),
        value=reason,
        remedy="choose another folder with -o",
    )


def _synchronise(folder: Path) -> None:
    """Bring the files and the folder's own entries to the disk."""
    for path in sorted(folder.iterdir()):
        with path.open("r+b") as stream:
            os.fsync(stream.fileno())
    _synchronise_entries(folder)


def _synchronise_entries(folder: Path) -> None:
    with suppress(OSError):  # Windows opens no folders
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _replace(staging: Path, target: Path) -> None:
    """Put the staging folder in the target's place; an old one ends up where staging was."""
    for attempt in range(ATTEMPTS):
        try:
            if not target.exists():
                staging.rename(target)
            elif not _exchanged(staging, target):
                _replaced_in_two_steps(staging, target)
            break
        except OSError:  # it appeared or vanished just now
            if attempt == ATTEMPTS - 1 or not staging.exists():
                raise
    _synchronise_entries(target.parent)


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    rename = getattr(ctypes.CDLL(None), "renameat2", None)
    if rename is None:
        return False
    names = os.fsencode(one), os.fsencode(other)
    return bool(rename(AT_FDCWD, names[0], AT_FDCWD, names[1], RENAME_EXCHANGE) == 0)


def _replaced_in_two_steps(staging: Path, target: Path) -> None:
    """Move the old folder aside, the new one in, and the old one back if that fails."""
    old = staging.with_suffix(".old")
    target.rename(old)
    try:
        staging.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)
