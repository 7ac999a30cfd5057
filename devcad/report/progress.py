"""A line on the terminal for work that takes a while."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any

PATIENCE = 1.0  # seconds of silence


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
