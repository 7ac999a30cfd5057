"""The commands batch and watch: words checked, the work done, and what became of it told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devcad import console, words
from devcad.errors import DevcadError, JobError
from devcad.interrupts import Interrupts

if TYPE_CHECKING:
    from devcad.batch.prints import Words
    from devcad.batch.run import Batch, Tally
    from devcad.batch.tasks import Record, Result
    from devcad.batch.workers import Walls


@dataclass(frozen=True, slots=True)
class Asked:
    """The options that batch and watch share, as the command line has them."""

    pipeline: str | None = None
    to: str | None = None
    allow: Sequence[str] | None = None
    workers: int = 0
    timeout: float = 600.0
    memory: float = 4.0
    renew: int = 16

    def words(self) -> Words:
        """What is said of every part.

        Raises:
            JobError: an unknown format, check or recipe.
        """
        from devcad.batch.prints import Words

        formats, allow = words.formats(self.to), words.checks(self.allow)
        words.recipe(self.pipeline)
        return Words(self.pipeline, tuple(formats), tuple(allow))

    def walls(self) -> Walls:
        """What a part may take.

        Raises:
            JobError: no time, or no memory.
        """
        from devcad.batch.workers import GIGABYTE, Walls

        for option, value in (("--timeout", self.timeout), ("--memory", self.memory)):
            if not 0.0 < value < float("inf"):
                raise JobError(
                    f"{value:g} is too little",
                    place=option,
                    value=value,
                    limit="above 0",
                    remedy="leave the option out",
                )
        return Walls(self.timeout, int(self.memory * GIGABYTE), self.renew)


def batch(
    arguments: Sequence[str],
    out: str,
    asked: Asked,
    *,
    shard: str | None = None,
    scheduler: str | None = None,
    quiet: bool = False,
    as_json: bool = False,
    interrupts: Interrupts,
) -> int:
    """Make all parts that are missing or changed; the exit code is the largest of the parts'.

    Raises:
        JobError: words, a list, names that are taken; FileError: OUT.
    """
    from devcad.batch.planning import shard_of

    said, limits, part = asked.words(), asked.walls(), shard_of(shard)
    try:
        done = _run(arguments, out, asked.workers, said, limits, part, scheduler)
    except DevcadError as error:
        interrupts.check()
        others: tuple[DevcadError, ...] = getattr(error, "others", ())
        if not others:
            raise
        for each in (error, *others):
            console.tell(each)
        if as_json:
            console.say_json([console.entry(error, None)])
        return max([error.code, *(each.code for each in others)])
    for record in done.records:
        for told in _errors(record.result):
            console.tell(told)
    if done.trouble:
        console.tell(done.trouble)
    if as_json:
        console.say_json(done.manifest)
    elif not quiet:
        for line in summary(done):
            console.say(line)
    return done.code


def watch(
    inbox: str, out: str, asked: Asked, *, every: float, once: bool, interrupts: Interrupts
) -> int:
    """Make what appears in a folder until a signal comes; a line a part. ``once``: until it is
    empty; the exit code is the largest of the parts' then.

    Raises:
        JobError: words; FileError: a folder that cannot be written, or is watched already.
    """
    from devcad.batch.run import Settings
    from devcad.batch.watch import watch as watched

    if not 0.0 < every < float("inf"):
        raise JobError(
            f"{every:g} s is no time between two looks",
            place="--every",
            value=every,
            limit="above 0",
            remedy="leave the option out",
        )

    def tell(record: Record) -> None:
        interrupts.check()
        for error in _errors(record.result):
            console.tell(error)
        if record.result.state == "done":
            console.say(f"done  {record.name}")
        console.flush()

    settings = Settings(out, asked.words(), asked.workers, asked.walls())
    return watched(Path(inbox), settings, tell, every=every, once=once)


def _run(
    arguments: Sequence[str],
    out: str,
    workers: int,
    said: Words,
    limits: Walls,
    shard: Any,
    scheduler: str | None,
) -> Batch:
    """The batch, with its progress on the terminal."""
    from devcad.batch.orders import orders_of
    from devcad.batch.run import Settings, run
    from devcad.report.progress import BatchBar

    settings = Settings(out, said, workers, limits, shard, scheduler=scheduler or "")
    with BatchBar() as bar:

        def show(tally: Tally) -> None:
            bar.show(
                parts=tally.parts,
                done=tally.done,
                failed=tally.failed,
                running=tally.running,
                made=tally.done + tally.failed - tally.standing,
                seconds=tally.seconds,
            )

        return run(orders_of(arguments), settings, show)


def _errors(result: Result) -> Iterator[DevcadError]:
    """The error lines of a part, as they were when it failed."""
    for each in result.errors:
        told = DevcadError(each["error"]["message"])
        told.code = each["error"]["code"]
        yield told


def summary(done: Batch) -> Iterator[str]:
    """A table: how many parts came to what end, and how long it took."""
    ends = Counter(_end(record.result) for record in done.records)
    rows = [(end, ends[end]) for end in sorted(ends, key=lambda end: (end != "done", end))]
    if done.tally.unchanged:
        rows.insert(1, ("  unchanged", done.tally.unchanged))
    width = max(len(end) for end, _ in rows) if rows else 0
    for end, count in rows:
        yield f"{end:{width}}  {count:7}"
    tally = done.tally
    made = tally.done + tally.failed - tally.standing
    rate = f", {made / tally.seconds:.3g} a second" if made and tally.seconds else ""
    yield f"{'parts':{width}}  {tally.parts:7}  in {tally.seconds:.1f} s{rate}"


def _end(result: Result) -> str:
    """The end that a part came to, in a word or two."""
    if result.state == "done":
        return "done"
    causes = {2: "job file", 3: "geometry", 4: "limits", 5: "files", 70: "bug"}
    return f"failed: {result.cause or causes.get(result.exit, result.exit)}"
