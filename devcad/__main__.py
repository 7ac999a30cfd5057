"""python -m devcad."""

import gc
import os
import sys

from devcad.cli import run

RARE = 50_000  # allocations between two garbage collections; the default, 700, costs 5 % of a check


def main() -> None:
    """The command line; leaves with its exit code.

    The process ends at once: taking the loaded libraries apart would cost a short command a
    fifth of its time.
    """
    gc.set_threshold(RARE)
    code = run(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
