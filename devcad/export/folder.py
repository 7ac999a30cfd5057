"""A folder or a file that appears at once: complete, by one rename, or not at all."""

from __future__ import annotations

import ctypes
import json
import os
import re
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from devcad.errors import DevcadError, FileError

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # linux/fcntl.h, linux/fs.h
ATTEMPTS = 16  # another process may publish the same folder between two of our steps
REPORT, PAGE = "report.json", "index.html"
LITTER = {".DS_Store", "Thumbs.db", "desktop.ini"}
"""What file managers put into every folder that is looked at."""


@contextmanager
def published(out: Path, name: str) -> Iterator[Path]:
    """A staging folder beside OUT/name, which it replaces when the block ends well.

    Whatever ends the block otherwise, an interrupt included, removes the staging folder and
    leaves OUT/name as it was. Files are synchronised to the disk before the rename. Staging
    folders that a killed process left behind are removed first.

    Raises:
        FileError: OUT cannot be written, or OUT/name holds something that its report does not
        list.
    """
    target = out / name
    fresh = done = False
    try:
        _refuse_file_in_the_way(out)
        _refuse_foreign(target)
        fresh = not out.exists()
        out.mkdir(parents=True, exist_ok=True)
        with _staging(out, name) as staging:
            yield staging
            _synchronise(staging)
            _refuse_foreign(target)  # again: it may have come while we wrote
            _replace(staging, target)
            done = True
    except DevcadError:
        raise
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        if fresh and not done:
            with suppress(OSError):
                out.rmdir()


@contextmanager
def published_files(out: Path, listing: str) -> Iterator[Path]:
    """A staging folder whose files appear in OUT together when the block ends well.

    ``listing`` is one of them, JSON whose "files" name the others, as a report's do. What an
    earlier listing in OUT names goes; what else is in OUT stays. Where a file cannot be moved in,
    OUT is put back as it was.

    Raises:
        FileError: OUT cannot be written, or has a file of that name that its listing does not
        name.
    """
    fresh = done = False
    try:
        _refuse_file_in_the_way(out)
        fresh = not out.exists()
        out.mkdir(parents=True, exist_ok=True)
        with _staging(out, Path(listing).stem) as staging:
            yield staging
            _synchronise(staging)
            _move_in(staging, out, listing)
            done = True
    except DevcadError:
        raise
    except OSError as error:
        raise unwritable(out, error) from error
    finally:
        if fresh and not done:
            with suppress(OSError):
                out.rmdir()


def _move_in(staging: Path, out: Path, listing: str) -> None:
    """Move the files of a staging folder into OUT in place of those that are listed there; the
    listing goes first and comes last, so that a complete set is one with its listing."""
    new = sorted(
        (path.name for path in staging.iterdir()), key=lambda name: (name == listing, name)
    )
    old = [listing, *sorted(listed(out / listing, listing) - {listing})]
    old = [name for name in old if Path(name).name == name and (out / name).is_file()]
    for name in new:
        if name not in old and os.path.lexists(out / name):
            raise _refused(
                out,
                f'cannot replace "{name}": {listing} does not say that it belongs to it',
                name,
                "move it elsewhere, or choose another folder with -o",
            )
    aside = staging / "old"
    aside.mkdir()
    moves = [(out / name, aside / name) for name in old]
    moves += [(staging / name, out / name) for name in new]
    made: list[tuple[Path, Path]] = []
    try:
        for start, end in moves:
            start.rename(end)
            made.append((start, end))
    except BaseException:
        for start, end in reversed(made):
            end.rename(start)
        raise
    _synchronise_entries(out)


def sweep(out: Path) -> None:
    """Remove what killed processes left in OUT: staging folders of any name, nobody's now.

    The lock on OUT keeps those that have just been made and are not locked themselves yet.
    """
    with suppress(OSError):
        outer = _lock(out)
        try:
            if outer is not None:
                _sweep_like(out, re.compile(r"\..+-[0-9a-f]{16}\.part"))
        finally:
            _unlock(outer)


def publish_file(out: Path, name: str, data: bytes) -> Path:
    """Write OUT/name, whole or not at all, in place of an earlier one; returns its path.

    Raises:
        FileError: OUT cannot be written.
    """
    target, part = out / name, out / f".{name}-{secrets.token_hex(8)}.part"
    fresh = done = False
    try:
        _refuse_file_in_the_way(out)
        fresh = not out.exists()
        out.mkdir(parents=True, exist_ok=True)
        with part.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(target)
        _synchronise_entries(out)
        done = True
        return target
    except DevcadError:
        raise
    except OSError as error:
        raise unwritable(out, error, name) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
            if fresh and not done:
                out.rmdir()


