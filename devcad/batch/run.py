"""A batch: every order made once, what is there already left alone, and told in the end.

The coordinator loads no geometry. It reads job files as bytes, compares fingerprints with what
lies in OUT, and hands the rest to processes of their own.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from devcad.batch.ledger import Ledger, opened
from devcad.batch.listing import cutlist, manifest, overview
from devcad.batch.making import make
from devcad.batch.orders import Order
from devcad.batch.places import CUTLIST, MANIFEST, Folder, marked, plain_json
from devcad.batch.planning import Shard, tasks_of
from devcad.batch.prints import Reader, Words
from devcad.batch.tasks import ATTEMPTS, DONE, FAILED, Record, Result, Task
from devcad.batch.workers import Walls, Work, Workers
from devcad.errors import DevcadError
from devcad.export.folder import PAGE

PATIENCE = 0.2
"""Seconds between two looks at the clock, for the progress line."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How a batch is run: where to (a folder, or the address of a bucket), what the command line
    says of every part, with how many processes, within which walls, which shard of it, what does
    the work, and the address of a cluster that does it, "" for processes here."""

    out: Path | str
    words: Words = field(default_factory=Words)
    workers: int = 0
    walls: Walls = field(default_factory=Walls)
    shard: Shard = field(default_factory=Shard)
    work: Work = make
    scheduler: str = ""


@dataclass
class Tally:
    """How far a batch is."""

    parts: int
    done: int = 0
    failed: int = 0
    unchanged: int = 0
    """Of those done: made by an earlier batch."""
    standing: int = 0
    """Of all: known from an earlier batch, done or failed."""
    running: tuple[str, ...] = ()
    start: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        """Since the beginning, whatever the clock on the wall says."""
        return time.monotonic() - self.start

    def count(self, result: Result) -> None:
        """One more part is through."""
        self.done += result.state == DONE
        self.failed += result.state == FAILED


Show = Callable[[Tally], None]


class Store(Protocol):
    """Where parts are published: a folder, or a bucket of an object storage."""

    @property
    def state(self) -> Path:
        """A folder here for the ledger and for scratch."""

    @property
    def address(self) -> str:
        """What a task is told of the place."""

    def claimed(self, mark: str = "") -> AbstractContextManager[None]:
        """The place for one batch alone while the block lasts."""

    def known(self, name: str) -> Record | None:
        """The record beside a part."""

    def there(self, record: Record) -> bool:
        """Whether the files of a part are the ones that were written."""

    def tell_failed(self, record: Record) -> None:
        """Leave word why a part is not there."""

    def forget_failed(self, name: str) -> None:
        """Remove that word."""

    def withdraw(self, mark: str = "") -> None:
        """Remove the manifest."""

    def page(self, name: str) -> bytes:
        """The page of a part, b"" where it is not at hand."""

    def publish(self, lists: Mapping[str, bytes]) -> None:
        """Write the lists."""


class Hands(Protocol):
    """Who makes parts: processes here, or a cluster's."""

    @property
    def free(self) -> bool:
        """Whether one more task can begin now."""

    @property
    def running(self) -> list[Task]:
        """The tasks being done."""

    def begin(self, task: Task) -> None:
        """Begin a task."""

    def wait(self, patience: float) -> Iterator[tuple[Task, Result]]:
        """What has become of tasks, after at most so many seconds."""

    def close(self) -> None:
        """End what is being done."""


@dataclass(frozen=True, slots=True)
class Batch:
    """What became of a batch: its records in the order of the list, the manifest, and what kept
    the lists from being written, if anything did."""

    records: tuple[Record, ...]
    tally: Tally
    manifest: dict[str, Any]
    trouble: DevcadError | None = None

    @property
    def code(self) -> int:
        """The largest exit code of its parts."""
        own = self.trouble.code if self.trouble else 0
        return max([own, *(record.result.exit for record in self.records)])


