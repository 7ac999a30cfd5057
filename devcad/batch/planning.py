"""Orders to tasks: every part has one name and one fingerprint, and belongs to one shard."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from devcad.batch.orders import Order, refuse
from devcad.batch.places import OWN
from devcad.batch.prints import Reader, Words
from devcad.batch.tasks import Task
from devcad.errors import DevcadError, JobError

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_TAKEN = re.compile(OWN, re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Shard:
    """The ``number``-th of ``count`` parts of a batch; 1 of 1 is all of it."""

    number: int = 1
    count: int = 1

    @property
    def mark(self) -> str:
        """What the names of its lists have, "" for the whole batch."""
        return "" if self.count == 1 else f"{self.number}-of-{self.count}"


def shard_of(text: str | None) -> Shard:
    """The shard that --shard says, such as 2/8.

    Raises:
        JobError: it says none.
    """
    if text is None:
        return Shard()
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    number, count = (int(word) for word in found.groups()) if found else (0, 0)
    if not 1 <= number <= count:
        raise JobError(
            f'"{text[:60]}" is no shard',
            place="--shard",
            value=text[:60],
            limit="i/n with 1 <= i <= n",
            remedy="such as --shard 2/8",
        )
    return Shard(number, count)


def tasks_of(
    orders: Sequence[Order], out: str, words: Words, reader: Reader, shard: Shard
) -> list[Task]:
    """The tasks of a shard in the order of the list: part k of all, sorted by name, belongs to
    shard 1 + k mod n.

    A job file that cannot be read, or has no name, goes by its file's name and fails later.

    Raises:
        JobError: two orders of one name, each told; nothing is done then.
    """
    names = _named(orders, reader)
    refuse(_twins(orders, names))
    place = {name: k for k, name in enumerate(sorted(names, key=lambda name: (name.lower(), name)))}
    return [
        Task(order, name, reader.print_of(order, words), out, words)
        for order, name in zip(orders, names, strict=True)
        if place[name] % shard.count == shard.number - 1
    ]


def _named(orders: Sequence[Order], reader: Reader) -> list[str]:
    """A name for each order; those without a good one get one that is free."""
    found = [_own_name(order, reader) for order in orders]
    taken = {name.lower() for name in found if name}
    out = []
    for order, name in zip(orders, found, strict=True):
        if not name:
            stem = re.sub(r"[^A-Za-z0-9_-]", "-", Path(order.path).stem)[:40].lstrip("-_") or "job"
            number = 1
            name = stem
            while name.lower() in taken:
                number += 1
                name = f"{stem}-{number}"
            taken.add(name.lower())
        out.append(name)
    return out


def _own_name(order: Order, reader: Reader) -> str:
    """The name that the list or the job file gives, "" where it is not there or not fit."""
    name = dict(order.changes).get("name") or reader.facts_of(order).name or ""
    return name if _NAME.fullmatch(name) and not name.endswith(".") else ""


def _twins(orders: Sequence[Order], names: Sequence[str]) -> list[DevcadError]:
    """An error for each name that is taken, by another part or by the lists of the batch."""
    first: dict[str, Order] = {}
    problems: list[DevcadError] = []
    for order, name in zip(orders, names, strict=True):
        by = first.setdefault(name.lower(), order)
        if by is not order or _TAKEN.fullmatch(name):
            taker = (by.place or by.path) if by is not order else "the batch's own lists"
            problems.append(
                JobError(
                    f'the name "{name}" is taken by {taker}; nothing was done',
                    place=f"{order.told} > name",
                    value=name,
                    limit="one part of each name",
                    remedy="give each row its own in a column name"
                    if order.place
                    else "rename one of the two",
                )
            )
    return problems
