"""Parts made by a dask.distributed cluster, each in a process of its own on its machine.

OUT and the job files must be at the same paths on every machine, or OUT be a bucket.
"""

from __future__ import annotations

import multiprocessing
import tempfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from devcad.batch.tasks import CRASHED, Result, Task, failure
from devcad.batch.workers import Walls, Work, Workers
from devcad.errors import FileError

PATIENCE = 30.0
"""Seconds to wait for a scheduler to answer."""
AHEAD = 2
"""Tasks a thread of the cluster: one being done, one that waits there."""
LOSSES = 10.0
"""Seconds of waiting for the result of a task while its machine is there."""


class Cluster:
    """The threads of a cluster as those who make parts.

    Raises:
        FileError: dask.distributed is not installed, or no scheduler answers.
    """

    def __init__(self, address: str, work: Work, limits: Walls, warm: Sequence[str] | None) -> None:
        self._client = _client(address)
        self._how = (work, limits, warm)
        self._tasks: dict[Any, Task] = {}
        self._done: SimpleQueue[Any] = SimpleQueue()

    @property
    def free(self) -> bool:
        """Whether one more task can begin now; a cluster whose machines have not come yet takes
        one."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        threads = sum(worker["nthreads"] for worker in workers)
        return len(self._tasks) < max(1, AHEAD * int(threads))

    @property
    def running(self) -> list[Task]:
        """The tasks handed to the cluster."""
        return list(self._tasks.values())

    def begin(self, task: Task) -> None:
        """Hand a task to the cluster; the key is new with every try, so that no old result is
        taken for it."""
        key = f"devcad-{task.name}-{task.print[:16]}-{task.tried}"
        future = self._client.submit(isolated, task, *self._how, key=key, pure=False, retries=0)
        self._tasks[future] = task
        future.add_done_callback(self._done.put)  # called by a thread of the client

    def wait(self, patience: float) -> Iterator[tuple[Task, Result]]:
        """What has become of tasks; a future is released once its result has been entered."""
        try:
            future = self._done.get(timeout=patience)
        except Empty:
            return
        task = self._tasks.pop(future)
        yield task, _result(future, task)
        future.release()

    def close(self) -> None:
        """Leave the cluster; what is still to be done is cancelled."""
        self._client.cancel(list(self._tasks), force=True)
        self._client.close()


def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise FileError(
            f"--scheduler needs dask.distributed: {error}",
            place="--scheduler",
            value=address,
            remedy="pip install 'devcad[cluster]'",
        ) from None
    try:
        return Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise FileError(
            f"no scheduler answers: {error}",
            place="--scheduler",
            value=address,
            remedy="start one with dask scheduler, and give its address, such as tcp://host:8786",
        ) from None


def _result(future: Any, task: Task) -> Result:
    """The result of a future, or why there is none: the machines that had it are gone."""
    error = future.exception() if future.status == "error" else None
    if future.status == "finished":
        result: Result = future.result(timeout=LOSSES)
        return result
    what = f"{type(error).__name__}" if error is not None else future.status
    return failure(task, f"{CRASHED}: {what} on the cluster", "see the logs of its workers")


# --- on the machines of the cluster ------------------------------------------------------------

_OWN = threading.local()


def isolated(task: Task, work: Work, limits: Walls, warm: Sequence[str] | None) -> Result:
    """The result of a task that is done in a process of its own, once, beside a worker's."""
    workers = _workers(work, limits, warm)
    workers.begin(task)
    while True:
        for _, result in workers.wait(1.0):
            return result


def _workers(work: Work, limits: Walls, warm: Sequence[str] | None) -> Workers:
    """The one process of this thread, kept for the next task."""
    known = getattr(_OWN, "workers", None)
    if known is None or _OWN.how != (work, limits, warm):
        multiprocessing.current_process().daemon = False  # else it may have no processes
        if known is not None:
            known.close()
        _OWN.scratch = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        known = _OWN.workers = Workers(work, 1, limits, Path(_OWN.scratch.name), warm)
        _OWN.how = (work, limits, warm)
    workers: Workers = known
    return workers
