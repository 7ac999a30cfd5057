"""Signals that end the command line, told apart from failures however they arrive.

A signal during the import of a compiled library comes out as that library's ImportError; who
asks here first does not take it for a bug.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

CAUGHT = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


class Interrupts:
    """Remembers the signal that came; ``code`` is its exit code as shells have it, or 0."""

    def __init__(self) -> None:
        self.code = 0

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Let the signals leave through the finally clauses, so that no staging folder stays.

        Those that the caller ignores, as nohup does, stay ignored.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.getsignal(number) for number in CAUGHT}
        ours = [number for number in CAUGHT if before[number] is not signal.SIG_IGN]
        hook = sys.unraisablehook
        try:
            sys.unraisablehook = self._muted(hook)
            for number in ours:
                signal.signal(number, self._came)
            yield
        finally:
            for number in ours:
                signal.signal(number, before[number])
            sys.unraisablehook = hook

    def check(self) -> None:
        """Leave now if a signal came and what it raised was lost on the way."""
        if self.code:
            raise SystemExit(self.code)

    def _came(self, number: int, frame: FrameType | None) -> NoReturn:
        self.code = 128 + number
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        raise SystemExit(self.code)

    def _muted(self, hook: Any) -> Any:
        """A hook that says nothing of what a signal raised where nothing can be raised."""

        def tell(unraisable: Any) -> None:
            if not self.code:
                hook(unraisable)

        return tell
