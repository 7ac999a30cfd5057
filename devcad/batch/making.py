"""One part, made in a process of its own: what runs inside it."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devcad.batch.orders import TITLES
from devcad.batch.places import RECORDS, write_record
from devcad.batch.tasks import DONE, FAILED, NO_MEMORY, File, Record, Result, Task, failure
from devcad.console import entry, failures
from devcad.errors import DevcadError, FileError, JobError

if TYPE_CHECKING:
    from devcad.job.load import Job

OTHERS = {"report.json": "report", "index.html": "page"}
"""What stands in a folder beside the files that its report lists."""
DRAWINGS = ("dxf", "svg", "pdf")
"""Formats to cut from, the best first, as export/cutlist.py has them."""
MARKS = ("", "-approximate", "-mm", "-approximate-mm")
"""What may stand between a drawing's name and its ending."""


def make(task: Task) -> Result:
    """Build and export a part into OUT/<name>, verified."""
    if "://" in task.out:
        from devcad.batch.remote import sent

        return guarded(task, lambda task: sent(task, _made))
    return guarded(task, _made)


def guarded(task: Task, work: Callable[[Task], Result]) -> Result:
    """The result of a task, timed and remembered; whatever goes wrong is a result too."""
    start = time.monotonic()
    try:
        result = work(task)
    except Exception as error:
        result = _no_memory(task) if _of_memory(error) else _failed(error, task)
    result = replace(result, seconds=round(time.monotonic() - start, 3))
    if result.state == DONE and "://" not in task.out:
        remember(task, result)
    return result


def _made(task: Task) -> Result:
    from devcad import pipeline as spine
    from devcad.job.load import load

    order, words = task.order, task.words
    job = load(order.path, order.changes, folder=order.folder or None)
    if job.name != task.name:
        raise JobError("the job file has changed just now", place=order.path, remedy="start again")
    recipe = spine.plan(
        job, pipeline=words.pipeline, formats=words.formats or order.formats, allow=words.allow
    )
    part = spine.build(job, pipeline=words.pipeline, allow=words.allow)
    report = spine.export(
        part, task.out, formats=recipe.formats, options=recipe.options, allow=recipe.allow
    )
    files = verified(Path(task.out, job.name), report)
    return Result(DONE, files=files, rows=cut_rows(job, report))


def verified(folder: Path, report: dict[str, Any]) -> tuple[File, ...]:
    """The files of a folder, read once more and compared with its report; the report itself, and
    what else stands beside it, come last.

    Raises:
        FileError: a file is not what the report says, or not there.
    """
    out = []
    for told in report["files"]:
        data, changed = _read(folder / told["path"])
        sha = hashlib.sha256(data).hexdigest()
        if sha != told["sha256"]:
            raise FileError(
                f'"{told["path"]}" is not what was written',
                place=str(folder),
                value=sha,
                limit=told["sha256"],
                remedy="check the disk, or choose another folder with -o",
            )
        out.append(File(told["path"], told["format"], sha, len(data), changed))
    listed = {file.path for file in out}
    for path in sorted(folder.iterdir()):
        if path.name not in listed:
            data, changed = _read(path)
            sha = hashlib.sha256(data).hexdigest()
            out.append(File(path.name, OTHERS.get(path.name, ""), sha, len(data), changed))
    return tuple(out)


def _read(path: Path) -> tuple[bytes, int]:
    """The content of a file, and the time when it was changed, ns."""
    with path.open("rb") as stream:
        return stream.read(), os.fstat(stream.fileno()).st_mtime_ns


def cut_rows(job: Job, report: dict[str, Any]) -> list[list[Any]]:
    """The rows of the cut list, a panel each, as export/cutlist.py has them; the drawing is named
    with the part's folder."""
    meta = job.meta
    return [
        [
            job.name,
            panel["name"],
            meta.part_number,
            meta.revision,
            meta.quantity,
            job.material or "",
            job.thickness,
            panel["flat_bbox"][2] - panel["flat_bbox"][0],
            panel["flat_bbox"][3] - panel["flat_bbox"][1],
            panel["flat_area"],
            panel["cut_length"],
            panel["pierces"],
            panel["mass_g"],
            None if meta.grain is None else math.degrees(meta.grain),
            meta.finish,
            _drawing(job.name, panel["name"], report),
        ]
        for panel in report["panels"]
    ]


def _drawing(job: str, panel: str, report: dict[str, Any]) -> str | None:
    """The drawing of a panel to cut from, None where none was asked for."""
    stem = job if len(report["panels"]) == 1 else f"{job}-{panel}"
    there = {file["path"] for file in report["files"]}
    names = (f"{stem}{mark}.{kind}" for kind in DRAWINGS for mark in MARKS)
    return next((f"{job}/{name}" for name in names if name in there), None)


def _of_memory(error: BaseException | None) -> bool:
    """Whether memory ran out, be it told by Python, numpy, C++ or the CAD kernel."""
    signs = ("MemoryError", "bad_alloc", "OutOfMemory", "not enough memory", "map segment")
    while error is not None:
        if any(sign in f"{type(error).__name__}: {error}" for sign in signs):
            return True
        error = error.__cause__ or error.__context__
    return False


def _no_memory(task: Task) -> Result:
    return failure(task, NO_MEMORY, "give a larger tolerance, or more with --memory")


def _failed(error: Exception, task: Task) -> Result:
    """The result of an error, every place told from the list's row on."""
    found = failures(error, task.order.path)
    for each in found:
        each.place = _from_list(each, task)
    told = [entry(each, task.order.path) for each in found]
    worst = max(each.code for each in found)
    return Result(FAILED, worst, "", str(found[0]), told)


def _from_list(error: DevcadError, task: Task) -> str:
    """The place of an error with the list's row before it, and the column where it has one."""
    order = task.order
    if not order.place:
        return error.place
    columns = [key for key, _ in order.changes if error.place.endswith(f" > {key}")]
    column = f", column {TITLES.get(columns[0], columns[0])}" if columns else ""
    return f"{order.place}{column} > {error.place}"


def remember(task: Task, result: Result) -> None:
    """The record beside the folder, from which a lost ledger is rebuilt; without it the part is
    made once more, no worse."""
    record = Record(task.name, task.print, task.order.told, task.tried + 1, result)
    write_record(Path(task.out) / RECORDS, record)
