"""What is to be made: an order for each part, from job files, folders of them, and lists."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from devcad.errors import DevcadError, FileError, JobError

LISTS = {".csv", ".tsv", ".txt"}
"""Endings of the names of lists."""
PLAIN = {"quantity": "meta.quantity", "revision": "meta.revision"}
"""Columns with short names for keys of the job."""
TITLES = {"": "without a name", **{key: title for title, key in PLAIN.items()}}


@dataclass(frozen=True, slots=True)
class Order:
    """One part to be made: its job file, and what a list says of it.

    ``place`` is where the list says so, "" without a list; ``changes`` are dotted keys of the job
    with their texts; ``formats`` none leaves them to the recipe; ``due`` is an ISO date or "".
    ``folder`` holds the files that the job names, "" where they lie beside it.
    """

    path: str
    place: str = ""
    changes: tuple[tuple[str, str], ...] = ()
    formats: tuple[str, ...] = ()
    due: str = ""
    folder: str = ""

    @property
    def told(self) -> str:
        """Where the order stands, for error lines: the list's row before the job file."""
        return f"{self.place} > {self.path}" if self.place else self.path


class ManyErrors(JobError):
    """Several problems of a list: the first is the error itself, ``others`` follow it."""

    others: tuple[DevcadError, ...] = ()


def refuse(problems: Sequence[DevcadError]) -> None:
    """Raise the problems as one; nothing happens where there are none."""
    if not problems:
        return
    first = problems[0]
    if len(problems) == 1:
        raise first
    error = ManyErrors(first.what, first.place, first.panel, first.value, first.limit, first.remedy)
    error.others = tuple(problems[1:])
    raise error


def orders_of(arguments: Sequence[str]) -> list[Order]:
    """The orders of the command line's words, in their order: job files, lists, folders.

    Raises:
        JobError: a list that is wrong, every row and column of it told; a folder without job
        files; FileError: a list or a folder that cannot be read.
    """
    out: list[Order] = []
    problems: list[DevcadError] = []
    for word in arguments:
        try:
            out += _orders(word)
        except DevcadError as error:
            problems += [error, *getattr(error, "others", ())]
    refuse(problems)
    return out


def _orders(word: str) -> list[Order]:
    path = Path(word)
    if path.is_dir():
        return [Order(str(job)) for job in _jobs_in(path)]
    if path.suffix.lower() in LISTS:
        from devcad.batch.joblist import read_list

        return read_list(word)
    return [Order(word)]


def _jobs_in(folder: Path) -> list[Path]:
    """The job files of a folder, sorted by name."""
    try:
        found = sorted(path for path in folder.iterdir() if path.suffix == ".toml")
    except OSError as error:
        raise FileError(
            f"cannot read the folder: {error.strerror}",
            place=str(folder),
            value=error.strerror,
            remedy="check the name and the permissions",
        ) from None
    if not found:
        raise JobError(
            "the folder has no job files",
            place=str(folder),
            value=0,
            limit="files named *.toml",
            remedy="name a folder with job files",
        )
    return found
