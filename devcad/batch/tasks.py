"""What a batch knows of its parts: the task to do, and what became of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from devcad.batch.orders import Order
from devcad.batch.prints import Words

DONE, FAILED = "done", "failed"
CRASHED, TIMED_OUT, NO_MEMORY = "crashed", "timed out", "out of memory"
TRANSIENT = (CRASHED, TIMED_OUT, NO_MEMORY)
"""Beginnings of the causes that a second try may not meet again."""
ATTEMPTS = 2
"""Tries of a part whose cause may pass."""
CODES = {CRASHED: 70, TIMED_OUT: 4, NO_MEMORY: 4}
LASTING = {2, 3}
"""Exit codes that the same input gives again: no later batch tries those parts."""

Row = list[Any]
"""Cells of the cut list."""


@dataclass(frozen=True, slots=True)
class Task:
    """One part to be made in OUT: its order, its name, its fingerprint, the command line's words
    and how often it was tried before."""

    order: Order
    name: str
    print: str
    out: str
    words: Words = field(default_factory=Words)
    tried: int = 0

    def again(self) -> Task:
        """The same task once more."""
        return replace(self, tried=self.tried + 1)


@dataclass(frozen=True, slots=True)
class File:
    """A file of a part as it lies there: name, format ("report" for report.json), hash, size and
    time of change."""

    path: str
    format: str
    sha256: str
    bytes: int
    mtime_ns: int


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a task. ``errors`` are entries as the command line's JSON has them, the first
    of them the one of ``message``; ``cause`` is the class of a failure that is no error of the
    job: crashed, timed out, out of memory."""

    state: str
    exit: int = 0
    cause: str = ""
    message: str = ""
    errors: list[dict[str, Any]] = field(default_factory=list)
    files: tuple[File, ...] = ()
    rows: list[Row] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def may_pass(self) -> bool:
        """Whether a second try can help."""
        return self.cause.startswith(TRANSIENT)

    @property
    def lasting(self) -> bool:
        """Whether the same input fails again for certain."""
        return self.state == FAILED and not self.cause and self.exit in LASTING


@dataclass(frozen=True, slots=True)
class Record:
    """A part as the ledger and its record file have it: how it was made, and what came of it."""

    name: str
    print: str
    place: str
    attempts: int
    result: Result


def failure(task: Task, cause: str, remedy: str) -> Result:
    """The result of a task whose process ended without one."""
    from devcad.console import entry
    from devcad.errors import DevcadError, LimitError

    kind = next(word for word in TRANSIENT if cause.startswith(word))
    error: DevcadError = LimitError(cause) if CODES[kind] == LimitError.code else DevcadError(cause)
    error.place, error.value, error.remedy = task.order.told, cause, remedy
    told = [entry(error, task.order.path)]
    return Result(FAILED, error.code, cause, str(error), told)


def to_plain(record: Record) -> dict[str, Any]:
    """A record as JSON has it."""
    from dataclasses import asdict

    return asdict(record)


def from_plain(tree: dict[str, Any]) -> Record:
    """The record that ``to_plain`` told.

    Raises:
        KeyError, TypeError: it is none.
    """
    result = dict(tree["result"])
    result["files"] = tuple(File(**file) for file in result["files"])
    return Record(**{**tree, "result": Result(**result)})
