"""Work for the processes of a batch that goes wrong as the part's name says.

A part is made by writing a drawing, a report and the record, as devcad does, without geometry, so
that tests of what happens around a part are quick.
"""

from __future__ import annotations

import errno
import os
import signal
import time
from pathlib import Path

from devcad.batch import making
from devcad.batch.tasks import DONE, Result, Task
from devcad.errors import JobError
from devcad.export import Written
from devcad.export.folder import published
from devcad.report import file_entry, to_bytes

MEGABYTE = 1_000_000


def work(task: Task) -> Result:
    """Make a part, or go wrong."""
    return making.guarded(task, _work)


def _work(task: Task) -> Result:
    with Path(task.out, ".batch", "log").open("a") as log:
        log.write(f"{task.name}\n")
    fault = task.name.rstrip("0123456789").rstrip("-")
    if fault in FAULTS:
        FAULTS[fault](task)
    text = Path(task.order.path).read_text()
    if fault == "refused" or "radius = -" in text or "[surface]" not in text:
        raise JobError("no such part", place=task.order.path)
    if fault == "full":
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "x.dxf")
    with published(Path(task.out), task.name) as folder:
        drawing = folder / f"{task.name}.dxf"
        drawing.write_text(task.name * 100)
        if fault == "slow":
            time.sleep(0.02)
        report = {"files": [file_entry(Written(drawing, "dxf", 0.0))]}
        (folder / "report.json").write_bytes(to_bytes(report))
    return Result(DONE, files=making.verified(Path(task.out, task.name), report))


def once(task: Task) -> bool:
    """Whether this is the first try of a part."""
    return task.tried == 0


def segfault(task: Task) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def segfault_once(task: Task) -> None:
    if once(task):
        segfault(task)


def hang(task: Task) -> None:
    while True:
        time.sleep(1.0)


def eat(task: Task) -> None:
    held = []
    while True:
        try:
            held.append(bytearray(100 * MEGABYTE))
        except MemoryError:
            held.clear()
            raise


def abort_without_memory(task: Task) -> None:
    os.write(2, b"terminate called after throwing an instance of 'std::bad_alloc'\n")
    os.abort()


def leave(task: Task) -> None:
    os._exit(3)


def swell(task: Task) -> None:
    held = b""
    while True:
        held += b"x" * 5 * MEGABYTE
        time.sleep(0.005)


FAULTS = {
    "swell": swell,
    "segfault": segfault,
    "once": segfault_once,
    "hang": hang,
    "eat": eat,
    "abort": abort_without_memory,
    "leave": leave,
}


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder that is not hidden, by its path."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and not any(word.startswith(".") for word in path.relative_to(folder).parts)
    }
