"""The folder of a batch: who works in it, what lies in it, what failed.

OUT/<part>/                 as a single export leaves it
OUT/manifest.json           there once the batch is through, with cutlist.csv
OUT/.failed/<part>.json     why there is no folder of that name
OUT/.batch/                 lock, ledger, a record a part
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from devcad.batch.tasks import File, Record, from_plain, to_plain
from devcad.errors import FileError
from devcad.export.folder import PAGE, REPORT, publish_file, sweep, unlisted, unwritable

STATE, RECORDS, FAILED_FOLDER = ".batch", ".batch/records", ".failed"
MANIFEST, CUTLIST = "manifest.json", "cutlist.csv"
OWN = "|".join(
    rf"{stem}(?:-\d+-of-\d+)?\.{ending}"
    for stem, _, ending in (name.partition(".") for name in (MANIFEST, CUTLIST, PAGE))
)
"""The names of a batch's lists and of its shards', as a regular expression."""


class Folder:
    """A folder as the place of a batch; ``address`` is what its parts are told."""

    def __init__(self, out: Path) -> None:
        self._out = out
        self.address = str(out)
        self.state = out / STATE

    @contextmanager
    def claimed(self, mark: str = "") -> Iterator[None]:
        """OUT for this batch alone while the block lasts; shards of one batch share it.

        The system drops the claim with the process, whatever ends that. What killed processes left
        in OUT is removed first.

        Raises:
            FileError: OUT cannot be written, or another batch is at work in it.
        """
        out = self._out
        try:
            (out / RECORDS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(out, error) from error
        handles: list[int] = []
        try:
            handles.append(claim(self.state / "lock", out, shared=bool(mark)))
            if mark:
                handles.append(claim(self.state / f"lock-{mark}", out, shared=False))
            else:
                _clear(out)
            sweep(out)
            yield
        finally:
            sweep(out)  # of the processes that were killed
            for handle in handles:
                os.close(handle)

    def known(self, name: str) -> Record | None:
        """The record beside a part's folder."""
        return read_record(self._out / RECORDS, name)

    def there(self, record: Record) -> bool:
        """Whether the files of a part are the ones that were written.

        Files of the same size and time are; others are read, as a copied folder has other times.
        """
        folder, files = self._out / record.name, record.result.files
        return bool(files) and all(_same(folder, file) for file in files)

    def tell_failed(self, record: Record) -> None:
        """Write OUT/.failed/<part>.json; a folder of that part, which is of another order, goes
        there.

        Raises:
            FileError: it cannot be written.
        """
        write_record(self._out / RECORDS, record)
        _set_aside(self._out, record.name)
        publish_file(self._out / FAILED_FOLDER, f"{record.name}.json", why(record))

    def forget_failed(self, name: str) -> None:
        """Remove what an earlier failure left of a part that is done now."""
        folder = self._out / FAILED_FOLDER
        with suppress(OSError):
            (folder / f"{name}.json").unlink(missing_ok=True)
            if (folder / name).is_dir():
                shutil.rmtree(folder / name)
            folder.rmdir()  # the last one

    def withdraw(self, mark: str = "") -> None:
        """Remove the manifest: the folder is not complete while parts are made.

        Raises:
            FileError: it cannot be removed.
        """
        try:
            (self._out / marked(MANIFEST, mark)).unlink(missing_ok=True)
        except OSError as error:
            raise unwritable(self._out, error, MANIFEST) from error

    def page(self, name: str) -> bytes:
        """The page of a part, b"" where there is none."""
        try:
            return (self._out / name / PAGE).read_bytes()
        except OSError:
            return b""

    def publish(self, lists: Mapping[str, bytes]) -> None:
        """Write lists, the one that says that all is complete last.

        Raises:
            FileError: OUT cannot be written.
        """
        for name, data in lists.items():
            publish_file(self._out, name, data)


def why(record: Record) -> bytes:
    """What stands in .failed/<part>.json."""
    result = record.result
    told = {
        "job": record.name,
        "state": result.state,
        "exit": result.exit,
        "message": result.message,
        "cause": result.cause or None,
        "attempts": record.attempts,
        "errors": [each["error"] for each in result.errors],
    }
    return plain_json(told)


def plain_json(tree: Any) -> bytes:
    """A tree as the bytes of a JSON file that people may read."""
    return f"{json.dumps(tree, indent=2, ensure_ascii=False)}\n".encode()


def claim(path: Path, out: Path, *, shared: bool) -> int:
    """A handle that holds a lock file of a folder, until it is closed or the process ends.

    Raises:
        FileError: another process holds it, or it cannot be written.
    """
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise unwritable(out, error) from error
    if sys.platform == "win32":
        return handle
    import fcntl

    try:
        fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError:
        owner = os.pread(handle, 32, 0).decode("ascii", "replace").strip()
        os.close(handle)
        who = f" (process {owner})" if owner.isdigit() else ""
        raise FileError(
            f"another batch is at work in this folder{who}",
            place=str(out),
            value=owner,
            limit="one batch a folder; shards of one may share it",
            remedy="wait until it is through, or choose another folder with -o",
        ) from None
    with suppress(OSError):
        os.truncate(handle, 0)
        os.pwrite(handle, f"{os.getpid()}\n".encode(), 0)
    return handle


def _clear(out: Path) -> None:
    """Remove what killed batches left of their lists."""
    ours = re.compile(rf"\.(?:{OWN})-[0-9a-f]{{16}}\.part")
    litter = [path for path in out.glob(".*.part") if ours.fullmatch(path.name)]
    litter += (out / STATE).glob("worker-*.txt")
    litter += [*(out / FAILED_FOLDER).glob(".*.part"), *(out / RECORDS).glob("*.part")]
    for path in litter:
        with suppress(OSError):
            path.unlink()


def write_record(folder: Path, record: Record) -> None:
    """Keep a record, whole or not at all; a disk that has no room for it goes without."""
    with suppress(OSError):
        part = folder / f"{record.name}.{os.getpid()}.part"
        part.write_text(json.dumps(to_plain(record)), encoding="utf-8")
        part.replace(folder / f"{record.name}.json")


def read_record(folder: Path, name: str) -> Record | None:
    """The record of a part, None where there is no sound one."""
    try:
        return from_plain(json.loads((folder / f"{name}.json").read_bytes()))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _same(folder: Path, file: File) -> bool:
    path = folder / file.path
    try:
        status = path.stat()
        if status.st_size != file.bytes:
            return False
        if status.st_mtime_ns == file.mtime_ns:
            return True
        return hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256
    except OSError:
        return False


def _set_aside(out: Path, name: str) -> None:
    """Move an earlier order's folder to where nobody takes it for this one's; what others put
    into it stays where they put it."""
    folder, aside = out / name, out / FAILED_FOLDER / name
    if not folder.is_dir() or not (folder / REPORT).is_file():
        return
    with suppress(OSError):
        shutil.rmtree(aside, ignore_errors=True)
        aside.parent.mkdir(exist_ok=True)
        strange = unlisted(folder)
        if not strange:
            folder.rename(aside)
            return
        aside.mkdir()
        for path in sorted(folder.iterdir(), key=lambda path: path.name == REPORT):
            if path.name not in strange:
                path.rename(aside / path.name)


def marked(name: str, mark: str) -> str:
    """The name of a list, with the shard it is of."""
    stem, dot, ending = name.rpartition(".")
    return f"{stem}-{mark}{dot}{ending}" if mark else name
