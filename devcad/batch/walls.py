"""The walls around a process: memory, signals, what it prints, and that it ends with its parent.

They stand where the system has them: all on Linux, none on Windows, where only time is limited.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path

PR_SET_PDEATHSIG = 1  # linux/prctl.h
PAGE = 4096


def die_with_parent() -> None:
    """Have the system kill this process when its parent dies."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() == 1:  # it died before
        os._exit(1)


def ignore_keyboard() -> None:
    """Leave Ctrl-C, which reaches every process of a terminal, to the batch itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", None)):
        if number is not None:
            signal.signal(number, signal.SIG_DFL)


def mute(errors: Path) -> None:
    """Send what libraries print to nowhere, and what they print of errors to a file."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    try:
        handle = os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o600)
    except OSError:  # a full disk
        handle = nowhere
    os.dup2(handle, 2)


SLACK = 2
"""How much more address space than memory a process may ask for: a library whose small request is
refused may try for ever, so that the memory in use is watched from outside and comes first."""


def limit_memory(room: int) -> None:
    """Let this process ask for ``SLACK`` times ``room`` bytes beyond what it has now."""
    if not sys.platform.startswith("linux"):
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = _pages("self", 0) + SLACK * room
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def memory_of(process: int | None) -> int:
    """The memory that a process uses, files that it maps left out, bytes; 0 where the system does
    not say."""
    if process is None or not sys.platform.startswith("linux"):
        return 0
    with suppress(OSError, ValueError, IndexError):
        return _pages(process, 1) - _pages(process, 2)
    return 0


def _pages(process: int | str, column: int) -> int:
    """A column of statm (size, resident, shared, ...), bytes."""
    words = Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()
    return int(words[column]) * os.sysconf("SC_PAGE_SIZE")


def ran_out_of_memory(errors: Path) -> bool:
    """Whether the last words of a process speak of memory, as those of C++ and of Python do."""
    with suppress(OSError):
        words = errors.read_bytes()[-PAGE:]
        return any(sign in words for sign in (b"bad_alloc", b"MemoryError", b"out of memory"))
    return False
