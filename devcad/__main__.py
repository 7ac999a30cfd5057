"""python -m devcad."""

import contextlib
import gc
import os
import signal
import sys

RARE = 1_000_000  # allocations between garbage collections; the default costs a check a tenth
INTERRUPTED = 130  # 128 + SIGINT, as shells have it


def main() -> None:
    """The command line; leaves with its exit code.

    The process ends at once: taking the loaded libraries apart would cost a short command a
    fifth of its time.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    # pydantic would search every installed package for plugins before its first model: 10 ms
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # the matrices are small: a thread for every core only waits, a third of a check's time
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(RARE)
    from devcad.cli import run  # only now, so that an interrupt of the import is quiet too

    code = run(sys.argv[1:])
    with contextlib.suppress(OSError):  # nobody is left to be told
        sys.stderr.flush()
    os._exit(code)


def _leave(*_: object) -> None:
    """Leave as long as, or once again, there is nothing to clean up."""
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
