"""Job files one after the other: what became of each, told as lines or as one array."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from devcad import console
from devcad.errors import DevcadError, FileError, JobError
from devcad.interrupts import Interrupts

if TYPE_CHECKING:
    from devcad.job.load import Job
    from devcad.pipeline import Progress


T = TypeVar("T")
Lot = TypeVar("Lot")
"""What working on one job gives."""


@dataclass
class Outcome:
    """What became of one job file of the command line."""

    path: str
    job: Job | None = None
    report: dict[str, Any] | None = None
    errors: list[DevcadError] = field(default_factory=list)

    @property
    def code(self) -> int:
        """The largest exit code of what went wrong, 0 for nothing."""
        return max((error.code for error in self.errors), default=0)

    def entry(self) -> dict[str, Any]:
        """The report, or what went wrong first."""
        if self.report is not None:
            return self.report
        return console.entry(self.errors[0], self.path or None)


def work_through(
    paths: Sequence[str],
    work: Callable[[Job, Progress], dict[str, Any]],
    as_json: bool,
    lines: Callable[[dict[str, Any]], Iterable[str]],
    interrupts: Interrupts,
) -> int:
    """Load every job, then work on each; the exit code is the largest.

    Raises:
        FileError: stdout cannot be written; every job was worked on nevertheless.
    """
    outcomes = [_loaded(path) for path in paths]
    interrupts.check()
    twins = _refuse_twins(outcomes)
    unsaid: list[FileError] = []
    for outcome in outcomes:
        if outcome.job is not None and not outcome.errors and not twins:
            _work_on(outcome, outcome.job, work)
        interrupts.check()
        try:
            for error in outcome.errors:
                console.tell(error)
            if outcome.report is not None and not as_json:
                for line in lines(outcome.report):
                    console.say(line)
        except FileError as broken:
            unsaid.append(broken)
    if as_json:
        done = [outcome.entry() for outcome in outcomes if outcome.report or outcome.errors]
        console.say_json(done)
    if unsaid:
        raise unsaid[0]
    return max(outcome.code for outcome in outcomes)


def work_together(
    paths: Sequence[str],
    work: Callable[[Job, Progress], Lot],
    finish: Callable[[list[Lot], Progress], dict[str, Any]],
    as_json: bool,
    lines: Callable[[dict[str, Any]], Iterable[str]],
    interrupts: Interrupts,
) -> int:
    """Load every job, work on each, then finish with all of them at once, or with none where one
    failed; the exit code is the largest.

    Raises:
        FileError: stdout cannot be written.
    """
    outcomes = [_loaded(path) for path in paths]
    interrupts.check()
    lots: list[Lot] = []
    told: dict[str, Any] = {}
    if not _refuse_twins(outcomes):
        for outcome in outcomes:
            if outcome.job is not None:
                _work_on(outcome, outcome.job, lambda job, show: lots.append(work(job, show)))
            interrupts.check()
        if not any(outcome.errors for outcome in outcomes):
            last = _finished(lots, finish, paths)
            interrupts.check()
            told = last.report or {}
            outcomes += [last] if last.errors else []
    failed = [outcome for outcome in outcomes if outcome.errors]
    for outcome in failed:
        for error in outcome.errors:
            console.tell(error)
    if as_json:
        console.say_json([outcome.entry() for outcome in failed] or [told])
    elif not failed:
        for line in lines(told):
            console.say(line)
    return max((outcome.code for outcome in failed), default=0)


def _finished(
    lots: list[Lot],
    finish: Callable[[list[Lot], Progress], dict[str, Any]],
    paths: Sequence[str],
) -> Outcome:
    """What became of all jobs together; an error belongs to the job that its place names."""
    from devcad.report.progress import ProgressLine

    outcome = Outcome("")
    with ProgressLine() as progress:
        try:
            outcome.report = finish(lots, progress.show)
        except Exception as error:
            first = console.failure(error)
            named = (path for path in paths if f"{first.place} > ".startswith(f"{path} > "))
            outcome.path = next(named, "")
            outcome.errors = console.failures(first, outcome.path) if outcome.path else [first]
    return outcome


def _loaded(path: str) -> Outcome:
    """The job of a path, or why there is none."""
    outcome = Outcome(path)
    try:
        from devcad.job.load import load

        outcome.job = load(path)
    except Exception as error:
        outcome.errors = console.failures(error, path)
    return outcome


def _refuse_twins(outcomes: Sequence[Outcome]) -> bool:
    """Give every job whose name is taken an error; case-blind, as some file systems are."""
    first: dict[str, str] = {}
    for outcome in outcomes:
        if outcome.job is None:
            continue
        name = outcome.job.name
        if name.lower() not in first:
            first[name.lower()] = outcome.path
        elif Path(first[name.lower()]).samefile(outcome.path):
            outcome.errors.append(
                JobError(
                    "the job file is given twice; nothing was done",
                    place=outcome.path,
                    value=outcome.path,
                    limit="once",
                    remedy="give it once",
                )
            )
        else:
            outcome.errors.append(
                JobError(
                    f'the name "{name}" is taken by {first[name.lower()]}; nothing was done',
                    place=f"{outcome.path} > name",
                    value=name,
                    limit="one job of each name",
                    remedy="rename one of the two, or run them one by one",
                )
            )
    return any(outcome.job and outcome.errors for outcome in outcomes)


def _work_on(
    outcome: Outcome, job: T, work: Callable[[T, Progress], dict[str, Any] | None]
) -> None:
    from devcad.report.progress import ProgressLine

    with ProgressLine() as progress:
        try:
            outcome.report = work(job, progress.show)
        except Exception as error:
            outcome.errors = console.failures(error, outcome.path)