def unwritable(target: Path, error: OSError, file: str = "") -> FileError:
    """The error of a folder, or of a file in it, that the system did not let us write."""
    reason = error.strerror or str(error)
    named = file or (Path(os.fsdecode(error.filename)).name if error.filename else "")
    what = f"cannot write {named}" if named else "cannot write the folder"
    return _refused(target, f"{what}: {reason}", reason)


def _refused(target: Path, what: str, value: str, remedy: str = "") -> FileError:
    remedy = remedy or "choose another folder with -o"
    return FileError(what, place=str(target), value=value, remedy=remedy)


# --- what must not be replaced -------------------------------------------------------------


def _refuse_file_in_the_way(out: Path) -> None:
    """FileError where OUT, or a folder it stands in, is a file."""
    for path in (out, *out.parents):
        if path.exists() and not path.is_dir():
            what = f"{path} is a file, not a folder"
            raise FileError(what, value=str(path), remedy="choose another folder with -o")


def _refuse_foreign(target: Path) -> None:
    """FileError where the target holds something that the export in it did not write."""
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        what = "cannot write the folder: it is there already and is not a folder"
        raise _refused(target, what, target.name)
    strange = _strange(target)
    if strange:
        raise _refused(
            target,
            f'cannot replace the folder: it holds "{strange[0]}", which no export put there',
            strange[0],
            "move it elsewhere, or choose another folder with -o",
        )


def _strange(target: Path) -> list[str]:
    """The entries of a folder that its report does not list, sorted.

    Another process may replace the folder while we look: then we look again.
    """
    found: list[str] = []
    for _ in range(ATTEMPTS):
        before = _identity(target)
        if before is None:
            return []
        found = unlisted(target)
        if not found or _identity(target) == before:
            return found
    return found


def _identity(folder: Path) -> tuple[int, int] | None:
    """What tells a folder from another one of its name; None where there is none."""
    try:
        status = folder.stat()
    except FileNotFoundError:
        return None
    return status.st_dev, status.st_ino


def unlisted(target: Path) -> list[str]:
    """The entries of a folder that its report does not list; a bad report lists nothing."""
    with suppress(FileNotFoundError):
        entries = sorted(target.iterdir())
        ours = listed(target / REPORT, REPORT)
        ours |= LITTER | ({PAGE} if ours else set())  # the page stands beside a good report
        ours |= listed(target / (fold := f"{target.name}-fold.json"), fold)  # of a simulation
        return [path.name for path in entries if path.name not in ours or path.is_dir()]
    return []


def listed(report: Path, own: str) -> set[str]:
    """The names of the files that a report speaks of, its ``own`` included."""
    try:
        files = json.loads(report.read_bytes())["files"]
        return {own, *(str(file["path"]) for file in files)}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return set()


# --- staging -------------------------------------------------------------------------------


@contextmanager
def _staging(out: Path, name: str) -> Iterator[Path]:
    """A new hidden folder in OUT, locked while its process lives, removed at the end.

    The lock on OUT keeps another process from sweeping the folder before it is locked itself.
    """
    path = out / f".{name}-{secrets.token_hex(8)}.part"
    lock = None
    try:
        outer = _lock(out)
        try:
            if outer is not None:
                _sweep(out, name)
            path.mkdir()
            lock = _lock(path)
        finally:
            _unlock(outer)
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        _unlock(lock)


def _sweep(out: Path, name: str) -> None:
    """Remove the staging folders of this name whose process has died: nobody locks them."""
    _sweep_like(out, re.compile(rf"\.{re.escape(name)}-[0-9a-f]{{16}}\.part"))


def _sweep_like(out: Path, pattern: re.Pattern[str]) -> None:
    """Remove the staging folders with such names whose process has died."""
    with os.scandir(out) as entries:  # no path for each of 10 000 parts: that takes 20 ms
        found = [out / one.name for one in entries if pattern.fullmatch(one.name)]
    for path in found:
        if path.is_symlink():
            continue
        lock = _lock_at_once(path)
        if lock is not None:
            shutil.rmtree(path, ignore_errors=True)
            _unlock(lock)


def _lock(folder: Path) -> int | None:
    """A handle that locks a folder, after waiting for it; None where the system cannot."""
    if sys.platform == "win32":
        return None
    import fcntl

    return _flocked(folder, fcntl.LOCK_EX)


def _lock_at_once(folder: Path) -> int | None:
    """A handle that locks a folder; None where another has the lock or the system cannot."""
    if sys.platform == "win32":
        return None
    import fcntl

    return _flocked(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _flocked(folder: Path, how: int) -> int | None:
    """A handle with that lock; the system drops it with the process, whatever ends that."""
    import fcntl

    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(handle, how)
    except OSError:
        os.close(handle)
        return None
    return handle


def _unlock(handle: int | None) -> None:
    if handle is not None:
        os.close(handle)


# --- the rename ----------------------------------------------------------------------------


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
