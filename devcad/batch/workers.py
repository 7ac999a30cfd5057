"""Processes that make parts: one part at a time in each, and no part can hurt another.

A fork server has the libraries loaded and warm, so that a new process is there in milliseconds. A
part that crashes, hangs or takes too much memory ends its process and nothing else. A process is
renewed after some parts, and after every failure; a second try has a process of its own.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from devcad.batch import walls
from devcad.batch.tasks import CRASHED, NO_MEMORY, TIMED_OUT, Result, Task, failure
from devcad.errors import FileError

GIGABYTE = 1_000_000_000
WARM = "DEVCAD_WARM"
"""Environment variable: the formats that a fork server warms up for."""
STARTS = 5
"""Tries to start a process while the fork server is being replaced."""
LOOK = 0.2
"""Seconds between two looks at the memory that parts use."""
GONE = 255
"""Exit code of a process whose fork server is not there to tell it."""

Work = Callable[[Task], Result]


@dataclass(frozen=True, slots=True)
class Walls:
    """What a part may take: seconds of time on the wall, bytes of memory; and how many parts a
    process makes before the next one, 1 for a process a part."""

    seconds: float = 600.0
    memory: int = 4 * GIGABYTE
    renew: int = 16


@dataclass
class _Bench:
    """A process at work, and what it works on."""

    process: BaseProcess
    line: Connection
    errors: Path
    made: int = 0
    task: Task | None = None
    end: float = 0.0
    """When its task must be through, on the monotonic clock."""
    most: int = 0
    """Bytes that it may use then."""


class Workers:
    """``count`` processes that do ``work``, started when there is something to do."""

    def __init__(
        self,
        work: Work,
        count: int,
        limits: Walls,
        scratch: Path,
        warm: Sequence[str] | None = None,
    ) -> None:
        """``warm`` are the formats that the fork server writes once before it forks, none for
        those of the default recipe; None leaves it cold."""
        self._work, self._count, self._limits = work, count, limits
        self._scratch, self._warm = scratch, warm
        self._benches: dict[int, _Bench] = {}
        self._context = _context(warm)

    @property
    def free(self) -> bool:
        """Whether one more task can begin now."""
        return any(place not in self._busy() for place in range(self._count))

    @property
    def running(self) -> list[Task]:
        """The tasks being done."""
        return [bench.task for bench in self._benches.values() if bench.task is not None]

    def begin(self, task: Task) -> None:
        """Have a free process do a task."""
        place = next(place for place in range(self._count) if place not in self._busy())
        bench = self._benches.get(place)
        worn = bench is not None and (bench.made >= self._limits.renew or task.tried)
        if bench is not None and worn:
            self._dismiss(place)
            bench = None
        if bench is None:
            bench = self._benches[place] = self._started(place)
        bench.task, bench.end = task, time.monotonic() + self._limits.seconds
        bench.most = walls.memory_of(bench.process.pid) + self._limits.memory
        bench.made += 1
        with suppress(OSError):  # it died idle: waiting will tell
            bench.line.send(task)

    def wait(self, patience: float) -> Iterator[tuple[Task, Result]]:
        """What has become of tasks, after at most so many seconds; nothing may have."""
        busy = self._busy()
        ends = [bench.end for bench in busy.values()]
        until = min([patience, LOOK, *(end - time.monotonic() for end in ends)])
        ready = set(wait([bench.line for bench in busy.values()], timeout=max(0.0, until)))
        for place, bench in busy.items():
            task = bench.task
            if task is None:
                continue
            if bench.line in ready:
                bench.task = None
                yield task, self._heard(place, bench, task)
            elif time.monotonic() >= bench.end:
                bench.task = None
                self._dismiss(place)
                yield task, self._late(task)
            elif walls.memory_of(bench.process.pid) > bench.most:
                bench.task = None
                self._dismiss(place)
                yield task, _swollen(task, self._limits)

    def close(self) -> None:
        """End every process, at work or not."""
        for place in list(self._benches):
            self._dismiss(place)

    def _busy(self) -> dict[int, _Bench]:
        return {place: bench for place, bench in self._benches.items() if bench.task is not None}

    def _heard(self, place: int, bench: _Bench, task: Task) -> Result:
        """What a process says of its task, or why it says nothing."""
        try:
            result: Result = bench.line.recv()
            return result
        except (EOFError, OSError):
            bench.process.join(timeout=5.0)
            lost = _lost(task, bench.process.exitcode, bench.errors, self._limits)
            self._dismiss(place)
            return lost

    def _late(self, task: Task) -> Result:
        limit = self._limits.seconds
        return failure(
            task, f"{TIMED_OUT} after {limit:g} s", "simplify the part, or give more with --timeout"
        )

    def _started(self, place: int) -> _Bench:
        """A new process; the fork server is started anew where it has died."""
        errors = self._scratch / f"worker-{os.getpid()}-{place}.txt"
        for attempt in range(STARTS):
            ours, theirs = self._context.Pipe()
            process = self._context.Process(
                target=_serve, args=(theirs, self._work, self._limits.memory, errors), daemon=True
            )
            try:
                with _warming(self._warm):
                    process.start()
                return _Bench(process, ours, errors)
            except (OSError, EOFError) as error:
                ours.close()
                if attempt == STARTS - 1:
                    raise FileError(
                        f"cannot start a process: {error}",
                        value=str(error),
                        remedy="end other programs, or give fewer --workers",
                    ) from error
                time.sleep(0.05 * 2**attempt)
            finally:
                theirs.close()
        raise AssertionError

    def _dismiss(self, place: int) -> None:
        """End a process; it holds nothing that is not on the disk already."""
        bench = self._benches.pop(place)
        bench.line.close()
        with suppress(OSError):
            bench.process.kill()
        bench.process.join(timeout=5.0)
        with suppress(OSError):
            bench.errors.unlink(missing_ok=True)


def _swollen(task: Task, limits: Walls) -> Result:
    remedy = f"give a larger tolerance, or more than --memory {limits.memory / GIGABYTE:g}"
    return failure(task, NO_MEMORY, remedy)


def _lost(task: Task, code: int | None, errors: Path, limits: Walls) -> Result:
    """The result of a process that ended in the midst of a task."""
    if walls.ran_out_of_memory(errors):
        return _swollen(task, limits)
    what = f"exit code {code}"
    if code is None or code == GONE:
        what = "its process was ended"
    elif code < 0:
        what = f"signal {-code}"
    return failure(task, f"{CRASHED}: {what}", "please report it with the job file")


def _context(warm: Sequence[str] | None) -> Any:
    """The way to start processes: a fork server, or what the system has."""
    if sys.platform == "win32":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([] if warm is None else ["devcad.batch.warm"])
    return context


@contextmanager
def _warming(formats: Sequence[str] | None) -> Iterator[None]:
    """The environment in which a fork server starts, if it does."""
    told: dict[str, str] = {} if formats is None else {WARM: ",".join(formats)}
    for name, value in (("OPENBLAS_NUM_THREADS", "1"), ("PYDANTIC_DISABLE_PLUGINS", "__all__")):
        told.setdefault(name, os.environ.get(name, value))
    before = {name: os.environ.get(name) for name in told}
    os.environ.update(told)
    try:
        yield
    finally:
        for name, was in before.items():
            if was is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = was


def _serve(line: Connection, work: Work, memory: int, errors: Path) -> None:
    """The life of a process: tasks come, results go, until nobody asks any more."""
    walls.die_with_parent()
    walls.ignore_keyboard()
    walls.mute(errors)
    while True:
        try:
            task = line.recv()
        except (EOFError, OSError):
            break
        walls.limit_memory(memory)
        result = work(task)
        try:
            line.send(result)
        except OSError:
            break
    os._exit(0)  # taking the loaded libraries apart would only take time