def processors() -> int:
    """The processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run(orders: Sequence[Order], settings: Settings, show: Show) -> Batch:
    """Make what is missing or changed, and write manifest.json, cutlist.csv and index.html.

    Raises:
        JobError: two orders of one name; FileError: OUT cannot be written, or another batch is
        at work in it. What became of each part is no exception: its record says it.
    """
    store, mark = store_of(settings.out), settings.shard.mark
    with store.claimed(mark), opened(store.state, mark) as ledger:
        reader = Reader(ledger.facts())
        known = len(reader.facts)
        tasks = tasks_of(orders, store.address, settings.words, reader, settings.shard)
        if len(reader.facts) > known:
            ledger.learn(reader.facts)
        book = Book(store, ledger)
        tally = Tally(len(tasks))
        todo = [task for task in tasks if not book.standing(task)]
        _count_standing(tally, book)
        show(tally)
        if todo:
            store.withdraw(mark)
            _work_off(todo, hands_of(settings, store, todo), book, tally, show)
        return _told(tasks, book, store, tally, mark)


def store_of(out: Path | str) -> Store:
    """The folder, or the bucket, of a path or an address.

    Raises:
        FileError: the library for buckets is not there.
    """
    if isinstance(out, str) and "://" in out:
        from devcad.batch.remote import Bucket

        return Bucket(out)
    return Folder(Path(out))


def _count_standing(tally: Tally, book: Book) -> None:
    """Count what needs nothing more."""
    for record in book.records.values():
        tally.count(record.result)
    tally.unchanged, tally.standing = tally.done, len(book.records)


def _told(tasks: Sequence[Task], book: Book, store: Store, tally: Tally, mark: str) -> Batch:
    """The batch, its lists published."""
    ordered = tuple(book.records[task.name] for task in tasks)
    told = manifest(ordered)
    rows = cutlist(ordered, [task.order for task in tasks])
    title = f"Batch {mark}" if mark else "Batch"
    lists = {
        marked(CUTLIST, mark): rows,
        marked(PAGE, mark): overview(title, ordered, store.page),
        marked(MANIFEST, mark): plain_json(told),
    }
    try:
        store.publish(lists)
    except DevcadError as error:
        return Batch(ordered, tally, told, error)
    return Batch(ordered, tally, told)


@dataclass(frozen=True, slots=True)
class Book:
    """Where results are entered: beside the parts first, in the ledger then."""

    store: Store
    ledger: Ledger
    records: dict[str, Record] = field(default_factory=dict)

    def standing(self, task: Task) -> bool:
        """Whether a task needs nothing more: done and still there, or failed in a way that would
        be the same again."""
        record = self.ledger.records.get(task.name)
        if record is None or record.print != task.print:
            record = self.store.known(task.name)
        if record is None or record.print != task.print:
            return False
        result = record.result
        lasting = result.lasting and record.place == task.order.told
        if not lasting and not (result.state == DONE and self.store.there(record)):
            return False
        if self.ledger.records.get(task.name) != record:
            self.ledger.keep(record)
        self.records[task.name] = record
        return True

    def enter(self, task: Task, result: Result) -> Record:
        """A part is through; where the disk is full its error is told in the end all the same."""
        record = Record(task.name, task.print, task.order.told, task.tried + 1, result)
        if result.state == FAILED:
            with suppress(DevcadError):
                self.store.tell_failed(record)
        else:
            self.store.forget_failed(task.name)
        self.ledger.keep(record)
        self.records[task.name] = record
        return record


def hands_of(settings: Settings, store: Store, todo: Sequence[Task]) -> Hands:
    """Who makes the parts: processes here, no more than there are parts, or a cluster."""
    formats = {name for task in todo for name in task.words.formats or task.order.formats}
    open_ended = not todo or any(not (x.words.formats or x.order.formats) for x in todo)
    warm = None if settings.work is not make else () if open_ended else tuple(sorted(formats))
    if settings.scheduler:
        from devcad.batch.cluster import Cluster

        cluster: Hands = Cluster(settings.scheduler, settings.work, settings.walls, warm)
        return cluster
    count = settings.workers or processors()
    return Workers(settings.work, min(count, len(todo) or count), settings.walls, store.state, warm)


def _work_off(todo: Sequence[Task], hands: Hands, book: Book, tally: Tally, show: Show) -> None:
    """Do every task, those that are due first; a failure that may pass is tried once more."""
    queue = deque(sorted(todo, key=lambda task: task.order.due or "9999"))
    try:
        while queue or hands.running:
            while queue and hands.free:
                hands.begin(queue.popleft())
            for task, result in hands.wait(PATIENCE):
                if result.may_pass and task.tried + 1 < ATTEMPTS:
                    queue.append(task.again())
                    continue
                book.enter(task, result)
                tally.count(result)
            tally.running = tuple(task.name for task in hands.running)
            show(tally)
    finally:
        hands.close()
