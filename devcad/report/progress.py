"""A line on the terminal for work that takes a while."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any

PATIENCE = 1.0  # seconds of silence
SHOWN = 3  # names of parts on the line of a batch


class ProgressLine:
    """Shows what is being done on stderr, if it is a terminal, once ``PATIENCE`` is over.

    rich is loaded only then. ``timer`` calls its second argument after so many seconds.
    """

    def __init__(self, timer: Callable[..., threading.Timer] = threading.Timer) -> None:
        self._text = ""
        self._status: Any = None
        self._timer = timer(PATIENCE, self._start)

    def __enter__(self) -> ProgressLine:
        if sys.stderr.isatty():
            self._timer.daemon = True
            self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._timer.cancel()
        if self._timer.is_alive():
            self._timer.join()
        if self._status is not None:
            self._status.stop()

    def show(self, text: str) -> None:
        """Say what begins now."""
        self._text = text
        if self._status is not None:
            self._status.update(text)

    def _start(self) -> None:
        from rich.console import Console

        status = Console(stderr=True).status(self._text)
        status.start()
        self._status = status


class BatchBar:
    """Shows on stderr, if it is a terminal, how far a batch is; rich is loaded only then."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> BatchBar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(
        self,
        *,
        parts: int,
        done: int,
        failed: int,
        running: Sequence[str],
        made: int,
        seconds: float,
    ) -> None:
        """So many of so many parts are through, ``made`` of them in the seconds since the start."""
        if not sys.stderr.isatty():
            return
        if self._bar is None:
            self._start(parts)
        self._bar.update(
            self._task,
            completed=done + failed,
            told=batch_words(
                parts=parts, done=done, failed=failed, running=running, made=made, seconds=seconds
            ),
        )

    def _start(self, parts: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        self._bar = Progress(
            BarColumn(bar_width=30),
            TextColumn("{task.fields[told]}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("", total=parts, told="")
        self._bar.start()


def batch_words(
    *, parts: int, done: int, failed: int, running: Sequence[str], made: int, seconds: float
) -> str:
    """How far a batch is, as one line: counts, what is being made, rate and time left."""
    rate = made / seconds if seconds > 0.0 else 0.0
    left = (parts - done - failed) / rate if rate else 0.0
    words = [f"{done} done", f"{failed} failed", f"{len(running)} running of {parts}"]
    if rate:
        words += [f"{rate:.3g}/s", f"{_clock(left)} left"]
    return ", ".join([*words, *running[:SHOWN]])


def _clock(seconds: float) -> str:
    """Hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
