"""A hot folder: job files that appear in it are made, for as long as it is watched.

    IN             drop job files here; files that they name lie here too
    IN/work        those being made
    IN/done        those that are done, each with <name>.json
    IN/failed      those that failed, each with <name>.json

A job file moves by renames only, so that it is in one of the four at any moment; what a killed
watch left in work is made first by the next one.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from devcad.batch.ledger import opened
from devcad.batch.listing import manifest
from devcad.batch.orders import Order
from devcad.batch.places import claim, plain_json
from devcad.batch.planning import Shard, tasks_of
from devcad.batch.prints import Reader
from devcad.batch.run import Book, Hands, Settings, hands_of, store_of
from devcad.batch.tasks import ATTEMPTS, DONE, FAILED, Record, Result, Task
from devcad.console import entry
from devcad.errors import DevcadError
from devcad.export.folder import publish_file, unwritable

WORK, READY, REFUSED = "work", "done", "failed"
Tell = Callable[[Record], None]


@dataclass
class _Looks:
    """What a file looked like at the last look: only one that stays the same is taken."""

    seen: dict[Path, tuple[int, int]] = field(default_factory=dict)

    def settled(self, inbox: Path) -> list[Path]:
        """The job files that have not changed since the last look, the oldest first."""
        now: dict[Path, tuple[int, int]] = {}
        for path in inbox.iterdir():
            if path.suffix == ".toml" and not path.name.startswith("."):
                with suppress(OSError):  # gone again
                    status = path.stat()
                    now[path] = (status.st_size, status.st_mtime_ns)
        same = [path for path, look in now.items() if self.seen.get(path) == look]
        self.seen = now
        return sorted(same, key=lambda path: (now[path][1], path.name))


def watch(inbox: Path, settings: Settings, tell: Tell, *, every: float, once: bool) -> int:
    """Make what appears in a folder until a signal ends it, or, ``once``, until it is empty.

    Returns:
        the largest exit code of the parts.
    Raises:
        FileError: a folder that cannot be written, or is watched or worked in already.
    """
    store = store_of(settings.out)
    with _claimed(inbox), store.claimed(), opened(store.state) as ledger:
        store.withdraw()
        desk = _Desk(inbox, settings, Book(store, ledger), tell)
        desk.hands = hands_of(settings, store, [])
        try:
            desk.take((inbox / WORK).glob("*.toml"))
            looks = _Looks()
            while True:
                desk.take(_moved(looks.settled(inbox), inbox / WORK))
                desk.go_on(time.monotonic() + every)
                if once and desk.idle and not looks.seen:
                    return desk.code
        finally:
            desk.hands.close()
            _give_back(inbox)


@contextmanager
def _claimed(inbox: Path) -> Iterator[None]:
    """The hot folder for this watch alone."""
    try:
        for name in (WORK, READY, REFUSED):
            (inbox / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(inbox, error) from error
    handle = claim(inbox / WORK / ".lock", inbox, shared=False)
    try:
        yield
    finally:
        os.close(handle)


def _moved(paths: list[Path], folder: Path) -> Iterator[Path]:
    """The files where they are now: in ``folder``, which may be the place of one of their name
    that is still being made; then they wait."""
    for path in paths:
        target = folder / path.name
        if not target.exists():
            with suppress(FileNotFoundError):  # its owner took it away again
                yield path.rename(target)


@dataclass
class _Desk:
    """What lies on the desk of a watch."""

    inbox: Path
    settings: Settings
    book: Book
    tell: Tell
    hands: Hands = field(init=False)
    queue: deque[Task] = field(default_factory=deque)
    code: int = 0

    @property
    def idle(self) -> bool:
        """Whether there is nothing to do."""
        return not self.queue and not self.hands.running

    def take(self, paths: Iterable[Path]) -> None:
        """Queue job files; one whose part is there already is done at once."""
        for path in sorted(paths):
            order = Order(str(path), folder=str(self.inbox))
            try:
                task = self._task(order)
            except DevcadError as error:  # a name that no part may have
                self._finish(path, _refused(path, error))
                continue
            if self.book.standing(task):
                self._finish(path, self.book.records[task.name])
            else:
                self.queue.append(task)

    def _task(self, order: Order) -> Task:
        settings = self.settings
        (task,) = tasks_of([order], self.book.store.address, settings.words, Reader(), Shard())
        return task

    def go_on(self, until: float) -> None:
        """Work until a moment of the monotonic clock, or sleep till then."""
        while (left := until - time.monotonic()) > 0.0:
            self._begin()
            if not self.hands.running:
                time.sleep(left)
                return
            for task, result in self.hands.wait(left):
                self._end(task, result)

    def _begin(self) -> None:
        """Begin what can begin: no two parts of one name at a time."""
        for _ in range(len(self.queue)):
            if not self.hands.free:
                return
            task = self.queue.popleft()
            busy = {other.name.lower() for other in self.hands.running}
            if task.name.lower() in busy:
                self.queue.append(task)
            else:
                self.hands.begin(task)

    def _end(self, task: Task, result: Result) -> None:
        if result.may_pass and task.tried + 1 < ATTEMPTS:
            self.queue.append(task.again())
        else:
            self._finish(Path(task.order.path), self.book.enter(task, result))

    def _finish(self, path: Path, record: Record) -> None:
        """Leave word beside the job file and move it there; one that cannot be moved stays in
        work and is made again by the next watch."""
        folder = self.inbox / (READY if record.result.state == DONE else REFUSED)
        other = self.inbox / (REFUSED if record.result.state == DONE else READY)
        self.code = max(self.code, record.result.exit)
        (told,) = manifest([record])["parts"]
        with suppress(DevcadError, OSError):
            publish_file(folder, f"{path.stem}.json", plain_json(told))
            for stale in (other / f"{path.stem}.json", other / path.name):
                stale.unlink(missing_ok=True)
            path.replace(folder / path.name)
        self.tell(record)


def _refused(path: Path, error: DevcadError) -> Record:
    """The record of a job file that never became a task."""
    result = Result(FAILED, error.code, "", str(error), [entry(error, str(path))])
    return Record(path.stem, "", str(path), 1, result)


def _give_back(inbox: Path) -> None:
    """Put what was not made back where it was dropped; what has a newer one there stays."""
    for path in (inbox / WORK).glob("*.toml"):
        if not (inbox / path.name).exists():
            with suppress(OSError):
                path.rename(inbox / path.name)
