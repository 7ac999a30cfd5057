"""Buckets: parts published to an object storage, whatever fsspec reaches.

There is no rename in a bucket. The report is written last and removed first: a folder with a report
is complete. There is no lock either: one batch a bucket is the user's to see to.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from devcad.batch.places import FAILED_FOLDER, MANIFEST, RECORDS, marked, why
from devcad.batch.tasks import Record, Result, Task, from_plain, to_plain
from devcad.errors import FileError

REPORT = "report.json"


def file_system(address: str) -> tuple[Any, str]:
    """The file system of an address, and the path in it.

    Raises:
        FileError: fsspec, or what it needs for that kind of address, is not there.
    """
    try:
        from fsspec.core import url_to_fs

        local = address.startswith(("file://", "local://"))  # others make no folders
        found: tuple[Any, str] = url_to_fs(address, **({"auto_mkdir": True} if local else {}))
        return found
    except (ImportError, ValueError) as error:
        raise FileError(
            f"cannot reach the address: {error}",
            place=address,
            value=str(error),
            remedy="pip install 'devcad[cluster]', and what fsspec names for that kind of address",
        ) from None


@contextmanager
def reaching(address: str) -> Iterator[None]:
    """What a storage refuses, told with its address."""
    try:
        yield
    except FileError:
        raise
    except Exception as error:  # every storage has its own
        raise FileError(
            f"the storage refused: {type(error).__name__}: {error}",
            place=address,
            value=type(error).__name__,
            remedy="check the address, the permissions and the room",
        ) from error


def sent(task: Task, work: Callable[[Task], Result]) -> Result:
    """The result of a task whose files are made here and sent to its bucket, with a record."""
    with tempfile.TemporaryDirectory() as folder:
        result = work(replace(task, out=folder))
        record = Record(task.name, task.print, task.order.told, task.tried + 1, result)
        with reaching(task.out):
            _send(Path(folder, task.name), task, record)
        return result


def _send(folder: Path, task: Task, record: Record) -> None:
    """Replace a part in the bucket, its report gone first and back last."""
    system, root = file_system(task.out)
    target = f"{root}/{task.name}"
    files = [file.path for file in record.result.files]
    with suppress(FileNotFoundError):
        system.rm_file(f"{target}/{REPORT}")
    for name in sorted(files, key=lambda name: name == REPORT):
        system.pipe_file(f"{target}/{name}", (folder / name).read_bytes())
    for path in system.ls(target, detail=False):
        if path.rsplit("/", 1)[-1] not in files:
            system.rm_file(path)
    data = json.dumps(to_plain(record)).encode()
    system.pipe_file(f"{root}/{RECORDS}/{task.name}.json", data)


class Bucket:
    """A bucket as the place of a batch; its ledger lives in a folder here, for as long as it."""

    def __init__(self, address: str) -> None:
        self.address = address.rstrip("/")
        self._system, self._root = file_system(self.address)
        self._sizes: dict[str, int] = {}
        self._here = tempfile.TemporaryDirectory()
        self.state = Path(self._here.name)

    @contextmanager
    def claimed(self, mark: str = "") -> Iterator[None]:
        """The bucket, looked at once; nothing keeps others from it."""
        try:
            with reaching(self.address):
                self._system.makedirs(self._root, exist_ok=True)
                self._system.invalidate_cache()
                found = self._system.find(self._root, detail=True)
                self._sizes = {self._inside(path): one["size"] for path, one in found.items()}
            yield
        finally:
            self._here.cleanup()

    def known(self, name: str) -> Record | None:
        """The record beside a part."""
        path = f"{RECORDS}/{name}.json"
        if path not in self._sizes:
            return None
        try:
            return from_plain(json.loads(self._system.cat_file(f"{self._root}/{path}")))
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None

    def there(self, record: Record) -> bool:
        """Whether the files of a part are there, by their sizes: storages keep what they take."""
        files = {f"{record.name}/{file.path}": file.bytes for file in record.result.files}
        return bool(files) and all(self._sizes.get(path) == size for path, size in files.items())

    def tell_failed(self, record: Record) -> None:
        """Write .failed/<part>.json; an older part of that name is removed."""
        with reaching(self.address):
            if f"{record.name}/{REPORT}" in self._sizes:
                self._system.rm(f"{self._root}/{record.name}", recursive=True)
            data = json.dumps(to_plain(record)).encode()
            self._put(f"{RECORDS}/{record.name}.json", data)
            self._put(f"{FAILED_FOLDER}/{record.name}.json", why(record))

    def forget_failed(self, name: str) -> None:
        """Remove what an earlier failure left of a part that is done now."""
        path = f"{FAILED_FOLDER}/{name}.json"
        if path in self._sizes:
            with reaching(self.address), suppress(FileNotFoundError):
                self._system.rm_file(f"{self._root}/{path}")

    def withdraw(self, mark: str = "") -> None:
        """Remove the manifest."""
        with reaching(self.address), suppress(FileNotFoundError):
            self._system.rm_file(f"{self._root}/{marked(MANIFEST, mark)}")

    def page(self, name: str) -> bytes:
        """None: a picture is not worth fetching a page for."""
        return b""

    def publish(self, lists: Mapping[str, bytes]) -> None:
        """Write lists, the one that says that all is complete last."""
        with reaching(self.address):
            for name, data in lists.items():
                self._put(name, data)

    def _put(self, path: str, data: bytes) -> None:
        self._system.pipe_file(f"{self._root}/{path}", data)

    def _inside(self, path: str) -> str:
        return path.removeprefix(f"{self._root}/")
